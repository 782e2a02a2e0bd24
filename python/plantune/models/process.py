"""Process models: lags, a zero, an integrator and a dead time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from plantune import _core
from plantune.models.base import LinearModel
from plantune.models.transfer import TransferFunction


@dataclass(frozen=True, slots=True)
class ProcessModel(LinearModel):
    """`K (Tz s + 1) e^(-L s) / (s^i prod (T_k s + 1))`; any real delay, exact.

    Parameters
    ----------
    K : float
        Static gain, y/u; its sign is the sign of the process.  Of an integrating process the slope
        that a unit of u gives, y/(u s).
    T : float or tuple
        Time constant, seconds, or several; `()` for none.
    L : float
        Dead time, seconds.
    Tz : float
        Time of the zero, seconds; negative for an inverse response, 0 for none.
    zeta : float, optional
        Damping of a pair of poles, `T1^2 s^2 + 2 zeta T1 s + 1` in place of `T1 s + 1`.
    integrating : bool
        Whether a pole lies at 0.

    Notes
    -----
    Source 001, (3.4-1), for `K T L` alone.

    Examples
    --------
    >>> print(ProcessModel(K=-5.939, T=0.1491, L=0.1))
    G(s) = -5.939 e^(-0.1 s) / (0.1491 s + 1)
    >>> print(ProcessModel(K=1.0, T=(1.0, 1.0, 1.0)))
    G(s) = 1 / ((1 s + 1) (1 s + 1) (1 s + 1))
    >>> print(ProcessModel(K=0.2, T=5.0, L=2.0, Tz=-1.5, integrating=True))
    G(s) = 0.2 (-1.5 s + 1) e^(-2 s) / (s (5 s + 1))
    """

    kind: ClassVar[str] = "process"

    K: float
    T: float | tuple[float, ...]
    L: float = 0.0
    Tz: float = 0.0
    zeta: float | None = None
    integrating: bool = False

    def __post_init__(self) -> None:
        for name in ("K", "L", "Tz"):
            object.__setattr__(self, name, float(getattr(self, name)))
        T = tuple(float(T) for T in np.atleast_1d(np.asarray(self.T, float)))
        object.__setattr__(self, "T", T[0] if len(T) == 1 else T)
        if self.zeta is not None:
            object.__setattr__(self, "zeta", float(self.zeta))

    @property
    def times(self) -> tuple[float, ...]:
        """Every time constant, seconds."""
        return self.T if isinstance(self.T, tuple) else (self.T,)

    @property
    def is_first_order(self) -> bool:
        """Whether it is `K e^(-L s) / (T s + 1)` and no more."""
        plain = not self.integrating and self.zeta is None and self.Tz == 0.0
        return plain and len(self.times) == 1

    def transfer(self) -> TransferFunction:
        """Return numerator, denominator and dead time.

        Examples
        --------
        >>> print(ProcessModel(K=2.0, T=(3.0, 1.0), L=0.5).transfer())
        G(s) = 2 e^(-0.5 s) / (3 s^2 + 4 s + 1)
        """
        return TransferFunction(**_core.transfer(self))

    def __str__(self) -> str:
        first = self.times[0] if self.times else 0.0
        pair = self.zeta is not None and [f"{first**2:.6g} s^2 + {2 * self.zeta * first:.6g} s + 1"]
        lags = [f"{T:.6g} s + 1" for T in self.times]
        factors = pair + lags[1:] if pair else lags
        several = len(factors) + self.integrating > 1
        below = (["s"] if self.integrating else []) + [
            f"({factor})" if several else factor for factor in factors
        ]
        under = " ".join(below)
        above = f"{self.K:.6g}"
        above += f" ({self.Tz:.6g} s + 1)" if self.Tz else ""
        above += f" e^(-{self.L:.6g} s)" if self.L else ""
        if not below:
            return f"G(s) = {above}"
        bare = self.integrating and not factors
        return f"G(s) = {above} / {under if bare else f'({under})'}"
