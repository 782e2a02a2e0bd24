"""Power spectral density by Welch, against scipy and the defining sums."""

import numpy as np
import pytest
import scipy.signal
from numpy.testing import assert_allclose
from pytest import approx
from scipy.stats import chi2

import plantune as pt
from oracles import spectrum as oracle


def noise_of(N, seed):
    return scipy.signal.lfilter([1, 0.5], [1, -0.6], np.random.default_rng(seed).normal(size=N))


def record(y, Ts=0.1, **fields):
    return pt.Record(u=np.zeros(len(y)), y=y, Ts=Ts, **fields)


@pytest.mark.parametrize("window", ["hann", "hamming", "rectangular"])
@pytest.mark.parametrize(("n", "overlap"), [(128, 0.5), (100, 0.75), (64, 0.0), (65, 0.5)])
def test_it_is_scipys(window, n, overlap):
    y = noise_of(1000, 2)
    psd = pt.analyze.spectrum(record(y), n=n, overlap=overlap, window=window)
    named = "boxcar" if window == "rectangular" else window
    noverlap = n - int(n * (1 - overlap) + 0.5)
    f, P = scipy.signal.welch(
        y - y.mean(), 10.0, named, nperseg=n, noverlap=noverlap, detrend=False
    )
    assert_allclose(psd.w, 2 * np.pi * f, atol=1e-12)
    assert_allclose(psd.P, P / (2 * np.pi), rtol=1e-10, atol=1e-15)


def test_degrees_of_freedom_and_band_are_the_oracles():
    y = noise_of(1000, 3)
    psd = pt.analyze.spectrum(record(y), n=128)
    _, P, ratio = oracle.welch(y - y.mean(), 0.1, 128)
    assert psd.dof == approx(2 / ratio, rel=1e-9)
    assert psd.averaged == 14
    low, high = oracle.band(P, ratio)
    assert_allclose(psd.low, low, rtol=1e-9)
    assert_allclose(psd.high, high, rtol=1e-9)
    assert psd.dof / chi2.ppf(0.975, psd.dof) == approx((psd.low / psd.P)[3])


def test_stretches_stay_within_segments():
    """A level that jumps between segments is no power at low frequencies."""
    y = noise_of(800, 4)
    apart = record(np.concatenate([y[:400], 100 + y[400:]]), starts=[0, 400])
    psd = pt.analyze.spectrum(apart, n=64)
    assert psd.averaged == 2 * 11
    halves = [pt.analyze.spectrum(record(part), n=64).P for part in (y[:400], y[400:])]
    assert_allclose(psd.P, np.mean(halves, axis=0), rtol=1e-10)


def test_the_bands_cover():
    """MA(1): the density is known; 30 seeds, frequencies a resolution apart."""
    inside = []
    for seed in range(30):
        e = np.random.default_rng(seed).normal(size=2001)
        psd = pt.analyze.spectrum(record(e[1:] + 0.5 * e[:-1], Ts=1.0), n=64)
        true = 2 * np.abs(1 + 0.5 * np.exp(-1j * psd.w)) ** 2 / (2 * np.pi)
        inside.append(((psd.low < true) & (true < psd.high))[1:-1])
    assert np.mean(inside) == approx(0.95, abs=0.02)


def test_wrong_arguments_are_refused():
    rec = record(noise_of(100, 1))
    for wrong in ({"n": 4}, {"overlap": 1.0}, {"overlap": -0.1}, {"window": "flat"}):
        with pytest.raises(pt.UsageError, match="U01"):
            pt.analyze.spectrum(rec, **wrong)
    with pytest.raises(pt.NotIdentifiable, match="X03"):
        pt.analyze.spectrum(rec, n=101)
