"""ARX by least squares."""

from __future__ import annotations

from collections.abc import Sequence

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import PerInput, orders, whole
from plantune.estimate.term_arx import term_arx
from plantune.models.terms import Regressor
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def arx(
    rec: Record,
    na: int,
    nb: PerInput,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    regressors: Sequence[Regressor] = (),
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + e(t) by least squares.

    Parameters
    ----------
    rec : Record
        Of one output or several, nu inputs; segments and `valid` are honoured.
    na : int
        Number of a coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).  With several outputs
        one `nb` for all inputs.
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    regressors : sequence of str, or of (str, function)
        Further regressors, linear in their coefficients: terms made of lagged signals `u(t-1)`
        and `y(t-2)` (or the record's names for them), numbers, `+ - * **` and `positive negative
        sign abs square max min`; or a name with a function from the record to one value per row,
        NaN where it has none.  Then `nb` may be 0, the model is a `TermModel`, and the constant
        is its `d`.
    robust : bool
        Whether large errors count less (Huber) and spikes not at all (D19), which a note counts.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a then b; `P` covariance of theta and the offset; `loss` in units
        of y squared.  With several outputs the model is a `MatrixPolyModel`, `A (na+1, ny, ny)`
        and `B (nb, ny, nu)`; `theta` is ordered by output, its names are `a1[y1,y2]`; `loss` is
        the mean over all outputs, and the criteria use the determinant of the residual covariance.

    Raises
    ------
    NotIdentifiable
        The input stands still (X01) or supports fewer parameters (X02); fewer usable rows than
        parameters (X03); a delay beyond a third of the record (X05); a regressor without full
        rank (X08); inputs that copy each other (X11); a regressor that takes one value (X01).
    UsageError
        Orders that do not fit the record, or a regressor that cannot be read (U01).

    Notes
    -----
    QR of the regressor, which is streamed and never held; not the normal equations.
    Source 000, (2.2-3) to (2.2-5), and (2.1-7) to (2.1-9) for several outputs.  For output noise
    prefer `process`, which is not biased.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.prep.detrend(pt.datasets.hair_dryer().take(slice(0, 300)))
    >>> fit = pt.estimate.arx(rec, 2, 2, 3, offset=False)
    >>> fit.theta.round(6), fit.N
    (array([-1.273739,  0.393546,  0.066618,  0.044482]), 296)

    Other friction to the left than to the right (source 000, chapter 4):

    >>> motor = pt.datasets.printer_motor("prbs", resolution=0, equation_var=0.01)
    >>> own = pt.estimate.arx(motor, 2, 2, 1, regressors=["positive(y(t-1))", "sign(y(t-1))"])
    >>> own.names[4:], own.model.kind
    (('positive(y(t-1))', 'sign(y(t-1))'), 'terms')
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    if robust and (regressors or rec.ny > 1):
        what = "regressors of one's own" if regressors else "several outputs"
        raise refusal(
            "U01",
            f"`robust` is not there for {what}",
            remedy="pt.prep.despike(rec), then arx",
        )
    if regressors:
        return term_arx(rec, na, nb, nk, regressors, offset, limits)
    if rec.ny > 1:
        return _of_several(rec, whole("na", na), nb, nk, offset, limits)
    wanted = orders(rec.nu, na=na, nb=nb, nk=nk)
    fit = _core.arx(rec, wanted, offset, robust, limits)
    return fit_from_core(fit, "ARX", rec, limits)


def _of_several(
    rec: Record, na: int, nb: PerInput, nk: PerInput, offset: bool, limits: Limits
) -> Fit:
    wanted = orders(rec.nu, na=na, nb=nb, nk=nk)
    if len(set(wanted.nb)) > 1:
        raise refusal(
            "U01",
            f"`nb` is {nb}: with several outputs B is one matrix a lag, all of its columns free",
            remedy=f"nb={max(wanted.nb)}",
        )
    fit = _core.matrix_arx(rec, na, wanted.nb[0], wanted.nk, offset, limits)
    return fit_from_core(fit, "ARX", rec, limits)
