"""A simulated engine loop under PI control with a switching set point; its truth is known.

`y = K e^(-L s) / (T s + 1) u + offset`.  Source 001, 3.7.6 and figure 3.7-6: the first operating
point with its offset, and the PI with which the tuning begins.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from plantune import _core
from plantune.datasets.arguments import check_arguments
from plantune.errors import refusal
from plantune.models import PID, ProcessModel
from plantune.record import Record


class EngineLoop(NamedTuple):
    """The truth behind `engine_loop`: `y = K e^(-L s) / (T s + 1) u + offset`, seconds.

    Examples
    --------
    >>> ENGINE_LOOP
    EngineLoop(K=-5.939, T=0.1491, L=0.1, offset=583.451)
    """

    K: float
    T: float
    L: float
    offset: float


ENGINE_LOOP: Final = EngineLoop(K=-5.939, T=0.1491, L=0.1, offset=583.451)
"""Gain, time constant in seconds, dead time in seconds, output offset."""

_TS: Final = 0.02
_KP: Final = -0.018
_KI: Final = -0.3385
_SET_POINT: Final = 400.0
_AMPLITUDE: Final = 50.0
_PRBS_BITS: Final = 10


def engine_loop(
    noise_var: float = 0.0,
    seed: int = 0,
    L: float = ENGINE_LOOP.L,
    t_end: float = 60.0,
    hold: float = 0.3,
) -> Record:
    """Simulate the engine loop: a sampled PI, set point 400 +- 50 switching at random.

    The loop starts in equilibrium at 400.  White noise is added to the output that is measured,
    and reaches the plant through the controller.

    Parameters
    ----------
    noise_var : float
        Variance of the output noise, >= 0.
    seed : int
        Of the set point and of the noise, >= 0.
    L : float
        Dead time of the plant, seconds, >= 0; any fraction of the sample time.
    t_end : float
        Length of the record, seconds.
    hold : float
        Shortest time between two switches of the set point, seconds; a multiple of 0.02 s.

    Returns
    -------
    Record
        Input `actuator`, `output` and its reference; `Ts` 0.02 s.

    Raises
    ------
    UsageError
        An argument out of its range (U01).

    Examples
    --------
    >>> rec = engine_loop(noise_var=1.5, seed=3, t_end=10.0)
    >>> print(rec)
    Record actuator -> output: 500 rows, Ts 0.02 s, 1 segment
    >>> ENGINE_LOOP.K, ENGINE_LOOP.offset
    (-5.939, 583.451)
    """
    check_arguments({"noise_var": noise_var, "seed": seed}, t_end, 2 * _TS, 1e5)
    N, rows_held = round(t_end / _TS), _whole_rows(hold)
    r = _SET_POINT + _AMPLITUDE * _core.prbs(N, rows_held, _PRBS_BITS, seed)
    noise = np.random.default_rng(seed).normal(0.0, noise_var**0.5, N)
    _, _, y, u = out = np.empty((4, N + 1))
    _core.closed_loop(
        ProcessModel(K=ENGINE_LOOP.K, T=ENGINE_LOOP.T, L=L),
        PID(Kp=_KP, Ti=_KP / _KI, Ts=_TS),
        _TS,
        r,
        out,
        noise=noise,
        offset=ENGINE_LOOP.offset,
        u0=(_SET_POINT - ENGINE_LOOP.offset) / ENGINE_LOOP.K,
    )
    return Record(
        u=u[:N],
        y=y[:N] + noise,
        r=r,
        Ts=_TS,
        u_names=("actuator",),
        y_names=("output",),
        log=(f"simulated engine loop: L {L:g} s, noise variance {noise_var:g}, seed {seed}",),
    )


def _whole_rows(hold: float) -> int:
    rows = round(hold / _TS)
    if rows < 1 or abs(rows * _TS - hold) > 1e-9:
        raise refusal("U01", f"`hold` is {hold}, must be a multiple of {_TS} s", remedy="hold=0.3")
    return rows
