"""Plants and declarations that end the main job, each named by its true cause."""

from __future__ import annotations

from dataclasses import replace

from plantune import _core
from plantune.errors import NotIdentifiable, PlantuneError, from_note, refusal
from plantune.estimate import Fit, process
from plantune.job.outcome import Run, is_unstable
from plantune.notes import Limits, note_of
from plantune.record import Record
from plantune.validate import check, compare

# Share of a response below which it is a ramp, and deviations from which on a slope is sure.
_RAMP = 0.1
_SURE = 5.0


def check_plant(run: Run, est: Record, val: Record, limits: Limits) -> None:
    """Refuse a plant that no process model serves, with the true cause."""
    process, rival = run.verdicts.get(run.process or ""), run.rival
    serves = process is not None and process.fit >= limits.V01
    _check_settles(run, serves=serves)
    if serves:
        return
    known = run.verdicts[rival].fit if rival is not None else 0.0
    if rival is not None:
        # From rest: an undamped model rings on from the start of a record it has no relation to.
        known = compare(val, run.fits[rival], x0="zero", limits=limits).rows[0].fit
    least = max(limits.V01, limits.V03 + (process.fit if process is not None else 0.0))
    if process is None:
        _raise_cause(est, run.record, limits, but="X04" if known >= least else "")
    if known < least:
        _check_stable(run)
    if rival is not None and known >= least:
        raise _other_plant(run, rival, limits)
    if process is not None and any(note.code == "X04" for note in process.notes):
        check(val, run.fits[run.process or "P1D"], limits=limits)


def _check_settles(run: Run, *, serves: bool) -> None:
    """Refuse a plant that integrates as far as the record shows (M01).

    A lag of which the record shows less than a tenth is no lag to tune on; an output that drifts
    by itself, unrelated to the input, looks the same (X04).  `serves` where the process model
    simulates it.
    """
    if any(note.code == "X04" for note in run.findings["delay"].notes):
        return
    for name, fit in run.fits.items():
        shown = (n.measured for n in fit.notes if n.code == "X07" and n.measured is not None)
        ramp = any(share < _RAMP for share in shown)
        if (ramp and name == run.process) or (not serves and (ramp or _integrates(fit))):
            error = refusal(
                "M01",
                f"{name} finds the plant integrating, as far as the record shows: "
                "no steady-state gain, and rules for plants that settle do not apply",
                where=(run.record.u_names[0], None, None),
                remedy='estimate.process(rec, "P0DI") or "P1DI", and tune.simc; or record longer',
            )
            error.result = replace(run, notes=(note_of(error), *run.notes))
            raise error


def _integrates(fit: Fit) -> bool:
    """Whether a polynomial fit cannot be told from an integrator that clearly moves."""
    if all(note.code != "M01" for note in fit.notes):
        return False
    slope, sd = fit.derived()["slope"]
    return abs(slope) > _SURE * sd


def _check_stable(run: Run) -> None:
    """Refuse an unstable plant by its name (M02), where no stable model simulates it."""
    for name, verdict in run.verdicts.items():
        if name in run.fits and is_unstable(verdict):
            (note,) = (note for note in verdict.notes if note.code == "M02")
            text = f"{name} finds the plant unstable; no rule for plants that settle serves it"
            error = from_note(replace(note, text=text))
            error.result = replace(run, notes=(note_of(error), *run.notes))
            raise error


def _other_plant(run: Run, rival: str, limits: Limits) -> PlantuneError:
    """M12: a polynomial model knows the plant, first order plus dead time does not."""
    process, polynomial = run.verdicts.get("P1D"), run.verdicts[rival]
    own = f"with {process.fit:.0f} %" if process is not None else "not at all"
    resonance = run.fits[rival].model.resonance()
    if resonance is None:
        cause = "the plant is not of first order"
    else:
        at = f"{resonance[0]:.4g} rad/{run.record.time_unit}, damping {resonance[1]:.2g}"
        cause = f"the plant has a resonance at {at}"
    error = refusal(
        "M12",
        f"a polynomial model, {rival}, simulates {polynomial.N} rows with {polynomial.fit:.0f} %, "
        f"first order plus dead time {own}: {cause}; PI rules for first order do not apply",
        where=(run.record.y_names[0], None, None),
        count=polynomial.N,
        measured=process.fit if process is not None else 0.0,
        limit=limits.V01,
        remedy="take the polynomial model from the result, and design a controller of higher order",
    )
    error.result = replace(run, notes=(note_of(error), *run.notes))
    return error


def _raise_cause(est: Record, rec: Record, limits: Limits, *, but: str) -> None:
    """Raise why P1D was refused, `but` for one code; the whole record may know the cause."""
    try:
        process(est, "P1D", limits=limits)
    except NotIdentifiable as error:
        if error.code == but:
            return
        if error.code == "X04" and est is not rec:
            process(rec, "P1D", limits=limits)
        raise


def check_action(run: Run, action: str | None) -> None:
    """Refuse a gain of the other sign than the loop was declared for."""
    if action is None:
        return
    try:
        _core.check_action(action, run.chosen.model.K)
    except NotIdentifiable as error:
        error.result = replace(run, notes=(note_of(error), *run.notes))
        raise
