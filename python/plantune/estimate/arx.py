"""ARX by least squares."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import PerInput, orders
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def arx(
    rec: Record,
    na: int,
    nb: PerInput,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + e(t) by least squares.

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments and `valid` are honoured.
    na : int
        Number of a coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    robust : bool
        Whether single outputs far off shall not move the fit; a note D19 says how many were left
        out.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a then b; `P` covariance of theta and the offset; `loss` in units
        of y squared.

    Raises
    ------
    NotIdentifiable
        The input stands still (X01) or supports fewer parameters (X02); fewer usable rows than
        parameters (X03); a delay beyond a third of the record (X05); a regressor without full
        rank (X08); inputs that copy each other (X11).
    UsageError
        Orders that do not fit the record (U01).

    Notes
    -----
    QR of the regressor, which is streamed and never held; not the normal equations.
    Robust: the first output of each run of errors beyond five standard deviations is missing, and
    Huber's weights serve the rest (Huber 1981, 7.8), 95 % efficient on clean records.
    Source 000, (2.2-3) to (2.2-5).  For output noise prefer `process`, which is not biased.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.prep.detrend(pt.datasets.hair_dryer().take(slice(0, 300)))
    >>> fit = pt.estimate.arx(rec, 2, 2, 3, offset=False)
    >>> fit.theta.round(6), fit.N
    (array([-1.273739,  0.393546,  0.066618,  0.044482]), 296)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    wanted = orders(rec.nu, na=na, nb=nb, nk=nk)
    fit = _core.arx(rec, wanted, offset, robust, limits)
    return fit_from_core(fit, "ARX", rec, limits)
