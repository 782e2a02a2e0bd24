"""Refusals of the auto-tuner carry their reason."""

import pytest

import plantune as pt

FIRST = pt.models.PID(Kp=-0.018, Ti=0.0532)


def test_a_stuck_sensor_is_named_as_long_as_it_is_stuck():
    rec = pt.datasets.engine_loop(noise_var=1.5, t_end=15.0)
    y = rec.y[:, 0].copy()
    y[250:400] = y[250]
    stuck = pt.Record(u=rec.u, y=y, Ts=rec.Ts)
    log = pt.adapt.replay(stuck, pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=FIRST))
    rows = [row for row, notes in log.reasons for note in notes if note.code == "D18"]
    assert rows[0] == pytest.approx(300, abs=25)  # 50 samples after u has moved
    assert rows == list(range(rows[0], 400))
    assert not log.accepted[rows[0] : 400].any() and log.accepted[400:].any()


def test_the_wrong_action_is_told_in_words():
    rec = pt.datasets.engine_loop(noise_var=1.5, t_end=4.0)
    wrong = pt.models.PID(Kp=0.018, Ti=0.0532)
    log = pt.adapt.replay(rec, pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=wrong))
    (note,) = log.reasons[-1][1]
    assert note.code == "A02" and note.text.endswith("must be positive")
    assert "action of the loop" in note.remedy
