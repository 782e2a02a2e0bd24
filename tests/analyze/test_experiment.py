"""Planned experiments: the predicted deviations are the oracle's and those of experiments."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import experiment_design as oracle
from plantune.analyze import experiment, predicted_sd

NAMES = ("K", "T", "L")
PLANT = (2.0, 10.0, 3.37)
SD = 0.02


def binary(N=300, hold=12, bits=9):
    """Return a binary input after a rest of 8 rows."""
    return np.concatenate([np.zeros(8), pt.signals.prbs(N - 8, hold=hold, bits=bits)])


def stepping(N=100, rest=20):
    return np.repeat([0.0, 1.0], [rest, N - rest])


# --- the prediction ---


def theirs(plant, u, Ts=1.0, ar=0.0):
    """Return the oracle's deviations of K, T, L for the rows and columns that a fit takes."""
    t = np.arange(len(u)) * Ts
    moved = u - u[0]
    moves = np.flatnonzero(np.diff(u))
    step = len(moves) <= 6 and moves[0] + 1 >= 0.015 * len(u)  # then at rest before
    psi = oracle.sensitivities((*plant, 0.0), moved, t, t, start=not step)
    if not step:  # the rows before the first delayed input are history
        psi = psi[int(plant[2] / Ts) + 1 :]
    R = oracle.ar1(len(psi), SD, ar) if ar else SD**2 * np.eye(len(psi))
    return oracle.predicted(psi, R)[:3]


