"""PID controller in two-degree-of-freedom standard form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from plantune import _core
from plantune.errors import refusal
from plantune.models.forms import Form, from_form, to_form


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

    def to(
        self,
        form: str,
        *,
        pv_span: float | None = None,
        op_span: float | None = None,
        time_unit: str = "s",
    ) -> Form:
        """Return the same controller in another form, exact with its filter.

        Parameters
        ----------
        form : "ideal", "parallel", "series", "pb" or "velocity"
            The last one needs a sampled controller.  Names of controllers: `pt.export.vendor`.
        pv_span, op_span : float, optional
            Spans of y and of u, both or neither: gains are then in percent of span,
            `Kp pv_span / op_span`.
        time_unit : "s" or "min"
            Unit of the times.

        Returns
        -------
        Form
            Its attributes are the form's own letters: `Kp Ti Td Tf`, `Kp Ki Kd Tf`,
            `PB Ti Td Tf` or `q0 q1 q2 d`.  The weights `b` and `c` are carried along.

        Raises
        ------
        UsageError
            There is no such form of this controller (U01).  Where the zeros of the controller are
            complex, `(Ti - Tf)^2 < 4 Ti Td`, no series form is: `.result` is then the `Nearest`.

        Notes
        -----
        The series form has its filter behind the lead, `(Td s + 1) / (Tf s + 1)`.  The nearest
        one has the least largest deviation of the frequency response, relative, of all series
        controllers with this filter; it is the same at every frequency.

        Examples
        --------
        >>> pid = PID(Kp=2.4, Ti=12.0, Td=5 / 3)
        >>> for form in ("series", "parallel", "pb"):
        ...     print(pid.to(form))
        series: Kp = 2, Ti = 10 s, Td = 2 s
        parallel: Kp = 2.4, Ki = 0.2 1/s, Kd = 4 s
        pb: PB = 41.6667 %, Ti = 12 s, Td = 1.66667 s
        >>> print(pid.to("ideal", pv_span=200.0, op_span=100.0, time_unit="min"))
        ideal: Kp = 4.8 %/%, Ti = 0.2 min, Td = 0.0277778 min
        """
        return to_form(self, form, pv_span=pv_span, op_span=op_span, time_unit=time_unit)

    @staticmethod
    def from_form(form: str, **settings: Any) -> PID:
        """Return the controller that settings of another form make; the inverse of `to`.

        Parameters
        ----------
        form : "ideal", "parallel", "series", "pb" or "velocity"
            Its letters are the names of the settings; `Ti`, `Ki`, `Td`, `Kd` and `Tf` may be
            left out.
        **settings : float
            The settings, and `b c filter Ts pv_span op_span time_unit` as of `Form`.

        Returns
        -------
        PID

        Raises
        ------
        UsageError
            A setting that the form has not, or that is out of its range; in series form a `Tf`
            above `Td`, which makes a lag (U01).

        Examples
        --------
        >>> print(PID.from_form("series", Kp=2.0, Ti=10.0, Td=2.0, Tf=0.25))
        PID: Kp = 2.35, Ti = 11.75 s, Td = 1.45213 s, Tf = 0.25 s
        >>> print(PID.from_form("pb", PB=50.0, Ti=0.2, time_unit="min"))
        PI: Kp = 2, Ti = 12 s
        """
        return from_form(form, **settings)

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
