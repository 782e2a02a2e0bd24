"""Smoothing over three rows: both signals keep the model, y alone does not and says so."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import check_refusal

N = 400
MOTOR = pt.models.PolyModel(A=[1, -1.2, 0.35], B=[0.3, 0.1], nk=1, Ts=0.01)


def motor(sd=0.0, **fields):
    """Return a second-order motor driven at random."""
    rng = np.random.default_rng(8)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 10), 10)
    y = np.ravel(MOTOR.simulate(u)) + sd * rng.normal(size=N)
    return pt.Record(u=u, y=y, r=-y, aux={"load": np.arange(float(N))}, Ts=0.01, **fields)


def three(x):
    return np.convolve(x, [0.25, 0.5, 0.25], mode="valid")


def test_values_are_those_of_the_source():
    rec, out = motor(), pt.prep.smooth(motor())
    for name in ("u", "y", "r"):
        assert getattr(out, name)[:, 0] == approx(three(getattr(rec, name)[:, 0]), abs=1e-15)
    assert np.array_equal(out.aux["load"], rec.aux["load"][1:-1])
    assert out.log == (f"smoothed u, y and r over three rows: 2 of {N} rows left out",)
    assert out.notes == ()


def test_first_and_last_row_of_each_segment_have_no_value():
    out = pt.prep.smooth(motor(starts=[0, 100, 102]))
    assert out.starts.tolist() == [0, 98]
    assert out.rows.tolist() == [*range(1, 99), *range(103, N - 1)]
    assert out.time == approx(0.01 * out.rows, abs=1e-12)


def test_an_output_counts_where_three_do():
    valid = np.ones(N, bool)
    valid[[50, 51]] = False
    out = pt.prep.smooth(motor(valid=valid))
    assert out.rows[~out.valid[:, 0]].tolist() == [49, 50, 51, 52]


def test_joined_records_keep_their_times():
    late, early = motor().take(slice(200, 300)), motor().take(slice(0, 100))
    rec = pt.Record.join([late, early])
    out = pt.prep.smooth(rec)
    kept = np.r_[1:99, 101:199]
    assert np.array_equal(out.time, rec.time[kept]) and np.array_equal(out.rows, rec.rows[kept])


def test_smoothing_both_keeps_the_model():
    fit = pt.estimate.arx(pt.prep.smooth(motor()), 2, 2, 1)
    assert fit.theta == approx([-1.2, 0.35, 0.3, 0.1], abs=1e-12)


def test_f01_smoothing_y_alone_is_biased_without_noise_and_says_so():
    out = pt.prep.smooth(motor(), signals="y")
    (note,) = out.notes
    assert (note.code, note.severity, note.where.column) == ("F01", "warning", "y")
    assert "F01" in out.log[-1] and "biased even without noise" in out.log[-1]
    assert np.array_equal(out.u, motor().u[1:-1]) and np.array_equal(out.r, motor().r[1:-1])
    assert out.y[:, 0] == approx(three(motor().y[:, 0]), abs=1e-15)
    a1 = pt.estimate.arx(out, 2, 2, 1).theta[0]
    assert abs(a1 + 1.2) > 0.05


def test_white_noise_keeps_three_eighths_of_its_variance():
    x = np.random.default_rng(1).normal(size=100_000)
    out = pt.prep.smooth(pt.Record(u=x, y=x, Ts=1.0))
    # 0.375 with a standard error of 0.5 %, from 20 seeds
    assert out.y.var() == approx(0.375 * x.var(), rel=0.02)


def test_d04_no_segment_has_three_rows():
    with pytest.raises(pt.DataError) as caught:
        pt.prep.smooth(pt.Record(u=[0, 1, 0, 1], y=[0, 1, 1, 0], Ts=1.0, starts=[0, 2]))
    check_refusal(caught.value, "D04", ("count", "measured", "limit"))


def test_u01_signals():
    with pytest.raises(pt.UsageError):
        pt.prep.smooth(motor(), signals="u")
