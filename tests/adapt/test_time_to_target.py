"""When the auto-tuner expects to be sure enough."""

from dataclasses import replace

import numpy as np
from pytest import approx

import plantune as pt

FIRST = pt.models.PID(Kp=-0.018, Ti=0.0532)
SETTINGS = pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=FIRST, target=0.02)


def test_it_counts_down_to_zero_where_the_window_is_long_enough():
    rec = pt.datasets.engine_loop(noise_var=1.5, seed=1, t_end=20.0)
    log = pt.adapt.replay(rec, SETTINGS)
    sure = np.maximum(log.sd[:, 0] / abs(log.K), log.sd[:, 1] / log.T) <= 0.02
    reached = log.t[np.flatnonzero(sure)[0]]
    assert np.all(log.time_to_target[sure] == 0.0)
    before = round(0.8 * reached / rec.Ts)
    assert log.t[before] + log.time_to_target[before] == approx(reached, rel=0.5)


def test_it_is_infinite_where_the_window_forgets_before():
    rec = pt.datasets.engine_loop(noise_var=1.5, seed=1, t_end=20.0)
    log = pt.adapt.replay(rec, replace(SETTINGS, rows=100))
    assert np.all(np.isinf(log.time_to_target[110:]))
