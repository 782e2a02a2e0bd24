"""A model judged on a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import NotIdentifiable, refusal
from plantune.estimate.fit import Fit
from plantune.models import (
    MatrixPolyModel,
    PolyModel,
    ProcessModel,
    StateSpace,
    TermModel,
    TransferFunction,
)
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record
from plantune.validate.evidence import against
from plantune.validate.plausible import plausible


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Correlations of the one-step errors, with their 99 % bands.

    Attributes
    ----------
    lags, autocorr, band : array (M + 1,), array (M + 1,), float
        Lags `0 … M`, normalised autocorrelation, half width of its band.
    cross_lags, crosscorr, cross_band : array (2 M + 1,), array (nu, 2 M + 1), array (nu,)
        Lags `-M … M`, correlation with each input (nu, 2 M + 1), half width per input; at a
        positive lag the error follows the input.
    portmanteau : float
        Chance that white errors have an autocorrelation as large as this over all lags.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> residuals = pt.validate.check(val, pt.estimate.arx(est, 2, 2, 3)).residuals
    >>> residuals.autocorr[:3].round(2), round(residuals.band, 2)
    (array([ 1.  , -0.34, -0.01]), 0.12)
    >>> residuals.crosscorr.shape, residuals.cross_lags[[0, -1]].tolist()
    ((1, 51), [-25, 25])
    """

    lags: NDArray[np.int64]
    autocorr: Floats
    band: float
    cross_lags: NDArray[np.int64]
    crosscorr: Floats
    cross_band: Floats
    portmanteau: float


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """How a model does on a record; true when it passes.

    Attributes
    ----------
    name : str
        Method of the fit, or class of a bare model.
    fit, fit_1step : float
        `100 (1 - |y - yhat| / |y - mean(y)|)` of the simulation and of the one-step prediction.
    rmse : float
        Root mean squared simulation error, units of y.
    loss : float
        Mean squared one-step error.
    N : int
        Rows judged.
    offset, offset_from : float, str
        `O` in the simulation; whether it is the fit's own or estimated here.
    x0 : str
        What was assumed of the start of each segment.
    rows : array (N,)
        Rows judged, with time `t`, measured output `y` and simulated output `yhat` there.
    errors : array (N,)
        One-step errors.
    residuals : Residuals
        Their correlations.
    widening : float
        Factor by which correlated residuals widen a standard deviation.
    feedback : bool
        Whether the input follows errors, as it does in closed loop.
    passed : bool
        Simulation fit above the limit V01 and residuals free of the input.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> verdict = pt.validate.check(val, pt.estimate.arx(est, 2, 2, 3))
    >>> print(str(verdict).splitlines()[0])
    ARX passes: simulation 85.3 %, one step 95.0 %, rmse 0.1207 on 496 rows
    """

    name: str
    fit: float
    fit_1step: float
    rmse: float
    loss: float
    N: int
    offset: float
    offset_from: str
    x0: str
    rows: NDArray[np.int64]
    t: Floats
    y: Floats
    yhat: Floats
    errors: Floats
    residuals: Residuals
    widening: float
    feedback: bool
    passed: bool
    notes: tuple[Note, ...]
    source: str

    def __bool__(self) -> bool:
        return self.passed

    def __str__(self) -> str:
        word = "passes" if self.passed else "does not pass"
        head = (
            f"{self.name} {word}: simulation {self.fit:.1f} %, one step {self.fit_1step:.1f} %, "
            f"rmse {self.rmse:.4g} on {self.N} rows"
        )
        return "\n".join([head, *(f"  {note}" for note in self.notes)])


