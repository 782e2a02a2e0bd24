"""ARMAX models."""

from __future__ import annotations

from plantune.estimate.fit import Fit
from plantune.estimate.orders import PerInput, orders
from plantune.estimate.pem import Start, pem
from plantune.notes import Limits
from plantune.record import Record


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
        Whether large errors count less (Huber) and spikes not at all (D19), which a note counts.
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
    return pem(rec, "ARMAX", orders(rec.nu, na=na, nb=nb, nc=nc, nk=nk), offset, x0, robust, limits)
