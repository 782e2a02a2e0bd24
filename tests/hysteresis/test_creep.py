"""Creep: closed forms, the leak by an ODE solver, the convex fit, the inverse."""

import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import creep as oracle
from oracles import play
from plantune.errors import NotIdentifiable, UsageError

TS = 0.05
R, W = [0.0, 0.1, 0.25, 0.5], [1.0, 0.3, 0.2, 0.1]
TAU = [0.4, 6.0, 60.0]
C = np.outer([0.1, 0.05, 0.08], W)
X = np.random.default_rng(4).standard_normal(800).cumsum() / 15
STACK = pt.hysteresis.Creep(r=R, w=W, tau=TAU, c=C, Ts=TS, offset=2.0)


def test_plays_and_their_creep_are_those_of_the_oracle():
    z = play.plays(X, R)
    y = 2.0 + z @ W
    for i in range(len(R)):
        y += oracle.creep(z[:, i], TS, C[:, i], TAU)
    assert np.abs(STACK.simulate(X) - y).max() < 1e-12


def test_a_step_creeps_by_exponentials():
    y = STACK.simulate(np.ones(2000)) - 2.0
    t = TS * np.arange(2000)
    z = 1.0 - np.array(R)
    slow = sum(c @ z * (1 - np.exp(-t / tau)) for c, tau in zip(C, TAU, strict=True))
    assert np.abs(y - (np.dot(W, z) + slow)).max() < 1e-12


def test_the_inverse_gives_the_input_and_the_output_again():
    inverse = STACK.inverse()
    assert np.abs(inverse.simulate(STACK.simulate(X)) - X).max() < 1e-11
    assert np.abs(STACK.simulate(inverse.simulate(X)) - X).max() < 1e-11
    assert inverse.inverse().same_as(STACK)


def test_without_a_part_that_follows_at_once_there_is_no_inverse():
    with pytest.raises(UsageError, match="w"):
        pt.hysteresis.Creep(r=[0], w=[0], tau=[1.0], c=[[1.0]], Ts=TS).inverse()


@pytest.mark.parametrize("model", [STACK, STACK.inverse(), pt.hysteresis.ChargeLeak(C=1e-6, Ts=TS)])
def test_live_is_replay_and_a_pickled_stream_goes_on(model):
    stream = model.stream()
    x = X * 1e-6 if model.kind == "charge_leak" else X
    assert np.array_equal([stream.step(v) for v in x[:300]], model.simulate(x[:300]))
    again = pickle.loads(pickle.dumps(stream))
    assert np.array_equal(again.run(x[300:]), stream.run(x[300:]))
    with pytest.raises(UsageError, match="state"):
        stream.state = np.zeros(3)


# -- the fit -------------------------------------------------------------------------------------


