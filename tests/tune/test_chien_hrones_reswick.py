"""Chien-Hrones-Reswick: every entry of the table, the margins that go with it, its range."""

import pytest
from pytest import approx

import plantune as pt
from plantune.tune import chien_hrones_reswick

# K = 2, T = 10, L = 2, so that a = 0.4; by hand from the table.
TABLE = [
    ("load", 0, "PI", 1.5, 8.0, 0.0),
    ("load", 0, "PID", 2.375, 4.8, 0.84),
    ("load", 20, "PI", 1.75, 4.6, 0.0),
    ("load", 20, "PID", 3.0, 4.0, 0.84),
    ("set_point", 0, "PI", 0.875, 12.0, 0.0),
    ("set_point", 0, "PID", 1.5, 10.0, 1.0),
    ("set_point", 20, "PI", 1.5, 10.0, 0.0),
    ("set_point", 20, "PID", 2.375, 14.0, 0.94),
]
# Over L / T from 1/9 to 1: the least gain margin and the largest Ms.
MARGINS = {
    ("load", 0, "PI"): (2.4, 2.0),
    ("load", 0, "PID"): (1.75, 2.4),
    ("load", 20, "PI"): (1.8, 3.0),
    ("load", 20, "PID"): (1.4, 3.5),
    ("set_point", 0, "PI"): (4.5, 1.4),
    ("set_point", 0, "PID"): (2.45, 1.7),
    ("set_point", 20, "PI"): (2.6, 1.8),
    ("set_point", 20, "PID"): (1.6, 2.7),
}


@pytest.mark.parametrize("step, overshoot, controller, Kp, Ti, Td", TABLE)
def test_settings_are_the_table(step, overshoot, controller, Kp, Ti, Td):
    plant = pt.models.ProcessModel(K=2.0, T=10.0, L=2.0)
    tuning = chien_hrones_reswick(plant, step=step, overshoot=overshoot, controller=controller)
    pid = tuning.controller
    assert (pid.Kp, pid.Ti, pid.Td, pid.Tf) == approx((Kp, Ti, Td, Td / 10), rel=1e-12)
    for word in (step, f"{overshoot} %", controller):
        assert word in tuning.rule or word == "PI"


@pytest.mark.parametrize("step, overshoot, controller", MARGINS)
@pytest.mark.parametrize("ratio", [1 / 9, 0.2, 0.4, 0.7, 1.0])
def test_the_loop_is_stable_over_the_range(step, overshoot, controller, ratio):
    tuning = chien_hrones_reswick(
        pt.models.ProcessModel(K=-3.0, T=2.0, L=2.0 * ratio),
        step=step,
        overshoot=overshoot,
        controller=controller,
    )
    m, (gain, Ms) = tuning.margins, MARGINS[step, overshoot, controller]
    assert m.stable and m.gain > gain and m.Ms < Ms
    assert "T02" not in [note.code for note in tuning.notes]


def test_a_set_point_without_overshoot_has_none():
    for ratio in (1 / 9, 0.3, 1.0):
        plant = pt.models.ProcessModel(K=2.0, T=10.0, L=10.0 * ratio)
        pid = chien_hrones_reswick(plant, step="set_point").controller
        assert pt.simulate.step(plant, pid).indices.overshoot < 0.5


def test_a_load_without_overshoot_comes_back_from_one_side():
    for ratio in (1 / 9, 0.3, 1.0):
        plant = pt.models.ProcessModel(K=2.0, T=10.0, L=10.0 * ratio)
        for controller, below in (("PI", 1e-6), ("PID", 0.05)):
            pid = chien_hrones_reswick(plant, controller=controller).controller
            y = pt.simulate.load_step(plant, pid).y
            assert -y.min() <= below * y.max()


@pytest.mark.parametrize("ratio, limit", [(0.11, 1 / 9), (1.1, 1.0)])
def test_its_range_is_noted(ratio, limit):
    note = chien_hrones_reswick(pt.models.ProcessModel(K=3.0, T=1.0, L=ratio)).notes[0]
    assert (note.code, note.measured, note.limit) == ("T02", ratio, limit)


@pytest.mark.parametrize(
    "wrong",
    [{"step": "setpoint"}, {"overshoot": 10}, {"overshoot": float("nan")}, {"controller": "PD"}],
)
def test_what_the_table_has_not_is_refused(wrong):
    with pytest.raises(pt.UsageError) as refusal:
        chien_hrones_reswick(pt.models.ProcessModel(K=3.0, T=1.0, L=0.5), **wrong)
    assert refusal.value.code == "U01" and refusal.value.where[0] == next(iter(wrong))
