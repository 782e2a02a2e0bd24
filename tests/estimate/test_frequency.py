"""Models fitted to a frequency response."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pytest import approx
from scipy.signal import dlti, freqresp

import plantune as pt

FR = pt.models.FrequencyResponse
Process = pt.models.ProcessModel
W = np.geomspace(0.01, 10, 60)

PLANTS = [
    ("P1D", Process(K=-2.0, T=3.0, L=0.73)),
    ("P1", Process(K=2.0, T=3.0)),
    ("P2D", Process(K=1.5, T=(4.0, 0.8), L=1.3)),
    ("P2DU", Process(K=1.5, T=(2.0,), zeta=0.25, L=0.4)),
    ("P1DI", Process(K=0.5, T=2.0, L=0.9, integrating=True)),
    ("P2DZ", Process(K=1.0, T=(3.0, 1.0), L=0.5, Tz=-1.2)),
    ("P3D", Process(K=1.0, T=(6.0, 2.0, 0.5), L=0.5)),
]


@pytest.mark.parametrize(("code", "plant"), PLANTS)
def test_exact_points_give_the_plant_back(code, plant):
    fit = pt.estimate.frequency(FR(w=W, G=plant.freqresp(W)), code)
    wanted = [plant.K, *plant.times, plant.L, *([plant.Tz] if plant.Tz else [])]
    wanted += [plant.zeta] if plant.zeta else []
    got = np.array(fit.theta)
    lags = slice(1, 1 + len(plant.times))
    got[lags] = np.sort(got[lags])[::-1]
    assert_allclose(got, wanted, rtol=1e-6, atol=1e-9)


def sampled_first_order(w, K, T, L, Ts):
    """Response of the first order behind a hold, from its difference equation, L = (m + f) Ts."""
    m, f = divmod(L / Ts, 1.0)
    a, late = np.exp(-Ts / T), np.exp(-(1 - f) * Ts / T)
    z = np.exp(1j * w * Ts)
    return K * ((1 - late) / z + (late - a) / z**2) / (1 - a / z) / z**m


@pytest.mark.parametrize("L", [0.0, 0.5, 0.73, 1.5])
def test_sampled_points_give_the_continuous_plant_back(L):
    w = np.linspace(0.05, np.pi / 0.5, 60)
    G = sampled_first_order(w, -2.0, 3.0, L, 0.5)
    fit = pt.estimate.frequency(FR(w=w, G=G, Ts=0.5), "P1D")
    assert_allclose(fit.theta, [-2.0, 3.0, L], rtol=1e-6, atol=1e-6)


def test_polynomials_of_sampled_points_are_scipys():
    w = np.linspace(0.05, 3.0, 50)
    _, G = dlti([0.5, 0.2], [1, -1.2, 0.5, 0], dt=1.0).freqresp(w)
    fit = pt.estimate.frequency(FR(w=w, G=G, Ts=1.0), nb=2, nf=2, nk=2)
    assert fit.names == ("b1", "b2", "f1", "f2")
    assert_allclose(fit.theta, [0.5, 0.2, -1.2, 0.5], rtol=1e-8)
    assert_allclose(fit.model.freqresp(w), G, rtol=1e-8)


def test_polynomials_of_continuous_points_have_a_real_delay():
    _, G = freqresp(([1.5, 2.0], [3.0, 4.0, 1.0]), W)
    fit = pt.estimate.frequency(FR(w=W, G=G * np.exp(-0.37j * W)), nb=2, nf=2)
    assert fit.names == ("a1", "a2", "b0", "b1", "L")
    assert_allclose(fit.theta, [4.0, 3.0, 2.0, 1.5, 0.37], rtol=1e-6)
    still = pt.estimate.frequency(FR(w=W, G=G), nb=2, nf=2, delay=False)
    assert still.theta[-1] == 0.0 and still.sd[-1] == 0.0
    assert_allclose(still.theta[:-1], [4.0, 3.0, 2.0, 1.5], rtol=1e-8)


def noisy(seed, sd=0.05):
    plant = Process(K=2.0, T=3.0, L=0.73)
    rng = np.random.default_rng(seed)
    error = sd / np.sqrt(2) * (rng.normal(size=60) + 1j * rng.normal(size=60))
    return FR(w=W, G=plant.freqresp(W) + error, sd=sd)


def test_standard_deviations_are_those_of_many_fits():
    fits = [pt.estimate.frequency(noisy(seed), "P1D") for seed in range(150)]
    theta = np.array([fit.theta for fit in fits])
    stated = np.median([fit.sd for fit in fits], axis=0)
    assert_allclose(theta.std(axis=0), stated, rtol=0.2)  # 150 fits: 6 %, three times that
    z = (theta - [2.0, 3.0, 0.73]) / [fit.sd for fit in fits]
    assert np.mean(np.abs(z) < 1.96) == approx(0.95, abs=0.03)
    assert np.mean([fit.loss for fit in fits]) == approx(1.0, abs=0.1)


def record(seed, N=2000):
    """A first-order plant, T + L = 8 samples, fractional delay, under a random binary input."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 4), 4)
    y = Process(K=2.0, T=5.0, L=2.6).simulate(u, Ts=1.0) + 5 + 0.2 * rng.normal(size=N)
    return pt.Record(u=u, y=y, Ts=1.0)


