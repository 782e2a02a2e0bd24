"""Internal model control in general: split, filter, classic controller, loop and costs."""

from math import exp, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from oracles import imc as oracle
from plantune.models import ProcessModel, TransferFunction
from plantune.tune import imc, imc_costs, imc_pi, imc_pid

W = np.geomspace(1e-3, 1e2, 40)
PLANTS = {
    "one lag": ProcessModel(K=-2.0, T=5.0, L=0.8),
    "two lags": ProcessModel(K=3.0, T=(4.0, 0.5), L=0.3),
    "inverse": ProcessModel(K=3.0, T=(4.0, 0.5), L=0.3, Tz=-0.7),
    "pair": ProcessModel(K=3.0, T=2.0, L=0.3, zeta=0.2, Tz=0.4),
    "right pair": TransferFunction([0.5, -0.8, 2.0], [1.0, 3.5, 3.5, 1.0], L=0.2),
    "no delay": TransferFunction([-0.5, 2.0], [1.0, 3.0, 3.0, 1.0]),
}


@pytest.fixture(params=PLANTS)
def plant(request):
    """Give one plant after the other."""
    return PLANTS[request.param]


def numbers(plant):
    """Give num, den, L of the plant."""
    G = plant if isinstance(plant, TransferFunction) else plant.transfer()
    return G.num, G.den, G.L


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("order", [None, 1, 3])
def test_the_parts_make_up_the_design(plant, mirror, order):
    """(3.6-6), (3.6-9), (3.6-11) to (3.6-13); G_+ has gain 1, and with mirrors modulus 1."""
    design = imc(plant, 0.6, order=order, mirror=mirror)
    minus, plus = design.invertible.freqresp(W), design.non_invertible.freqresp(W)
    np.testing.assert_allclose(minus * plus, plant.freqresp(W), rtol=1e-9)
    np.testing.assert_allclose(
        design.filter.freqresp(W), (1 + 0.6j * W) ** -design.order, rtol=1e-12
    )
    np.testing.assert_allclose(
        design.controller.freqresp(W) * minus, design.filter.freqresp(W), rtol=1e-9
    )
    np.testing.assert_allclose(
        design.closed_loop.freqresp(W), design.filter.freqresp(W) * plus, rtol=1e-12
    )
    assert design.non_invertible.dc_gain() == approx(1.0)
    assert (design.invertible.zeros().real <= 0).all()
    if mirror:
        np.testing.assert_allclose(abs(plus), 1.0, rtol=1e-9)
    if order is None:
        assert design.proper
        if design.order > 1:
            assert not imc(plant, 0.6, order=design.order - 1, mirror=mirror).proper


@pytest.mark.parametrize("mirror", [False, True])
def test_the_classic_controller_is_that_of_the_oracle(plant, mirror):
    """(3.6-15), with the exact dead time."""
    design = imc(plant, 0.6, mirror=mirror)
    C = oracle.controller(*numbers(plant), T_F=0.6, gamma=design.order, allpass=mirror)
    np.testing.assert_allclose(design.classic_freqresp(W), C(1j * W), rtol=1e-6)
    assert (design.classic is None) == (plant.L > 0)
    if design.classic is not None:
        np.testing.assert_allclose(design.classic.freqresp(W), C(1j * W), rtol=1e-6)
        assert design.classic.den[-1] == 0.0  # integral action, exactly


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_with_a_rational_delay_the_loop_closes_on_its_own_model(plant, delay, mirror):
    """C G / (1 + C G) = C_F G_+ where G = G_- G_+ is the approximated plant."""
    design = imc(plant, 0.6, delay=delay, mirror=mirror)
    G = design.invertible.freqresp(W) * design.non_invertible.freqresp(W)
    x = 1j * W * plant.L
    near = 1 - x if delay == "taylor" else (1 - x / 2) / (1 + x / 2)
    np.testing.assert_allclose(G, plant.freqresp(W) * np.exp(x) * near, rtol=1e-9)
    L = design.classic.freqresp(W) * G
    np.testing.assert_allclose(L / (1 + L), design.closed_loop.freqresp(W), rtol=1e-7)


@pytest.mark.parametrize("delay, rule", [("taylor", imc_pi), ("pade", imc_pid)])
def test_of_one_lag_the_classic_controllers_are_pi_and_pid(delay, rule):
    """(3.6-17) as corrected, and (3.6-21), of order 1."""
    model = PLANTS["one lag"]
    C = imc(model, 0.9, order=1, delay=delay).classic
    pid = rule(model, tau_c=0.9).controller
    s = 1j * W
    np.testing.assert_allclose(
        C.freqresp(W), pid.Kp * (1 + 1 / (pid.Ti * s) + pid.Td * s), rtol=1e-11
    )


def test_of_an_integrator_the_classic_controller_is_lambda_tuning():
    model = ProcessModel(K=0.4, T=(), L=1.5, integrating=True)
    C = imc(model, 2.0, delay="taylor").classic
    pid = pt.tune.lambda_(model, 2.0).controller
    np.testing.assert_allclose(C.freqresp(W), pid.Kp * (1 + 1 / (pid.Ti * 1j * W)), rtol=1e-11)


