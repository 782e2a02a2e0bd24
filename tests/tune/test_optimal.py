"""The controller of least error under limits."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import optimum

ENGINE = pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1)


def test_the_engine_loop_has_its_known_optimum():
    """METHODS 3.1: Kp 0.1213, Ki 0.855, load IAE 1.17 at Ms 1.59; the oracle has 1.1723."""
    tuning = pt.tune.optimal(ENGINE, Ms=1.59)
    iae = pt.simulate.load_step(ENGINE, tuning.controller).indices.iae
    assert tuning.margins.stable and tuning.margins.Ms <= 1.59
    assert (tuning.controller.Kp, tuning.controller.Ki) == approx((-0.1213, -0.855), rel=5e-3)
    assert iae < 1.1735


@pytest.mark.parametrize("row", optimum.ROWS, ids=lambda r: f"{r.kind}-{r.ratio}-{r.M}")
def test_a_fine_grid_finds_no_better_pi(row):
    """Plants of K = L = 1 under Ms alone: within 0.3 % of the oracle's search."""
    plant = pt.models.ProcessModel(K=1.0, T=1 / row.ratio, L=1.0)
    load = row.kind == "load"
    tuning = pt.tune.optimal(plant, Ms=row.M, answer="load" if load else "set_point")
    run = pt.simulate.load_step if load else pt.simulate.step
    assert tuning.margins.Ms <= row.M
    assert run(plant, tuning.controller).indices.iae <= 1.003 * row.iae
    assert tuning.cost == approx(row.iae, rel=0.01)  # the search simulates coarsely


def test_both_lies_between_the_two():
    tunings = {a: pt.tune.optimal(ENGINE, answer=a) for a in ("load", "set_point", "both")}
    load = [
        pt.simulate.load_step(ENGINE, tunings[a].controller).indices.iae
        for a in ("load", "both", "set_point")
    ]
    step = [
        pt.simulate.step(ENGINE, tunings[a].controller).indices.iae
        for a in ("set_point", "both", "load")
    ]
    assert load[0] < load[1] < load[2] and step[0] < step[1] < step[2]
    assert 1.0 <= tunings["both"].cost < 1.1


def test_a_derivative_pays_and_a_limit_on_noise_costs():
    pi, pid = (pt.tune.optimal(ENGINE, controller=c) for c in ("PI", "PID"))
    quiet = pt.tune.optimal(ENGINE, controller="PID", noise_gain=0.4)
    quiet_y = pt.tune.optimal(ENGINE, controller="PID", noise_gain=0.4, filter="y2")
    assert pid.cost < 0.75 * pi.cost
    assert pid.margins.noise_gain > 1.0
    for tuning in (quiet, quiet_y):
        assert tuning.margins.noise_gain <= 0.4 and tuning.margins.Ms <= 1.6
        assert pid.cost < tuning.cost < pi.cost
    assert quiet_y.controller.filter == "y2"


def test_units_of_gain_and_time_go_through():
    one = pt.tune.optimal(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)).controller
    other = pt.tune.optimal(pt.models.ProcessModel(K=-0.2, T=500.0, L=100.0)).controller
    assert (other.Kp, other.Ti) == approx((-10 * one.Kp, 100 * one.Ti), rel=1e-3)


def test_limits_bind_or_leave_room():
    strict, mild = (pt.tune.optimal(ENGINE, Ms=2.0, Mt=Mt) for Mt in (1.05, np.inf))
    assert strict.margins.Mt <= 1.05 < mild.margins.Mt
    assert strict.cost > mild.cost


@pytest.mark.parametrize(
    "wish", [{"Ms": 1.0}, {"Mt": 0.9}, {"noise_gain": 0.0}, {"answer": "noise"}, {"share": 0.1}]
)
def test_wishes_out_of_reach_are_refused(wish):
    with pytest.raises(pt.UsageError) as caught:
        pt.tune.optimal(ENGINE, **wish)
    assert caught.value.code == "U01"


def test_a_plant_that_needs_no_limit_is_refused():
    """First order without dead time: every gain keeps Ms = 1."""
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.tune.optimal(pt.models.ProcessModel(K=1.0, T=1.0))
    assert caught.value.code == "M12" and "noise gain" in caught.value.remedy


def test_over_a_fit_the_limits_hold_on_the_share_of_its_models():
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5, t_end=2.0), "P1D")
    over, alone = pt.tune.optimal(fit, Ms=1.6), pt.tune.optimal(fit.model, Ms=1.6)
    drawn = [pt.models.ProcessModel(**m) for m in pt._core.cloud([fit.drawn_from], 200)]
    sensitivity = np.array([pt.tune.margins(m, over.controller).Ms for m in drawn])
    assert np.mean(sensitivity <= 1.6) >= 0.95
    assert abs(over.controller.Ki) < abs(alone.controller.Ki)
    again = pt.tune.optimal(fit, Ms=1.6)
    assert again.controller == over.controller  # the same fit, the same models


def test_fits_of_several_delays_are_weighed():
    rec = pt.datasets.engine_loop(noise_var=1.5, t_end=10.0)
    fits = [pt.estimate.armax(rec, 1, 1, 1, nk) for nk in (5, 6, 7)]
    with pytest.raises(pt.UsageError, match="different records"):
        other = pt.estimate.armax(pt.datasets.engine_loop(noise_var=1.5), 1, 1, 1, 6)
        pt.tune.optimal([*fits, other])


def test_an_open_sign_is_refused():
    rec = pt.datasets.engine_loop(noise_var=4000.0, t_end=4.0, seed=3)
    with pytest.raises(pt.NotIdentifiable):
        pt.tune.optimal(pt.estimate.process(rec, "P1D"))
