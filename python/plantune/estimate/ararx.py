"""ARX models whose disturbance is autoregressive: ARARX, ARARMAX."""

from __future__ import annotations

from plantune.estimate.fit import Fit
from plantune.estimate.orders import PerInput, orders
from plantune.estimate.pem import Start, pem
from plantune.notes import Limits
from plantune.record import Record


def ararx(
    rec: Record,
    na: int,
    nb: PerInput,
    nd: int,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    x0: Start = "estimate",
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + e(t)/D(q), a disturbance that is autoregressive.

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments are honoured, and a row that is not `valid` ends one.
    na, nd : int
        Numbers of a and d coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    x0 : "estimate" or "zero"
        What is known before each segment: nothing, or all signals are zero there.
    robust : bool
        Whether large errors count less (Huber) and spikes not at all (D19), which a note counts.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a, b, d; `P` covariance of theta and the offset; `x0` the first `nd`
        errors of each segment.

    Raises
    ------
    NotIdentifiable
        As `arx`; and orders so high that parameters cannot be told apart (X10).

    Notes
    -----
    The generalised least squares of Clarke 1967, as minimum of the prediction errors: the
    predictor and the search of `bj`.  Ljung 1999, (4.25) and 10.4.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.ararx(pt.datasets.hair_dryer(), 2, 2, 1, 3)
    >>> fit.names, fit.status
    (('a1', 'a2', 'b1', 'b2', 'd1'), 'converged')
    """
    return pem(rec, "ARARX", orders(rec.nu, na=na, nb=nb, nd=nd, nk=nk), offset, x0, robust, limits)


def ararmax(
    rec: Record,
    na: int,
    nb: PerInput,
    nc: int,
    nd: int,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    x0: Start = "estimate",
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + C(q)/D(q) e(t).

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments are honoured, and a row that is not `valid` ends one.
    na, nc, nd : int
        Numbers of a, c and d coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    x0 : "estimate" or "zero"
        What is known before each segment: nothing, or all signals are zero there.
    robust : bool
        Whether large errors count less (Huber) and spikes not at all (D19), which a note counts.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a, b, c, d; `P` covariance of theta and the offset; `x0` as impulses
        into `1/C` at the first residual rows.

    Raises
    ------
    NotIdentifiable
        As `arx`; and orders so high that parameters cannot be told apart (X10).

    Notes
    -----
    The predictor and the search of `bj`.  Ljung 1999, (4.26) and 7.2.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.ararmax(pt.datasets.hair_dryer(), 2, 2, 1, 1, 3)
    >>> fit.names, fit.status
    (('a1', 'a2', 'b1', 'b2', 'c1', 'd1'), 'converged')
    """
    wanted = orders(rec.nu, na=na, nb=nb, nc=nc, nd=nd, nk=nk)
    return pem(rec, "ARARMAX", wanted, offset, x0, robust, limits)
