"""IMC-PID: the formulas of source 001, 3.6.5, margins met exactly, and second-order plants."""

from math import atan, hypot, inf, pi, radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from oracles import imc as oracle
from plantune.models import ProcessModel
from plantune.tune import imc_pi, imc_pid

gains = st.one_of(st.floats(0.01, 100.0), st.floats(-100.0, -0.01))
times = st.floats(0.05, 50.0)
OP1 = ProcessModel(K=-5.939, T=0.1491, L=0.1)


@given(K=gains, T=times, L=times, speed=st.floats(0.2, 10.0))
def test_settings_are_those_of_the_source(K, T, L, speed):
    """(3.6-22) to (3.6-24)."""
    pid = imc_pid(ProcessModel(K=K, T=T, L=L), tau_c=speed * L).controller
    assert (pid.Kp, pid.Ti, pid.Td) == approx(oracle.pid(K, T, L, speed * L), rel=1e-12)
    assert pid.Tf == 0.0


@given(K=gains, T=times, L=times, A_M=st.floats(1.05, 20.0))
def test_gain_margin_is_met(K, T, L, A_M):
    """(3.6-48) to (3.6-50); the loop's margins come from a search of their own."""
    tuning = imc_pid(ProcessModel(K=K, T=T, L=L), gain_margin=A_M)
    assert tuning.tau_c == approx(oracle.T_F_pid(L, gain_margin=A_M), rel=1e-9)
    gain, w_gain, phase, _ = oracle.margins_pid(L, tuning.tau_c)
    assert (tuning.margins.gain, tuning.margins.w_gain) == approx((gain, w_gain), rel=1e-9)
    assert gain == approx(A_M, rel=1e-9) and tuning.margins.stable
    assert radians(tuning.margins.phase_deg) == approx(phase, rel=1e-7)


@given(K=gains, T=times, L=times, degrees=st.floats(1.0, 88.0))
def test_phase_margin_is_met(K, T, L, degrees):
    """(3.6-51) to (3.6-53)."""
    tuning = imc_pid(ProcessModel(K=K, T=T, L=L), phase_margin=degrees)
    assert tuning.margins.phase_deg == approx(degrees, rel=1e-7)
    assert tuning.margins.w_phase == approx(1 / (tuning.tau_c * (tuning.tau_c + L)) ** 0.5)
    assert tuning.tau_c == approx(oracle.T_F_pid(L, phase_margin=radians(degrees)), rel=1e-7)


def test_the_known_numbers_at_operating_point_1():
    """Corrections to source 001: 1.433589 L and 74.3 degrees; 60 degrees needs 0.637557 L."""
    by_gain, by_phase = imc_pid(OP1, gain_margin=3), imc_pid(OP1, phase_margin=60)
    assert by_gain.tau_c == approx(0.1433589, abs=5e-8)
    assert by_gain.margins.w_gain * 0.1 == approx(2.458714, abs=5e-7)
    assert by_gain.margins.phase_deg == approx(74.3, abs=0.05)
    assert by_phase.tau_c == approx(0.0637557, abs=5e-8)


@given(
    K=gains,
    T1=times,
    ratio=st.floats(0.02, 1.0),
    L=times,
    A_M=st.floats(1.7, 6.0),
    pair=st.booleans(),
)
def test_second_order_plants_have_the_margins_of_imc_pi(K, T1, ratio, L, A_M, pair):
    """The cancelled loop is e^(-Ls)/(a s) for two lags and for a damped pair."""
    plant = (
        ProcessModel(K=K, T=T1, L=L, zeta=0.9 * ratio)
        if pair
        else ProcessModel(K=K, T=(T1, ratio * T1), L=L)
    )
    tuning = imc_pid(plant, gain_margin=A_M)
    alone = imc_pi(ProcessModel(K=K, T=1.0, L=L), gain_margin=A_M)
    p, q = (1.8 * ratio * T1, T1**2) if pair else (T1 * (1 + ratio), ratio * T1**2)
    a = alone.tau_c + L
    pid = tuning.controller
    assert (pid.Kp, pid.Ti, pid.Td) == approx((p / (K * a), p, q / p), rel=1e-8)
    assert tuning.tau_c == approx(alone.tau_c, rel=1e-8)
    m = tuning.margins
    assert (m.gain, m.w_gain, m.phase_deg) == approx(
        (A_M, pi / (2 * L), alone.margins.phase_deg), rel=1e-7
    )
    assert m.stable and not [note for note in tuning.notes if note.code == "T05"]


@given(T1=times, T2=times, L=st.one_of(st.just(0.0), times), b=times, A_M=st.floats(1.8, 6.0))
def test_an_inverse_response_stays_in_the_loop(T1, T2, L, b, A_M):
    """(1 - b s) e^(-Ls)/(a s): atan(b w) + w L = pi/2, A_M = a w / sqrt(1 + (b w)^2)."""
    tuning = imc_pid(ProcessModel(K=-2.0, T=(T1, T2), L=L, Tz=-b), gain_margin=A_M)
    a, m = tuning.tau_c + L + b, tuning.margins
    assert m.stable
    if L == 0.0:  # the phase comes to -180 degrees beyond all frequencies
        assert a == approx(A_M * b, rel=1e-9) and m.gain == inf
        return
    assert m.gain == approx(A_M, rel=1e-7)
    w = m.w_gain
    assert atan(b * w) + w * L == approx(pi / 2, rel=1e-7)
    assert a * w / hypot(1, b * w) == approx(A_M, rel=1e-7)


