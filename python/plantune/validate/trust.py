"""Which of several models that were judged on one record to trust."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from plantune.errors import refusal
from plantune.estimate.candidates import is_sound, size
from plantune.estimate.fit import Fit
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.validate.check import Verdict

# Structures whose noise model stays true when u answers to y, the least biased first.
_IN_CLOSED_LOOP = ("ARMAX", "ARX")


@dataclass(frozen=True, slots=True, eq=False)
class Trust:
    """The model to trust, and why.

    Attributes
    ----------
    name : str
        Its name among those compared.
    note : Note
        V10, with the reason in one sentence; a warning where no model is free of objections.
    objections : mapping of str to str
        Why a model was not eligible; models without an entry were.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> fits = {f"ARX {n}": pt.estimate.arx(est, n, n, 3) for n in (1, 2, 3)}
    >>> verdicts = {name: pt.validate.check(val, fit) for name, fit in fits.items()}
    >>> found = pt.validate.trust(fits, verdicts)
    >>> found.name, dict(found.objections)
    ('ARX 2', {'ARX 1': 'its errors follow the input'})
    """

    name: str
    note: Note
    objections: Mapping[str, str]


def trust(
    fits: Mapping[str, Fit],
    verdicts: Mapping[str, Verdict],
    *,
    closed_loop: bool = False,
    limits: Limits | None = None,
) -> Trust:
    """Choose the model to trust by the simulation of rows that none has seen.

    Eligible are models whose search converged and whose parameters can be told apart (not X10),
    that are stable (not M02), do better than the mean (not X04), and whose one-step errors are free
    of the input (not V02).  The objection of the input is dropped where it would cost more than
    `limits.V03` percent of simulation.  In closed loop, where u holds part of the noise and a
    biased model may simulate better, ARMAX and ARX models with white errors are eligible alone, if
    there are any.

    All within `limits.V10` percent of the best simulation are equals.  Among equals one with white
    errors goes first, since its standard deviations hold, and one without parameters that may as
    well be zero (X02); in closed loop ARMAX, then ARX, since output errors are biased there; then
    the fewest parameters, the delay counted; then the better simulation.

    Parameters
    ----------
    fits, verdicts : mapping of str to Fit, Verdict
        The models, and how they did on the same rows.
    closed_loop : bool
        Whether the input answers to the output in the record.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Trust
        Where there is an objection to the model, the note is a warning.

    Raises
    ------
    UsageError
        No model is given (U01).

    Notes
    -----
    Source 001, 3.5.9 and 3.5.10, where equal simulations are told apart by the noise model too;
    Ljung 1999, 13.4 and 16.4, and for the closed loop `oe`.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.engine_loop(noise_var=1.5).split(0.5)
    >>> fits = {"OE": pt.estimate.oe(est, 1, 1, 6), "ARX": pt.estimate.arx(est, 2, 2, 6)}
    >>> verdicts = {name: pt.validate.check(val, fit) for name, fit in fits.items()}
    >>> for reason in pt.validate.trust(fits, verdicts).note.text.split("; "):
    ...     print(reason)
    OE is trusted: it simulates 1494 rows with 95.8 %, the best
    its errors are white and free of the input
    it has 3 parameters (its equals: ARX 5)
    """
    limits = limits or DEFAULT_LIMITS
    if not fits:
        raise refusal("U01", "there is no model to trust", remedy="trust(fits, verdicts)")
    objections = _objections(fits, verdicts)
    pool = _eligible(fits, verdicts, objections, closed_loop, limits)
    best = max(pool, key=lambda name: verdicts[name].fit)
    equals = [n for n in pool if verdicts[best].fit - verdicts[n].fit <= limits.V10]

    def rank(name: str) -> tuple[bool, bool, int, int, float]:
        place = _place_in_closed_loop(fits[name]) if closed_loop else 0
        spare = any(note.code == "X02" for note in fits[name].notes)
        fit = verdicts[name].fit
        return not _white(verdicts[name]), spare, place, size(fits[name]), -fit

    name = min(equals, key=rank)
    reasons = [
        _simulation(name, best, verdicts),
        _errors(name, verdicts, objections),
        *([_loop(fits[name])] if closed_loop else []),
        _size(name, equals, fits),
        *(f"not {other}: {text}" for other, text in objections.items() if other != name),
    ]
    note = Note(
        code="V10",
        severity="warning" if name in objections else "info",
        text=f"{name} is trusted: " + "; ".join(reasons),
        measured=verdicts[best].fit - verdicts[name].fit,
        limit=limits.V10,
        remedy="record longer, or look at the residuals" if name in objections else "",
    )
    return Trust(name=name, note=note, objections=objections)


def _objections(fits: Mapping[str, Fit], verdicts: Mapping[str, Verdict]) -> dict[str, str]:
    """Return why models are not eligible, the grave reasons first."""
    grave = {name: text for name in fits if (text := _grave(fits[name], verdicts[name]))}
    others = (name for name in fits if name not in grave and "V02" in _codes(verdicts[name]))
    return {**grave, **dict.fromkeys(others, "its errors follow the input")}


def noise_holds(fit: Fit, verdict: Verdict) -> bool:
    """Whether the noise model may be true, so that feedback does not bias the model.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.engine_loop(noise_var=1.5).split(0.5)
    >>> fits = pt.estimate.armax(est, 1, 1, 1, 6), pt.estimate.oe(est, 1, 1, 6)
    >>> [noise_holds(fit, pt.validate.check(val, fit)) for fit in fits]
    [True, False]
    """
    return fit.method in _IN_CLOSED_LOOP and _white(verdict)


def _eligible(
    fits: Mapping[str, Fit],
    verdicts: Mapping[str, Verdict],
    objections: Mapping[str, str],
    closed_loop: bool,
    limits: Limits,
) -> list[str]:
    """Return names without objection; without a grave one where that is clearly better, or all.

    In closed loop those alone, if there are any, whose noise model is true.
    """
    sound = [n for n in fits if not _grave(fits[n], verdicts[n])] or list(fits)
    free = [n for n in sound if n not in objections]

    def best(names: list[str]) -> float:
        return max(verdicts[name].fit for name in names)

    pool = free if free and best(sound) - best(free) <= limits.V03 else sound
    true = [n for n in pool if noise_holds(fits[n], verdicts[n])]
    return true if closed_loop and true else pool


def _grave(fit: Fit, verdict: Verdict) -> str:
    """Say what forbids trust in any case; empty where nothing does."""
    if not is_sound(fit):
        return "its search did not converge, or its orders are too high"
    if "M02" in _codes(verdict):
        return "it is unstable, and cannot be simulated"
    return "it is no better than the mean" if "X04" in _codes(verdict) else ""


def _white(verdict: Verdict) -> bool:
    return "M08" not in _codes(verdict)


def _codes(verdict: Verdict) -> set[str]:
    return {note.code for note in verdict.notes}


def _simulation(name: str, best: str, verdicts: Mapping[str, Verdict]) -> str:
    own = f"it simulates {verdicts[name].N} rows with {verdicts[name].fit:.1f} %"
    if name == best:
        overall = max(verdicts.values(), key=lambda verdict: verdict.fit) is verdicts[name]
        return f"{own}, the best" + " of the eligible" * (not overall)
    return f"{own}, as good as {best} with {verdicts[best].fit:.1f} %"


def _errors(name: str, verdicts: Mapping[str, Verdict], objections: Mapping[str, str]) -> str:
    white = "white" if _white(verdicts[name]) else "coloured"
    follow = ", yet no other model comes near" if name in objections else ""
    free = "follow the input" if "V02" in _codes(verdicts[name]) else "free of the input"
    return f"its errors are {white} and {free}{follow}"


def _place_in_closed_loop(fit: Fit) -> int:
    known = fit.method in _IN_CLOSED_LOOP
    return _IN_CLOSED_LOOP.index(fit.method) if known else len(_IN_CLOSED_LOOP)


def _loop(fit: Fit) -> str:
    if fit.method in _IN_CLOSED_LOOP:
        return "the input answers to the output, which its noise model takes up"
    return "the input answers to the output, which may bias it"


def _size(name: str, equals: list[str], fits: Mapping[str, Fit]) -> str:
    others = ", ".join(f"{n} {size(fits[n])}" for n in equals if n != name)
    own = f"it has {size(fits[name])} parameters"
    return f"{own} (its equals: {others})" if others else own