def record(seconds=200.0, noise=1e-3):
    """Eight plays, three time constants, steps and sines; rest at 0 before."""
    rng = np.random.default_rng(8)
    n = round(seconds / TS)
    t = TS * np.arange(n)
    x = 0.5 * np.repeat(rng.uniform(-1, 1, n // 200), 200) + 0.4 * np.sin(2 * np.pi * t / 7.3)
    r = np.arange(8) / 8
    w = np.exp(-3 * r) / 3
    truth = pt.hysteresis.Creep(r=r, w=w, tau=TAU, c=np.outer([0.08, 0.06, 0.1], w), Ts=TS)
    return x, truth.simulate(x) + noise * rng.standard_normal(n), truth


def test_the_fit_predicts_to_the_noise_and_plays_alone_do_not():
    x, y, truth = record()
    half = len(x) // 2
    found = pt.hysteresis.Creep.identify(x[:half], y[:half], TS, r=truth.r)
    left = np.sqrt(np.mean((found.simulate(x) - truth.simulate(x))[half:] ** 2))
    plays = pt.hysteresis.Creep.identify(x[:half], y[:half], TS, r=truth.r, tau=[])
    without = np.sqrt(np.mean((plays.simulate(x) - truth.simulate(x))[half:] ** 2))
    assert left < 1.5e-3 < 1e-2 < without, (left, without)


def test_the_number_of_time_constants_is_judged_on_rows_not_used():
    x, y, truth = record()
    tried = dict(pt.hysteresis.Creep.identify(x, y, TS, r=truth.r).identified.tried)
    assert list(tried) == list(range(len(tried))) and tried[0] > 3 * min(tried.values())


def test_weights_of_the_truth_come_back_without_noise():
    x, _, truth = record(40.0)
    y = truth.simulate(x)
    found = pt.hysteresis.Creep.identify(x, y, TS, r=truth.r, tau=TAU)
    how = found.identified
    assert found.w == approx(truth.w, abs=1e-6) and found.c == approx(truth.c, abs=1e-5)
    assert how.names[:2] == ("w0", "w1") and how.names[-1] == "offset"
    assert len(how.names) == len(how.sd) == 8 * 4 + 1


def test_what_cannot_be_fitted_is_refused():
    identify = pt.hysteresis.Creep.identify
    with pytest.raises(NotIdentifiable, match="throughout"):
        identify(np.zeros(50), np.ones(50), TS)
    with pytest.raises(NotIdentifiable, match="rows"):
        identify(X[:10], X[:10], TS)
    for options in ({"n": 0}, {"tau": [-1.0]}):
        with pytest.raises(UsageError):
            identify(X, X, TS, **options)
    with pytest.raises(UsageError, match="Ts"):
        identify(X, X, 0.0)


@pytest.mark.parametrize(
    "change", [{"tau": [0.0, 1, 2]}, {"c": [[1.0]]}, {"Ts": -1.0}, {"w": [1.0]}, {"c": C * np.inf}]
)
def test_parameters_that_are_none_are_refused(change):
    with pytest.raises(UsageError):
        pt.hysteresis.Creep(**{"r": R, "w": W, "tau": TAU, "c": C, "Ts": TS, **change})


# -- charge and leak -----------------------------------------------------------------------------


def test_the_leak_at_the_printed_current():
    """Source 002, (5): 5 nA, 20.7 Gohm, 103.5 V as ERRATA has them."""
    piezo = pt.hysteresis.ChargeLeak(C=1e-6)
    assert piezo.resistance(5e-9) == approx(oracle.leak_resistance(5e-9), rel=1e-14)
    assert piezo.resistance(5e-9) / 1e9 == approx(20.7, abs=0.05)
    assert piezo.leak(103.5) * 1e9 == approx(5.0, abs=0.01)
    assert piezo.leak(103.5) == approx(oracle.leak(103.5), rel=1e-14)
    assert piezo.leak(700.0) == np.inf


def test_a_resistor_leaks_exponentially():
    piezo = pt.hysteresis.ChargeLeak(C=1e-6, R=1e7, a=0.0, Ts=3.0)
    q = piezo.simulate(np.full(50, 2e-6))
    t = 3.0 * np.arange(50)
    assert q == approx(2e-6 * 10.0 * (1 - np.exp(-t / 10.0)), rel=1e-13)


def test_the_open_leak_is_that_of_an_ode_solver():
    i = np.concatenate([np.full(20, 3e-6), np.zeros(20), np.full(20, -5e-6)])
    for C, Ts in ((1e-6, 1.0), (1e-7, 5.0)):
        ours = pt.hysteresis.ChargeLeak(C=C, Ts=Ts).simulate(i * C / 1e-6)
        theirs = oracle.charge(i * C / 1e-6, Ts, C)
        assert np.abs(ours - theirs).max() < 2e-9 * np.abs(theirs).max()


def test_the_current_of_the_leak_holds_the_charge():
    piezo = pt.hysteresis.ChargeLeak(C=1e-6, G=2e6)
    stream = piezo.stream()
    stream.state = np.array([1e-6 * 103.5])
    hold = piezo.leak(103.5)
    assert stream.run(np.full(1000, hold))[-1] == approx(2 * 103.5, rel=1e-12)


def test_a_charge_has_no_inverse_within_its_sample():
    with pytest.raises(UsageError, match="leak"):
        pt.hysteresis.ChargeLeak(C=1e-6).inverse()


@pytest.mark.parametrize("change", [{"C": 0.0}, {"R": -1.0}, {"a": -1.0}, {"G": 0.0}, {"Ts": 0.0}])
def test_a_charge_that_is_none_is_refused(change):
    with pytest.raises(UsageError):
        pt.hysteresis.ChargeLeak(**{"C": 1e-6, **change})
