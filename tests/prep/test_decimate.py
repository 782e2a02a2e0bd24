"""A longer step behind a filter: no aliases, no delay, and estimates that stay."""

import numpy as np
import pytest
from pytest import approx
from scipy import signal

import plantune as pt
from contract.records import check_cli_refusal, check_refusal, codes, record, write

K, T, L, TS = 2.0, 1.0, 0.3, 0.01


def lag(N=12_000, **fields):
    """Return a first-order lag with a dead time, driven at random without noise."""
    u = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], N // 21 + 1), 21)[:N]
    y = np.ravel(pt.models.ProcessModel(K=K, T=T, L=L).simulate(u, Ts=TS))
    return pt.Record(u=u, y=y, r=u, aux={"load": y}, Ts=TS, **fields)


def counting(rec):
    return np.flatnonzero(rec.valid[:, 0])


# --- no aliases ---


@pytest.mark.parametrize("k", [2, 4, 5, 10])
def test_what_would_alias_is_gone_and_the_rest_stays(k):
    # New Nyquist frequency 0.5 / k of the old rate: one sine above it, one far below.
    n = np.arange(20_000)
    slow, fast = np.sin(2 * np.pi * 0.05 / k * n), np.sin(2 * np.pi * 0.7 / k * n)
    # Dropping rows, the fast one comes back at 0.3 of the new rate.
    out = pt.prep.resample(pt.Record(u=slow, y=slow + fast, aux={"fast": fast}, Ts=1.0), float(k))
    keep = counting(out)
    assert np.ptp(fast[::k]) > 1.8
    # Twice 8th order, 1.75 beyond its cut-off, and more by the bilinear map: below 1e-3.
    assert np.abs(out.aux["fast"][keep]).max() < 1e-3
    assert out.y[keep, 0] == approx(slow[::k][: out.N][keep], abs=2e-3)


def test_white_noise_keeps_the_share_of_the_band():
    noise = np.random.default_rng(4).normal(size=100_000)
    out = pt.prep.resample(pt.Record(u=noise, y=noise, Ts=0.1), 0.5)
    sos = signal.butter(8, 0.8 / 5, output="sos")
    gain = np.abs(signal.sosfreqz(sos, 20_000)[1]) ** 4
    # 20 000 new rows: a standard error of about 1 %
    assert out.y[counting(out), 0].var() == approx(gain.mean(), rel=0.05)


# --- the numbers ---


@pytest.mark.parametrize("k", [2, 5])
def test_values_are_those_of_scipys_filter_both_ways(k):
    rec = lag()
    out = pt.prep.resample(rec, k * TS)
    sos = signal.butter(8, 0.8 / k, output="sos")
    u, y = (signal.sosfiltfilt(sos, x[:, 0]) for x in (rec.u, rec.y))
    keep = counting(out)
    # Where the ends are forgotten; scipy guesses the unknown past otherwise.
    assert out.y[keep, 0] == approx(y[::k][keep], abs=1e-5)
    means = u.reshape(-1, k).mean(axis=1)
    assert out.u[keep, 0] == approx(means[keep], abs=1e-5)
    assert np.array_equal(out.r, out.u) and np.array_equal(out.aux["load"], out.y[:, 0])


def test_rows_and_times_stay_true():
    rows = np.concatenate([np.arange(3000), np.arange(5000, 8000)])
    rec = lag(6000, starts=[0, 3000], rows=rows)
    out = pt.prep.resample(rec, 4 * TS)
    assert out.Ts == 4 * TS and out.source == rec.source
    assert out.rows.tolist() == [*range(0, 3000, 4), *range(5000, 8000, 4)]
    assert out.time == approx(TS * out.rows, abs=1e-9)
    assert out.starts.tolist() == [0, 750]
    assert "low-pass both ways on every signal" in out.log[-1]


def test_a_ratio_that_is_not_whole():
    # A slow sine: linear between two rows to (w Ts)^2 / 8 = 5e-5.
    t = TS * np.arange(9000)
    rec = pt.Record(u=np.sin(2 * t), y=np.cos(2 * t), Ts=TS)
    Ts = 2.5 * TS
    out = pt.prep.resample(rec, Ts)
    keep = counting(out)
    assert out.time == approx(Ts * np.arange(out.N), abs=1e-9)
    assert out.rows.tolist() == [int(2.5 * j) for j in range(out.N)]
    assert out.y[keep, 0] == approx(np.cos(2 * out.time[keep]), abs=1e-4)
    middle = out.time[keep] + (Ts - TS) / 2
    # 2.5 held rows have their middle up to a twentieth of a row beside that of the step.
    assert out.u[keep, 0] == approx(np.sin(2 * middle), abs=1.1e-3)


