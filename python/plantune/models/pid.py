"""PID controller in two-degree-of-freedom standard form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from plantune import _core
from plantune.errors import refusal


@dataclass(frozen=True, slots=True)
class PID:
    """`u = Kp [b r - y + (1/Ti) int (r - y) dt + Td d/dt (c r - y) / (Tf s + 1)]`.

    Parameters
    ----------
    Kp : float
        Proportional gain, u/y; negative for a process of negative gain.
    Ti : float
        Integral time, seconds; `inf` for none.
    Td, Tf : float
        Derivative time and filter time, seconds.
    b, c : float
        Set-point weights on P and D.
    filter : "d1" or "y2"
        First order on D, `1/(Tf s + 1)`, or second order on y, `1/(1 + Tf s + (Tf s)^2/2)`.
    Ts : float, optional
        Sample time in seconds of a sampled controller (backward Euler); None is continuous.

    Raises
    ------
    UsageError
        A setting that is no number, or `Ti <= 0`, `Td < 0`, `Tf < 0`, `Ts <= 0`.

    Examples
    --------
    >>> pi = PID(Kp=2.0, Ti=10.0)
    >>> print(pi, pi.Ki)
    PI: Kp = 2, Ti = 10 s 0.2
    >>> print(PID.integral(0.5))
    I: Ki = 0.5 1/s
    """

    kind: ClassVar[str] = "pid"

    Kp: float
    Ti: float = math.inf
    Td: float = 0.0
    Tf: float = 0.0
    b: float = 1.0
    c: float = 0.0
    filter: str = "d1"
    Ts: float | None = None
    pure_Ki: float | None = None

    def __post_init__(self) -> None:
        for name, fine, needed in (
            ("Kp", math.isfinite(self.Kp), "finite"),
            ("Ti", self.Ti > 0, "positive, or inf"),
            ("Td", math.isfinite(self.Td) and self.Td >= 0, "zero or positive"),
            ("Tf", math.isfinite(self.Tf) and self.Tf >= 0, "zero or positive"),
            ("filter", self.filter in ("d1", "y2"), "'d1' or 'y2'"),
            ("Ts", self.Ts is None or self.Ts > 0, "positive, or None"),
        ):
            if not fine:
                value = getattr(self, name)
                raise refusal("U01", f"`{name}` is {value!r}, must be {needed}", remedy="mend it")

    @staticmethod
    def integral(Ki: float, Ts: float | None = None) -> PID:
        """Return a purely integral controller `u = Ki int (r - y) dt`.

        Examples
        --------
        >>> PID.integral(0.5).Ki
        0.5
        """
        return PID(Kp=0.0, Ts=Ts, pure_Ki=float(Ki))

    @property
    def Ki(self) -> float:
        """Integral gain `Kp / Ti`, u/(y s)."""
        return _core.gains(self)[0]

    @property
    def Kd(self) -> float:
        """Derivative gain `Kp Td`, u s/y."""
        return _core.gains(self)[1]

    def _where(self) -> str:
        return " on y" if self.filter == "y2" else ""

    def to_control(self, **options: Any) -> Any:
        """Return the transfer function from the error; options as of `pt.export.to_control`.

        Examples
        --------
        >>> print(PID(Kp=2.0, Ti=10.0).to_control().zeros().real)
        [-0.1]
        """
        from plantune.models.control import to_control

        return to_control(self, **options)

    def __str__(self) -> str:
        if self.pure_Ki is not None:
            return f"I: Ki = {self.pure_Ki:.6g} 1/s"
        parts = [("Kp", f"{self.Kp:.6g}")]
        parts += [("Ti", f"{self.Ti:.6g} s")] if math.isfinite(self.Ti) else []
        filtered = self.Td or (self.filter == "y2" and self.Tf)
        parts += [("Td", f"{self.Td:.6g} s")] if self.Td else []
        parts += [("Tf", f"{self.Tf:.6g} s" + self._where())] if filtered else []
        parts += [("Ts", f"{self.Ts:.6g} s")] if self.Ts else []
        form = "P" + ("I" if math.isfinite(self.Ti) else "") + ("D" if self.Td else "")
        return f"{form}: " + ", ".join(f"{name} = {value}" for name, value in parts)
