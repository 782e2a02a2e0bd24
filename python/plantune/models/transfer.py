"""Transfer functions in s with a dead time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from plantune.models.base import LinearModel, coefficients
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class TransferFunction(LinearModel):
    """`G(s) = num(s) / den(s) e^(-L s)`, the dead time exact.

    Parameters
    ----------
    num, den : array
        Coefficients in descending powers of s; `den` is at least as long as `num`.
    L : float
        Dead time, seconds.

    Examples
    --------
    >>> G = TransferFunction([2.0], [3.0, 4.0, 1.0], L=0.5)
    >>> print(G)
    G(s) = 2 e^(-0.5 s) / (3 s^2 + 4 s + 1)
    >>> G.step([0.5, 60.0]).round(3)
    array([0., 2.])
    """

    kind: ClassVar[str] = "transfer"

    num: Floats
    den: Floats
    L: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "num", coefficients(self.num, "num"))
        object.__setattr__(self, "den", coefficients(self.den, "den"))
        object.__setattr__(self, "L", float(self.L))

    @property
    def core(self) -> Any:
        """The model as the core reads it."""
        return SimpleNamespace(num=self.num.tolist(), den=self.den.tolist(), L=self.L)

    def __str__(self) -> str:
        delay = f" e^(-{self.L:.6g} s)" if self.L else ""
        above, below = _written(self.num), _written(self.den)
        above = above if len(self.num) == 1 else f"({above})"
        return f"G(s) = {above}{delay}" + ("" if below == "1" else f" / ({below})")


def _written(p: Floats) -> str:
    return _terms(np.trim_zeros(p, "f").tolist()) or "0"


def _terms(p: Sequence[float]) -> str:
    text = ""
    for power, c in zip(range(len(p) - 1, -1, -1), p, strict=True):
        if c == 0.0:
            continue
        size = f"{abs(c):.6g}" + ("" if power == 0 else " s" if power == 1 else f" s^{power}")
        text += (" - " if c < 0 else " + ") + size if text else ("-" if c < 0 else "") + size
    return text