def check(
    rec: Record,
    fit: Fit
    | PolyModel
    | ProcessModel
    | TransferFunction
    | MatrixPolyModel
    | StateSpace
    | TermModel,
    *,
    output: str | None = None,
    x0: str = "estimate",
    offset: str | None = None,
    lags: int = 25,
    limits: Limits | None = None,
) -> Verdict:
    """Judge a fit or a bare model on a record, best on rows it has not seen.

    Parameters
    ----------
    rec : Record
        With the columns of the model.
    fit : Fit, or a linear model of `plantune.models`
        A bare model has offset 0.
    output : str, optional
        With several outputs the name of the one that is judged: each has a verdict of its own, in
        its own unit.
    x0 : "estimate" or "zero"
        Initial state of each segment.
    offset : "fit" or "estimate", optional
        The fit's own, or a new one for this record.  By default the fit's own, its steps included;
        but a new one where the record's own means were removed, or where the offset has steps and
        the record is another: its level is then another than that of the fit.
    lags : int
        Most lags of the residual correlations.
    limits : Limits, optional
        Thresholds.

    A model with regressors of one's own (`TermModel`) runs from the first rows of each segment,
    and has its constant inside: `x0` and `offset` do not concern it.

    Returns
    -------
    Verdict
        With note M11 where rows of the fit are judged again, and what `plausible` doubts of the
        model's poles and zeros.  Of a fit also X09, feedback that its noise model does not take up
        (`closed_loop`); M07, a plant that changed within the record (`time_varying`); and V08, an
        ARX whose regressor is noisy.  These leave `passed` as it is.

    Raises
    ------
    NotIdentifiable
        The model is no better than the mean (X04); the verdict is in `.result`.

    Notes
    -----
    Source 001, 3.5.9 and 3.5.10.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> verdict = pt.validate.check(val, pt.estimate.arx(est, 2, 2, 3))
    >>> bool(verdict), round(verdict.fit), round(verdict.fit_1step)
    (True, 85, 95)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    if offset is None:
        known = not isinstance(fit, Fit) or fit.knows_level_of(rec)
        offset = "fit" if known and not _core.has_no_level(rec, limits) else "estimate"
    if offset not in ("fit", "estimate"):
        raise refusal("U01", f"`offset` is {offset!r}, must be 'fit' or 'estimate'", remedy="'fit'")
    model = _judged_model(fit)
    i = _which(rec, model, output)
    extra = {
        "name": fit.method if isinstance(fit, Fit) else type(model).__name__,
        "x0": x0,
        "offset_from": offset,
    }
    seen = _seen(rec, fit) if isinstance(fit, Fit) else ()
    several = isinstance(model, MatrixPolyModel | StateSpace)
    own_terms = isinstance(model, TermModel)
    bare: Any = fit
    inputs = rec.u_names if rec.nu > 1 else ()
    doubts = () if several or own_terms else plausible(bare, inputs=inputs, limits=limits)
    further = (*doubts, *seen, *limits.changes())
    own = fit.offset.tolist() if isinstance(fit, Fit) else [0.0] * rec.ny
    used = own if offset == "fit" else None
    measured = rec
    if isinstance(fit, Fit) and offset == "fit":
        rec = fit.without_steps(rec)
    try:
        if own_terms:
            d = _core.term_check(rec, model, model.given(rec, ahead=True), lags, limits)
            extra.update(x0="measured", offset_from="fit")
        elif several:
            d = _core.matrix_check(rec, model, i, (x0, used, lags), limits)
        else:
            level = None if used is None else used[0]
            fitted = fit.N if isinstance(fit, Fit) else None
            d = _core.check(rec, model, (x0, level, lags, fitted), limits)
    except NotIdentifiable as error:
        if error.result is not None:
            error.result = _verdict(error.result, rec, measured, i, extra, further)
        raise
    if isinstance(fit, Fit):
        white = all(note["code"] != "M08" for note in d["notes"])
        found = against(rec, fit, white=white, widening=d["widening"], limits=limits)
        further = (*found, *further)
    return _verdict(d, rec, measured, i, extra, further)


def _judged_model(fit: Any) -> Any:
    """Return the model whose errors count: that with the noise model where one was fitted.

    The offset of an integrating process model is a drift, which its samples do not know.
    """
    if not isinstance(fit, Fit):
        return fit
    drifts = any(plant.integrating for plant in fit.plants)
    return fit.model if drifts else fit.sampled or fit.model


def _which(rec: Record, model: Any, output: str | None) -> int:
    """Return the number of the output that is judged; of several one has to be named."""
    if output is None and (rec.ny == 1 or not isinstance(model, MatrixPolyModel | StateSpace)):
        return 0
    if output not in rec.y_names:
        names = ", ".join(map(repr, rec.y_names))
        came = "missing" if output is None else repr(output)
        raise refusal(
            "U01",
            f"`output` is {came}, must be one of {names}: each output has a verdict of its own",
            remedy=f"check(rec, fit, output={rec.y_names[0]!r})",
        )
    return rec.y_names.index(output)


def residuals(
    rec: Record,
    fit: Fit | PolyModel | ProcessModel,
    *,
    lags: int = 25,
    limits: Limits | None = None,
) -> Residuals:
    """Return the correlations of a model's one-step errors on a record, with their bands.

    Parameters
    ----------
    rec : Record
        With the columns of the model.
    fit : Fit, PolyModel or ProcessModel
        A bare model has offset 0.
    lags : int
        Most lags.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Residuals
        Also where the model is no better than the mean.

    Notes
    -----
    `check` says in words what lies outside.  Source 001, 3.5.9; Ljung and Box 1978.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> pt.validate.residuals(val, pt.estimate.arx(est, 2, 2, 3)).portmanteau < 0.01
    True
    """
    try:
        return check(rec, fit, lags=lags, limits=limits).residuals
    except NotIdentifiable as error:
        if error.result is None:
            raise
        return error.result.residuals  # type: ignore[no-any-return]


def _verdict(
    d: Mapping[str, Any],
    rec: Record,
    measured: Record,
    i: int,
    extra: Mapping[str, Any],
    notes: tuple[Note, ...],
) -> Verdict:
    """Build the verdict; `measured` has the steps of the offset that `rec` was judged without."""
    r = d["residuals"]
    rows = np.array(d["rows"], np.int64)
    y = measured.y[rows, i]
    yhat = d["yhat"] if measured is rec else d["yhat"] + (y - rec.y[rows, i])
    return Verdict(
        **{
            **d,
            **extra,
            "rows": rows,
            "yhat": yhat,
            "residuals": Residuals(
                lags=np.array(r["lags"]),
                autocorr=r["autocorr"],
                band=r["band"],
                cross_lags=np.array(r["cross_lags"]),
                crosscorr=np.array(r["crosscorr"]),
                cross_band=r["cross_band"],
                portmanteau=r["portmanteau"],
            ),
            "notes": (*notes_from_core(d["notes"]), *notes),
        },
        t=rec.time[rows],
        y=y,
        source=rec.source,
    )


def _seen(rec: Record, fit: Fit) -> tuple[Note, ...]:
    """M11 where rows of the same source were used to fit."""
    if rec.source != fit.source:
        return ()
    inside = np.zeros(rec.N, bool)
    for first, last in fit.rows:
        inside |= (rec.rows >= first) & (rec.rows <= last)
    if not inside.any():
        return ()
    count = int(inside.sum())
    return (
        Note(
            code="M11",
            severity="warning",
            text=f"not validated: {count} of {rec.N} rows were used to fit",
            count=count,
            remedy="keep rows apart: est, val = rec.split(0.5)",
        ),
    )
