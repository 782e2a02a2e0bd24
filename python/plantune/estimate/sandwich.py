"""Intervals that hold where residuals are not white."""

from __future__ import annotations

from dataclasses import replace

from plantune import _core
from plantune.estimate.fit import Fit, known_process, refit_arguments, stretched
from plantune.notes import DEFAULT_LIMITS, Limits, notes_from_core
from plantune.record import Record


def sandwich(rec: Record, fit: Fit, *, limits: Limits | None = None) -> Fit:
    """Return the fit with P = J^-1 S J^-1, the residuals an autoregression.

    Parameters
    ----------
    rec : Record
        The record of the fit.
    fit : Fit
        Of a polynomial or a process model.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        The same parameters; `P` and `sd` are new, and a note (V12) says how much wider they are.

    Raises
    ------
    UsageError
        Another record than that of the fit, or a model that is neither (U01).
    NotIdentifiable
        Fewer than 20 residuals in a row (X03).

    Notes
    -----
    `J = psi' psi`, `S = psi' R psi`, `R` the covariance of an autoregression of the residuals whose
    order, 1 to 20, BIC takes.  Where they are white this costs nothing; a noise model (`armax`)
    is better still, for it weighs the rows as well.  Huber 1967; Ljung 1999, (9.42).
    Of models with `A`, `C` or `D`, whose gradient holds past noise, the products `psi eps` are
    summed with Bartlett's weights instead (Newey & West 1987).  Noise that is not white then
    moves the parameters themselves, which no interval can mend.
    Of a process model the profiles of `T` and `L` are widened in proportion.

    Examples
    --------
    A pole of the noise at 0.95 under an output-error model:

    >>> import numpy as np, plantune as pt
    >>> rng = np.random.default_rng(1)
    >>> u, e = np.repeat(rng.choice([-1.0, 1.0], 100), 10), rng.normal(size=1000)
    >>> noise = pt.models.PolyModel(A=[1, -0.95], B=[1], nk=0, Ts=0.1).simulate(e)
    >>> plant = pt.models.PolyModel(A=[1, -0.9], B=[0.2], nk=1, Ts=0.1)
    >>> rec = pt.Record(u=u, y=plant.simulate(u) + 0.1 * noise, Ts=0.1)
    >>> plain = pt.estimate.oe(rec, 1, 1, 1)
    >>> wide = pt.estimate.sandwich(rec, plain)
    >>> bool((wide.sd > plain.sd).all()), wide.notes[-1].code
    (True, 'V12')
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    known = known_process(rec, fit)
    if known is None:
        P, sd, note = _core.sandwich(rec, *refit_arguments(rec, fit), limits)
        return replace(fit, P=P, sd=sd, notes=(*fit.notes, *notes_from_core([note])))
    P, sd, factors, note = _core.process_sandwich(rec, known, fit.flat_P, limits)
    wider = dict(zip(fit.names, factors, strict=False))  # the offset's is the last
    intervals = {name: stretched(fit, name, float(wider[name])) for name in fit.intervals}
    notes = (*fit.notes, *notes_from_core([note]))
    return replace(fit, P=P, sd=sd, intervals=intervals, notes=notes)
