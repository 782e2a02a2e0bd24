"""Tuning over the uncertainty, counted: METHODS 3.3 on the engine loop."""

import numpy as np
import pytest

import plantune as pt

K, T, L, TS, OFFSET = -5.939, 0.1491, 0.1, 0.02, 583.451
TRUE = pt.models.ProcessModel(K, T, L)


def two_seconds(seed):
    """Run the sampled PI on `A y = B u + e`, var e = 1.5, set point 400 +- 50 held for 0.3 s."""
    rng = np.random.default_rng(seed)
    N, a = 100, np.exp(-TS / T)
    r = 400 + 50 * pt._core.prbs(N, 15, 10, seed)
    e = rng.normal(0, 1.5**0.5, N)
    start = (400 - OFFSET) / K
    y, u, yd, total = np.zeros(N), np.zeros(N), K * start, start
    for k in range(N):
        if k:
            yd = a * yd + K * (1 - a) * (u[k - 6] if k >= 6 else start) + e[k]
        y[k] = yd + OFFSET
        total += -0.3385 * TS * (r[k] - y[k])
        u[k] = total - 0.018 * (r[k] - y[k])
    return pt.Record(u=u, y=y, r=r, Ts=TS)


def true_Ms(controller):
    """Return Ms on the plant itself, infinite where the loop is unstable."""
    m = pt.tune.margins(TRUE, pt.models.PID(controller.Kp, controller.Ti))
    return m.Ms if m.stable else np.inf


def designs(seed):
    """Return Ms on the true plant of the set design and of the point design, and the price."""
    rec = two_seconds(seed)
    fits = [pt.estimate.armax(rec, 1, 1, 1, nk) for nk in range(2, 12)]
    over = pt.tune.optimal(fits, Ms=1.6).controller
    alone = pt.tune.optimal(min(fits, key=lambda fit: fit.loss).model, Ms=1.6).controller
    return true_Ms(over), true_Ms(alone), over.Ki / alone.Ki


def test_the_set_design_keeps_its_limit_where_the_point_design_fails():
    found = np.array([designs(seed) for seed in range(6)])
    assert np.sum(found[:, 0] > 1.65) == 0 < np.sum(found[:, 1] > 1.65)
    assert 0.5 < np.median(found[:, 2]) < 1.0


@pytest.mark.slow
def test_above_1_65_in_at_most_2_percent_of_200_runs():
    """Issue: at most 2 %.  Counted: 0 of 200, the point design 33."""
    found = np.array([designs(seed) for seed in range(200)])
    over, alone = np.mean(found[:, :2] > 1.65, axis=0)
    assert over <= 0.02 and alone > 0.1, (over, alone)
