"""Steady-state feed-forward: what holds the plant, as the plant itself answers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.models import PolyModel, ProcessModel, TransferFunction
from plantune.tune import precontrol


@given(K=st.floats(0.01, 100.0), r=st.floats(-50.0, 50.0), load=st.floats(-5.0, 5.0))
def test_the_plant_comes_to_rest_at_the_set_point(K, r, load):
    """(3.4-51), (3.4-53): the controller would end at r / K."""
    model = ProcessModel(K=-K, T=(2.0, 0.5), L=0.3)
    p = precontrol(model, r, load=load)
    assert (p + load) * model.step([200.0])[0] == approx(r, abs=1e-9)


def test_the_loop_ends_with_the_controller_where_it_began():
    """The input of the closed loop ends at p, whatever the settings."""
    model = ProcessModel(K=2.0, T=5.0, L=1.0)
    for tuning in (pt.tune.simc(model), pt.tune.imc_pi(model, gain_margin=5)):
        u = pt.simulate.step(model, tuning.controller, t_end=200.0).u
        assert u[-1] == approx(precontrol(model, 1.0), abs=1e-6)


def test_every_kind_of_model_is_served():
    G = TransferFunction([-0.4, 2.0], [3.0, 4.0, 1.0], L=0.5)
    assert precontrol(G, 3.0) == 1.5
    assert precontrol(PolyModel(A=[1, -0.5], B=[1], nk=1, Ts=1.0), 3.0) == 1.5


@pytest.mark.parametrize("T", [(), 3.0, (3.0, 1.0)])
def test_an_integrating_plant_needs_an_input_for_a_ramp_only(T):
    model = ProcessModel(K=0.25, T=T, L=1.0, integrating=True)
    assert precontrol(model, 10.0, load=0.5) == -0.5
    assert precontrol(model.transfer(), ramp=2.0) == approx(8.0)
    late = np.array([400.0, 401.0])
    assert np.diff(8.0 * model.step(late))[0] == approx(2.0)


def test_the_offset_of_a_fit_is_taken_off():
    fit = pt.estimate.process(pt.datasets.engine_loop(), "P1D")
    p = precontrol(fit, 600.0, load=0.1)
    assert fit.model.K * (p + 0.1) + fit.offset[0] == approx(600.0)
    tank = replace(fit, model=ProcessModel(K=2.0, T=(), L=1.0, integrating=True))
    assert precontrol(tank, 5.0) == approx(-fit.offset[0] / 2.0)  # it drifts by the offset


@pytest.mark.parametrize(
    "wrong, code",
    [
        (lambda: precontrol(ProcessModel(K=2.0, T=1.0), 1.0, ramp=1.0), "U01"),
        (lambda: precontrol(ProcessModel(K=2.0, T=1.0), float("nan")), "U01"),
        (lambda: precontrol(ProcessModel(K=0.0, T=1.0), 1.0), "M12"),
        (lambda: precontrol(TransferFunction([1.0, 0.0], [1.0, 1.0]), 1.0), "M12"),
        (lambda: precontrol(TransferFunction([1.0], [1.0, 0.0, 0.0]), 1.0), "M01"),
    ],
)
def test_what_no_input_holds_is_refused(wrong, code):
    with pytest.raises(pt.PlantuneError) as refusal:
        wrong()
    assert refusal.value.code == code
