"""How much gain and delay a loop can bear, and how much the data leave open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.record import Floats
from plantune.tune.tuning import Tuning

_DRAWS = 400
_STEPS = 61


@dataclass(frozen=True, slots=True, eq=False)
class Robustness:
    """Border of stability in the plane of gain and delay changes, and the identified cloud in it.

    Attributes
    ----------
    tuning : Tuning
        The settings whose loop this is.
    delay : array (m,)
        Changes of the dead time, seconds.
    low, high : array (m,)
        Gain factors between which the loop is stable at each; NaN where it never is.
    cloud_gain, cloud_delay : array (n,)
        What each model that the data leave open is beside the model, at the gain crossover: a
        gain factor, and seconds of delay.  Empty without a fit.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    >>> seen = pt.tune.robustness(pt.tune.imc_pi(fit, gain_margin=3), fit)
    >>> at_no_change = abs(seen.delay).argmin()
    >>> round(float(seen.high[at_no_change]), 2), len(seen.cloud_gain)
    (3.0, 400)
    """

    tuning: Tuning
    delay: Floats
    low: Floats
    high: Floats
    cloud_gain: Floats
    cloud_delay: Floats


def robustness(tuning: Tuning, fits: Fit | Sequence[Fit] = ()) -> Robustness:
    """Return how much gain and delay the loop can bear, beside what the data leave open.

    Parameters
    ----------
    tuning : Tuning
        Settings and the model that they were found on.
    fits : Fit, or several of different delays
        Whose uncertainty is drawn; none draws the border alone.

    Returns
    -------
    Robustness
        `plot.robustness` draws it.

    Raises
    ------
    RunError
        The loop has no gain crossover (C07).

    Notes
    -----
    At the crossover any departure of a plant from its model is a gain and a delay, whatever
    parameters it came from.  The distance to the border upwards is the gain margin, that to the
    right the delay margin.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> from plantune.tune import simc
    >>> seen = robustness(simc(ProcessModel(K=2.0, T=5.0, L=1.0)))
    >>> float(seen.delay[0]), round(float(seen.delay[-1]), 2)
    (-1.0, 3.21)
    """
    given = [fits] if isinstance(fits, Fit) else list(fits)
    m, plant = tuning.margins, tuning.model
    dead = float(getattr(plant, "L", 0.0))
    reach = 1.5 * m.delay if np.isfinite(m.delay) else 1.0
    delay = np.unique([*np.linspace(-min(dead, reach), 0.0, 20), *np.linspace(0.0, reach, _STEPS)])
    border, cloud = _core.robustness(
        plant, tuning.controller, delay.tolist(), [fit.drawn_from for fit in given], _DRAWS
    )
    low, high = np.array(border).T
    gains, delays = np.array(cloud).reshape(-1, 2).T
    return Robustness(tuning, delay, low, high, gains, delays)
