"""A process model under a relay."""

from __future__ import annotations

from math import inf

import numpy as np

from plantune import _core
from plantune.errors import refusal
from plantune.models import ProcessModel
from plantune.record import Record


def relay(
    model: ProcessModel,
    *,
    high: float,
    low: float,
    hysteresis: float,
    Ts: float,
    t_end: float,
    r: float = 0.0,
    noise_sd: float = 0.0,
    seed: int = 0,
    offset: float = 0.0,
    rest: float = 0.0,
) -> Record:
    """Return the record of a relay test, the delay exact, fraction included.

    Parameters
    ----------
    model : ProcessModel
        The plant, of either sign.
    high, low : float
        Levels of u, on either side of the input that holds y at `r`; unless they lie at different
        distances from it, the test does not tell gain from time constant.
    hysteresis : float
        y passes `r` by so much before the relay switches, >= 0; three times `noise_sd` is enough.
    Ts : float
        Seconds; the relay reads y and switches once per sample.
    t_end : float
        Seconds, `rest` included.
    r : float
        Set point.
    noise_sd : float
        Standard deviation of the white noise on the measured y, which the relay reads.
    seed : int
        Of the noise.
    offset : float
        `O` in `y = G u + O`.
    rest : float
        Seconds at the equilibrium of `r` before the relay takes over.

    Returns
    -------
    Record
        `t_end / Ts` rows of `u`, the measured `y`, and `r`.

    Raises
    ------
    UsageError
        Levels that do not enclose the input at rest, or an argument out of its range (U01).

    Notes
    -----
    The relay drives y back towards `r`: for a positive gain it gives `low` above `r + hysteresis`
    and `high` below `r - hysteresis`, for a negative one the other way round.

    Examples
    --------
    >>> plant = ProcessModel(K=2.0, T=3.0, L=1.0)
    >>> rec = relay(plant, high=2.0, low=-1.0, hysteresis=0.1, Ts=0.1, t_end=20.0)
    >>> rec.N, sorted(set(rec.u[:, 0].tolist()))
    (200, [-1.0, 2.0])
    """
    for name, value, least in (("Ts", Ts, 0.0), ("t_end", t_end, 0.0)):
        if not least < value < inf:
            raise refusal(
                "U01", f"`{name}` is {value}, must be positive and finite", remedy=f"{name}=10.0"
            )
    for name, value in (("noise_sd", noise_sd), ("rest", rest)):
        if not 0 <= value < inf:
            raise refusal(
                "U01", f"`{name}` is {value}, must be zero or positive", remedy=f"{name}=0.0"
            )
    e = noise_sd * np.random.default_rng(seed).standard_normal(round(t_end / Ts))
    u, y = _core.simulate_relay(model, low, high, hysteresis, Ts, r, offset, round(rest / Ts), e)
    return Record(u=u, y=y, Ts=Ts, r=np.full(len(y), r))
