"""IMC-PI: settings and margins as the closed forms of source 001, 3.6.4 to 3.6.6."""

from math import pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from oracles import loop

gains = st.one_of(st.floats(0.01, 100.0), st.floats(-100.0, -0.01))
lags = st.floats(0.01, 100.0)
ratios = st.floats(0.05, 5.0)  # L / T


def plant(K, T, L):
    """Make K e^(-Ls) / (Ts + 1)."""
    return pt.models.ProcessModel(K=K, T=T, L=L)


def test_operating_point_1_gives_the_printed_settings():
    """Source 001, table 3.6-4; the text prints magnitudes."""
    tuning = pt.tune.imc_pi(plant(-5.939, 0.1491, 0.1), gain_margin=3)
    assert tuning.controller.Kp == approx(-0.1315, abs=5e-5)
    assert tuning.controller.Ti == approx(0.1491, rel=1e-12)
    assert tuning.margins.gain_db == approx(9.5424, abs=5e-5)
    assert tuning.margins.w_gain == approx(15.708, abs=5e-4)
    assert tuning.margins.phase_deg == approx(60.0, abs=1e-8)


# The margins come from a search: its roots are asked for to 1e-9.
@given(K=gains, T=lags, ratio=ratios, A_M=st.floats(1.7, 6.0))
def test_gain_margin_is_met(K, T, ratio, A_M):
    L = ratio * T
    tuning = pt.tune.imc_pi(plant(K, T, L), gain_margin=A_M)
    tau_c = (2 * A_M / pi - 1) * L  # (3.6-41)
    assert (tuning.controller.Kp, tuning.controller.Ti) == approx(
        loop.imc_pi(K, T, L, tau_c), rel=1e-12
    )
    m = tuning.margins
    assert m.gain == approx(A_M, rel=1e-9)
    assert m.w_gain == approx(pi / (2 * L), rel=1e-9)  # (3.6-33)
    assert radians(m.phase_deg) == approx(pi / 2 * (1 - 1 / A_M), rel=1e-9)  # (3.6-42)
    assert m.w_phase == approx(1 / (tau_c + L), rel=1e-9)  # (3.6-36)
    assert m.delay == approx(radians(m.phase_deg) / m.w_phase, rel=1e-9)


@given(K=gains, T=lags, ratio=ratios, phase=st.floats(33.0, 85.0))
def test_phase_margin_is_met(K, T, ratio, phase):
    L = ratio * T
    tuning = pt.tune.imc_pi(plant(K, T, L), phase_margin=phase)
    tau_c = (1 / (pi / 2 - radians(phase)) - 1) * L  # (3.6-43)
    assert tuning.controller.Kp == approx(T / (K * (tau_c + L)), rel=1e-10)
    assert tuning.margins.phase_deg == approx(phase, rel=1e-9)
    assert tuning.margins.gain == approx(1 / (1 - 2 / pi * radians(phase)), rel=1e-9)  # (3.6-44)


@given(K=gains, T=lags, ratio=ratios, speed=st.floats(0.1, 10.0))
def test_closed_loop_time_constant_is_taken_as_given(K, T, ratio, speed):
    L = ratio * T
    tuning = pt.tune.imc_pi(plant(K, T, L), tau_c=speed * L)
    assert tuning.controller.Kp == approx(T / (K * (speed * L + L)), rel=1e-12)  # (3.6-18)
    assert tuning.margins.gain == approx(pi * (speed + 1) / 2, rel=1e-9)  # (3.6-35)
    assert radians(tuning.margins.phase_deg) == approx(pi / 2 - 1 / (speed + 1), rel=1e-9)


def test_gain_margin_3_and_phase_margin_60_are_the_same_tuning():
    """Source 001, (3.6-45)."""
    model = plant(2.0, 5.0, 1.0)
    by_gain = pt.tune.imc_pi(model, gain_margin=3).controller
    by_phase = pt.tune.imc_pi(model, phase_margin=60).controller
    by_tau = pt.tune.imc_pi(model, tau_c=6 / pi - 1).controller
    assert (by_phase.Kp, by_phase.Ti) == approx((by_gain.Kp, by_gain.Ti), rel=1e-12)
    assert (by_tau.Kp, by_tau.Ti) == approx((by_gain.Kp, by_gain.Ti), rel=1e-12)


@given(K=gains, T=lags, ratio=ratios, scale=st.floats(1e-3, 1e3))
def test_units_of_gain_and_time_carry_over(K, T, ratio, scale):
    L = ratio * T
    plain = pt.tune.imc_pi(plant(K, T, L), gain_margin=3)
    gain = pt.tune.imc_pi(plant(scale * K, T, L), gain_margin=3)
    time = pt.tune.imc_pi(plant(K, scale * T, scale * L), gain_margin=3)
    assert gain.controller.Kp * scale == approx(plain.controller.Kp, rel=1e-12)
    assert time.controller.Ti / scale == approx(plain.controller.Ti, rel=1e-12)
    assert time.margins.delay / scale == approx(plain.margins.delay, rel=1e-9)
    assert (time.margins.Ms, gain.margins.Mt) == approx(
        (plain.margins.Ms, plain.margins.Mt), rel=1e-6
    )


@given(K=gains, T=lags, ratio=ratios)
def test_gain_and_controller_have_the_same_sign(K, T, ratio):
    assert pt.tune.imc_pi(plant(K, T, ratio * T), gain_margin=3).controller.Kp * K > 0


@pytest.mark.parametrize(
    "wish",
    [
        {"gain_margin": 1.2},  # below pi/2: (3.6-39)
        {"phase_margin": 20.0},  # below 32.7 degrees: (3.6-40)
        {"phase_margin": 90.0},
        {"tau_c": -0.1},
        {"gain_margin": 3, "tau_c": 0.1},  # two wishes
    ],
)
def test_wishes_out_of_reach_are_refused(wish):
    with pytest.raises(Exception) as refusal:
        pt.tune.imc_pi(plant(2.0, 5.0, 1.0), **wish)
    assert refusal.value.code == "U01"


@pytest.mark.parametrize("K, T, L", [(0.0, 1.0, 0.1), (1.0, 1.0, -0.1), (1.0, -1.0, 0.1)])
def test_unrealistic_models_are_not_tuned(K, T, L):
    """BAD_INPUTS M12; an unstable lag (T < 0) may be named M02."""
    with pytest.raises(Exception) as refusal:
        pt.tune.imc_pi(plant(K, T, L), gain_margin=3)
    assert refusal.value.code in ("M12", "M02", "U01")
