"""Output-error models."""

from __future__ import annotations

from plantune.estimate.fit import Fit
from plantune.estimate.orders import PerInput, orders
from plantune.estimate.pem import Start, pem
from plantune.notes import Limits
from plantune.record import Record


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
        Whether large errors count less (Huber) and spikes not at all (D19), which a note counts.
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
    return pem(rec, "OE", orders(rec.nu, nb=nb, nf=nf, nk=nk), offset, x0, robust, limits)
