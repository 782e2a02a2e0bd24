"""Whether first order plus dead time suffices, or a second lag is asked for."""

from __future__ import annotations

from plantune.errors import NotIdentifiable, NumericsError
from plantune.estimate.candidates import is_sound
from plantune.estimate.fit import Fit
from plantune.estimate.process import process
from plantune.notes import Limits, Note
from plantune.record import Record
from plantune.validate.check import Verdict
from plantune.validate.compare import compare

# Standard deviations by which the shorter lag must differ from none.
_SURE = 2.0

# Damping below which a pair of poles is a resonance, and no rule for lags applies.
_RESONANT = 0.7


def second_lag(
    est: Record, val: Record, first: Fit, verdict: Verdict, known: float, limits: Limits
) -> tuple[Fit, Verdict, Note] | None:
    """Return P2D, its verdict and V15 where it takes the place of P1D; None where P1D stays.

    Asked for where the polynomial model simulates fresh rows better by more than `limits.V10`
    percent, or errors of P1D follow the input.  It takes the place where its search converged, the
    second lag lies two standard deviations from none, BIC prefers it, and it simulates fresh rows
    better by more than `limits.V10` percent.  A pair of poles below a damping of 0.7 is none of two
    lags, and stays with the polynomial model.

    Parameters
    ----------
    est, val : Record
        What models were fitted on, and rows that none has seen.
    first, verdict : Fit, Verdict
        P1D and how it does on `val`.
    known : float
        Percent of `val` that the best polynomial model simulates.
    limits : Limits
        Thresholds.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> fits = pt.estimate.process(est), pt.estimate.oe(est, 2, 2, 3)
    >>> first, rival = (pt.validate.check(val, fit) for fit in fits)
    >>> fit, found, note = second_lag(est, val, fits[0], first, rival.fit, pt.Limits())
    >>> note.code, round(found.fit - first.fit)
    ('V15', 3)
    """
    follows = any(note.code == "V02" for note in verdict.notes)
    if not follows and known - verdict.fit <= limits.V10:
        return None
    try:
        fit = process(est, "P2D", limits=limits)
        (found,) = compare(val, fit, names=["P2D"], limits=limits).rows
    except (NotIdentifiable, NumericsError):
        return None
    better = found.fit - verdict.fit
    told = is_sound(fit) and _is_two_lags(fit) and fit.bic / fit.N < first.bic / first.N
    if not (told and better > limits.V10 and found.fit >= limits.V01):
        return None
    return fit, found, _note(found, verdict, limits)


def _is_two_lags(fit: Fit) -> bool:
    """Whether the shorter lag is sure, or the two are too close to tell apart."""
    x = dict(zip(fit.names, zip(fit.theta, fit.sd, strict=True), strict=True))
    if "zeta" in x:
        return float(x["zeta"][0]) >= _RESONANT
    T, sd = min(x["T1"], x["T2"])
    return bool(T > _SURE * sd)


def _note(found: Verdict, first: Verdict, limits: Limits) -> Note:
    return Note(
        code="V15",
        severity="info",
        text=f"a second lag is needed: P2D simulates {found.N} rows with {found.fit:.1f} %, P1D "
        f"with {first.fit:.1f} %",
        count=found.N,
        measured=found.fit - first.fit,
        limit=limits.V10,
    )
