"""M05 and M06 of BAD_INPUTS.md: what a linear model leaves depends on where the input turned."""

import numpy as np
import pytest

import plantune as pt
from contract.records import TS, codes
from oracles.play import play, stack

K = 2.5
TRAVEL = 2.0
MEMORY = {"M05", "M06"}


def levels(rng, N=1500, hold=15):
    """Return levels in [-1, 1], each held for `hold` rows."""
    return rng.uniform(-1, 1, N // hold).repeat(hold)


def lag(v):
    """Return y[k] = 0.8 y[k-1] + 0.5 v[k-1] from rest."""
    y = np.zeros(len(v))
    for k in range(1, len(v)):
        y[k] = 0.8 * y[k - 1] + 0.5 * v[k - 1]
    return y


def sticks(u, band):
    """Return a valve that stays until the command is off by more."""
    position, out = u[0], []
    for command in u:
        position = command if abs(command - position) > band else position
        out.append(position)
    return np.array(out)


def judged(u, y, seed=0, sd=0.02):
    """Return the verdict on the second half of a record, of a P1D of the first."""
    rec = pt.Record(u=u, y=y + sd * np.random.default_rng(seed).standard_normal(len(y)), Ts=TS)
    est, val = rec.split(0.5)
    return pt.validate.check(val, pt.estimate.process(est, "P1D"))


def note_of(verdict, code):
    (note,) = [note for note in verdict.notes if note.code == code]
    return note


@pytest.mark.parametrize("slack", [lambda u: play(u, 0.15, u[0]), lambda u: sticks(u, 0.15)])
def test_m05_a_dead_band_is_named_with_its_gains(slack):
    found = 0
    for seed in range(20):
        u = levels(np.random.default_rng(seed))
        verdict = judged(u, lag(slack(u)), seed)
        if "M05" in codes(verdict):
            note = note_of(verdict, "M05")
            assert note.measured >= note.limit
            assert note.where
            assert note.remedy
            rising, falling = (float(x.strip(",")) for x in note.text.split() if x[0] == "2")
            assert rising == pytest.approx(K, rel=0.15)
            assert falling == pytest.approx(K, rel=0.15)
            found += 1
    assert found >= 17


def test_m06_hysteresis_points_to_the_models_that_remember():
    for seed in range(20):
        u = levels(np.random.default_rng(seed))
        y = stack(u, [0.0, 0.2, 0.4, 0.6], [0.5, 0.3, 0.3, 0.3])
        verdict = judged(u, lag(y), seed)
        note = note_of(verdict, "M06")
        assert note.measured >= note.limit
        assert "pt.hysteresis" in note.remedy
        assert {"M08", "V02", "V01"} & set(codes(verdict)), "the residual test fails as well"


def test_m06_major_and_minor_loops_of_a_piezo_offered_to_a_linear_fit():
    turns = np.array([0.0, *np.tile([100.0, 20.0, 80.0, 0.0], 10)])
    u = np.interp(np.arange(2000) / 50, np.arange(len(turns)), turns)
    y = stack(u, np.arange(10) * 5.0, np.full(10, 0.06))
    y += 0.05 * np.random.default_rng(0).standard_normal(len(y))
    est, val = pt.Record(u=u, y=y, Ts=TS).split(0.5)
    assert "M06" in codes(pt.validate.check(val, pt.estimate.oe(est, 1, 1, 1)))


@pytest.mark.parametrize("plant", [lag, lambda u: lag(lag(u)), lambda u: lag(u + 0.3 * u**2)])
def test_plants_without_memory_are_left_in_peace(plant):
    """Of first and second order and with a curved characteristic: at most one in twenty."""
    said = 0
    for seed in range(40):
        u = levels(np.random.default_rng(seed))
        said += bool(MEMORY & set(codes(judged(u, plant(u), seed))))
    assert said <= 2


def test_a_loop_without_slack_is_left_in_peace_and_one_with_it_is_not():
    pid = pt.models.PID(Kp=0.3, Ti=1.0, Ts=TS)
    plant = pt.models.ProcessModel(K=2.0, T=1.0, L=0.3)
    counts = {0.0: 0, 0.08: 0}
    for seed in range(10):
        rng = np.random.default_rng(seed)
        r, noise = levels(rng, 2000, 50), 0.01 * rng.standard_normal(2000)
        for band in counts:
            valve = pt.simulate.Actuator(dead_band=band)
            run = pt.simulate.closed_loop(plant, pid, r=r, noise=noise, Ts=TS, actuator=valve)
            counts[band] += "M05" in codes(judged(run.u, run.y, sd=0.0))
    assert counts[0.0] == 0
    assert counts[0.08] == 10


def test_two_levels_say_nothing_of_memory():
    u = np.random.default_rng(1).choice([-1.0, 1.0], 200).repeat(8)
    assert not MEMORY & set(codes(judged(u, lag(play(u, 0.15)))))
