"""One PID controller in the forms that texts and controllers write it in.

::

    ideal      Kp (1 + 1/(Ti s) + Td s / (Tf s + 1))       the form of `PID`
    parallel   Kp + Ki / s + Kd s / (Tf s + 1)
    series     Kp (1 + 1/(Ti s)) (Td s + 1) / (Tf s + 1)   the filter closes the lead
    pb         ideal, with PB = 100 % / Kp
    velocity   du = d du1 + q0 e + q1 e1 + q2 e2           increments of a sampled controller
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

from plantune import _core
from plantune.errors import PlantuneError, refusal

if TYPE_CHECKING:
    from plantune.models.pid import PID

_SECONDS = {"s": 1.0, "min": 60.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A controller's settings in one form and in one set of units, as `PID.to` gives them.

    Attributes
    ----------
    Kp, Ti, Td, Tf : float
        Of "ideal" and "series"; "parallel" has `Kp Ki Kd Tf`, "pb" `PB Ti Td Tf`, and "velocity"
        `q0 q1 q2 d`.  Gains in u/y, or in percent of span; `PB` in percent.
    b, c, filter, Ts
        As of `PID`: the weights are those of the standard form in every form.
    pv_span, op_span : float or None
        Spans of y and u, where gains are in percent of these.
    time_unit : "s" or "min"
        Unit of the times and of `1 / Ki`; `Ts` is always in seconds.

    Examples
    --------
    >>> from plantune.models import PID
    >>> series = PID(Kp=2.4, Ti=12.0, Td=5 / 3).to("series")
    >>> print(series)
    series: Kp = 2, Ti = 10 s, Td = 2 s
    >>> round(series.Ti, 9), round(series.repeats_per_minute, 9)
    (10.0, 6.0)
    >>> print(series.pid())
    PID: Kp = 2.4, Ti = 12 s, Td = 1.66667 s, Tf = 0 s
    """

    form: ClassVar[str]
    letters: ClassVar[tuple[str, ...]]

    b: float = 1.0
    c: float = 0.0
    filter: str = "d1"
    Ts: float | None = None
    pv_span: float | None = None
    op_span: float | None = None
    time_unit: str = "s"

    @property
    def settings(self) -> dict[str, float]:
        """The settings by their letters."""
        return {letter: getattr(self, letter) for letter in self.letters}

    @property
    def repeats_per_minute(self) -> float:
        """How often integral action repeats the proportional one in a minute, `60 s / Ti`."""
        raise AttributeError(f"the {self.form} form has no integral time")

    def pid(self) -> PID:
        """Return the controller that these settings make."""
        rest: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(Form)}
        return from_form(self.form, **(rest | self.settings))

    def __str__(self) -> str:
        gain, time = "%/%" if self.pv_span is not None else "", self.time_unit
        units = {"PB": "%", "Ki": f"{gain or 1}/{time}", "Kd": f"{gain} {time}", "d": ""}
        units |= dict.fromkeys(("Ti", "Td", "Tf"), time)
        printed = [
            (letter, value, units.get(letter, gain))
            for letter, value in self.settings.items()
            if letter in _acting(self)
        ]
        printed += [("Ts", self.Ts, "s")] if self.Ts is not None else []
        text = ", ".join(
            f"{x} = {value:.6g} {' '.join(unit.split())}".rstrip() for x, value, unit in printed
        )
        return f"{self.form}: {text}"


@dataclass(frozen=True, slots=True, kw_only=True)
class _WithTi(Form):
    Ti: float
    Td: float
    Tf: float

    @property
    def repeats_per_minute(self) -> float:
        """`60 s / Ti`."""
        return 60.0 / (self.Ti * _SECONDS[self.time_unit])


@dataclass(frozen=True, slots=True, kw_only=True)
class Ideal(_WithTi):
    """`Kp (1 + 1/(Ti s) + Td s / (Tf s + 1))`."""

    form: ClassVar[str] = "ideal"
    letters: ClassVar[tuple[str, ...]] = ("Kp", "Ti", "Td", "Tf")

    Kp: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Series(_WithTi):
    """`Kp (1 + 1/(Ti s)) (Td s + 1) / (Tf s + 1)`."""

    form: ClassVar[str] = "series"
    letters: ClassVar[tuple[str, ...]] = ("Kp", "Ti", "Td", "Tf")

    Kp: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ProportionalBand(_WithTi):
    """The ideal form with `PB = 100 % / Kp`; the sign of the gain is kept."""

    form: ClassVar[str] = "pb"
    letters: ClassVar[tuple[str, ...]] = ("PB", "Ti", "Td", "Tf")

    PB: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Parallel(Form):
    """`Kp + Ki / s + Kd s / (Tf s + 1)`."""

    form: ClassVar[str] = "parallel"
    letters: ClassVar[tuple[str, ...]] = ("Kp", "Ki", "Kd", "Tf")

    Kp: float
    Ki: float
    Kd: float
    Tf: float

    @property
    def repeats_per_minute(self) -> float:
        """`60 s Ki / Kp`; infinite without a proportional action to repeat."""
        if self.Kp == 0.0:
            return math.inf
        return 60.0 / _SECONDS[self.time_unit] * (self.Ki / self.Kp)


