"""A record brought to a tenth of its rate tells K, T and L as well as all its rows."""

import numpy as np
import pytest

import plantune as pt

K, T, L, TS = 2.0, 10.0, 3.4, 0.1
SEEDS = 20


def fast(seed, N=4000):
    """Return a record with white noise and a hum of 0.97 Hz, which at 1 Hz would seem slow."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 120 + 1), 120)[:N]
    y = np.ravel(pt.models.ProcessModel(K=K, T=T, L=L).simulate(u, Ts=TS))
    t = np.arange(N) * TS
    hum = 0.3 * np.sin(2 * np.pi * 0.97 * t + rng.uniform(0, 2 * np.pi))
    return pt.Record(u=u, y=5 + y + hum + 0.3 * rng.normal(size=N), Ts=TS)


def fitted(recs):
    return np.array([pt.estimate.process(rec, "P1D").theta[:3] for rec in recs])


@pytest.fixture(scope="module")
def estimates():
    recs = [fast(seed) for seed in range(SEEDS)]
    return fitted(recs), fitted(pt.prep.resample(rec, 10 * TS) for rec in recs)


def test_decimation_keeps_the_spread(estimates):
    every, few = (theta.std(axis=0, ddof=1) for theta in estimates)
    # What a causal filter on both signals reached, and what every row tells.
    assert np.all(few < [0.021, 0.17, 0.068])
    assert np.all(few < 1.3 * every)


def test_decimation_has_little_bias(estimates):
    every, few = estimates
    error = few.std(axis=0, ddof=1) / np.sqrt(SEEDS)
    # A filtered input is no longer held.  Where L is no whole number of new steps, something is
    # left even without noise: 0.4 % of T and 1.5 % of a step, less than half a deviation here.
    assert np.all(np.abs(few.mean(axis=0) - [K, T, L]) < 2 * error + [0.001, 0.05, 0.02])
    assert np.all(np.abs((few - every).mean(axis=0)) < [0.005, 0.1, 0.03])
