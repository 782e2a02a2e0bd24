"""Process models with a real-valued delay."""

from __future__ import annotations

from collections.abc import Sequence

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def process(
    rec: Record,
    code: str | Sequence[str] = "P1D",
    *,
    noise: tuple[int, int] = (0, 0),
    offset: bool = True,
    L: tuple[float, float] | None = None,
    limits: Limits | None = None,
) -> Fit:
    """Fit y = K e^(-L s)/(T s + 1) u + O, the delay a real number.

    Parameters
    ----------
    rec : Record
        One input, one output; segments and `valid` are honoured.
    code : "P1D"
        One pole and a delay.
    offset : bool
        Whether `O` is estimated.
    L : (low, high), optional
        Seconds to search for the delay; by default up to a quarter of the longest segment, at
        most 200 samples.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` is `K, T, L`; `P` their covariance, then the offset's, for white output noise.

    Raises
    ------
    NotIdentifiable
        The input stands still (X01), too few rows (X03), nothing of y follows u (X04), delays
        beyond a third of the record (X05), `T` clearly below two sample times (M09).

    Notes
    -----
    Variable projection: gain, offset and the initial state of every segment are solved for
    linearly, `T` and `L` by Levenberg-Marquardt from several delays.  Source 001, 3.5.6.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(L=0.107), "P1D")
    >>> fit.theta.round(4), fit.offset.round(3)
    (array([-5.939 ,  0.1491,  0.107 ]), array([583.451]))
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    codes = [code] if isinstance(code, str) else list(code)
    return fit_from_core(
        _core.process(rec, codes, noise, offset, L, limits), " ".join(codes), rec, limits
    )
