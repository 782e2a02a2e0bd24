"""Box-Jenkins models."""

from __future__ import annotations

from plantune.estimate.fit import Fit
from plantune.estimate.orders import PerInput, orders
from plantune.estimate.pem import Start, pem
from plantune.notes import Limits
from plantune.record import Record


def bj(
    rec: Record,
    nb: PerInput,
    nc: int,
    nd: int,
    nf: PerInput,
    nk: PerInput = 1,
    *,
    offset: bool = True,
    x0: Start = "estimate",
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit y(t) = B(q)/F(q) u(t - nk) + O + C(q)/D(q) e(t).

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments are honoured, and a row that is not `valid` ends one.
    nb, nf, nk : int, or one per input
        Number of b coefficients, >= 1; of f coefficients, >= 0; delay in samples (0 = direct term).
    nc, nd : int
        Numbers of c and d coefficients of the noise model, >= 0.
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
        `theta` (n,) ordered b, c, d, f; `P` covariance of theta and the offset; `x0` as impulses
        into each `1/F`, then into `1/C`, at the first residual rows.

    Raises
    ------
    NotIdentifiable
        As `arx`; and orders so high that parameters cannot be told apart (X10).

    Notes
    -----
    Plant and noise share nothing, so that the plant stays true where the noise model is too small,
    in open loop.  The predictor and the search of `oe`; the starts are ranked and the best four
    followed: plants by simpler methods with a noise model of what they leave, weighted null-space
    fitting (Galrinho, Rojas and Hjalmarsson 2019), random ones.  `C` and `F` are kept stable by
    reflection, so that the predictor is; `D` may have its roots anywhere, as a drifting
    disturbance has.  Source 001, 3.5.7; Ljung 1999, (4.31), lemma 4.2 and 7.2.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.bj(pt.datasets.engine_loop(noise_var=1.5), 1, 0, 1, 1, 6)
    >>> fit.names, fit.status
    (('b1', 'd1', 'f1'), 'converged')
    >>> bool(abs(fit.model.dc_gain() + 5.939) < 0.05)
    True
    """
    wanted = orders(rec.nu, nb=nb, nc=nc, nd=nd, nf=nf, nk=nk)
    return pem(rec, "BJ", wanted, offset, x0, robust, limits)
