"""Claim: source 001, 3.7.6 c and d noise-free, K, T, L and the settings within a second or two.

40 set-point PRBS seeds, each value held 0.2 to 0.5 s, the loop at rest before.  Times count from
the first move of the set point.  The document needs 19.5 s.
"""

import numpy as np

from adapt.loops import lasting
from oracles import scenarios
from plantune.models import PID

FIRST = PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=0.02)
TARGET = -0.1315, -0.8816  # source 001, 3.7.6
K, T, L = -5.939, 0.1491, 0.1


def loop(offset, seed, wait=50, **changes):
    scenario = scenarios.engine(seed, wait=wait, seconds=6.0, **changes)
    if offset == 0.0:  # 3.7.6 d: the actuator then works below zero
        plant = scenarios.Plant(K, T, L)
        scenario = scenarios.tuplified(scenario, {"plant": plant, "low": -np.inf, "high": np.inf})
    return scenario


def times(run):
    """Return when K and T stay within 1 %, when the delay stays right, and when the target does."""
    error = np.abs(run.models / [K, T, L] - 1)
    known = lasting(np.max(error[:, :2], axis=1) < 0.01)
    chosen = [max(d.delay_posterior, key=d.delay_posterior.get) for d in run.decisions]
    delay = lasting((np.abs(run.models[:, 2] - L) < 0.001) & (np.array(chosen) == 6))
    gains = [(np.nan, np.nan) if d.target is None else (d.target.Kp, d.target.Ki) for d in run.decisions]
    target = lasting(np.max(np.abs(np.array(gains) / TARGET - 1), axis=1) < 0.01)
    return [run.t[k] - run.first_move if k < len(run.t) else np.inf for k in (known, delay, target)]
