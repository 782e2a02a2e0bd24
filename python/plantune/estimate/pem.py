"""Output-error and ARMAX models by prediction errors."""

from __future__ import annotations

from typing import Literal

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import Orders, PerInput, orders
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record

Start = Literal["estimate", "zero"]


def oe(
    rec: Record,
    nb: PerInput,
    nf: PerInput,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    x0: Start = "estimate",
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit y(t) = B(q)/F(q) u(t - nk) + O + e(t), the noise white on the output.

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments are honoured, rows that are not `valid` are passed over.
    nb, nf, nk : int, or one per input
        Number of b coefficients, >= 1; of f coefficients, >= 0; delay in samples (0 = direct term).
    offset : bool
        Whether `O` is estimated.
    x0 : "estimate" or "zero"
        What is known before each segment: nothing, so that its state is a parameter and the rows
        up to the longest lag are history; or all signals are zero there.
    robust : bool
        Whether single outputs far off shall not move the fit; a note D19 says how many were left
        out.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered b then f, per input; `P` their covariance, then the offset's; `x0` as
        impulses into each `1/F` at the first residual rows.

    Raises
    ------
    NotIdentifiable
        As `arx`; and orders so high that poles and zeros cancel (X10).

    Notes
    -----
    Gauss-Newton steps, damped where they fail, with analytic gradient, from several starts; on
    the triangle of the gradient's columns, by QR where these are near dependence.  `F` is kept
    stable by reflection.  Source 001, (3.5-40) to (3.5-50); Ljung 1999, 7.2.
    In closed loop with a weak excitation prefer `armax`: output errors are biased there.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.oe(pt.datasets.engine_loop(), 1, 1, 6)
    >>> fit.theta.round(4), fit.offset.round(3), fit.status
    (array([-0.7455, -0.8745]), array([583.451]), 'converged')
    """
    return _pem(rec, "OE", orders(rec.nu, nb=nb, nf=nf, nk=nk), offset, x0, robust, limits)


def armax(
    rec: Record,
    na: int,
    nb: PerInput,
    nc: int,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    x0: Start = "estimate",
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + C(q) e(t), a disturbance that is a moving average.

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments are honoured, and a row that is not `valid` ends one.
    na, nc : int
        Numbers of a and c coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    x0 : "estimate" or "zero"
        What is known before each segment: nothing, or all signals are zero there.
    robust : bool
        Whether single outputs far off shall not move the fit; a note D19 says how many were left
        out.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a, b, c; `P` covariance of theta and the offset; `x0` as impulses
        into `1/C` at the first residual rows.

    Raises
    ------
    NotIdentifiable
        As `arx`; and orders so high that parameters cannot be told apart (X10).

    Notes
    -----
    The predictor and the search of `oe`; `C` is kept stable by reflection.
    Source 001, (3.5-51) to (3.5-69) as corrected; Ljung 1999, 7.2 and 10.2.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.armax(pt.datasets.engine_loop(noise_var=1.5), 1, 1, 1, 6)
    >>> fit.names, fit.status
    (('a1', 'b1', 'c1'), 'converged')
    >>> bool(abs(fit.model.dc_gain() + 5.939) < 0.05)
    True
    """
    return _pem(
        rec, "ARMAX", orders(rec.nu, na=na, nb=nb, nc=nc, nk=nk), offset, x0, robust, limits
    )


def _pem(
    rec: Record,
    method: str,
    wanted: Orders,
    offset: bool,
    x0: Start,
    robust: bool,
    limits: Limits | None,
) -> Fit:
    limits = limits or rec.limits or DEFAULT_LIMITS
    return fit_from_core(_core.pem(rec, wanted, offset, x0, robust, limits), method, rec, limits)
