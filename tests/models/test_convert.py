"""c2d and d2c: exact for any delay, and back; no model where none exists."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx
from scipy import signal

import plantune as pt
from oracles import fopdt

K, T, TS = -5.939, 0.1491, 0.02


@pytest.mark.parametrize("L", [0.0, 0.1, 0.107, 0.0199, 0.033])
def test_c2d_gives_the_closed_form(L):
    """METHODS 1.5: b1 at u(-m-1), b2 at u(-m-2), for L = m Ts + f."""
    model = pt.models.c2d(pt.models.ProcessModel(K=K, T=T, L=L), TS)
    m = int(np.floor(L / TS + 1e-9))
    f = max(L - m * TS, 0.0)
    a = np.exp(-TS / T)
    b = np.zeros(m + 4)
    b[m + 1 : m + 3] = K * (1 - np.exp(-(TS - f) / T)), K * (np.exp(-(TS - f) / T) - a)
    found = np.zeros(m + 4)
    found[model.nk : model.nk + len(np.ravel(model.B))] = np.ravel(model.B)
    assert np.ravel(model.A) == approx([1, -a], rel=1e-13)
    assert found == approx(b, rel=1e-11, abs=1e-13)  # f carries the rounding of L/Ts
    assert model.Ts == TS


def test_c2d_without_delay_agrees_with_scipy():
    num, den, _ = signal.cont2discrete(([K], [T, 1.0]), TS, method="zoh")
    model = pt.models.c2d(pt.models.ProcessModel(K=K, T=T, L=0.0), TS)
    assert np.ravel(model.A) == approx(den, rel=1e-13)
    assert np.ravel(model.B)[0] == approx(np.ravel(num)[1], rel=1e-12)
    assert model.nk == 1


# L below 10 samples, T from one sample to 500: beyond, K = b/(1 - a) loses digits (METHODS 8.4)
@given(
    gain=st.floats(0.01, 1e3),
    sign=st.sampled_from([-1.0, 1.0]),
    lag=st.floats(0.02, 10.0),
    L=st.floats(0.0, 0.2),
)
def test_there_and_back_returns_the_model(gain, sign, lag, L):
    there = pt.models.c2d(pt.models.ProcessModel(K=sign * gain, T=lag, L=L), TS)
    back = pt.models.d2c(there)
    assert approx((sign * gain, lag), rel=1e-9) == (back.K, back.T)
    assert approx(L, abs=1e-9) == back.L


@given(L=st.floats(0.0, 0.2), lag=st.floats(0.03, 2.0), seed=st.integers(0, 1000))
def test_both_models_simulate_the_superposition_of_steps(L, lag, seed):
    u = fopdt.hold_input(120, 3, seed)
    y = fopdt.simulate(u, K, lag, L, TS)
    model = pt.models.ProcessModel(K=K, T=lag, L=L)
    assert np.ravel(model.simulate(u, Ts=TS)) == approx(y, abs=1e-10)
    assert np.ravel(pt.models.c2d(model, TS).simulate(u)) == approx(y, abs=1e-10)


def test_frequency_response_is_exact():
    w = np.geomspace(0.1, 100, 50)
    G = np.ravel(pt.models.ProcessModel(K=K, T=T, L=0.107).freqresp(w))
    assert approx(K * np.exp(-0.107j * w) / (1j * w * T + 1), rel=1e-12) == G


@pytest.mark.parametrize(
    "A, B",
    [
        ([1.0, 0.4], [1.0]),  # pole at -0.4: no continuous first-order model
        ([1.0, 0.0], [1.0]),  # pole at 0
        ([1.0, -1.0], [1.0]),  # pole on the unit circle
        ([1.0, -1.2], [1.0]),  # pole outside
        ([1.0, -0.8], [1.0, -0.5]),  # b1/K = 2: no delay between 0 and one sample
    ],
)
def test_d2c_refuses_with_a_reason(A, B):
    with pytest.raises(Exception) as refusal:
        pt.models.d2c(pt.models.PolyModel(A=A, B=B, nk=1, Ts=TS))
    assert getattr(refusal.value, "code", None)
    assert len(str(refusal.value)) > 20
