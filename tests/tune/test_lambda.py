"""Lambda tuning: IMC-PI by another name, and the IMC-PID of a Padé delay."""

from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx
from scipy.optimize import brentq

import plantune as pt
from plantune.tune import imc_pi, lambda_


@given(T=st.floats(0.01, 100.0), ratio=st.floats(0.01, 20.0), speed=st.floats(0.1, 10.0))
def test_the_pi_is_imc_pi(T, ratio, speed):
    plant = pt.models.ProcessModel(K=-2.0, T=T, L=ratio * T)
    ours, imc = lambda_(plant, speed * T), imc_pi(plant, tau_c=speed * T)
    assert ours.controller == imc.controller and ours.tau_c == imc.tau_c == speed * T


@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_without_a_wish_the_loop_is_three_times_slower_than_the_plant(controller):
    plant = pt.models.ProcessModel(K=2.0, T=10.0, L=2.0)
    default, given_ = (lambda_(plant, wish, controller=controller) for wish in (None, 30.0))
    assert default.controller == given_.controller and default.tau_c == 30.0
    assert (default.rule[-3:], given_.rule[-2:]) == ("3 T", "30")


@pytest.mark.parametrize("speed", [0.8, 1.0, 3.0])
@pytest.mark.parametrize("ratio", [0.01, 0.3, 1.0, 4.0, 30.0])
def test_the_pid_cancels_the_plant_and_the_pade_delay(ratio, speed):
    """C G = e^(-Ls) / (s (tau_c + L/2)) (1 + L s / 2), but for the filter."""
    K, T, L = -2.0, 5.0, 5.0 * ratio
    tau_c = speed * L
    pid = lambda_(pt.models.ProcessModel(K=K, T=T, L=L), tau_c, controller="PID").controller
    s = 1j * np.geomspace(1e-3, 1e2, 50) / L
    ours = pid.Kp * (1 + 1 / (pid.Ti * s) + pid.Td * s) * K / (T * s + 1)
    np.testing.assert_allclose(ours, (1 + L * s / 2) / (s * (tau_c + L / 2)), rtol=1e-11)
    assert pid.Tf == approx(pid.Td / 10, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.01, 0.3, 1.0, 4.0, 30.0])
@pytest.mark.parametrize("speed", [0.8, 1.0, 3.0])
def test_gain_margins_are_those_of_the_cancelled_loop(ratio, speed):
    """PI: pi (tau_c + L) / (2 L).  PID: at x - atan(x/2) = pi/2, x = w L; the filter takes 10 %."""
    L = 5.0 * ratio
    plant = pt.models.ProcessModel(K=-2.0, T=5.0, L=L)
    pi_, pid = (lambda_(plant, speed * L, controller=c) for c in ("PI", "PID"))
    assert pi_.margins.gain == approx(pi * (speed + 1) / 2, rel=1e-9)
    x = brentq(lambda x: x - np.arctan(x / 2) - pi / 2, 1.0, 4.0)
    assert pid.margins.gain == approx((speed + 0.5) * x / sqrt(1 + x**2 / 4), rel=0.1)
    assert pi_.margins.stable and pid.margins.stable


def test_the_range_of_the_pid_is_noted():
    """Rivera, Morari and Skogestad 1986: tau_c above 0.8 L."""
    plant = pt.models.ProcessModel(K=2.0, T=1.0, L=10.0)
    note = lambda_(plant, 7.9, controller="PID").notes[0]
    assert (note.code, note.measured, note.limit) == ("T02", 0.79, 0.8)
    for tuning in (lambda_(plant, 8.0, controller="PID"), lambda_(plant, 7.9)):
        assert "T02" not in [note.code for note in tuning.notes]


def test_a_plant_without_delay_is_served():
    plant = pt.models.ProcessModel(K=2.0, T=5.0, L=0.0)
    for controller in ("PI", "PID"):
        tuning = lambda_(plant, 2.5, controller=controller)
        pid = tuning.controller
        assert (pid.Kp, pid.Ti, pid.Td, tuning.notes) == (1.0, 5.0, 0.0, ())


@pytest.mark.parametrize("tau_c", [-1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_impossible_wishes_are_refused(tau_c, controller):
    with pytest.raises(pt.UsageError) as refusal:
        lambda_(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0), tau_c, controller=controller)
    assert refusal.value.code == "U01"


@pytest.mark.parametrize("K, T", [(0.0, 1.0), (1.0, -1.0)])
def test_unrealistic_models_are_not_tuned(K, T):
    with pytest.raises(pt.NotIdentifiable) as refusal:
        lambda_(pt.models.ProcessModel(K=K, T=T, L=0.1), 1.0)
    assert refusal.value.code == "M12"


@given(T1=st.floats(0.1, 50.0), ratio=st.floats(0.02, 1.0), L=st.floats(0.0, 10.0))
def test_two_lags_are_cancelled(T1, ratio, L):
    """C G = e^(-Ls) / (s (tau_c + L)), but for the filter; tau_c = 3 T1 by default."""
    T2 = ratio * T1
    tuning = lambda_(pt.models.ProcessModel(K=-2.0, T=(T2, T1), L=L), controller="PID")
    pid, a = tuning.controller, 3 * T1 + L
    assert tuning.tau_c == approx(3 * T1, rel=1e-9)
    assert (pid.Kp, pid.Ti, pid.Td) == approx(
        ((T1 + T2) / (-2.0 * a), T1 + T2, T1 * T2 / (T1 + T2)), rel=1e-9
    )


@pytest.mark.parametrize("T", [0.0, 0.7, 20.0])
@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_integrating_plants_get_the_settings_of_chien_and_fruehauf(controller, T):
    """As in table 12.1 of Seborg, Edgar, Mellichamp and Doyle, rows M, N and O, c = tau_c."""
    K, L, c = 0.4, 1.5, 4.0
    times = (T,) if T else ()
    plant = pt.models.ProcessModel(K=K, T=times, L=L, integrating=True)
    pid = lambda_(plant, c, controller=controller).controller
    if controller == "PI":
        L += T / 2  # the half rule
        printed = ((2 * c + L) / (K * (c + L) ** 2), 2 * c + L, 0.0)
    elif T == 0:
        printed = (
            (2 * c + L) / (K * (c + L / 2) ** 2),
            2 * c + L,
            (c * L + L**2 / 4) / (2 * c + L),
        )
    else:
        Ti = 2 * c + T + L
        printed = (Ti / (K * (c + L) ** 2), Ti, (2 * c + L) * T / Ti)
    assert (pid.Kp, pid.Ti, pid.Td) == approx(printed, rel=1e-12)


def test_by_default_an_integrating_plant_is_arrested_in_three_dead_times():
    plant = pt.models.ProcessModel(K=0.4, T=(), L=1.5, integrating=True)
    tuning = lambda_(plant)
    assert tuning.tau_c == 4.5 and tuning.rule == "lambda, tau_c = 3 L"
    assert tuning.margins.stable and tuning.margins.Ms < 1.65
