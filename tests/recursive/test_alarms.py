"""The engine loop of source 001, 3.7.6: offset steps, outliers, and what is found how soon."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from recursive.records import engine_with_steps, gain_and_lag

R = pt.recursive


def rml(**settings):
    return R.ARMAX(1, 1, 1, 6, **settings)


def in_seconds(alarms):
    """Count alarms, those within a second as one."""
    return int((np.diff(np.r_[-9.0, alarms]) > 1.0).sum())


@pytest.mark.parametrize(
    "make",
    [
        rml,
        lambda: rml(lam=0.995),
        lambda: rml(lam=0.98),
        lambda: R.ARX(1, 1, 6),
        lambda: R.OE(1, 1, 6),
        lambda: R.BJ(1, 1, 1, 1, 6),
    ],
)
def test_no_false_alarm_in_forty_runs(make):
    """METHODS 1.4: noise variance 1.5, 15 s, the start included."""
    alarms = [
        make().run(pt.datasets.engine_loop(1.5, seed, t_end=15.0, hold=0.2)).alarms
        for seed in range(40)
    ]
    assert sum(map(len, alarms)) == 0


@pytest.mark.parametrize("lam", [1.0, 0.995])
def test_a_step_of_the_offset_moves_the_offset_and_nothing_else(lam):
    """METHODS 1.4: -60 at 15 s; median peak error 0.9 % of K, 2.3 % of T, alarm after a sample."""
    peaks = []
    for seed in range(20):
        trace = rml(lam=lam).run(engine_with_steps(seed, steps=[(15.0, -60.0)]))
        K, T = gain_and_lag(trace)
        after = trace.t >= 15.0
        peaks.append([np.abs(K[after]).max(), np.abs(T[after]).max()])
        assert in_seconds(trace.alarms) == 1
        assert 15.0 < trace.alarms[0] < 15.05
        assert trace.offset[-1] == approx(523.451, abs=4 * trace.offset_sd[-1])
    assert (np.median(peaks, axis=0) < [0.015, 0.04]).all()
    deaf = rml(lam=0.995, alarm=False).run(engine_with_steps(0, steps=[(15.0, -60.0)]))
    assert np.abs(gain_and_lag(deaf)[0][deaf.t > 15.0]).max() > 0.1


def test_without_noise_a_step_is_seen_as_well():
    trace = rml(lam=0.995).run(engine_with_steps(1, 0.0, [(15.0, -60.0)]))
    K, T = gain_and_lag(trace)
    assert in_seconds(trace.alarms) == 1
    assert np.abs(K[-1]) < 1e-3 and np.abs(T[-1]) < 1e-3
    assert trace.offset[-1] == approx(523.451, abs=0.05)


def test_outliers_raise_no_alarm_and_hardly_move_anything():
    """20 single outliers of 60 standard deviations."""
    rec = engine_with_steps(2)
    y, rng = rec.y[:, 0].copy(), np.random.default_rng(0)
    rows = 500 + 50 * np.arange(20)
    y[rows] += rng.choice([-75.0, 75.0], 20)
    dirty = pt.Record(u=rec.u, y=y, Ts=0.02)
    cut, whole = (
        rml(lam=0.995, clip=clip, alarm=clip is not None).run(dirty) for clip in (6.0, None)
    )
    errors = [np.abs(np.array(gain_and_lag(t))[:, 500:]).max() for t in (cut, whole)]
    assert len(cut.alarms) == 0
    assert errors[0] < 0.15 and errors[0] < 0.5 * errors[1], errors


def test_gain_and_lag_are_found_as_soon_as_the_prototypes_found_them():
    """METHODS 1.1, RML with the offset: RMS errors of K and T, percent, at 2, 5, 10 s, 40 runs."""
    errors = []
    for seed in range(40):
        rec = pt.datasets.engine_loop(1.5, seed, t_end=10.0, hold=0.2)
        errors.append(np.array(gain_and_lag(rml().run(rec)))[:, [99, 249, 499]])
    rms = 100 * np.sqrt(np.mean(np.square(errors), axis=0))
    assert (rms <= 1.3 * np.array([[3.8, 0.9, 0.4], [5.3, 1.6, 0.9]])).all(), rms


def test_without_noise_half_a_second_is_enough():
    """To stay within 1 % of K and T, from the first move of the set point; METHODS 1.1: 0.26 s."""
    taken = []
    for seed in range(20):
        rec = pt.datasets.engine_loop(0.0, seed, t_end=5.0, hold=0.2)
        trace = rml().run(rec)
        outside = np.abs(np.array(gain_and_lag(trace))).max(axis=0) > 0.01
        moved = trace.t[np.flatnonzero(np.diff(rec.r[:, 0]))[0] + 1]
        taken.append(trace.t[np.flatnonzero(outside)[-1] + 1] - moved)
    assert np.median(taken) < 0.3 and max(taken) < 0.5