@dataclass(frozen=True, slots=True, kw_only=True)
class Velocity(Form):
    """`u - u1 = d (u1 - u2) + q0 e + q1 e1 + q2 e2`, the digits counting samples back."""

    form: ClassVar[str] = "velocity"
    letters: ClassVar[tuple[str, ...]] = ("q0", "q1", "q2", "d")

    q0: float
    q1: float
    q2: float
    d: float


@dataclass(frozen=True, slots=True)
class Nearest:
    """What comes nearest to a controller that a form cannot have.

    Attributes
    ----------
    form : Form
        Its settings.
    deviation : float
        Largest relative deviation of the frequency response, `max |C_near / C - 1|` over all
        frequencies.

    Examples
    --------
    >>> import plantune as pt
    >>> try:
    ...     pt.models.PID(Kp=2.0, Ti=10.0, Td=5.0).to("series")
    ... except pt.UsageError as error:
    ...     print(error.result.form, f"within {error.result.deviation:.1%}")
    series: Kp = 1.17157, Ti = 7.07107 s, Td = 7.07107 s within 17.2%
    """

    form: Form
    deviation: float


_FORMS: dict[str, type[Form]] = {
    cls.form: cls for cls in (Ideal, Parallel, Series, ProportionalBand, Velocity)
}
# What a setting is where it is left out.
_ABSENT = {"Ti": math.inf, "Ki": 0.0, "Td": 0.0, "Kd": 0.0, "Tf": 0.0, "d": 0.0}


def to_form(
    pid: PID,
    form: str,
    *,
    pv_span: float | None = None,
    op_span: float | None = None,
    time_unit: str = "s",
) -> Form:
    """Return the settings of a controller in another form; see `PID.to`."""
    own: dict[str, Any] = {"b": pid.b, "c": pid.c, "filter": pid.filter, "Ts": pid.Ts}
    units: dict[str, Any] = {"pv_span": pv_span, "op_span": op_span, "time_unit": time_unit}
    minutes = _minutes(time_unit)
    try:
        settings = _core.to_form(pid, form, pv_span, op_span, minutes)
    except PlantuneError as error:
        error.result = nearest_of(form, error, **own, **units)
        raise
    return _FORMS[form](**(own | units | settings))


def from_form(
    form: str,
    *,
    b: float = 1.0,
    c: float = 0.0,
    filter: str = "d1",
    Ts: float | None = None,
    pv_span: float | None = None,
    op_span: float | None = None,
    time_unit: str = "s",
    **settings: float,
) -> PID:
    """Return the controller of settings in another form; see `PID.from_form`."""
    from plantune.models.pid import PID

    rest = PID(Kp=0.0, b=b, c=c, filter=filter, Ts=Ts)
    values = _in_order(form, settings)
    found = _core.from_form(form, values, rest, pv_span, op_span, _minutes(time_unit))
    return PID(**found, c=c, filter=filter, Ts=Ts)


def nearest_of(form: str, error: PlantuneError, **rest: Any) -> Nearest | None:
    """Return what the core offers beside a refusal, if it does."""
    if error.result is None:
        return None
    settings, deviation = error.result
    return Nearest(_FORMS[form](**settings, **rest), deviation)


def _in_order(form: str, settings: dict[str, float]) -> list[float]:
    """Return the settings in the order of the form's letters."""
    if form not in _FORMS:
        raise refusal(
            "U01",
            f"`form` is {form!r}, must be one of {', '.join(_FORMS)}",
            remedy="take one of these; `plantune.export.vendors()` lists those of controllers",
        )
    letters = _FORMS[form].letters
    strange = [name for name in settings if name not in letters]
    missing = [name for name in letters if name not in settings and name not in _ABSENT]
    for names, said in ((strange, "has no"), (missing, "needs")):
        if names:
            raise refusal(
                "U01",
                f"the {form} form {said} {' '.join(names)}",
                where=(names[0], None, None),
                remedy=f"its settings are {' '.join(letters)}",
            )
    return [float(settings.get(name, _ABSENT.get(name, 0.0))) for name in letters]


def _minutes(time_unit: str) -> bool:
    if time_unit not in _SECONDS:
        raise refusal(
            "U01", f"`time_unit` is {time_unit!r}, must be 's' or 'min'", remedy="time_unit='min'"
        )
    return time_unit == "min"


def _acting(form: Form) -> set[str]:
    """Return the letters of the settings that do something."""
    settings = form.settings
    off = {name for name, value in settings.items() if value == _ABSENT.get(name)}
    no_derivative = "Td" in off or "Kd" in off
    if no_derivative and form.filter == "d1":
        off.add("Tf")
    return set(settings) - off
