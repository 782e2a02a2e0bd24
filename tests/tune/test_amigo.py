"""AMIGO: the printed forms, the robustness it was fitted for, and its limit for integrators."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.tune import amigo

RATIOS = (0.001, 0.01, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0)  # L / T


@pytest.mark.parametrize(
    "controller, Kp, Ki, Ms, iae",
    [("PI", 0.0528, 0.373, 1.22, 2.68), ("PID", 0.1466, 1.058, 1.44, 1.04)],
)
def test_amigo_at_operating_point_1(controller, Kp, Ki, Ms, iae):
    """METHODS 3.1, to the digits printed there."""
    plant = pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1)
    tuning = amigo(plant, controller=controller)
    pid = tuning.controller
    assert -pid.Kp == approx(Kp, abs=5e-5) and -pid.Kp / pid.Ti == approx(Ki, abs=5e-4)
    assert tuning.margins.Ms == approx(Ms, abs=6e-3)
    assert pt.simulate.load_step(plant, pid).indices.iae == approx(iae, abs=6e-3)


@given(K=st.floats(0.01, 100.0), T=st.floats(0.01, 100.0), ratio=st.floats(0.01, 20.0))
def test_amigo_is_the_printed_form(K, T, ratio):
    """Astrom and Hagglund 2006, chapter 7, as printed."""
    L = ratio * T
    plant = pt.models.ProcessModel(K=K, T=T, L=L)
    pi, pid = (amigo(plant, controller=c).controller for c in ("PI", "PID"))
    assert pi.Kp == approx(0.15 / K + (0.35 - L * T / (L + T) ** 2) * T / (K * L), rel=1e-9)
    assert pi.Ti == approx(0.35 * L + 13 * L * T**2 / (T**2 + 12 * L * T + 7 * L**2), rel=1e-12)
    assert pi.Td == 0
    assert pid.Kp == approx((0.2 + 0.45 * T / L) / K, rel=1e-12)
    assert pid.Ti == approx((0.4 * L + 0.8 * T) / (L + 0.1 * T) * L, rel=1e-12)
    assert pid.Td == approx(0.5 * L * T / (0.3 * L + T), rel=1e-12)
    assert pid.Tf == approx(pid.Td / 10, rel=1e-12)


def test_a_long_lag_gets_the_settings_of_an_integrator():
    """Those of the source for k e^(-Ls) / s, in units of 1 / (k L) and L."""
    plant = pt.models.ProcessModel(K=1e6, T=1e6, L=1.0)
    pi, pid = (amigo(plant, controller=c).controller for c in ("PI", "PID"))
    assert (pi.Kp, pi.Ti) == approx((0.35, 13.4), rel=5e-3)
    assert (pid.Kp, pid.Ti, pid.Td) == approx((0.45, 8.0, 0.5), rel=1e-4)


@pytest.mark.parametrize("controller", ["PI", "PID"])
@pytest.mark.parametrize("ratio", RATIOS)
def test_the_loop_is_robust_for_every_dead_time(controller, ratio):
    """Fitted for Ms = Mt = 1.4 over a batch of plants; this one plant comes within 0.2 of it."""
    tuning = amigo(pt.models.ProcessModel(K=3.0, T=2.0, L=2.0 * ratio), controller=controller)
    m = tuning.margins
    assert m.stable and 1.2 < m.Ms < 1.5 and m.Mt < 1.25
    assert m.gain > 3.1 and m.phase_deg > 57
    assert not tuning.notes


@given(K=st.floats(0.01, 100.0), L=st.floats(0.01, 100.0))
def test_integrators_get_the_printed_settings(K, L):
    """0.35 / (K L), 13.4 L as printed; 0.45 / (K L), 8 L, L / 2."""
    plant = pt.models.ProcessModel(K=K, T=(), L=L, integrating=True)
    pi, pid = (amigo(plant, controller=c).controller for c in ("PI", "PID"))
    assert (pi.Kp, pi.Ti) == approx((0.35 / (K * L), 13.4 * L), rel=4e-3)
    assert (pid.Kp, pid.Ti, pid.Td) == approx((0.45 / (K * L), 8 * L, L / 2), rel=1e-12)


@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_the_rule_for_integrators_is_the_limit_of_the_other(controller):
    tank = pt.models.ProcessModel(K=3.0, T=(), L=2.0, integrating=True)
    lag = pt.models.ProcessModel(K=3e7, T=1e7, L=2.0)
    ours, theirs = (amigo(plant, controller=controller).controller for plant in (tank, lag))
    assert (ours.Kp, ours.Ti, ours.Td) == approx((theirs.Kp, theirs.Ti, theirs.Td), rel=1e-5)
    margins = amigo(tank, controller=controller).margins
    assert margins.Ms == approx({"PI": 1.41, "PID": 1.45}[controller], abs=0.01)
