"""Tyreus-Luyben: the exact ultimate gain and period, the 2 dB of its source, its range."""

from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.tune import margins, tyreus_luyben


@settings(max_examples=25)
@given(K=st.floats(-100.0, -0.01), T=st.floats(0.01, 100.0), ratio=st.floats(0.01, 20.0))
def test_settings_follow_the_gain_margin_of_a_proportional_loop(K, T, ratio):
    """`margins` finds the ultimate gain by a search; roots to 1e-9, the filter Td / 10 is ours."""
    plant = pt.models.ProcessModel(K=K, T=T, L=ratio * T)
    unit = margins(plant, pt.models.PID(Kp=1 / K))
    Ku, Tu = unit.gain / K, 2 * pi / unit.w_gain
    pi_, pid = (tyreus_luyben(plant, controller=c).controller for c in ("PI", "PID"))
    assert (pi_.Kp, pi_.Ti, pi_.Td) == approx((Ku / 3.2, 2.2 * Tu, 0.0), rel=1e-8)
    assert (pid.Kp, pid.Ti, pid.Td) == approx((Ku / 2.2, 2.2 * Tu, Tu / 6.3), rel=1e-8)
    assert pid.Tf == approx(pid.Td / 10, rel=1e-12)


def test_a_long_lag_gets_the_settings_of_an_integrator():
    """K_u = pi / (2 k L), T_u = 4 L; the source aims at a closed-loop peak of 2 dB there."""
    tuning = tyreus_luyben(pt.models.ProcessModel(K=1e5, T=1e5, L=1.0))
    assert (tuning.controller.Kp, tuning.controller.Ti) == approx((pi / 6.4, 8.8), rel=1e-4)
    assert tuning.margins.Mt == approx(10 ** (2 / 20), rel=0.01)


@pytest.mark.parametrize("controller, gain, Ms", [("PI", 3.0, 1.7), ("PID", 1.6, 2.6)])
@pytest.mark.parametrize("ratio", [0.001, 0.05, 0.2, 0.5, 1.0])
def test_the_loop_is_stable_over_the_range(controller, gain, Ms, ratio):
    plant = pt.models.ProcessModel(K=3.0, T=2.0, L=2.0 * ratio)
    tuning = tyreus_luyben(plant, controller=controller)
    assert tuning.margins.stable and tuning.margins.gain > gain and tuning.margins.Ms < Ms
    assert "T02" not in [note.code for note in tuning.notes]


def test_beyond_its_range_a_note_says_so_and_the_pid_may_be_unstable():
    plant = pt.models.ProcessModel(K=3.0, T=1.0, L=7.0)
    tuning = tyreus_luyben(plant, controller="PID")
    assert [note.code for note in tuning.notes] == ["T02", "C07"] and not tuning.margins.stable
    assert (tuning.notes[0].measured, tuning.notes[0].limit) == (7.0, 1.0)
    assert tyreus_luyben(plant).margins.stable


@pytest.mark.parametrize(
    "plant, Ku, Tu",
    [
        (pt.models.ProcessModel(0.5, (), 2.0, integrating=True), pi / 2, 8.0),
        (pt.models.ProcessModel(-2.0, (1.0, 1.0, 1.0)), -4.0, 2 * pi / 3**0.5),
        (pt.models.TransferFunction([-1.0, 1.0], [1.0, 2.0, 1.0]), 2.0, 2 * pi / 3**0.5),
    ],
    ids=["integrator", "three lags", "inverse"],
)
def test_any_plant_is_served_by_its_ultimate_point(plant, Ku, Tu):
    """(1 - s)/(s + 1)^2: at w^2 = 3, (1 - jw)/(1 + jw)^2 = -1/2."""
    pid = tyreus_luyben(plant).controller
    assert (pid.Kp, pid.Ti) == approx((Ku / 3.2, 2.2 * Tu), rel=1e-8)


def test_what_never_oscillates_is_refused():
    with pytest.raises(pt.NotIdentifiable) as refusal:
        tyreus_luyben(pt.models.ProcessModel(2.0, (3.0, 1.0)))
    assert refusal.value.code == "M12"


def test_a_lag_beside_an_integrator_is_out_of_its_range():
    plant = pt.models.ProcessModel(2.0, 3.0, 1.0, integrating=True)
    note = tyreus_luyben(plant).notes[0]
    assert (note.code, note.measured, note.limit) == ("T02", 3.0, 1.0)
