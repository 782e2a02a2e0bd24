"""The model's uncertainty carried on to curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.estimate.fit import Fit, flat
from plantune.record import Floats

Band = tuple[Floats, Floats]


def step_band(fit: Fit, t: ArrayLike, input: int = 0) -> Band:
    """Return the 95 % band of the unit step response at times `t`.

    Quantiles over models drawn from the fit's covariance; the same fit gives the same band.

    Parameters
    ----------
    fit : Fit
        With a model.
    t : array (m,)
        Seconds.
    input : int
        Which input.

    Returns
    -------
    low, high : array (m,)

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    >>> low, high = step_band(fit, [1.0])
    >>> bool(low[0] < fit.model.step([1.0])[0] < high[0])
    True
    """
    return _core.step_band(fit.model, flat(fit), input, _grid(t))


def bode_band(fit: Fit, w: ArrayLike, input: int = 0) -> tuple[Band, Band]:
    """Return the 95 % bands of magnitude and of phase in degrees at `w` rad/s.

    Parameters
    ----------
    fit : Fit
        With a model.
    w : array (m,)
        Frequencies, rad/s.
    input : int
        Which input.

    Returns
    -------
    (low, high), (low, high)
        Of the magnitude, then of the phase.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    >>> (low, high), _ = bode_band(fit, [1.0])
    >>> bool(low[0] < abs(fit.model.freqresp([1.0])[0]) < high[0])
    True
    """
    return _core.bode_band(fit.model, flat(fit), input, _grid(w))


def _grid(x: ArrayLike) -> Floats:
    return np.ascontiguousarray(np.atleast_1d(x), float)
