"""A record at another sample time: inputs held, outputs interpolated, segments kept."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt

N = 60
U = np.repeat([1.0, -1.0, 2.0], 20)


def record(**other):
    t = np.arange(N) * 0.1
    return pt.Record(u=U, y=3 * t, r=U, aux={"load": 2 * t}, Ts=0.1, **other)


@pytest.mark.parametrize("Ts", [0.1, 0.05, 0.03, 0.14])
def test_lines_are_met_and_steps_are_held(Ts):
    rec = record()
    out = pt.prep.resample(rec, Ts)
    assert out.Ts == Ts and out.time == approx(np.arange(out.N) * Ts, abs=1e-12)
    assert out.y[:, 0] == approx(3 * out.time, abs=1e-12)
    assert out.aux["load"] == approx(2 * out.time, abs=1e-12)
    before = np.searchsorted(rec.time, out.time + 1e-9, "right") - 1
    assert np.array_equal(out.u[:, 0], U[before]) and np.array_equal(out.r[:, 0], U[before])
    assert np.array_equal(out.rows, before)
    assert ("no filter" in out.log[-1]) == (Ts > 0.1)


@pytest.mark.parametrize("Ts", [0.25, 1.0])
def test_dropping_rows_without_a_filter_is_refused(Ts):
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.prep.resample(record(), Ts, filter=False)
    assert caught.value.code == "M10" and caught.value.measured == approx(10 * Ts)


def test_the_same_step_changes_nothing_but_the_log():
    rec = record()
    out = pt.prep.resample(rec, 0.1)
    assert np.array_equal(out.y, rec.y) and np.array_equal(out.u, rec.u)
    assert np.array_equal(out.rows, rec.rows) and out.source == rec.source


def test_segments_and_their_rows_are_kept():
    rows = np.concatenate([np.arange(25), np.arange(40, 75)])
    rec = record(starts=[0, 25], rows=rows)
    out = pt.prep.resample(rec, 0.05)
    assert out.starts.tolist() == [0, 49]
    assert out.rows[[0, 48, 49, -1]].tolist() == [0, 24, 40, 74]
    assert out.time[49] == approx(4.0)


def test_an_output_counts_where_both_its_neighbours_do():
    valid = np.ones(N, bool)
    valid[10] = False
    out = pt.prep.resample(record(valid=valid), 0.05)
    assert np.flatnonzero(~out.valid[:, 0]).tolist() == [19, 20, 21]


def test_segments_of_one_row_are_left_out():
    out = pt.prep.resample(record(starts=[0, 1, 30]), 0.1)
    assert (
        out.N == N - 1 and out.starts.tolist() == [0, 29] and "1 segments of one row" in out.log[0]
    )
    with pytest.raises(pt.DataError) as caught:
        pt.prep.resample(pt.Record(u=[0, 1], y=[0, 1], Ts=1.0, starts=[0, 1]), 0.5)
    assert caught.value.code == "D04" and caught.value.count == 2


@pytest.mark.parametrize("Ts", [0.0, -1.0, np.nan, 1e-12])
def test_u01_steps_that_are_none(Ts):
    with pytest.raises(pt.UsageError):
        pt.prep.resample(record(), Ts)
