"""What every rule shares beyond one lag: which plants it serves, signs, units, stability, bands."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.models import ProcessModel, TransferFunction
from plantune.tune import (
    amigo,
    chien_hrones_reswick,
    cohen_coon,
    half_rule,
    imc_pi,
    imc_pid,
    lambda_,
    margins,
    refined_ziegler_nichols,
    simc,
    simc_plus,
    tyreus_luyben,
    ziegler_nichols,
)

PID = {"controller": "PID"}
INTEGRATING = (
    simc,
    partial(simc, **PID),
    simc_plus,
    partial(simc_plus, **PID),
    amigo,
    partial(amigo, **PID),
    lambda_,
    partial(lambda_, **PID),
    tyreus_luyben,
    partial(tyreus_luyben, **PID),
    ziegler_nichols,
    partial(ziegler_nichols, **PID),
)
SETTLING_ONLY = (
    partial(imc_pi, gain_margin=3),
    partial(imc_pid, gain_margin=3),
    refined_ziegler_nichols,
    cohen_coon,
    partial(cohen_coon, **PID),
    chien_hrones_reswick,
    partial(chien_hrones_reswick, step="set_point", **PID),
)
EVERY = (*INTEGRATING, *SETTLING_ONLY)
KNOWS_TWO_LAGS = (
    partial(simc, **PID),
    partial(lambda_, **PID),
    partial(imc_pid, gain_margin=3),
    tyreus_luyben,
    partial(tyreus_luyben, **PID),
)
gains = st.one_of(st.floats(0.01, 100.0), st.floats(-100.0, -0.01))
tanks = st.builds(
    lambda K, L: ProcessModel(K, (), L, integrating=True), gains, st.floats(0.01, 50.0)
)


def scaled(model, gain, time):
    """Measure u in other units and time too; an integrating slope is per second."""
    return replace(
        model,
        K=model.K * gain / (time if model.integrating else 1.0),
        T=tuple(time * T for T in model.times),
        L=time * model.L,
        Tz=time * model.Tz,
    )


@pytest.mark.parametrize("rule", INTEGRATING)
@settings(max_examples=10)
@given(plant=tanks)
def test_integrators_are_served_stably(rule, plant):
    tuning = rule(plant)
    assert tuning.margins.stable and tuning.controller.Kp * plant.K > 0
    assert tuning.model is plant
    assert not [note for note in tuning.notes if note.code in ("T02", "T05")]


@pytest.mark.parametrize("rule", EVERY)
@settings(max_examples=10)
@given(
    T=st.lists(st.floats(0.1, 10.0), min_size=2, max_size=4),
    Tz=st.floats(-2.0, 0.0),
    gain=gains,
    time=st.floats(1e-2, 1e2),
    integrating=st.booleans(),
)
def test_units_and_signs_carry_over(rule, T, Tz, gain, time, integrating):
    """Of every order, with an inverse response; what is refused is refused in all units."""
    plain = ProcessModel(2.0, tuple(T), 0.5, Tz, integrating=integrating)
    try:
        ours = rule(plain)
    except pt.NotIdentifiable as refusal:
        assert refusal.code == "M01" and integrating and rule in SETTLING_ONLY
        return
    theirs = rule(scaled(plain, gain, time))
    assert theirs.controller.Kp == approx(ours.controller.Kp / gain, rel=1e-9)
    assert theirs.controller.Ti == approx(time * ours.controller.Ti, rel=1e-9)
    assert theirs.controller.Td == approx(time * ours.controller.Td, rel=1e-9, abs=1e-12)
    assert theirs.margins.stable == ours.margins.stable
    assert theirs.margins.Ms == approx(ours.margins.Ms, rel=1e-6)


# Largest Ms over plants of several lags and dead time, as measured and rounded up: what the
# reduction costs.  The rules whose gain is bounded by tau_c stand an inverse response as well; for
# others it is worse than the delay that it counts as, and C07 says where.
SOUND = (
    (simc, True, True, 2.1),
    (partial(simc, **PID), True, True, 2.4),
    (partial(imc_pi, gain_margin=3), True, False, 2.1),
    (partial(imc_pid, gain_margin=3), True, False, 2.1),
    (refined_ziegler_nichols, False, False, 1.8),
    (simc_plus, False, True, 2.0),
    (partial(simc_plus, **PID), False, True, 1.9),
    (amigo, False, True, 1.6),
    (partial(amigo, **PID), False, True, 1.5),
)


@pytest.mark.parametrize("rule, inverse, integrators, Ms", SOUND)
def test_loops_on_random_plants_are_stable(rule, inverse, integrators, Ms):
    rng = np.random.default_rng(7)
    for k in range(150):
        T = tuple(10 ** rng.uniform(-1, 1, rng.integers(1, 6)))
        L, Tz = 10 ** rng.uniform(-1, 1), -(10 ** rng.uniform(-2, 0.7))
        plant = ProcessModel(
            rng.choice([-3.0, 0.5]),
            T,
            L,
            Tz if inverse and k % 2 else 0.0,
            integrating=integrators and k % 3 == 0,
        )
        m = rule(plant).margins
        assert m.stable and m.Ms < Ms, plant


@pytest.mark.parametrize("rule", EVERY)
def test_what_a_rule_has_no_formula_for_is_reduced_with_a_note(rule):
    plant = ProcessModel(K=-2.0, T=(5.0, 2.0), L=0.7)
    tuning = rule(plant)
    noted = [note for note in tuning.notes if note.code == "T05"]
    if str(rule) in map(str, KNOWS_TWO_LAGS):
        assert not noted
    else:
        assert str(half_rule(plant)) in noted[0].text and noted[0].severity == "info"
        assert tuning.controller == rule(half_rule(plant)).controller
    assert tuning.margins == margins(plant, tuning.controller)


@pytest.mark.parametrize("rule", EVERY)
def test_transfer_functions_are_served_as_the_process_models_they_are(rule):
    for plant in (ProcessModel(K=-2.0, T=5.0, L=0.7), ProcessModel(K=-2.0, T=(5.0, 1.0), L=0.7)):
        ours, theirs = rule(plant), rule(plant.transfer())
        assert ours.controller.Kp == approx(theirs.controller.Kp, rel=1e-9)
        assert ours.controller.Ti == approx(theirs.controller.Ti, rel=1e-9)
        assert [n.code for n in ours.notes] == [n.code for n in theirs.notes]
        assert isinstance(theirs.model, TransferFunction)


def test_a_slow_lag_and_an_integrator_get_the_same_settings():
    """K/(T s + 1) is K/T / s where T is long; the rules that serve both agree."""
    lag, tank = ProcessModel(2e6, 1e6, 1.5), ProcessModel(2.0, (), 1.5, integrating=True)
    for rule in INTEGRATING:
        if "lambda_" in str(rule):  # its time constant is asked for
            rule = partial(rule, tau_c=4.0)
            if "PID" not in str(rule):
                continue  # Ti = T on a lag
            assert rule(tank).controller.Kp != rule(lag).controller.Kp
            continue
        ours, theirs = rule(lag).controller, rule(tank).controller
        assert (ours.Kp, ours.Ti, ours.Td) == approx((theirs.Kp, theirs.Ti, theirs.Td), rel=1e-4)


@pytest.fixture(scope="module")
def second_order_fit():
    """A fit of two lags, its covariance made up."""
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    theta = np.array([2.0, 5.0, 1.0, 0.6])
    sd = np.array([0.05, 0.2, 0.1, 0.05])
    return replace(
        fit, model=ProcessModel(2.0, (5.0, 1.0), 0.6), theta=theta, sd=sd, P=np.diag(sd**2), Ts=0.1
    )


@pytest.mark.parametrize("rule", [simc, partial(simc, **PID), partial(imc_pid, gain_margin=3)])
def test_bands_are_carried_over_a_fit_of_two_lags(rule, second_order_fit):
    tuning = rule(second_order_fit)
    for name, (low, high) in tuning.bands.items():
        assert low < getattr(tuning.margins, name) < high, name
    assert tuning.model is second_order_fit.model


def test_the_slowest_time_constant_decides_about_sampling(second_order_fit):
    """M09: a second lag of five samples may well be shorter than two; the first may not."""
    assert simc(replace(second_order_fit, Ts=0.9)).margins.stable
    with pytest.raises(pt.NotIdentifiable) as refusal:
        simc(replace(second_order_fit, Ts=4.0))
    assert refusal.value.code == "M09"


def test_bands_of_an_integrating_fit(second_order_fit):
    fit = replace(
        second_order_fit,
        model=ProcessModel(2.0, (), 0.6, integrating=True),
        theta=np.array([2.0, 0.6]),
        sd=np.array([0.05, 0.05]),
        P=np.diag([0.05**2, 0.05**2]),
    )
    low, high = simc(fit).bands["gain"]
    assert low < simc(fit).margins.gain < high
    with pytest.raises(pt.NotIdentifiable) as refusal:
        simc(replace(fit, sd=np.array([2.0, 0.05])))
    assert refusal.value.code == "X12"
