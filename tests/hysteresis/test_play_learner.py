"""Weights of plays learnt on line: the oracle's path, what is kept, and live is replay."""

import pickle

import numpy as np
import pytest
from pytest import approx

from oracles import play as oracle
from plantune.errors import DataError, NotIdentifiable, UsageError
from plantune.hysteresis import PlayLearner, PlayStack

R = np.arange(12) / 12
W = np.random.default_rng(3).uniform(0, 1, 12)
W[[3, 6, 9]] = 0
NOISE = 2e-3


def record(N, size=1.0, seed=0):
    g = np.random.default_rng(seed)
    t = np.arange(N)
    sines = zip([0.0047, 0.011, 0.0173, 0.0291], g.uniform(0, 6, 4), strict=True)
    x = size * sum(np.sin(2 * np.pi * f * t + p) for f, p in sines) / 2.5
    return x, oracle.stack(x, R, W) + 0.3 + NOISE * g.standard_normal(N)


def test_the_path_is_that_of_batches():
    """At every t the minimum over all rows so far, solved anew by another library."""
    x, y = record(120)
    for lam in (1.0, 0.97):
        learner = PlayLearner(r=R[:5], lam=lam, offset=False, P0=1e4, gate=0, hold=0)
        path = []
        for t in range(len(x)):
            learner.step(x[t], y[t])
            path.append(learner.w)
        theirs = oracle.fit_forgetting(x, y, R[:5], lam, 1e-4)
        assert np.array(path) == approx(theirs, abs=1e-8)


def test_a_whole_record_gives_what_identify_gives():
    x, y = record(1000)
    learner = PlayLearner(r=R, P0=1e12)
    learner.run(x, y)
    batch = PlayStack.identify(x, y, r=R)
    assert learner.w == approx(batch.w, abs=1e-7)
    assert learner.offset == approx(batch.offset, abs=1e-7)
    assert learner.sd == approx(batch.identified.sd, rel=1e-3)
    assert learner.model.simulate(x) == approx(batch.simulate(x), abs=1e-6)


@pytest.mark.parametrize(("lam", "far"), [(1.0, 5e-3), (0.999, 1e-2), (0.99, 8e-2)])
def test_weights_come_near_the_truth(lam, far):
    x, y = record(4000)
    learner = PlayLearner(r=R, lam=lam)
    learner.run(x, y)
    assert np.abs(learner.w - W).max() < far and np.all(learner.w >= 0)
    z = oracle.plays(x, R)
    assert np.sqrt(np.mean((z @ (learner.w - W) + learner.offset - 0.3) ** 2)) < NOISE


def test_the_bound_never_makes_it_run_away():
    """Weights cut at zero within the recursion reach 1e75 here."""
    x, y = record(4000)
    errors = PlayLearner(r=R, lam=0.99).run(x, y - 0.5 * x)
    assert np.abs(errors).max() < 10


def test_weights_that_change_are_followed():
    x, y = record(3000)
    now = W * np.linspace(1.3, 0.8, 12)
    learner = PlayLearner(r=R, lam=0.995)
    learner.run(x, y)
    learner.run(x, oracle.stack(x, R, now) + 0.3)
    assert np.abs(learner.w - now).max() < 0.02


def test_rest_teaches_nothing():
    x, y = record(2000)
    learner = PlayLearner(r=R, lam=0.99)
    learner.run(x, y)
    before = learner.w
    g = np.random.default_rng(1)
    learner.run(np.full(20_000, x[-1]), y[-1] + 0.1 * g.standard_normal(20_000))
    assert np.array_equal(learner.w, before) and learner.seen == 22_000


def test_small_loops_keep_what_large_ones_told():
    """Sixty memories of loops of 15 % of the range."""
    x, y = record(3000)
    small, _ = record(6000, 0.15, seed=5)
    z = oracle.plays(np.append(x, small), R)
    g = np.random.default_rng(2)
    errors = {}
    for hold in (0.0, 1e-4):
        learner = PlayLearner(r=R, lam=0.99, hold=hold)
        learner.run(x, y)
        learner.run(small, z[3000:] @ W + 0.3 + NOISE * g.standard_normal(6000))
        off = z[:3000] @ (learner.w - W) + learner.offset - 0.3
        errors[hold] = np.sqrt(np.mean(off**2)) / np.ptp(y)
    assert errors[1e-4] < 0.001 < 0.1 < errors[0.0]


def test_run_is_step_in_a_loop_and_a_pickle_goes_on():
    x, y = record(300)
    one, other = PlayLearner(r=R, lam=0.99), PlayLearner(r=R, lam=0.99)
    errors = one.run(x, y)
    first = [other.step(*row) for row in zip(x[:150], y[:150], strict=True)]
    other = pickle.loads(pickle.dumps(other))
    assert np.array_equal(np.append(first, other.run(x[150:], y[150:])), errors)
    assert np.array_equal(one.w, other.w) and one.lam == other.lam == 0.99


def test_scale_and_offset_pass_through():
    x, y = record(800)
    one, other = PlayLearner(r=R, P0=1e12), PlayLearner(r=R, P0=1e12)
    one.run(x, y)
    other.run(x, 10 * y + 5)
    assert other.w == approx(10 * one.w, abs=1e-6)
    assert other.offset == approx(10 * one.offset + 5, abs=1e-6)


def test_a_refused_sample_changes_nothing():
    x, y = record(50)
    learner = PlayLearner(r=R)
    learner.run(x, y)
    before = learner.__getstate__()
    for bad in [(np.nan, 0.0), (0.0, np.inf), (1e200, 0.0)]:
        with pytest.raises(UsageError):
            learner.step(*bad)
    assert np.array_equal(learner.__getstate__(), before)
    with pytest.raises(DataError):
        learner.run(x, y[1:])


@pytest.mark.parametrize(
    "options",
    [{"r": [1, 0]}, {"r": []}, {"lam": 0}, {"lam": 1.1}, {"P0": 0}, {"gate": -1}, {"hold": 2}],
)
def test_settings_out_of_range_are_refused(options):
    with pytest.raises(UsageError):
        PlayLearner(**{"r": R, **options})


def test_nothing_learnt_is_no_model():
    with pytest.raises(NotIdentifiable, match="moved"):
        PlayLearner(r=R).model  # noqa: B018
    with pytest.raises(UsageError, match="state"):
        PlayLearner(r=R).__setstate__(np.zeros(3))
