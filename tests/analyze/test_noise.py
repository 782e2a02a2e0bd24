"""Noise report: moments, histogram, autocorrelation, spectrum, parts, reading."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import noise as oracle
from oracles import spectrum as spectra

# Source 001, tables 3.5-3 and 3.5-4: mean, rms, variance, SNR in dB.
PRINTED = [
    (342.4065, 342.4082, 1.1488, 50.0885),
    (259.0487, 259.0533, 2.4065, 44.4538),
    (967.4347, 967.4381, 6.7016, 51.4507),
    (867.8637, 867.8685, 8.3371, 49.5589),
]


def at_rest(y, Ts=0.1, **fields):
    """Return a record whose input stands still."""
    return pt.Record(u=np.zeros(len(y)), y=y, Ts=Ts, **fields)


def coloured(N, a, seed):
    return lfilter([1], [1, -a], np.random.default_rng(seed).normal(size=N + 500))[500:]


def with_moments(mean, var, N=500, seed=3):
    """Return values of exactly this mean and variance."""
    x = np.random.default_rng(seed).normal(size=N)
    return mean + (x - x.mean()) / x.std() * np.sqrt(var)


@pytest.mark.parametrize(("mean", "rms", "var", "snr"), PRINTED)
def test_moments_of_source_001_give_its_snr(mean, rms, var, snr):
    report = pt.analyze.noise(at_rest(with_moments(mean, var)))
    assert report.mean == approx(mean, abs=1e-9)
    assert report.rms == approx(rms, abs=1e-4)
    assert report.var == approx(var, rel=1e-12)
    # Four decimals are printed, of the variance too: 5e-5 of it are 9e-5 dB where it is least.
    assert report.snr == approx(snr, abs=1.5e-4)


def test_the_two_parts_of_source_001_differ_and_armax_follows():
    first, second = PRINTED[0], PRINTED[1]
    y = [with_moments(part[0], part[2], seed=k) for k, part in enumerate((first, second))]
    report = pt.analyze.noise(at_rest(np.concatenate(y), starts=[0, 500]))
    assert [part.snr for part in report.parts] == approx([first[3], second[3]], abs=1.5e-4)
    assert report.p_var < 0.01 and report.p_mean < 0.01
    assert {note.code for note in report.notes} == {"M07"}
    assert any("ARMAX" in line for line in report.advice)


def test_moments_histogram_and_correlation_are_the_oracles():
    y = 5 + coloured(1000, 0.7, 1)
    report = pt.analyze.noise(at_rest(y), lags=60)
    assert (report.mean, report.rms, report.var, report.snr) == approx(oracle.moments(y))
    assert_allclose(report.R, oracle.autocorrelation(y, 60), atol=1e-12)
    assert len(report.histogram.counts) == oracle.bins(y)
    counts, edges = np.histogram(y, bins="fd")
    assert_array_equal(report.histogram.counts, counts)
    assert_allclose(report.histogram.edges, edges)
    assert report.N_mean == approx(oracle.effective(y, 1), rel=1e-9)


def test_parts_are_judged_as_the_oracle_does():
    for seed in range(10):
        y = coloured(2000, 0.8, seed)
        report = pt.analyze.noise(at_rest(y))
        wanted = oracle.stationary(y[:1000], y[1000:])
        assert (report.p_mean, report.p_var) == approx(wanted, rel=1e-6)


@pytest.mark.parametrize("N", [64, 101, 1000])
def test_the_periodogram_holds_the_variance(N):
    """Parseval, (3.5-12), for even and odd lengths."""
    y = 300 + coloured(N, 0.5, N)
    report = pt.analyze.noise(at_rest(y, Ts=0.02))
    w, P = spectra.periodogram(y - y.mean(), 0.02)
    assert_allclose(report.periodogram.w, w, rtol=1e-12)
    assert_allclose(report.periodogram.P, P, atol=1e-12 * P.max())
    assert report.parseval < 1e-12
    assert np.sum(report.periodogram.P) * w[1] == approx(report.var, rel=1e-12)


@given(scale=st.floats(1e-6, 1e6), shift=st.floats(-1e3, 1e3))
def test_units_do_not_change_what_is_said(scale, shift):
    y = coloured(400, 0.6, 2)
    one, other = pt.analyze.noise(at_rest(y)), pt.analyze.noise(at_rest(scale * (y + shift)))
    assert other.var == approx(scale**2 * one.var, rel=1e-6)
    assert_allclose(other.R, one.R, atol=1e-7)
    assert_array_equal(other.histogram.counts.sum(), 400)
    assert other.white == approx(one.white, rel=1e-4, abs=1e-12)


def test_white_and_coloured_are_told_apart():
    white = pt.analyze.noise(at_rest(coloured(1000, 0.0, 5)))
    slow = pt.analyze.noise(at_rest(coloured(1000, 0.9, 5)))
    fast = pt.analyze.noise(at_rest(coloured(1000, -0.6, 5)))
    assert white.white > 0.01 and white.advice[0].startswith("white")
    assert slow.white < 1e-6 and "slow" in slow.advice[0] and "ARMAX" in slow.advice[0]
    assert "fast" in fast.advice[0]
    assert white.memory == 1 and slow.memory > 5


@pytest.mark.parametrize("step", [0.5, 0.1, 0.01])
def test_a_signal_read_in_steps_has_its_step_and_no_comb(step):
    y = coloured(2000, 0.5, 4)
    report = pt.analyze.noise(at_rest(np.round(y / step) * step))
    assert report.quantum == approx(step, rel=1e-9)
    assert pt.analyze.noise(at_rest(y)).quantum is None
    # Values lie in the middle of the bins.
    off = report.histogram.centres / step * 2
    assert_allclose(off, np.round(off), atol=1e-6)


def test_reading_more_coarsely_than_the_noise_is_noted():
    y = np.round(coloured(1000, 0.0, 4) / 3) * 3
    report = pt.analyze.noise(at_rest(y))
    assert "M04" in {note.code for note in report.notes}


def test_few_independent_rows_are_not_compared():
    report = pt.analyze.noise(at_rest(coloured(100, 0.97, 1)))
    assert report.p_mean is None and report.p_var is None
    assert "X03" in {note.code for note in report.notes}


def test_an_input_that_moves_is_said():
    report = pt.analyze.noise(pt.datasets.hair_dryer())
    assert {note.code for note in report.notes} == {"X04"}
    assert len(report.advice) == 1 and "residuals" in report.advice[0]


def test_rows_that_do_not_count_are_left_out():
    y = coloured(600, 0.5, 8)
    broken = np.array(y)
    broken[200:230] = 1e6
    valid = np.ones(600, bool)
    valid[200:230] = False
    report = pt.analyze.noise(at_rest(broken, valid=valid))
    assert report.N == 570 and report.var < 5
    assert report.periodogram.n == 370  # the longest run


def test_segments_are_not_joined():
    """Two halves at different levels: deviations are from the mean of each."""
    y = coloured(1000, 0.0, 9)
    apart = pt.analyze.noise(at_rest(np.concatenate([y[:500], 50 + y[500:]]), starts=[0, 500]))
    assert apart.white > 1e-3 and apart.N_mean > 800
    assert [(part.first, part.last) for part in apart.parts] == [(0, 499), (500, 999)]


def test_what_cannot_be_analysed_is_refused():
    with pytest.raises(pt.DataError, match="D18"):
        pt.analyze.noise(at_rest(np.full(100, 3.0)))
    with pytest.raises(pt.NotIdentifiable, match="X03"):
        pt.analyze.noise(at_rest(coloured(12, 0.0, 1)))
    rec = at_rest(coloured(100, 0.0, 1))
    for wrong in ({"signal": "z"}, {"parts": 1}, {"parts": 50}, {"lags": 0}, {"lags": 100}):
        with pytest.raises(pt.UsageError, match="U01"):
            pt.analyze.noise(rec, **wrong)


@pytest.mark.slow
@pytest.mark.parametrize(("a", "most"), [(0.0, 0.025), (0.5, 0.025), (0.9, 0.035)])
def test_steady_noise_is_called_unsteady_as_rarely_as_stated(a, most):
    """Recipe: .007 to .020 false at p < .01 of 1000 rows a part."""
    reports = [pt.analyze.noise(at_rest(coloured(2000, a, seed))) for seed in range(1000)]
    assert np.mean([report.p_mean < 0.01 for report in reports]) <= most
    assert np.mean([report.p_var < 0.01 for report in reports]) <= most
