"""Improved SIMC: the printed forms, what it is for, and SIMC where the lag is long."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.tune import simc, simc_plus

RATIOS = (0.001, 0.05, 0.2, 1.0, 3.0, 20.0, 1000.0)  # L / T


@given(T=st.floats(0.01, 100.0), ratio=st.floats(0.01, 20.0), speed=st.floats(0.1, 10.0))
def test_the_pi_is_simc_of_a_lag_longer_by_a_third_of_the_delay(T, ratio, speed):
    L = ratio * T
    ours = simc_plus(pt.models.ProcessModel(K=-2.0, T=T, L=L), speed * L)
    theirs = simc(pt.models.ProcessModel(K=-2.0, T=T + L / 3, L=L), speed * L)
    assert ours.controller.Kp == approx(theirs.controller.Kp, rel=1e-12)
    assert ours.controller.Ti == approx(theirs.controller.Ti, rel=1e-12)


@given(T=st.floats(0.01, 100.0), ratio=st.floats(0.01, 20.0), speed=st.floats(0.1, 10.0))
def test_the_pid_is_simc_in_series_with_a_lead_of_a_third_of_the_delay(T, ratio, speed):
    L = ratio * T
    plant = pt.models.ProcessModel(K=-2.0, T=T, L=L)
    pid = simc_plus(plant, speed * L, controller="PID").controller
    pi = simc(plant, speed * L).controller
    s = 1j * np.geomspace(1e-3, 1e3, 30) / L
    ours = pid.Kp * (1 + 1 / (pid.Ti * s) + pid.Td * s)
    np.testing.assert_allclose(ours, pi.Kp * (1 + 1 / (pi.Ti * s)) * (1 + L / 3 * s), rtol=1e-11)
    assert pid.Tf == approx(pid.Td / 10, rel=1e-12)


def test_by_hand():
    """K = 2, T = 1, L = 3.  PI: 2 / (2 * 6), 2.  PID: Kc 1/9, t_I 1, t_D 1."""
    plant = pt.models.ProcessModel(K=2.0, T=1.0, L=3.0)
    pi, pid = (simc_plus(plant, controller=c) for c in ("PI", "PID"))
    assert (pi.controller.Kp, pi.controller.Ti, pi.tau_c) == approx((1 / 6, 2.0, 3.0))
    own = pid.controller
    assert (own.Kp, own.Ti, own.Td, pid.tau_c) == approx((2 / 9, 2.0, 0.5, 1.5))
    assert (pi.rule, pid.rule) == ("SIMC+, tau_c = L", "SIMC+ PID, tau_c = L / 2")


@pytest.mark.parametrize("controller, Ms", [("PI", 1.71), ("PID", 1.77)])
@pytest.mark.parametrize("ratio", RATIOS)
def test_the_loop_is_robust_for_every_dead_time(controller, Ms, ratio):
    tuning = simc_plus(pt.models.ProcessModel(K=3.0, T=2.0, L=2.0 * ratio), controller=controller)
    m = tuning.margins
    assert m.stable and 1.4 < m.Ms < Ms and m.gain > 2.4 and m.phase_deg > 46
    assert not tuning.notes


def test_both_reject_a_load_faster_than_simc_where_the_delay_dominates():
    """What they were made for; the plant of T = L / 20 under a unit load."""
    plant = pt.models.ProcessModel(K=1.0, T=0.05, L=1.0)
    iae = [
        pt.simulate.load_step(plant, tuning.controller, 30.0).indices.iae
        for tuning in (simc(plant), simc_plus(plant), simc_plus(plant, controller="PID"))
    ]
    assert iae[2] < 0.95 * iae[1] < 0.9 * iae[0]


def test_a_plant_without_delay_is_served_with_a_wish():
    plant = pt.models.ProcessModel(K=2.0, T=5.0, L=0.0)
    for controller in ("PI", "PID"):
        pid = simc_plus(plant, 0.5, controller=controller).controller
        assert (pid.Kp, pid.Ti, pid.Td) == (5.0, 2.0, 0.0)


@pytest.mark.parametrize("tau_c", [-1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_impossible_wishes_are_refused(tau_c, controller):
    with pytest.raises(pt.UsageError) as refusal:
        simc_plus(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0), tau_c, controller=controller)
    assert refusal.value.code == "U01"
