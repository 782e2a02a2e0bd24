"""Continuous transfer functions by refined instrumental variables."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import whole
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.record import Record


def srivc(
    rec: Record,
    n: int,
    nb: int = 1,
    *,
    L: tuple[float, float] | None = None,
    offset: bool = True,
    limits: Limits | None = None,
) -> Fit:
    """Fit y = B(s)/A(s) e^(-L s) u + O + e by refined instruments.

    `A(s) = a_n s^n + … + a_1 s + 1` and `B(s) = b_(nb-1) s^(nb-1) + … + b_0`.

    Parameters
    ----------
    rec : Record
        One input, one output; segments are honoured, and a row that is not `valid` begins a
        stretch of y with a state of its own.
    n : int
        Number of poles, 1 to 4.
    nb : int
        Number of coefficients of the numerator, 1 to n.
    L : (low, high), optional
        Seconds to search for the delay; by default up to a quarter of the longest segment, at
        most 200 samples.
    offset : bool
        Whether `O` is estimated.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        A `ProcessModel` with `theta` = `K, T, L` for `n = nb = 1`, else a `TransferFunction` with
        `theta` = `a1 … an, b0 …, L`, the powers of s ascending.  `P` is the covariance for white
        output noise, `sd` of L and T of a first order being too small by up to a tenth where the
        delay is known to less than a sample (`process` has its profile).  `status` is
        "converged" when the denominator rests.

    Raises
    ------
    NotIdentifiable
        The input stands still (X01) or supports fewer parameters (X02); too few rows (X03);
        nothing of y follows u (X04); delays beyond a third of the record (X05); of a first order
        `T` clearly below two sample times (M09).
    UsageError
        Other orders, or a record of several inputs or outputs (U01).

    Notes
    -----
    A second way to the numbers of `process`, by other arithmetic: where the two differ by more
    than their deviations one of them is in a minimum of its own.  In closed loop u follows the
    noise, and the instruments made of u with it: the estimate is biased.  A record with a
    reference `r` is given note X09; take `armax`.  Young and Jakeman 1980; Garnier and
    Wang 2008; Young 2011; for the delay Chen, Garnier and Gilson 2015.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.srivc(pt.datasets.engine_loop(L=0.107), 1, L=(0.0, 0.3))
    >>> fit.theta.round(3), fit.status
    (array([-5.939,  0.149,  0.107]), 'converged')
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    fit = _core.srivc(rec, (whole("n", n), whole("nb", nb)), offset, L, limits)
    return fit_from_core(fit, "SRIVC", rec, limits, _closed_loop(rec))


def _closed_loop(rec: Record) -> tuple[Note, ...]:
    if rec.r is None:
        return ()
    return (
        Note(
            code="X09",
            severity="warning",
            text="the record has a reference: where u follows y instruments made of u are biased",
            remedy="in closed loop take armax, whose noise model keeps it unbiased",
        ),
    )
