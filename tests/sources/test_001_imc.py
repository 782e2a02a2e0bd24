"""Source 001, 3.4.8 and 3.6: internal model control as corrected, equation by equation."""

from functools import partial
from math import pi, radians

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import imc as oracle
from plantune.models import ProcessModel
from plantune.tune import imc, imc_costs, imc_pi, imc_pid, precontrol

K, T, L = 5.939, 0.1491, 0.1  # operating point 1; the text prints magnitudes
OP1 = ProcessModel(K, T, L)
W = np.geomspace(0.1, 100.0, 25)


def test_the_structure_follows_the_set_point_as_its_filter_says():
    """(3.6-1) to (3.6-4), (3.6-8), (3.6-13): with G* = G the loop is C_imc G = C_F G_+."""
    design = imc(OP1, 0.2)
    C, G = design.controller.freqresp(W), OP1.freqresp(W)
    answer = oracle.responses(C, G, G)
    np.testing.assert_allclose(answer["Y/R"], design.closed_loop.freqresp(W), rtol=1e-12)
    np.testing.assert_allclose(answer["U/R"], C, rtol=1e-12)
    # The classic controller does the same to any other plant: (3.6-14).
    other = ProcessModel(1.2 * K, T, 1.1 * L).freqresp(W)
    loop = design.classic_freqresp(W) * other
    np.testing.assert_allclose(oracle.responses(C, other, G)["Y/R"], loop / (1 + loop), rtol=1e-10)


@pytest.mark.parametrize("order", [1, 2, 5])
def test_the_filter_has_order_gamma(order):
    """(3.6-9), (3.6-10): y / r = 1 / (T_F s + 1)^gamma where all can be inverted."""
    plant = ProcessModel(K, (T, 0.05))
    design = imc(plant, 0.2, order=order)
    np.testing.assert_allclose(design.closed_loop.freqresp(W), (1 + 0.2j * W) ** -order, rtol=1e-12)
    assert design.proper == (order >= 2)  # (3.6-5): the ideal controller is not proper


def test_the_taylor_delay_gives_the_pi():
    """(3.6-16) to (3.6-19), with T s + 1 in the plant."""
    design = imc(OP1, 0.2, order=1, delay="taylor")
    assert str(design.non_invertible) == "G(s) = (-0.1 s + 1)"
    pid = imc_pi(OP1, tau_c=0.2).controller
    assert (pid.Kp, pid.Ti) == approx((T / (K * (0.2 + L)), T))
    assert design.classic.num / design.classic.den[0] == approx([pid.Kp, pid.Ki])


def test_the_pade_delay_gives_the_pid():
    """(3.6-20) to (3.6-24)."""
    design = imc(OP1, 0.2, order=1, delay="pade")
    assert design.invertible.den == approx([T * L / 2, T + L / 2, 1.0])
    pid = imc_pid(OP1, tau_c=0.2).controller
    assert (pid.Kp, pid.Ti, pid.Td) == approx(
        ((2 * T + L) / (K * (0.4 + L)), T + L / 2, T * L / (2 * T + L))
    )
    assert design.classic.num / design.classic.den[0] == approx([pid.Kd, pid.Kp, pid.Ki])


def test_the_open_loops_are_those_of_the_source():
    """(3.6-32) and (3.6-47)."""
    of = pt.tune.sensitivities
    pi_ = of(OP1, imc_pi(OP1, tau_c=0.2).controller, W).L
    np.testing.assert_allclose(pi_, np.exp(-1j * W * L) / (1j * W * 0.3), rtol=1e-12)
    pid = of(OP1, imc_pid(OP1, tau_c=0.2).controller, W).L
    np.testing.assert_allclose(
        pid, (W * L - 2j) * np.exp(-1j * W * L) / (W * (0.4 + L)), rtol=1e-12
    )


def test_gain_margin_3_and_phase_margin_60():
    """(3.6-45) for the PI; the PID by (3.6-48) to (3.6-53)."""
    assert imc_pi(OP1, gain_margin=3).tau_c == approx((6 / pi - 1) * L)
    by_gain, by_phase = imc_pid(OP1, gain_margin=3), imc_pid(OP1, phase_margin=60)
    assert by_gain.tau_c / L == approx(oracle.T_F_pid(1.0, gain_margin=3), rel=1e-9)
    assert by_phase.tau_c / L == approx(oracle.T_F_pid(1.0, phase_margin=radians(60)), rel=1e-9)


def test_costs_at_gain_margin_3():
    """(3.6-68) to (3.6-70) for the ideal loop, ITAE as corrected; and the true ones of the PI."""
    tau_c = imc_pi(OP1, gain_margin=3).tau_c
    ideal, true = (imc_costs(OP1, tau_c, loop=loop) for loop in ("ideal", "pi"))
    assert (ideal.ise, ideal.iae, ideal.itae) == approx(oracle.costs_gain_margin_3(L), rel=1e-12)
    assert ideal.itae / L**2 == approx(2.2377, abs=5e-5)
    assert (true.ise / L, true.iae / L) == approx((1.6539867, 2.1378556), rel=1e-5)
    assert true.itae / L**2 == approx(2.8556536, rel=1e-5)


@pytest.mark.parametrize("rule", [imc_pi, partial(imc_pid, N=10)])
def test_the_controller_ends_at_the_pre_control(rule):
    """(3.4-48) to (3.4-53): r_ss / K, for the PI and the PID alike."""
    u = pt.simulate.step(OP1, rule(OP1, gain_margin=4).controller, t_end=8.0).u
    assert u[-1] == approx(precontrol(OP1, 1.0), rel=1e-6)


def test_the_cost_of_a_trajectory_is_the_sum_of_the_text():
    """(3.6-57) to (3.6-60): the set point for a nominal trajectory, the first seconds alone."""
    model = pt.models.ProcessModel(5.939, 0.1491, 0.1)
    pid = pt.tune.imc_pi(model, gain_margin=3).controller
    run = pt.simulate.closed_loop(model, pid, np.ones(100), Ts=0.02)
    ours = pt.tune.tracking_cost(run.r, run.y, Ts=0.02, T_J=0.4)
    assert ours == approx(0.02 * np.sum((run.r - run.y)[1:21] ** 2))
    whole = pt.tune.tracking_cost(run.r, run.y, Ts=0.02)
    assert whole == approx(run.indices.ise, abs=0.011)  # half a step of the first error
    with pytest.raises(pt.UsageError):
        pt.tune.tracking_cost([1.0, 2.0], [1.0], Ts=0.02)
