"""SIMC and both Ziegler-Nichols rules: formulas, signs, scales, and what every rule shares."""

from dataclasses import replace
from functools import partial
from math import inf, isnan, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt

OP1 = pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1)
PI_OR_PID = (
    pt.tune.amigo,
    pt.tune.chien_hrones_reswick,
    pt.tune.cohen_coon,
    pt.tune.simc_plus,
    pt.tune.tyreus_luyben,
    pt.tune.ziegler_nichols,
)
NEED_DELAY = (
    pt.tune.simc,
    pt.tune.refined_ziegler_nichols,
    *PI_OR_PID,
    *(partial(rule, controller="PID") for rule in PI_OR_PID),
)
PIS = (pt.tune.simc, pt.tune.refined_ziegler_nichols, pt.tune.lambda_, *PI_OR_PID)
RULES = (
    *NEED_DELAY,
    pt.tune.lambda_,
    partial(pt.tune.lambda_, controller="PID"),
    partial(pt.tune.imc_pid, gain_margin=3),
)
plants = st.builds(
    lambda K, T, ratio: pt.models.ProcessModel(K=K, T=T, L=ratio * T),
    st.one_of(st.floats(0.01, 100.0), st.floats(-100.0, -0.01)),
    st.floats(0.01, 100.0),
    st.floats(0.05, 5.0),
)


@pytest.fixture(scope="module")
def fit():
    """Fit the noisy engine."""
    return pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")


@given(plant=plants, speed=st.floats(0.1, 10.0))
def test_simc_has_the_gain_of_imc_and_the_shorter_integral_time(plant, speed):
    tau_c = speed * plant.L
    simc = pt.tune.simc(plant, tau_c)
    assert simc.controller.Kp == approx(pt.tune.imc_pi(plant, tau_c=tau_c).controller.Kp, rel=1e-12)
    assert simc.controller.Ti == approx(min(plant.T, 4 * (tau_c + plant.L)), rel=1e-12)
    assert simc.tau_c == tau_c


@given(plant=plants)
def test_simc_aims_at_the_dead_time_by_default(plant):
    default, given_ = pt.tune.simc(plant), pt.tune.simc(plant, plant.L)
    assert default.controller == given_.controller and default.tau_c == plant.L
    if plant.T <= 8 * plant.L:
        assert default.margins.gain == approx(pi, rel=1e-9)  # (3.6-35) with tau_c = L


def test_simc_at_operating_point_1():
    """METHODS 3.1: Kc 0.1255, Ms 1.59, IAE of a load step 1.19."""
    tuning = pt.tune.simc(OP1)
    assert abs(tuning.controller.Kp) == approx(0.1255, abs=5e-5)
    assert tuning.margins.Ms == approx(1.59, abs=5e-3)
    load = pt.simulate.load_step(OP1, tuning.controller)
    assert load.indices.iae == approx(1.19, abs=5e-3)


@given(plant=plants)
def test_ziegler_nichols_is_the_table(plant):
    pi, pid = (pt.tune.ziegler_nichols(plant, controller=c).controller for c in ("PI", "PID"))
    slope, L = plant.K / plant.T, plant.L
    assert (pi.Kp, pi.Ti, pi.Td) == approx((0.9 / (slope * L), 3 * L, 0), rel=1e-12)
    assert (pid.Kp, pid.Ti, pid.Td) == approx((1.2 / (slope * L), 2 * L, L / 2), rel=1e-12)
    assert pid.Tf == approx(pid.Td / 10, rel=1e-12)


@given(K=st.floats(0.01, 100.0), L=st.floats(0.01, 100.0))
def test_ziegler_nichols_of_an_integrator_takes_its_slope_for_the_rate(K, L):
    plant = pt.models.ProcessModel(K=-K, T=(), L=L, integrating=True)
    pi, pid = (pt.tune.ziegler_nichols(plant, controller=c).controller for c in ("PI", "PID"))
    assert (pi.Kp, pi.Ti) == approx((-0.9 / (K * L), 3 * L), rel=1e-12)
    assert (pid.Kp, pid.Ti, pid.Td) == approx((-1.2 / (K * L), 2 * L, L / 2), rel=1e-12)


@given(plant=plants)
def test_refined_ziegler_nichols_is_the_table(plant):
    Ku, Tu = plant.T / (plant.K * plant.L), 4 * plant.L  # (3.6-71), (3.6-72)
    k = Ku * plant.K
    pid = pt.tune.refined_ziegler_nichols(plant).controller
    assert pid.Kp == approx(5 * Ku / 6 * (12 + k) / (15 + 14 * k), rel=1e-12)
    assert pid.Ti == approx(Tu / 5 * (4 * k / 15 + 1), rel=1e-12)


@pytest.mark.parametrize("rule", RULES)
@settings(max_examples=25)
@given(plant=plants, scale=st.floats(1e-3, 1e3))
def test_units_of_gain_and_time_carry_over(rule, plant, scale):
    plain = rule(plant)
    gain = rule(replace(plant, K=-scale * plant.K))
    time = rule(replace(plant, T=scale * plant.T, L=scale * plant.L))
    assert -scale * gain.controller.Kp == approx(plain.controller.Kp, rel=1e-12)
    assert gain.controller.Ti == approx(plain.controller.Ti, rel=1e-12)
    assert time.controller.Ti / scale == approx(plain.controller.Ti, rel=1e-12)
    assert time.controller.Td / scale == approx(plain.controller.Td, rel=1e-12)
    assert time.margins.gain == approx(plain.margins.gain, rel=1e-9)
    assert plain.margins.stable and gain.margins.stable


