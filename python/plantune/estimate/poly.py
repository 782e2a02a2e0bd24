"""Any case of the polynomial family."""

from __future__ import annotations

from plantune.estimate.fit import Fit
from plantune.estimate.orders import Orders, PerInput, orders
from plantune.estimate.pem import Start, pem
from plantune.notes import Limits
from plantune.record import Record


def poly(
    rec: Record,
    *,
    na: int = 0,
    nb: PerInput,
    nc: int = 0,
    nd: int = 0,
    nf: PerInput = 0,
    nk: PerInput = 1,
    offset: bool = True,
    x0: Start = "estimate",
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q)/F(q) u(t - nk) + C(q)/D(q) e(t).

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments are honoured.
    na, nc, nd : int
        Numbers of a, c and d coefficients, >= 0.
    nb, nf, nk : int, or one per input
        Number of b coefficients, >= 1; of f coefficients, >= 0; delay in samples (0 = direct term).
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
        `theta` (n,) ordered a, b, c, d, f; `method` the name of the structure: ARX, ARMAX, ARARX,
        ARARMAX, FIR, OE, BJ, or POLY where both `A` and `F` are asked for.

    Raises
    ------
    NotIdentifiable
        As `arx`; and orders so high that parameters cannot be told apart (X10).

    Notes
    -----
    The predictor and the search of `oe` and `bj`.  Ljung 1999, (4.33) and 7.2.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> fit = pt.estimate.poly(rec, nb=2, nd=1, nf=2, nk=3)
    >>> fit.method, fit.names
    ('BJ', ('b1', 'b2', 'd1', 'f1', 'f2'))
    """
    wanted = orders(rec.nu, na=na, nb=nb, nc=nc, nd=nd, nf=nf, nk=nk)
    return pem(rec, _structure(wanted), wanted, offset, x0, robust, limits)


def _structure(n: Orders) -> str:
    """Return the field's name for these orders."""
    noise = n.nc + n.nd > 0
    if not n.na:
        return "BJ" if noise else "OE" if any(n.nf) else "FIR"
    if any(n.nf):
        return "POLY"
    return "AR" + "AR" * (n.nd > 0) + ("MAX" if n.nc else "X")
