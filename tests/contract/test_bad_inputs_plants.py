"""M01, M02 and M12 of BAD_INPUTS.md: plants that a tuning rule does not serve."""

from functools import partial

import pytest

import plantune as pt
from contract.records import refused
from plantune.models import ProcessModel, TransferFunction
from plantune.tune import (
    amigo,
    chien_hrones_reswick,
    cohen_coon,
    imc,
    imc_pi,
    imc_pid,
    lambda_,
    refined_ziegler_nichols,
    simc,
    simc_plus,
    tyreus_luyben,
    ziegler_nichols,
)

SETTLING_ONLY = (
    partial(imc_pi, gain_margin=3),
    partial(imc_pid, tau_c=2.0),
    refined_ziegler_nichols,
    cohen_coon,
    chien_hrones_reswick,
)
EVERY = (
    *SETTLING_ONLY,
    simc,
    partial(simc, controller="PID"),
    simc_plus,
    amigo,
    lambda_,
    tyreus_luyben,
    ziegler_nichols,
)
TANK = ProcessModel(K=0.5, T=3.0, L=1.0, integrating=True)


@pytest.mark.parametrize("rule", SETTLING_ONLY)
@pytest.mark.parametrize("plant", [TANK, TANK.transfer()], ids=["process", "transfer"])
def test_m01_an_integrating_plant_is_refused_by_rules_for_plants_that_settle(rule, plant):
    error = refused(lambda: rule(plant), "M01", ("remedy",))
    assert "simc" in error.remedy


@pytest.mark.parametrize("rule", EVERY)
def test_m01_two_integrators_are_refused_by_all(rule):
    refused(lambda: rule(TransferFunction([1.0], [2.0, 1.0, 0.0, 0.0], L=1.0)), "M01", ("remedy",))


@pytest.mark.parametrize("rule", (*EVERY, partial(imc, tau_c=1.0)))
@pytest.mark.parametrize("den", [[5.0, -1.0], [1.0, -0.2, 1.0], [1.0, 0.0, 1.0], [1.0, -1.0, 0.0]])
def test_m02_an_unstable_plant_is_refused_by_all(rule, den):
    error = refused(lambda: rule(TransferFunction([2.0], den, L=1.0)), "M02", ("measured", "limit"))
    assert error.measured >= 0 == error.limit


@pytest.mark.parametrize("rule", EVERY)
@pytest.mark.parametrize(
    "wrong",
    [
        {"K": 0.0},
        {"T": (3.0, -1.0)},
        {"L": -0.1},
        {"L": float("nan")},
        {"Tz": float("inf")},
        {"zeta": -0.3},
    ],
    ids=str,
)
def test_m12_what_is_no_plant_is_refused(rule, wrong):
    fields = {"K": 1.0, "T": (3.0, 1.0), "L": 0.5, **wrong}
    refused(lambda: rule(ProcessModel(**fields)), "M12", ("remedy",))


@pytest.mark.parametrize(
    "rule", [rule for rule in EVERY if "imc_pid" not in str(rule) and rule is not tyreus_luyben]
)
def test_m12_a_damped_pair_is_refused_by_rules_for_lags(rule):
    error = refused(lambda: rule(ProcessModel(1.0, 3.0, 0.5, zeta=0.3)), "M12", ("remedy",))
    assert "imc_pid" in error.remedy


def test_m01_compare_leaves_out_what_does_not_serve(monkeypatch):
    """With the code of the refusal; where none serves, it is raised."""
    refused(lambda: pt.tune.compare(TANK, [cohen_coon, chien_hrones_reswick]), "M01", ("remedy",))
