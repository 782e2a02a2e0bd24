"""Poor excitation: what is known stays known (N07), and the table of METHODS 1.3."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from recursive.records import ESTIMATORS, levels

R = pt.recursive
TRUTH = [0.8745, -0.745, 0.6275]  # y = a y(-1) + b u(-1) + d


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_a_million_samples_without_motion_change_nothing(kind):
    """N07: forgetting 0.98, then a step; a time constant is 4.5 samples."""
    rng = np.random.default_rng(1)
    moving, still = 1000, 1_000_000
    u = np.r_[levels(moving, 5, rng, 0.0), np.full(still, 1.0), np.full(40, -1.0)]
    y = lfilter([0, 0, 0.5], [1, -0.8], u) + 0.02 * rng.normal(size=len(u))
    estimator = ESTIMATORS[kind][0](lam=0.98)
    trace = estimator.run(pt.Record(u=u, y=y, Ts=1.0))
    ab = [k for k, name in enumerate(trace.names) if name in ("a1", "b1", "f1")]
    before, after = trace.theta[moving - 1, ab], trace.theta[moving + still - 1, ab]
    truth = [-0.8, 0.5] if "a1" in trace.names else [0.5, -0.8]
    assert after == approx(before, rel=0.01)
    assert trace.learnt[moving : moving + still].sum() < 150  # the window, and then nothing
    closed = trace.theta[moving + 200 : moving + still]
    assert (closed == closed[0]).all()
    assert np.isfinite(estimator.P).all() and np.trace(estimator.P) < 1e4
    within = trace.theta[moving + still + 23 :, ab]  # 5 time constants after the step
    assert np.abs(within / truth - 1).max() < 0.03
    assert not len(trace.alarms)


def frozen(seed=1, N=4000, still=56_000):
    """Return u, y of METHODS 1.3: an input that freezes, noise in the equation."""
    rng = np.random.default_rng(seed)
    u = np.r_[levels(N, 10, rng, 0.0), np.full(still, 1.0)]
    y = lfilter([1], [1, -TRUTH[0]], np.r_[0, TRUTH[1] * u[:-1] + TRUTH[2]])
    return u, y + lfilter([1], [1, -TRUTH[0]], 0.1 * rng.normal(size=len(u)))


def test_what_each_scheme_makes_of_a_frozen_input():
    """METHODS 1.3, factor 0.995.  There plain forgetting ends with P 3e119, here at its bound.

    Directional: max P 0.007, .872 -.749 .632; gate: 0.18, .874 -.746 .629.
    """
    u, y = frozen()
    phi = np.c_[y[:-1], u[:-1], np.ones(len(u) - 1)]
    found = {}
    for scheme in ("exponential", "directional", "variable"):
        rls = R.RLS(3, lam=0.995, forgetting=scheme)
        rls.run(phi, y[1:])
        found[scheme] = rls
    for lost in ("exponential", "variable"):
        assert np.abs(found[lost].theta[1:]).min() > 20 and found[lost].P.max() > 1e15
        assert np.isfinite(found[lost].P).all()
    assert found["directional"].theta == approx(TRUTH, abs=0.01)
    assert found["directional"].P.max() < 0.01
    gated = R.ARX(1, 1, 1, lam=0.995)
    gated.run(pt.Record(u=u, y=y, Ts=1.0), every=1000)
    d = gated.offset * (1 + gated.theta[0])
    assert [-gated.theta[0], gated.theta[1], d] == approx(TRUTH, abs=0.01)
    assert gated.P.max() < 0.3  # 0.18 there


def test_fed_back_noise_is_no_motion_and_a_level_may_be_given():
    rng = np.random.default_rng(2)
    u = levels(4000, 10, rng, 0.0)
    u[2000:] = 1.0 + 0.002 * rng.normal(size=2000)
    y = lfilter([0, 0.5], [1, -0.8], u) + 0.1 * rng.normal(size=4000)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    learnt = {
        gate: R.ARX(1, 1, 1, lam=0.98, gate=gate, window=100).run(rec).learnt[2100:].sum()
        for gate in (True, 0.001, 0.1, False)
    }
    assert learnt == {True: 0, 0.001: 1900, 0.1: 0, False: 1900}


def test_nothing_is_gated_where_nothing_is_forgotten():
    u, y = frozen(N=500, still=500)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    assert R.ARX(1, 1, 1).run(rec).learnt[1:].all()
    assert R.ARX(1, 1, 1, gate=True, window=50).run(rec).learnt[560:].sum() == 0
    walk = R.ARX(1, 1, 1, forgetting="kalman", R1=[1e-6, 1e-6, 0.0], window=50)
    assert walk.run(rec).learnt[560:].sum() == 0


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_no_stretch_of_constants_makes_a_number_none(kind):
    """Exact data, frozen for 200 000 samples, with and without the gate."""
    u = np.r_[levels(500, 5, np.random.default_rng(3)), np.full(200_000, 4.0)]
    y = lfilter([0, 0, 0.5], [1, -0.8], u)
    for settings in ({"lam": 0.98}, {"lam": 0.98, "gate": False}, {"lam": 0.9, "gate": False}):
        estimator = ESTIMATORS[kind][0](**settings)
        estimator.run(pt.Record(u=u, y=y, Ts=1.0), every=10**6)
        assert np.isfinite(estimator.theta).all() and np.isfinite(estimator.P).all()