@pytest.mark.parametrize("way", [{"n": 256}, {"method": "bt"}, {}])
def test_a_record_its_response_and_the_fit_to_it(way):
    """The intervals hold although neighbouring points overlap: that is what `share` is for."""
    inside = []
    for seed in range(30):
        fr = pt.analyze.spa(record(seed), **way)
        fit = pt.estimate.frequency(fr, "P1D")
        inside.append(np.abs(fit.theta - [2.0, 5.0, 2.6]) < 1.96 * fit.sd)
        assert_allclose(fit.theta, [2.0, 5.0, 2.6], rtol=0.15)
    assert np.mean(inside) > 0.85


def test_scaling_and_shifting():
    fr = noisy(1)
    one = pt.estimate.frequency(fr, "P1D")
    scaled = pt.estimate.frequency(FR(w=fr.w, G=10 * fr.G, sd=10 * fr.sd), "P1D")
    assert_allclose(scaled.theta, one.theta * [10, 1, 1], rtol=1e-6)
    slower = pt.estimate.frequency(FR(w=fr.w / 60, G=fr.G, sd=fr.sd), "P1D")
    assert_allclose(slower.theta, one.theta * [1, 60, 60], rtol=1e-5)
    later = FR(w=fr.w, G=fr.G[:, 0, 0] * np.exp(-1.1j * fr.w), sd=fr.sd)
    shifted = pt.estimate.frequency(later, "P1D")
    assert_allclose(shifted.theta, one.theta + [0, 0, 1.1], rtol=1e-4)


def test_points_that_are_not_coherent_do_not_count():
    fr = noisy(2)
    G = np.where(fr.w < 3, fr.G[:, 0, 0], 100.0)
    marked = FR(w=fr.w, G=G, sd=fr.sd, coherence=np.where(fr.w < 3, 0.9, 0.1))
    wanted = pt.estimate.frequency(fr.between(0, 3), "P1D")
    assert_allclose(pt.estimate.frequency(marked, "P1D").theta, wanted.theta, rtol=1e-9)


def test_one_pair_of_several_is_chosen():
    fast, slow = Process(K=2.0, T=0.5), Process(K=-1.0, T=5.0, L=0.3)
    G = np.zeros((len(W), 2, 2), complex)
    G[:, 0, 1], G[:, 1, 0] = fast.freqresp(W), slow.freqresp(W)
    fr = FR(w=W, G=G)
    assert pt.estimate.frequency(fr, "P1D", output=1, input=0).theta == approx([-1.0, 5.0, 0.3])
    assert pt.estimate.frequency(fr, "P1", output=0, input=1).theta == approx([2.0, 0.5, 0.0])


def test_what_cannot_be_fitted_is_refused():
    fr = noisy(3)
    with pytest.raises(pt.NotIdentifiable, match="X03"):
        pt.estimate.frequency(fr.take([3]), "P1D")
    with pytest.raises(pt.NotIdentifiable, match="X10"):
        flat = FR(w=W, G=np.full(60, 2.0))
        pt.estimate.frequency(flat, nb=3, nf=2, delay=False)
    for wrong in (
        {},
        {"code": "P9"},
        {"code": "P1D", "nb": 1, "nf": 1},
        {"nb": 1},
        {"nb": 0, "nf": 1},
        {"nb": 4, "nf": 1},
        {"code": "P1D", "output": 1},
    ):
        with pytest.raises(pt.UsageError, match="U01"):
            pt.estimate.frequency(fr, **wrong)
