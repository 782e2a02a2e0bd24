"""A plant with hysteresis in its loop: the oracle's loop, and what each part of it is worth."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import cmac as oracle
from plantune.errors import UsageError

R, W = np.arange(10) / 10, np.r_[1.0, np.full(9, 0.15)]
STACK = pt.hysteresis.PlayStack(r=R, w=W)
RELAYS = pt.hysteresis.Preisach(levels=np.linspace(-1, 1, 11), mu=0.05 * np.tri(10))
TIME = np.arange(600)
REFERENCE = 0.9 * np.sin(TIME / 30) * np.cos(TIME / 47)


def test_the_loop_is_that_of_the_oracle():
    """Inverse, PID and CMAC together, on plays."""
    feed = STACK.inverse().simulate(REFERENCE * 0.9)
    theirs = oracle.loop(
        REFERENCE, oracle.stage(R, W), 0.1, 0.2, 1.5, 0.01, feed=feed,
        learner=oracle.cmac(-0.9, 0.9, 25, 8, 0.2, tables=2),
    )  # fmt: skip
    # The same feed-forward: of a plant whose output is 1/0.9 of the plays'.
    ahead = pt.hysteresis.PlayStack(r=R, w=W / 0.9).inverse()
    ours = pt.hysteresis.track(
        STACK, REFERENCE, 0.1, inverse=ahead,
        pid=pt.models.PID(Kp=0.2, Ti=0.2 / 1.5, Td=0.05, c=1.0, Ts=0.1),
        cmac=pt.hysteresis.Cmac(range=(-0.9, 0.9), beta=0.2),
    )  # fmt: skip
    assert np.abs(ours.u - theirs.u).max() < 1e-9
    assert np.abs(ours.y - theirs.y).max() < 1e-9
    assert ours.rms == approx(np.sqrt(np.mean(theirs.e**2)))
    assert ours.relative == approx(ours.rms / np.ptp(REFERENCE))
    assert ours.worst == approx(np.abs(theirs.e).max())


@pytest.mark.parametrize("plant", [STACK, RELAYS])
def test_the_right_inverse_leaves_nothing_and_the_controller_lets_it(plant):
    pid = pt.models.PID(Kp=0.2, Ti=0.1, Ts=0.1)
    for feedback in (None, pid):
        run = pt.hysteresis.track(plant, REFERENCE, 0.1, inverse=plant.inverse(), pid=feedback)
        assert run.worst < 1e-12
        assert np.abs(run.u - run.ahead).max() < 1e-12


def test_creep_is_undone_as_well():
    creep = pt.hysteresis.Creep(r=R, w=W, tau=[1.0, 20.0], c=0.1 * np.ones((2, 10)), Ts=0.1)
    run = pt.hysteresis.track(creep, REFERENCE, 0.1, inverse=creep.inverse())
    assert run.worst < 1e-11
    plays = pt.hysteresis.track(creep, REFERENCE, 0.1, inverse=STACK.inverse())
    assert plays.relative > 0.05


def test_a_controller_alone_leaves_more_than_the_inverse_of_a_poor_model():
    gain = pt.hysteresis.PlayStack(r=[0], w=[1 / W.sum()])
    poor = pt.hysteresis.PlayStack(r=R[:5], w=W[:5] * 1.2).inverse()
    pid = pt.models.PID.integral(2.0, Ts=0.1)
    left = [
        pt.hysteresis.track(STACK, REFERENCE, 0.1, inverse=ahead, pid=feedback).relative
        for ahead, feedback in ((gain, None), (None, pid), (poor, pid))
    ]
    assert left[0] > left[1] > left[2]


def test_noise_is_read_and_not_counted():
    pid = pt.models.PID.integral(2.0, Ts=0.1)
    options = {"inverse": STACK.inverse(), "pid": pid, "noise_sd": 0.01}
    run = pt.hysteresis.track(STACK, REFERENCE, 0.1, **options)
    again = pt.hysteresis.track(STACK, REFERENCE, 0.1, **options)
    other = pt.hysteresis.track(STACK, REFERENCE, 0.1, **options, seed=1)
    assert np.array_equal(run.u, again.u) and not np.array_equal(run.u, other.u)
    assert 1e-3 < run.rms < 1e-2


def test_dynamics_behind_it_are_those_of_the_simulator():
    lag = pt.models.ProcessModel(K=1.0, T=0.5)
    run = pt.hysteresis.track(STACK, REFERENCE, 0.1, inverse=STACK.inverse(), dynamics=lag)
    assert run.y == approx(lag.simulate(np.append(REFERENCE, 0.0), Ts=0.1)[1:].ravel(), abs=1e-12)


def test_limits_hold():
    run = pt.hysteresis.track(STACK, REFERENCE, 0.1, inverse=STACK.inverse(), limits=(-0.1, 0.2))
    assert run.u.min() == -0.1 and run.u.max() == 0.2


def test_passes_follow_one_another():
    run = pt.hysteresis.track(RELAYS, REFERENCE, 0.1, inverse=STACK.inverse(), passes=3)
    assert run.t.shape == run.r.shape == run.y.shape == run.u.shape == (1800,)
    assert run.pass_rms.shape == (3,)
    assert run.rms == approx(np.sqrt(np.mean(run.pass_rms**2)))


def test_a_loop_that_runs_away_ends_with_a_note():
    pid = pt.models.PID(Kp=-40.0, Ts=0.1)
    run = pt.hysteresis.track(STACK, REFERENCE, 0.1, pid=pid)
    assert [note.code for note in run.notes] == ["M02"] and len(run.y) < 600
    assert len(run.t) == len(run.r) == len(run.y)


@pytest.mark.parametrize(
    ("r", "Ts", "options"),
    [
        (np.ones(10), 0.1, {}),
        (REFERENCE, 0.0, {}),
        (REFERENCE, 0.1, {"passes": 0}),
        (REFERENCE, 0.1, {"noise_sd": -1.0}),
        (REFERENCE, 0.1, {"limits": (0.5, 1.0)}),
        (REFERENCE, 0.1, {"inverse": 3.0}),
    ],
)
def test_what_is_no_loop_is_refused(r, Ts, options):
    with pytest.raises(UsageError):
        pt.hysteresis.track(STACK, r, Ts, **options)
