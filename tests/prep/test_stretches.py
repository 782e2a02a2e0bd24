"""Steady stretches and the rest: every row is in one of them, or in a stretch that is too short."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from contract.records import check_refusal


def record(u, r=None, **fields):
    u = np.asarray(u, float)
    return pt.Record(u=u, y=np.arange(len(u)), r=r, Ts=0.1, **fields)


def steady_rows(u, needed, tolerance=0.02):
    """Return the steady rows by their definition."""
    travel = u.max() - u.min()
    windows = {k: u[k - needed : k + 1] for k in range(needed, len(u))}
    return {k for k, w in windows.items() if w.max() - w.min() <= tolerance * travel}


@given(
    levels=st.lists(st.sampled_from([0.0, 0.01, 1.0]), min_size=10, max_size=60),
    T=st.floats(0.1, 0.3),
)
def test_steady_rows_are_those_of_the_definition(levels, T):
    u, needed = np.repeat(levels, 4), int(np.ceil(5 * T / 0.1 - 1e-9))
    expected = steady_rows(u, needed)
    runs = np.split(sorted(expected), np.flatnonzero(np.diff(sorted(expected)) > 1) + 1)
    kept = [int(k) for run in runs if len(run) >= needed for k in run]
    if not kept:
        with pytest.raises(pt.DataError):
            pt.prep.steady(record(u), T)
        return
    out = pt.prep.steady(record(u), T)
    assert out.rows.tolist() == kept
    assert np.array_equal(out.u[:, 0], u[kept])


def test_steady_and_moving_share_the_rows():
    u = np.repeat([0.0, 1.0, 0.0], 100)
    rec = record(u, r=u, aux={"load": 2 * u})
    rest, rise = pt.prep.steady(rec, 0.5, 0.5), pt.prep.moving(rec, 0.5, 0.5)
    assert sorted([*rest.rows, *rise.rows]) == list(range(300))
    assert rest.rows.tolist() == [*range(30, 100), *range(130, 200), *range(230, 300)]
    assert rest.starts.tolist() == [0, 70, 140] and rise.starts.tolist() == [0, 30, 60]
    assert rest.time == approx(0.1 * rest.rows, abs=1e-12)
    assert np.array_equal(rest.aux["load"], rec.aux["load"][rest.rows])
    assert (rest.source, rest.notes) == (rec.source, ())
    assert rest.log == ("steady stretches: 210 of 300 rows in 3 stretches",)


def test_the_reference_counts_as_well():
    r = np.repeat([0.0, 1.0], 50)
    assert pt.prep.steady(record(np.zeros(100), r=r), 0.4).rows.tolist() == [
        *range(20, 50),
        *range(70, 100),
    ]
    assert pt.prep.steady(record(np.zeros(100)), 0.4).rows.tolist() == [*range(20, 100)]


def test_ripple_within_the_tolerance_is_rest():
    u = np.repeat([0.0, 1.0], 100)
    u[20:100:2] += 0.015
    assert pt.prep.steady(record(u), 0.4).N == 80 + 80
    with_ripple = pt.prep.steady(record(u), 0.4, tolerance=0.01)
    assert with_ripple.rows.tolist() == [*range(120, 200)]


def test_each_segment_has_its_own_past():
    out = pt.prep.steady(record(np.zeros(100), starts=[0, 40]), 0.2)
    assert out.rows.tolist() == [*range(10, 40), *range(50, 100)]


def test_f03_short_stretches_are_dropped_and_counted():
    u = np.repeat([0.0, 1.0, 0.0], [60, 25, 60])
    out = pt.prep.steady(record(u), 0.4)  # 20 rows needed; 5 of the second level are steady
    assert out.rows.tolist() == [*range(20, 60), *range(105, 145)]
    (note,) = out.notes
    assert (note.code, note.severity, note.count) == ("F03", "info", 5)
    assert "1 steady stretches of 5 rows left out" in note.text and note.text in out.log[-1]


@pytest.mark.parametrize(
    ("select", "u", "longest"),
    [
        (pt.prep.steady, np.tile([0.0, 1.0], 50), 0),
        (pt.prep.steady, np.repeat(np.arange(4) % 2, 25), 5),
        (pt.prep.moving, np.tile([0.0, 1.0], 7), 14),
    ],
    ids=["never rests", "rests too shortly", "is too short"],
)
def test_d04_nothing_is_left(select, u, longest):
    with pytest.raises(pt.DataError) as caught:
        select(record(u), 0.4)
    check_refusal(caught.value, "D04", ("count", "measured", "limit"))
    assert caught.value.measured == longest and f"has {longest} (" in caught.value.text


@pytest.mark.parametrize(
    "arguments",
    [(0.0,), (-1.0,), (np.nan,), (1.0, -0.1), (1.0, np.inf), (1.0, 0.0, 1.0), (1.0, 0.0, -0.1)],
)
def test_u01_times_and_tolerances_that_are_none(arguments):
    with pytest.raises(pt.UsageError):
        pt.prep.steady(record(np.zeros(50)), *arguments)