@pytest.mark.parametrize("rule", NEED_DELAY)
def test_a_plant_without_delay_is_refused_with_a_way_out(rule):
    with pytest.raises(pt.NotIdentifiable) as refusal:
        rule(pt.models.ProcessModel(K=2.0, T=5.0, L=0.0))
    assert refusal.value.code == "M12" and "tau_c" in refusal.value.remedy
    served = rule(pt.models.ProcessModel(K=2.0, T=5.0, L=0.0), delay_at_least=0.1)
    assert served.notes[0].code == "T01" and served.model.L == 0.1


def test_simc_with_a_wish_serves_a_plant_without_delay():
    tuning = pt.tune.simc(pt.models.ProcessModel(K=2.0, T=5.0, L=0.0), 0.5)
    assert (tuning.controller.Kp, tuning.controller.Ti) == (5.0, 2.0)


@pytest.mark.parametrize("rule", NEED_DELAY)
@pytest.mark.parametrize("K, T, L", [(0.0, 1.0, 0.1), (1.0, 1.0, -0.1), (1.0, -1.0, 0.1)])
def test_unrealistic_models_are_not_tuned(rule, K, T, L):
    with pytest.raises(pt.NotIdentifiable) as refusal:
        rule(pt.models.ProcessModel(K=K, T=T, L=L))
    assert refusal.value.code == "M12"


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: pt.tune.simc(OP1, -0.1),
        lambda: pt.tune.simc(OP1, inf),
        lambda: pt.tune.ziegler_nichols(OP1, controller="P"),
        lambda: pt.tune.simc(pt.models.PolyModel(A=[1, -0.5], B=[1], nk=1, Ts=1.0)),
    ],
)
def test_wrong_arguments_are_refused(wrong):
    with pytest.raises(pt.UsageError) as refusal:
        wrong()
    assert refusal.value.code == "U01"


@pytest.mark.parametrize("rule", PIS)
def test_every_rule_carries_the_uncertainty_of_a_fit(rule, fit):
    tuning = rule(fit)
    assert list(tuning.bands) == ["gain", "phase_deg", "delay", "Ms", "Mt"]
    for name, (low, high) in tuning.bands.items():
        assert low <= getattr(tuning.margins, name) <= high, name  # Mt is 1 at least
    assert tuning.source == fit.source and tuning.model is fit.model


@pytest.mark.parametrize("rule", PIS)
def test_no_rule_tunes_on_a_gain_of_open_sign(rule, fit):
    unsure = replace(fit, sd=np.array([abs(fit.theta[0]), *fit.sd[1:]]))
    with pytest.raises(pt.NotIdentifiable) as refusal:
        rule(unsure)
    assert refusal.value.code == "X12"
    assert rule(unsure, limits=pt.Limits(X12=0.5)).notes[-1].code == "X12"  # the change is noted


def test_rules_that_aim_at_no_time_constant_say_so():
    assert isnan(pt.tune.ziegler_nichols(OP1).tau_c)
    assert isnan(pt.tune.refined_ziegler_nichols(OP1).tau_c)


def test_parameters_of_a_rule_are_in_its_name():
    assert pt.tune.simc(OP1, 0.25).rule == "SIMC, tau_c = 0.25"
    assert pt.tune.ziegler_nichols(OP1, controller="PID").rule == "Ziegler-Nichols PID"


def test_weak_margins_are_noted_against_the_limits():
    """C07; imc_pi(tau_c=0) has a gain margin of pi/2 and a phase margin of 32.7 degrees."""
    notes = pt.tune.imc_pi(OP1, tau_c=0.0).notes
    assert [(n.code, n.limit) for n in notes] == [("C07", 2.0), ("C07", 45.0)]
    assert [n.measured for n in notes] == approx([pi / 2, 32.7042], rel=1e-5)
    limits = pt.Limits(C07=1.5, C07_phase=30.0)
    notes = pt.tune.imc_pi(OP1, tau_c=0.0, limits=limits).notes
    assert [(n.code, n.severity) for n in notes] == [("C07", "info"), ("C07", "info")]
    assert not pt.tune.imc_pi(OP1, gain_margin=3).notes


def test_weak_margins_within_the_uncertainty_are_noted(fit):
    """The same nominal margins, and only the uncertain one is doubted."""
    at = pt.tune.imc_pi(fit, gain_margin=3).bands["gain"][0] - 0.01
    assert not pt.tune.imc_pi(fit, gain_margin=3, limits=pt.Limits(C07=at)).notes[:-1]
    weak = pt.tune.imc_pi(fit, gain_margin=3, limits=pt.Limits(C07=at + 0.02)).notes
    assert weak[0].severity == "warning" and "may be as low as" in weak[0].text
    assert not pt.tune.imc_pi(fit.model, gain_margin=3, limits=pt.Limits(C07=at + 0.02)).notes[:-1]