@pytest.mark.parametrize("T, delay", [((), "pade"), (3.0, "taylor")], ids=["alone", "with a lag"])
def test_of_an_integrator_the_lambda_pid_is_a_classic_controller_too(T, delay):
    """Seborg's table 12.1, rows N and O, follow from a filter of order 2."""
    model = ProcessModel(K=0.4, T=T, L=1.5, integrating=True)
    C = imc(model, 2.0, order=2, delay=delay).classic
    pid = pt.tune.lambda_(model, 2.0, controller="PID").controller
    s = 1j * W
    np.testing.assert_allclose(
        C.freqresp(W), pid.Kp * (1 + 1 / (pid.Ti * s) + pid.Td * s), rtol=1e-11
    )


@pytest.mark.parametrize("Tz", [0.0, -0.7])
@pytest.mark.parametrize("mirror", [False, True])
def test_loads_on_an_integrating_plant_die_out(Tz, mirror):
    """1 - C_F G_+ has two zeros at 0, so that G (1 - C_F G_+), from load to output, has one."""
    model = ProcessModel(K=0.4, T=3.0, L=1.5, Tz=Tz, integrating=True)
    design = imc(model, 2.0, mirror=mirror)
    w = np.array([1e-4])
    rest = model.freqresp(w) * (1 - design.closed_loop.freqresp(w))
    assert abs(rest[0]) < 1e-2 and design.proper
    assert design.closed_loop.dc_gain() == approx(1.0)


def test_the_loop_answers_as_the_source_says():
    """(3.6-62): y = 1 - e^(-(t - L)/T_F) from L on."""
    t = np.array([0.5, 0.8, 1.0, 3.0])
    y = imc(PLANTS["one lag"], 0.6).closed_loop.step(t)
    assert y == approx([0.0, 0.0, *(1 - np.exp(-(t[2:] - 0.8) / 0.6))], abs=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: imc(PLANTS["one lag"], 0.0),
        lambda: imc(PLANTS["one lag"], 1.0, order=0),
        lambda: imc(PLANTS["one lag"], 1.0, delay="none"),
        lambda: imc(pt.models.PolyModel(A=[1, -0.5], B=[1], nk=1, Ts=1.0), 1.0),
        lambda: imc_costs(PLANTS["two lags"], 1.0),
        lambda: imc_costs(PLANTS["one lag"], -1.0),
        lambda: imc_costs(PLANTS["one lag"], 1.0, loop="open"),
    ],
)
def test_wrong_arguments_are_refused(wrong):
    with pytest.raises(pt.UsageError) as refusal:
        wrong()
    assert refusal.value.code == "U01"


@pytest.mark.parametrize(
    "num, den, code",
    [
        ([1.0], [1.0, -2.0], "M02"),
        ([1.0], [1.0, 0.0, 4.0], "M02"),
        ([1.0], [1.0, 0.0, 0.0], "M01"),
        ([1.0, 0.0], [1.0, 2.0, 1.0], "M12"),
    ],
)
def test_what_cannot_be_inverted_is_refused(num, den, code):
    with pytest.raises(pt.NotIdentifiable) as refusal:
        imc(TransferFunction(num, den), 1.0)
    assert refusal.value.code == code


# --- costs ---


@pytest.mark.parametrize("A_M", [2.0, 3.0, 4.3, 1000.0])
def test_costs_of_the_pi_are_those_of_exact_arithmetic(A_M):
    """Times in L; at 4.27 the overshoot ends, k = 1/e."""
    L = 2.5
    found = imc_costs(ProcessModel(K=1.0, T=1.0, L=L), (2 * A_M / pi - 1) * L)
    assert found.ise == approx(L * oracle.pi_delay_ise(A_M), rel=1e-12)
    if A_M > exp(1) * pi / 2:  # no overshoot: IAE is the integral of e
        k = pi / (2 * A_M)
        assert (found.iae, found.itae) == approx((L / k, L**2 * (1 - k) / k**2), rel=1e-12)
    else:
        exact = oracle.pi_delay_costs(A_M)  # cut off after 50 L
        assert (found.iae / L, found.itae / L**2) == approx((exact.iae, exact.itae), rel=1e-9)


@given(L=st.floats(0.0, 50.0), tau_c=st.floats(0.01, 50.0))
def test_costs_of_the_ideal_loop_are_the_closed_forms(L, tau_c):
    """(3.6-64) to (3.6-66)."""
    found = imc_costs(ProcessModel(K=-3.0, T=2.0, L=L), tau_c, loop="ideal")
    assert (found.ise, found.iae, found.itae) == approx(oracle.costs(L, tau_c), rel=1e-12)


def test_costs_are_those_of_the_simulated_loop():
    """Its straight line between nodes costs about 1e-5."""
    model = ProcessModel(K=-5.939, T=0.1491, L=0.1)
    tuning = imc_pi(model, gain_margin=3)
    found = imc_costs(model, tuning.tau_c)
    indices = pt.simulate.step(model, tuning.controller, t_end=3.0).indices
    assert (found.ise, found.iae, found.itae) == approx(
        (indices.ise, indices.iae, indices.itae), rel=1e-4
    )
