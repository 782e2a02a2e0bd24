"""Process models with real-valued delays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def process(
    rec: Record,
    code: str | Sequence[str] = "P1D",
    *,
    noise: str | tuple[int, int] = "white",
    offset: bool | Literal["steps", "each"] = True,
    L: tuple[float, float] | None = None,
    robust: bool = False,
    limits: Limits | None = None,
) -> Fit:
    """Fit y = sum K (Tz s + 1) e^(-L s) / (s^i prod (T s + 1)) u + O + v.

    Parameters
    ----------
    rec : Record
        One output; segments and `valid` are honoured.  Stamps that are not uniform are served
        exactly by one or two lags with a dead time (P1, P1D, P2, P2D) of one input.
    code : str, or one per input
        `P0` to `P3`, the number of lags, with any of the letters `D` a dead time, `Z` a zero,
        `I` an integrator, `U` a pair `T^2 s^2 + 2 zeta T s + 1` in place of the first two lags:
        `P2DU`.  One code serves all inputs.  Where y jumps with u (P0D, P1DZ) the dead time is
        known to the sample.
    noise : "white", "arma" or (nc, nd)
        White noise on the output, or `v = C/D e` estimated with the plant; "arma" takes as many
        coefficients as the plant has poles.  Data from a closed loop need it.
    offset : bool, "steps" or "each"
        Whether `O` is estimated; with an integrator it is the drift, in units of y per second.
        "steps": a load that comes on within the record is searched for, and `O` has steps.
        "each": every segment has its own, as different experiments do.
    L : (low, high), optional
        Seconds to search for the delays; by default up to a quarter of the longest segment, at
        most 200 samples.
    robust : bool
        Huber's weights, and spikes beyond five standard deviations left out; a note (D19) counts
        them.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` is `K, T1 ..., L, Tz, zeta`, the last two where the code has them, `L = 0` where it
        has no `D`; of several inputs `K[power]` and so on.  `P` their covariance, then the
        offset's.  `steps` says where `O` changes.  `interval("L")` is the profile's.  `model` is a
        ProcessModel; of several inputs the PolyModel that samples all, their process models in
        `plants`.

    Raises
    ------
    NotIdentifiable
        The input stands still (X01), too few rows (X03), nothing of y follows u (X04), delays
        beyond a third of the record (X05), `T` of a first order clearly below two sample times
        (M09).
    DataError
        Stamps that are not uniform, and another structure than these (D15).

    Notes
    -----
    Variable projection: gains, offset and the states of every segment are solved for linearly;
    times, damping and dead times by Levenberg-Marquardt from several starts.  The interval of a
    dead time, and that of the `T` of a first order, comes from the profile of the loss, which has
    kinks at whole samples; of a pair of poles and of all others from the delta rule.  Source 001,
    3.5.6.  Load steps are found in what is left by rough times and dead times, for exact ones would
    bend to a step that is not seen yet, and then fitted together with all else: Hinkley 1970.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(L=0.107), "P1D")
    >>> fit.theta.round(4), fit.offset.round(3)
    (array([-5.939 ,  0.1491,  0.107 ]), array([583.451]))
    >>> print(pt.estimate.process(pt.datasets.hair_dryer(), "P2D").model)
    G(s) = 0.93674 e^(-0.157499 s) / ((0.254327 s + 1) (0.135369 s + 1))
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    codes = [code] * rec.u.shape[1] if isinstance(code, str) else list(code)
    fields = _core.process(rec, codes, noise, offset, L, robust, limits)
    return fit_from_core(fields, " ".join(codes), rec, limits)
