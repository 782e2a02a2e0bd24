"""Process model `G(s) = K e^(-L s) / (T s + 1)`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from plantune.models.base import LinearModel


@dataclass(frozen=True, slots=True)
class ProcessModel(LinearModel):
    """First order plus dead time, `K e^(-L s) / (T s + 1)`; any real delay, exact.

    Parameters
    ----------
    K : float
        Static gain, y/u; its sign is the sign of the process.
    T : float
        Time constant, seconds.
    L : float
        Dead time, seconds.

    Notes
    -----
    Source 001, (3.4-1).

    Examples
    --------
    >>> print(ProcessModel(K=-5.939, T=0.1491, L=0.1))
    G(s) = -5.939 e^(-0.1 s) / (0.1491 s + 1)
    """

    kind: ClassVar[str] = "process"

    K: float
    T: float
    L: float = 0.0

    def __post_init__(self) -> None:
        for name in ("K", "T", "L"):
            object.__setattr__(self, name, float(getattr(self, name)))

    def __str__(self) -> str:
        return f"G(s) = {self.K:.6g} e^(-{self.L:.6g} s) / ({self.T:.6g} s + 1)"