def test_a_level_stays_a_level():
    level = np.full(2000, 583.451)
    out = pt.prep.resample(pt.Record(u=level, y=level, Ts=0.1), 0.3)
    assert out.N == 666 and np.all(out.y == 583.451)
    assert out.u == approx(level[:666, None], rel=1e-14)


# --- estimates stay ---


@pytest.mark.parametrize("k", [2, 3, 5, 7.5, 10])
def test_a_model_keeps_its_gain_lag_and_dead_time(k):
    fit = pt.estimate.process(pt.prep.resample(lag(), k * TS))
    # T = 10 new steps at the most; half a step late would be 0.5 Ts.
    assert fit.theta[0] == approx(K, rel=1e-3)
    assert fit.theta[1] == approx(T, rel=2e-3)
    assert fit.theta[2] == approx(L, abs=0.01 * k * TS)


# --- what the filter cannot know ---


def test_both_ends_are_marked():
    out = pt.prep.resample(lag(), 5 * TS)
    lost = np.flatnonzero(~out.valid[:, 0])
    assert out.notes == () and 40 < len(lost) < 80
    (inner,) = np.flatnonzero(np.diff(lost) > 1)
    at_start, at_end = inner + 1, len(lost) - inner - 1
    assert lost[0] == 0 and lost[-1] == out.N - 1 and abs(at_start - at_end) <= 1


def test_f02_short_segments_are_marked_by_a_tenth():
    out = pt.prep.resample(lag(2000, starts=[0, 1800]), 5 * TS)
    assert codes(out) == ["F02"] and out.notes[0].count == 1
    assert (~out.valid[360:, 0]).sum() == 4


def test_segments_too_short_for_the_filter_are_left_out():
    out = pt.prep.resample(lag(3000, starts=[0, 50, 2950]), 5 * TS)
    assert out.starts.tolist() == [0] and out.rows[[0, -1]].tolist() == [50, 2945]
    assert out.time[0] == approx(50 * TS)
    assert "2 segments too short for the filter left out" in out.log[-1]
    with pytest.raises(pt.DataError) as caught:
        pt.prep.resample(lag(3000, starts=[*range(0, 3000, 50)]), 5 * TS)
    check_refusal(caught.value, "D04", ("count", "measured", "limit"))
    assert caught.value.measured == 50


def test_a_hole_is_marked_on_both_sides_and_changes_nothing_else():
    valid = np.ones(12_000, bool)
    valid[6000:6005] = False
    rec = lag()
    y = np.where(valid, rec.y[:, 0], -9999.0)
    plain = pt.prep.resample(rec, 5 * TS)
    out = pt.prep.resample(pt.Record(u=rec.u, y=y, Ts=TS, valid=valid), 5 * TS)
    lost = np.flatnonzero(plain.valid & ~out.valid)
    assert lost[0] < 1200 - 20 and lost[-1] > 1200 + 20
    assert np.array_equal(lost, np.arange(lost[0], lost[-1] + 1))
    assert out.y[out.valid] == approx(plain.y[out.valid], abs=1e-5)


# --- refusals ---


@pytest.mark.parametrize("Ts", [0.16, 0.25, 1.0])
def test_m10_dropping_rows_without_a_filter(Ts):
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.prep.resample(record(), Ts, filter=False)
    check_refusal(caught.value, "M10", ("where", "measured", "limit"))
    assert caught.value.measured == approx(10 * Ts)


def test_m10_on_the_command_line(tmp_path):
    rec = record()
    path = write(tmp_path / "a.csv", rec.u[:, 0], rec.y[:, 0])
    needs = ("where", "measured", "limit")
    arguments = (path, "--u", "u", "--y", "y", "--resample", "0.5")
    error = check_cli_refusal(tmp_path, "M10", needs, *arguments)
    assert "prep.resample" in error["remedy"]


@pytest.mark.parametrize("Ts", [1e6, np.inf])
def test_u01_steps_that_are_too_long(Ts):
    with pytest.raises(pt.UsageError):
        pt.prep.resample(record(), Ts)