@pytest.mark.parametrize("degrees", [45.0, 60.0, 80.0])
@pytest.mark.parametrize("L, b", [(1.0, 0.0), (1.0, 0.5), (0.01, 2.0), (0.0, 2.0)])
def test_phase_margin_of_second_order_is_met(L, b, degrees):
    tuning = imc_pid(ProcessModel(K=3.0, T=(5.0, 2.0), L=L, Tz=-b), phase_margin=degrees)
    assert tuning.margins.phase_deg == approx(degrees, rel=1e-7) and tuning.margins.stable


@given(T1=times, T2=times, share=st.floats(0.05, 1.0), above=st.booleans(), L=times)
def test_a_zero_to_the_left_is_cancelled_by_the_filter(T1, T2, share, above, L):
    """Where a PID can: Tz up to the smaller lag, or from the larger one to their sum."""
    small, large = sorted((T1, T2))
    Tz = large + 0.95 * share * small if above else share * small
    plant = ProcessModel(K=2.0, T=(T1, T2), L=L, Tz=Tz)
    tuning = imc_pid(plant, tau_c=L)
    w = np.geomspace(1e-2, 1e2, 30) / L
    loop = pt.tune.sensitivities(plant, tuning.controller, w).L
    np.testing.assert_allclose(loop, np.exp(-1j * w * L) / (2j * w * L), rtol=1e-8)
    assert not [note for note in tuning.notes if note.code == "T05"]


@pytest.mark.parametrize("wish", [{"gain_margin": 3.0}, {"phase_margin": 60.0}])
@pytest.mark.parametrize("T, Tz", [(0.1, 0.0), (5.0, 0.0), ((5.0, 2.0), 0.0), ((5.0, 2.0), -0.4)])
@pytest.mark.parametrize("N", [5.0, 20.0])
def test_with_a_filter_the_margin_is_met_by_another_tau_c(T, Tz, N, wish):
    plant = ProcessModel(K=-3.0, T=T, L=0.7, Tz=Tz)
    bare, ours = imc_pid(plant, **wish), imc_pid(plant, **wish, N=N)
    pid, m = ours.controller, ours.margins
    met = m.gain if "gain_margin" in wish else m.phase_deg
    assert met == approx(*wish.values(), rel=1e-7) and m.stable
    assert pid.Tf == approx(pid.Td / N, rel=1e-12)
    if T != 0.1:  # there the filter takes gain rather than phase
        assert bare.tau_c < ours.tau_c < 2 * bare.tau_c + 0.7
    free = imc_pid(plant, tau_c=ours.tau_c, N=N).controller
    assert (free.Kp, free.Tf) == approx((pid.Kp, pid.Tf), rel=1e-9)


def test_more_lags_are_reduced_to_two():
    G = ProcessModel(K=1.0, T=(4.0, 2.0, 1.0, 0.5), L=0.3)
    tuning = imc_pid(G, gain_margin=3)
    two = imc_pid(pt.tune.half_rule(G, 2), gain_margin=3)
    assert tuning.controller == two.controller and tuning.model is G
    assert [note.code for note in tuning.notes] == ["T05"]


@pytest.mark.parametrize(
    "plant, wish",
    [
        (OP1, {"gain_margin": 1.0}),
        (OP1, {"phase_margin": 0.0}),
        (OP1, {"phase_margin": 90.0}),
        (OP1, {"tau_c": -0.1}),
        (OP1, {"tau_c": 0.1, "N": 0.0}),
        (OP1, {"gain_margin": 3, "tau_c": 0.1}),
        (ProcessModel(K=1.0, T=(2.0, 1.0), L=1.0), {"gain_margin": 1.5}),  # below pi/2
        (ProcessModel(K=1.0, T=(2.0, 1.0), L=1.0), {"phase_margin": 30.0}),  # below 32.7
    ],
)
def test_wishes_out_of_reach_are_refused(plant, wish):
    with pytest.raises(pt.UsageError) as refusal:
        imc_pid(plant, **wish)
    assert refusal.value.code == "U01"


def test_a_margin_asked_of_a_plant_without_delay_is_refused():
    for T in (2.0, (2.0, 1.0)):
        with pytest.raises(pt.NotIdentifiable) as refusal:
            imc_pid(ProcessModel(K=1.0, T=T), phase_margin=60)
        assert refusal.value.code == "M12" and "tau_c" in refusal.value.remedy
    assert imc_pid(ProcessModel(K=1.0, T=(2.0, 1.0)), tau_c=0.5).controller.Kp == approx(6.0)
