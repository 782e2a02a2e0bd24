"""Means go, everything else stays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt

RNG = np.random.default_rng(11)


def record():
    valid = np.ones((50, 2), bool)
    valid[10:14, 0] = valid[12:20, 1] = False
    return pt.Record(
        u=RNG.normal(5, 2, (50, 3)),
        y=RNG.normal(-300, 2, (50, 2)),
        r=RNG.normal(-300, 2, (50, 2)),
        aux={"load": RNG.normal(7, 1, 50)},
        Ts=0.1,
        t0=3.0,
        valid=valid,
        starts=[0, 20, 35],
        rows=np.arange(100, 150),
        y_names=("a", "b"),
    )


def test_means_over_the_rows_that_count_are_removed():
    rec = record()
    out = pt.prep.detrend(rec)
    either = rec.valid.any(axis=1)
    # 1e-12 of 300: two orders of summation
    for j in range(2):
        level = rec.y[rec.valid[:, j], j].mean()
        assert out.y[:, j] == approx(rec.y[:, j] - level, abs=1e-10)
        assert out.r[:, j] == approx(rec.r[:, j] - level, abs=1e-10)
    assert out.u == approx(rec.u - rec.u[either].mean(axis=0), abs=1e-10)


def test_everything_else_stays():
    rec = record()
    out = pt.prep.detrend(rec)
    for name in ("valid", "starts", "rows", "time"):
        assert np.array_equal(getattr(out, name), getattr(rec, name))
    assert (out.source, out.units, out.Ts, out.t0) == (rec.source, rec.units, rec.Ts, rec.t0)
    assert np.array_equal(out.aux["load"], rec.aux["load"])
    assert len(out.log) == 1 and out.log[0].startswith("removed means: u1 ")


@given(level=st.floats(-1e6, 1e6))
def test_a_level_does_not_matter(level):
    u, y = np.sin(np.arange(30)), np.cos(np.arange(30))
    plain = pt.prep.detrend(pt.Record(u=u, y=y, Ts=1.0))
    moved = pt.prep.detrend(pt.Record(u=u + level, y=y - level, Ts=1.0))
    assert moved.u == approx(plain.u, abs=1e-9) and moved.y == approx(plain.y, abs=1e-9)


def test_twice_is_once():
    once = pt.prep.detrend(pt.datasets.hair_dryer())
    twice = pt.prep.detrend(once)
    assert twice.u == approx(once.u, abs=1e-12) and twice.y == approx(once.y, abs=1e-12)


def test_a_line_is_that_of_numpy_and_the_reference_moves_with_it():
    rng = np.random.default_rng(3)
    t = np.arange(100) * 0.5
    u, y = rng.normal(size=100) + 0.2 * t, rng.normal(size=100) - 0.7 * t + 40
    rec = pt.Record(u=u, y=y, r=y + 1, Ts=0.5)
    flat = pt.prep.detrend(rec, by="line")
    assert flat.y[:, 0] == approx(y - np.polyval(np.polyfit(t, y, 1), t), abs=1e-9)
    assert flat.u[:, 0] == approx(u - np.polyval(np.polyfit(t, u, 1), t), abs=1e-9)
    assert flat.r - flat.y == approx(np.ones((100, 1)))
    assert "removed lines" in flat.log[-1]
    again = pt.prep.detrend(flat, by="line")
    assert again.y == approx(flat.y, abs=1e-12)


def test_levels_between_steps_are_removed():
    y = 3.0 + 5.0 * (np.arange(300) >= 120) + 0.1 * np.random.default_rng(4).normal(size=300)
    rec = pt.prep.detrend(pt.Record(u=np.full(300, 7.0), y=y, Ts=1.0), by="steps")
    assert abs(rec.y[:120].mean()) < 1e-9
    assert abs(rec.y[120:].mean()) < 1e-9
    assert "at row 120" in rec.log[-1]
    with pytest.raises(pt.UsageError):
        pt.prep.detrend(rec, by="spline")
