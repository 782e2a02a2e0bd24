"""Subspace from frequency responses: exact data anywhere on the circle, noise, continuous time."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import subspace


def system(seed, n=4, nu=2, ny=3, Ts=1.0):
    rng = np.random.default_rng(seed)
    A = np.zeros((n, n))
    for i in range(0, n, 2):
        r, angle = rng.uniform(0.3, 0.99), rng.uniform(0.05, 3)
        c, s = r * np.cos(angle), r * np.sin(angle)
        A[i : i + 2, i : i + 2] = [[c, s], [-s, c]]
    T = np.linalg.qr(rng.normal(size=(n, n)))[0]
    B, C, D = (rng.normal(size=shape) for shape in ((n, nu), (ny, n), (ny, nu)))
    return pt.models.StateSpace(A=T @ A @ T.T, B=B, C=C, D=D, Ts=Ts)


def seen(model, w):
    return pt.models.FrequencyResponse(w=w, G=model.freqresp(w), Ts=model.Ts)


def worst(model, fr):
    return abs(model.freqresp(fr.w) - fr.G).max() / abs(fr.G).max()


@pytest.mark.parametrize("slowest", [-4.0, -2.0, -1.0])
@pytest.mark.parametrize("n", [4, "auto"])
def test_exact_data_give_the_system(slowest, n):
    for seed in range(20):
        fr = seen(system(seed), np.logspace(slowest, np.log10(3), 100))
        fit = pt.estimate.subspace_frequency(fr, n)
        assert fit.model.n == 4
        assert worst(fit.model, fr) < 1e-10
        assert fit.singular_values[3] / fit.singular_values[4] > 1e7
        assert fit.loss < 1e-18


def test_slow_frequencies_lose_no_digits():
    """All of them below 0.01 rad/sample: 1e-6 without the map."""
    for seed in range(20):
        fr = seen(system(seed), np.geomspace(1e-4, 1e-2, 100))
        assert worst(pt.estimate.subspace_frequency(fr, 4).model, fr) < 1e-9


def test_the_oracle_on_noisy_data():
    rng = np.random.default_rng(0)
    model, w = system(0), np.linspace(0.02, 3.1, 200)
    G = model.freqresp(w)
    G = G + 0.01 * abs(G).mean() * (rng.normal(size=G.shape) + 1j * rng.normal(size=G.shape))
    fr = pt.models.FrequencyResponse(w=w, G=G, Ts=1.0)
    ours = pt.estimate.subspace_frequency(fr, 4)
    *theirs, _ = subspace.from_frequency(np.exp(1j * w), G, 4, ours.block_rows)
    assert ours.model.freqresp(w) == approx(subspace.freqresp(*theirs, np.exp(1j * w)), abs=1e-9)
    assert worst(ours.model, seen(model, w)) < 0.01


def test_continuous_data_give_a_continuous_model():
    plant = pt.models.TransferFunction([2.0, 1.0], [1.0, 1.4, 3.0, 1.0])
    w = np.geomspace(0.01, 100, 40)
    fr = pt.models.FrequencyResponse(w=w, G=plant.freqresp(w))
    fit = pt.estimate.subspace_frequency(fr)
    assert (fit.model.Ts, fit.model.n) == (None, 3)
    assert worst(fit.model, fr) < 1e-11
    poles = np.sort_complex(fit.model.poles())
    assert poles == approx(np.sort_complex(plant.poles()), rel=1e-8)


def test_zero_and_the_highest_frequency_count():
    fr = seen(system(1), np.linspace(0.0, np.pi, 60))
    assert worst(pt.estimate.subspace_frequency(fr, 4).model, fr) < 1e-10


def test_unstable_poles_are_reflected_and_said():
    model = pt.models.StateSpace(A=[[1.2]], B=[1.0], C=[1.0], Ts=1.0)
    fr = seen(model, np.linspace(0.05, 3, 40))
    kept = pt.estimate.subspace_frequency(fr, 1, stable=False)
    assert kept.model.poles()[0].real == approx(1.2)
    fit = pt.estimate.subspace_frequency(fr, 1)
    assert abs(fit.model.poles()).max() < 1.0
    assert [note.code for note in fit.notes] == ["M02"]


def test_too_few_frequencies_are_refused():
    fr = seen(system(0), np.linspace(0.1, 3, 4))
    with pytest.raises(pt.NotIdentifiable, match="4 frequencies") as refused:
        pt.estimate.subspace_frequency(fr, 12)
    assert refused.value.code == "X03"
    with pytest.raises(pt.UsageError, match="`n` is 0"):
        pt.estimate.subspace_frequency(fr, 0)