@pytest.mark.parametrize("ar", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("u", [binary(), binary(hold=40), stepping()], ids=["fast", "slow", "step"])
@pytest.mark.parametrize("plant", [PLANT, (2.0, 10.0, 3.0), (-0.5, 4.0, 0.3)], ids=str)
def test_prediction_is_the_oracles(plant, u, ar):
    ours = predicted_sd(plant, u, SD, 1.0, ar=ar or ())
    assert [ours.sd[name] for name in NAMES] == approx(theirs(plant, u, ar=ar), rel=1e-6)


def test_prediction_does_not_depend_on_the_unit_of_time():
    u = binary()
    seconds = predicted_sd(PLANT, u, 0.1, 1.0)
    tenths = predicted_sd((2.0, 1.0, 0.337), u, 0.1, 0.1)
    assert [tenths.relative[n] for n in NAMES] == approx([seconds.relative[n] for n in NAMES])


def test_prediction_holds_the_response_and_the_shares():
    u = binary()
    found = predicted_sd(PLANT, u, 0.1, 1.0)
    K, T, L = PLANT
    assert found.y == approx(oracle.response((*PLANT, 0.0), u - u[0], *[np.arange(300.0)] * 2))
    shares = [found.sd["K"] / K, found.sd["T"] / T, found.sd["L"] / (T + L)]
    assert [found.relative[name] for name in NAMES] == approx(shares)
    assert "K = 2 ±" in str(found) and not found.notes


# --- experiments that are simulated and fitted ---


def coloured(rng, N, sd, ar):
    e = rng.normal(size=N + 200) * sd * np.sqrt(1 - ar**2)
    v = np.zeros(N + 200)
    for k in range(1, N + 200):
        v[k] = ar * v[k - 1] + e[k]
    return v[200:]


def ratios(plant, u, sd, runs, ar=0.0, seed=0):
    """Return simulated over predicted deviations of K, T, L."""
    rng = np.random.default_rng(seed)
    clean = pt.models.ProcessModel(*plant).simulate(u, Ts=1.0)
    thetas = []
    for _ in range(runs):
        rec = pt.Record(u=u, y=5 + clean + coloured(rng, len(u), sd, ar), Ts=1.0)
        thetas.append(pt.estimate.process(rec, "P1D").theta[:3])
    found = predicted_sd(plant, u, sd, 1.0, ar=ar or ())
    return np.std(thetas, axis=0, ddof=1) / [found.sd[name] for name in NAMES]


def test_simulated_experiments_have_the_predicted_deviations():
    # A deviation from 60 runs has a standard error of 9 %.
    assert ratios(PLANT, binary(), 0.1, 60) == approx(np.ones(3), abs=0.25)


def test_a_step_in_noise_is_taken_as_from_rest():
    """Else a start is estimated too, and the gain is three times as unsure."""
    assert ratios(PLANT, stepping(), 0.1, 60) == approx(np.ones(3), abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "plant, u, sd, ar",
    [
        (PLANT, binary(), 0.1, 0.0),
        (PLANT, binary(), 0.3, 0.9),
        ((2.0, 10.0, 3.0), binary(), 0.1, 0.0),
        (PLANT, stepping(), 0.02, 0.0),
        (PLANT, stepping(), 0.1, 0.0),
    ],
    ids=["prbs", "coloured", "whole L", "step", "step in noise"],
)
def test_300_experiments_have_the_predicted_deviations(plant, u, sd, ar):
    # 10 % is promised; 300 runs know a deviation to 4 %.
    found = ratios(plant, u, sd, 300, ar)
    print(found.round(3))
    assert found == approx(np.ones(3), abs=0.12)


# --- the plan ---


def planned(**more):
    wishes = {"Ts": 1.0, "noise_sd": 0.2, "u_limits": (45.0, 55.0), **more}
    return experiment(PLANT, **wishes)


@pytest.mark.parametrize("shape", ["prbs", "gbn", "stairs", "step", "multisine", None])
def test_plan_stays_within_its_limits(shape):
    limits = {"u_limits": (49.0, 51.0), "y_limits": (18.0, 23.0), "at": (50.0, 20.0)}
    plan = planned(shape=shape, time=600.0, target=0.1, **limits)
    assert plan.u.min() >= 49 and plan.u.max() <= 51
    assert plan.y.min() >= 18 and plan.y.max() <= 23
    assert plan.u[0] == 50 and plan.y[0] == approx(20)
    clean = pt.models.ProcessModel(*PLANT).simulate(plan.u - 50, Ts=1.0)
    assert plan.y == approx(20 + np.ravel(clean))


def test_plan_knows_what_it_promises():
    plan = planned(time=400.0, target=0.03)
    again = predicted_sd(PLANT, plan.u, 0.2, 1.0)
    assert [plan.sd[name] for name in NAMES] == approx([again.sd[name] for name in NAMES])
    assert max(plan.relative.values()) == approx(0.03)
    assert (len(plan.u), plan.t[-1]) == (400, 399.0)


def test_the_best_shape_is_chosen():
    plan = planned(time=400.0, target=0.05, u_limits=None)
    # Without limits all are compared at one amplitude, so by the amplitude they need.
    needed = [trial.amplitude for trial in plan.trials]
    assert {trial.shape for trial in plan.trials} == {"prbs", "gbn", "stairs", "step", "multisine"}
    assert plan.shape == plan.trials[0].shape and needed == sorted(needed)


def test_the_chosen_shape_is_the_least_unsure_where_limits_hold_all():
    plan = planned(time=400.0, noise_sd=8.0, target=0.2)
    capped = [trial for trial in plan.trials if not trial.reaches]
    worst = [max(trial.relative.values()) for trial in plan.trials]
    assert capped and worst[0] == approx(min(worst)) and worst == sorted(worst)


@pytest.mark.parametrize("L", [0.5, 3.4, 30.0])
def test_clock_follows_the_time_constant_whatever_the_dead_time(L):
    plan = experiment((2.0, 10.0, L), 1.0, 0.1, time=400.0, shape="prbs")
    assert 11 <= plan.hold <= 16


def test_deviations_go_as_noise_over_amplitude_and_root_of_time():
    u = binary(bits=12, N=12 * 200)
    half = predicted_sd(PLANT, u / 2, 0.1, 1.0)
    whole = predicted_sd(PLANT, u, 0.1, 1.0)
    longer = predicted_sd(PLANT, np.tile(u, 4), 0.1, 1.0)
    for name in NAMES:
        assert half.sd[name] == approx(2 * whole.sd[name])
        assert longer.sd[name] == approx(whole.sd[name] / 2, rel=0.02)


def test_amplitude_goes_as_noise_over_target():
    one = planned(time=400.0, target=0.05, noise_sd=0.2)
    assert planned(time=400.0, target=0.05, noise_sd=0.4).amplitude == approx(2 * one.amplitude)
    assert planned(time=400.0, target=0.025, noise_sd=0.2).amplitude == approx(2 * one.amplitude)


def test_time_is_found_at_the_largest_amplitude():
    plan = planned(noise_sd=2.0, u_limits=(49.0, 51.0), target=0.05)
    assert plan.amplitude == approx(1.0, rel=0.06) and max(plan.relative.values()) <= 0.05
    with pytest.raises(pt.NotIdentifiable):
        planned(noise_sd=2.0, u_limits=(49.0, 51.0), target=0.05, time=0.5 * len(plan.u))


# --- refusals ---


def refused(error, **wishes):
    with pytest.raises(error) as found:
        planned(**wishes)
    return found.value


def test_too_little_room_says_what_would_do():
    few = refused(pt.NotIdentifiable, time=300.0, noise_sd=2.0, u_limits=(49.0, 51.0), target=0.05)
    assert few.code == "X07" and "more time needed" in few.text
    assert few.measured > few.limit == approx(0.05)
    assert "rows" in few.remedy and "an amplitude of" in few.remedy and "target" in few.remedy
    # Both remedies serve.
    wishes = {"noise_sd": 2.0, "target": 0.05}
    planned(time=1.1 * few.count, u_limits=(49.0, 51.0), **wishes)
    share = 1.01 * few.measured / few.limit
    planned(time=300.0, u_limits=(50 - share, 50 + share), **wishes)


def test_an_input_that_leaves_a_parameter_unknown_is_refused():
    with pytest.raises(pt.NotIdentifiable) as found:
        predicted_sd((2.0, 300.0, 3.4), stepping(60), 0.5, 1.0)
    assert found.value.code == "X07" and "more time needed" in found.value.text
    with pytest.raises(pt.NotIdentifiable) as found:
        predicted_sd(PLANT, np.ones(100), 0.1, 1.0)
    assert found.value.code == "X02"


def test_slow_sampling_is_refused():
    slow = refused(pt.NotIdentifiable, Ts=15.0, time=3000.0)
    assert slow.code == "M09" and "sample every" in slow.remedy


@pytest.mark.parametrize(
    "wishes",
    [
        {"u_limits": None},
        {"at": (60.0, 0.0), "time": 300.0},
        {"u_limits": (55.0, 45.0), "time": 300.0},
        {"target": 0.0, "time": 300.0},
        {"target": 0.5, "time": 300.0},
        {"Ts": -1.0, "time": 300.0},
        {"noise_sd": 0.0, "time": 300.0},
        {"ar": 1.1, "time": 300.0},
        {"shape": "square", "time": 300.0},
    ],
    ids=str,
)
def test_wishes_that_make_no_sense_are_refused(wishes):
    assert refused(pt.UsageError, **wishes).code == "U01"


def test_a_short_record_is_refused():
    assert refused(pt.NotIdentifiable, time=15.0).code == "X03"


def test_a_dead_time_near_zero_is_noted():
    plan = experiment((2.0, 10.0, 0.01), 1.0, 0.2, time=300.0)
    assert [note.code for note in plan.notes] == ["X07"]
    assert "one-sided" in plan.notes[0].text
