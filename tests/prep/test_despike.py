"""Spikes are left out, and the parameters come back."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import b0, codes, record

U, Y = b0()


def spiked(seed, size=20.0):
    """Add five outliers of as many standard deviations of y."""
    rng = np.random.default_rng(seed)
    y = Y.copy()
    rows = np.sort(rng.choice(np.arange(1, 999, 3), 5, replace=False))
    y[rows] += size * Y.std() * rng.choice([-1, 1], 5)
    return y, rows


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "fit", [lambda rec: pt.estimate.arx(rec, 1, 1, 1), pt.estimate.process], ids=["ARX", "P1D"]
)
def test_parameters_come_back_within_two_percent(fit, seed):
    """BAD_INPUTS D19; as they stand the spikes cost more than a tenth."""
    clean = fit(record()).theta[:2]
    y, rows = spiked(seed)
    rec = pt.prep.despike(record(y=y))
    assert np.flatnonzero(~rec.valid[:, 0]).tolist() == rows.tolist()
    assert fit(rec).theta[:2] == approx(clean, rel=0.02)
    assert np.abs(fit(record(y=y)).theta[:2] / clean - 1).max() > 0.02


def test_the_main_job_gives_the_settings_of_the_clean_record():
    y, _ = spiked(1)
    run, clean = pt.job.run(pt.prep.despike(record(y=y))), pt.job.run(record())
    assert run.chosen.theta[:2] == approx(clean.chosen.theta[:2], rel=0.02)
    assert run.tunings[0].controller.Kp == approx(clean.tunings[0].controller.Kp, rel=0.02)
    assert "D19" in codes(run)
    assert run.findings["health"].spikes == ()


def test_it_is_logged_and_noted_and_done_once():
    y, rows = spiked(2)
    rec = pt.prep.despike(record(y=y))
    assert rec.log == ("marked 5 of 1000 values as spikes: y 5",)
    (note,) = rec.notes
    assert (note.code, note.count, note.where.row) == ("D19", 5, rows[0])
    assert np.array_equal(rec.y[:, 0], y)  # nothing is filled in
    assert pt.prep.despike(rec) is rec
    assert pt.prep.despike(record()).log == ()


def test_outputs_are_marked_one_by_one():
    y = np.column_stack([Y, Y[::-1]])
    y[400, 1] += 40
    rec = pt.prep.despike(pt.Record(u=U, y=y, Ts=0.1))
    assert np.argwhere(~rec.valid).tolist() == [[400, 1]]
    assert rec.log == ("marked 1 of 2000 values as spikes: y2 1",)


def test_a_limit_decides_and_is_noted():
    y, _ = spiked(3)
    assert pt.prep.despike(record(y=y), limits=pt.Limits(D19=1e4)).log == ()
    assert "limit D19 is 15 instead of 20" in [
        note.text for note in pt.prep.despike(record(y=y), limits=pt.Limits(D19=15.0)).notes
    ]
