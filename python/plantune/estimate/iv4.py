"""Instrumental variables in four steps."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import PerInput, orders, whole
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def iv4(
    rec: Record,
    na: int,
    nb: PerInput,
    nk: PerInput = 1,
    *,
    iterate: int = 1,
    offset: bool = True,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + v(t), v of any colour, by instruments.

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments and `valid` are honoured.
    na : int
        Number of a coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).
    iterate : int
        How often the last two steps are done, >= 1; ends earlier where nothing moves any more.
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a then b; `P` covariance of theta and the offset, the colour of v
        taken into account; `loss` the mean square of v.

    Raises
    ------
    NotIdentifiable
        As `arx`.

    Notes
    -----
    Least squares; instruments from its simulated output; an autoregression of what they leave,
    of order 8 or more; instruments again, all filtered by it.  No search and no local minimum,
    but only nearly efficient: `bj` and `armax` give the last percent.  In closed loop the input
    carries the noise, and the instruments with it: prefer `armax` or `bj` there.
    Ljung 1999, (15.21) to (15.26).

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.iv4(pt.datasets.hair_dryer(), 2, 2, 3)
    >>> fit.names, fit.N
    (('a1', 'a2', 'b1', 'b2'), 996)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    wanted = orders(rec.nu, na=na, nb=nb, nk=nk)
    fit = _core.iv4(rec, wanted, offset, whole("iterate", iterate), limits)
    return fit_from_core(fit, "IV4", rec, limits)
