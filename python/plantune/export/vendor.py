"""A controller as it is entered on the faceplate of a vendor's controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from plantune import _core
from plantune.errors import PlantuneError, refusal
from plantune.export.profiles import Profile, profile_of
from plantune.models import PID
from plantune.models.forms import nearest_of
from plantune.notes import Note, notes_from_core
from plantune.tune import Margins, Tuning, margins
from plantune.tune.judge import as_given

# Rise of Ms from which entering counts as a cost.
_COST = 1.01


@dataclass(frozen=True, slots=True, eq=False)
class VendorSettings:
    """What to enter on a controller, and the controller that this makes.

    Attributes
    ----------
    vendor, title : str
        Name of the profile, and in words.
    values, units : mapping
        Values, rounded as the controller does, and their units by the names on its faceplate.
    action : "reverse", "direct" or "signed"
        Reverse for a positive gain, the error being set point less measurement; "signed" where
        the gain itself has the sign.
    setup : str
        Options that the controller must have for this.
    level : "verified" or "unverified"
        Whether the equation was read in the vendor's public text.
    source, checked : str
        That text, and what was read in it.
    controller : PID
        What runs after entering these values: judge and simulate this one.
    margins : Margins or None
        Of `controller` on the model of the tuning, if one was given.
    notes : tuple of Note
        P01 unverified profile, P02 another filter than the design's, P03 other set-point weights,
        P04 out of the controller's range, P05 entering costs margin, C07 weak margins.

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID.from_form("series", Kp=2.0, Ti=10.0, Td=2.0)
    >>> print(pt.export.vendor(pid, "rockwell-pide", pv_span=100.0, op_span=100.0))
    Rockwell Logix PIDE, independent gains (verified)
      PGain = 2.4
      IGain = 12 1/min
      DGain = 0.06666667 min
      action reverse: ControlAction cleared
      set up: DependIndepend cleared, PVEProportional cleared, PVEDerivative set, DSmoothing cleared
    """

    vendor: str
    title: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    action: str
    setup: str
    level: str
    source: str
    checked: str
    controller: PID
    margins: Margins | None
    notes: tuple[Note, ...]

    def __str__(self) -> str:
        profile = profile_of(self.vendor)
        lines = [f"{self.title} ({self.level})"]
        lines += [f"  {k} = {v:.10g} {self.units[k]}".rstrip() for k, v in self.values.items()]
        if self.action != "signed":
            told = profile.reverse if self.action == "reverse" else profile.direct
            lines.append(f"  action {self.action}: {told}")
        lines.append(f"  set up: {self.setup}")
        if self.margins is not None:
            lines.append(f"  {self.margins}")
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def vendor(
    what: PID | Tuning,
    name: str,
    *,
    pv_span: float | None = None,
    op_span: float | None = None,
    digits: int | None = None,
) -> VendorSettings:
    """Return what to enter on a controller, in its own form, names, units and digits.

    Parameters
    ----------
    what : PID or Tuning
        Of a tuning the margins are computed again with the values as entered.
    name : str
        A profile of `vendors()`, such as "rockwell-pide" or "deltav-series".
    pv_span, op_span : float
        Span of the measurement and of the output in the units of the model, positive; needed
        where the controller's gain is in percent of span.
    digits : int, optional
        Significant digits to keep instead of the controller's own, 1 to 17.

    Returns
    -------
    VendorSettings
        `.values` by the names on the faceplate; `.controller` is the PID that they make.

    Raises
    ------
    UsageError
        An unknown name, a missing span, a setting that its digits round to zero; or the
        controller has no such form, as of `PID.to` (U01).

    Notes
    -----
    The values are those of the exact conversion.  Where the controller has a filter or set-point
    weights of its own these take the place of the design's, and a note says so.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=-0.5, T=30.0, L=4.0)
    >>> entry = vendor(pt.tune.simc(plant), "siemens-pid-compact", digits=2)
    >>> entry.values["Gain"], entry.values["Ti"], entry.action
    (7.5, 30.0, 'direct')
    >>> print(entry.controller)
    PI: Kp = -7.5, Ti = 30 s
    """
    pid = what.controller if isinstance(what, Tuning) else what
    if not isinstance(pid, PID):
        kind = type(what).__name__
        raise refusal("U01", f"a {kind} is no controller", remedy="pass a PID or a Tuning")
    if digits is not None and not 1 <= digits <= 17:
        raise refusal("U01", f"`digits` is {digits}, must be 1 to 17", remedy="digits=4")
    profile = profile_of(name)
    found = _entered(pid, profile, pv_span, op_span, digits)
    controller, unrounded = (
        replace(pid, **found[key], c=found["c"], filter="d1") for key in ("controller", "unrounded")
    )
    notes = (*_unverified(profile), *notes_from_core(found["notes"]))
    judged: Margins | None = None
    if isinstance(what, Tuning):
        judged, doubts = _judged(what, controller, unrounded)
        notes = (*notes, *doubts)
    shown = [
        (setting, value)
        for setting, value in zip(profile.settings, found["values"], strict=True)
        if setting.name
    ]
    return VendorSettings(
        vendor=profile.name,
        title=profile.title,
        values={setting.name: value for setting, value in shown},
        units={setting.name: setting.unit for setting, _ in shown},
        action="signed" if profile.signed else "direct" if found["direct"] else "reverse",
        setup=profile.setup,
        level=profile.level,
        source=profile.source,
        checked=profile.checked,
        controller=controller,
        margins=judged,
        notes=notes,
    )


def _entered(
    pid: PID, profile: Profile, pv_span: float | None, op_span: float | None, digits: int | None
) -> dict[str, Any]:
    try:
        return _core.enter(pid, profile, pv_span, op_span, digits)
    except PlantuneError as error:
        rest: dict[str, Any] = {"b": pid.b, "c": pid.c, "Ts": pid.Ts}
        if profile.gain == "span":
            rest |= {"pv_span": pv_span, "op_span": op_span}
        error.result = nearest_of(profile.form, error, **rest)
        raise


def _unverified(profile: Profile) -> tuple[Note, ...]:
    """P01 where the equation was not read in the vendor's own text."""
    if profile.level == "verified":
        return ()
    return (
        Note(
            code="P01",
            severity="warning",
            text="unverified profile: its equation was not read in the vendor's own text",
            remedy="compare with the manual of your controller; `.checked` says what was read",
        ),
    )


def _judged(tuning: Tuning, controller: PID, unrounded: PID) -> tuple[Margins, tuple[Note, ...]]:
    """Return the margins as entered, and what entering costs (P05, C07)."""
    entered = as_given(controller, tuning.model, 0.0, None)
    before, after = tuning.margins, entered.margins
    own = tuple(note for note in entered.notes if note not in tuning.notes)
    if after.stable and after.Ms <= _COST * before.Ms:
        return after, own
    exact = margins(tuning.model, unrounded)
    said = f"Ms is {after.Ms:.3g}" if after.stable else "the loop is unstable"
    note = Note(
        code="P05",
        severity="warning",
        text=f"entering costs margin: {said}, designed {before.Ms:.3g}, "
        f"before rounding {exact.Ms:.3g}",
        measured=after.Ms,
        limit=before.Ms,
        remedy="keep more digits" if exact.Ms <= _COST * before.Ms else "design with this filter",
    )
    return after, (note, *own)
