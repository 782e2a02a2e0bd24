"""Cohen-Coon: two printed forms, the decay it was made for, its range."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.tune import cohen_coon


def test_cohen_coon_by_hand():
    """r = 1/2: 2 (0.9 + 1/24), 31.5/19; 2 (4/3 + 1/8), 35/17, 4/12."""
    plant = pt.models.ProcessModel(K=-1.0, T=2.0, L=1.0)
    pi, pid = (cohen_coon(plant, controller=c).controller for c in ("PI", "PID"))
    assert (pi.Kp, pi.Ti, pi.Td) == approx((-1.8833333333, 1.6578947368, 0.0), rel=1e-9)
    assert (pid.Kp, pid.Ti, pid.Td) == approx((-2.9166666667, 2.0588235294, 1 / 3), rel=1e-9)
    assert pid.Tf == approx(1 / 30, rel=1e-12)


@given(T=st.floats(0.01, 100.0), r=st.floats(0.1, 1.0))
def test_both_printed_forms_agree_to_their_rounding(T, r):
    """The other one is that of O'Dwyer's handbook, in decimals of r; they differ by up to 4 %."""
    plant = pt.models.ProcessModel(K=2.0, T=T, L=r * T)
    pi, pid = (cohen_coon(plant, controller=c).controller for c in ("PI", "PID"))
    assert pi.Kp == approx((0.9 / r + 0.083) / 2, rel=0.01)
    assert pi.Ti == approx(T * (3.33 * r + 0.31 * r**2) / (1 + 2.22 * r), rel=0.04)
    assert pid.Kp == approx((1.35 / r + 0.25) / 2, rel=0.02)
    assert pid.Ti == approx(T * (2.5 * r + 0.46 * r**2) / (1 + 0.61 * r), rel=0.04)
    assert pid.Td == approx(0.37 * r * T / (1 + 0.19 * r), rel=0.04)


@pytest.mark.parametrize("controller, gain, Ms", [("PI", 1.45, 4.2), ("PID", 1.28, 4.8)])
@pytest.mark.parametrize("ratio", [0.1, 0.2, 0.4, 0.7, 1.0])
def test_the_loop_is_stable_and_weak_over_the_range(controller, gain, Ms, ratio):
    tuning = cohen_coon(pt.models.ProcessModel(K=3.0, T=2.0, L=2.0 * ratio), controller=controller)
    m = tuning.margins
    assert m.stable and gain < m.gain < 2 and 2.5 < m.Ms < Ms
    assert {note.code for note in tuning.notes} == {"C07"}


@pytest.mark.parametrize("controller", ["PI", "PID"])
@pytest.mark.parametrize("ratio", [0.1, 0.2, 0.35, 0.5])
def test_a_load_decays_by_three_quarters_each_period(controller, ratio):
    """What the rule was made for; two poles alone would leave 0.25."""
    plant = pt.models.ProcessModel(K=1.0, T=1.0, L=ratio)
    y = pt.simulate.load_step(plant, cohen_coon(plant, controller=controller).controller).y
    peaks = y[1:-1][(y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])]
    assert 0.15 < peaks[1] / peaks[0] < 0.33 and 0.15 < peaks[2] / peaks[1] < 0.33


@pytest.mark.parametrize("ratio, limit", [(0.09, 0.1), (1.1, 1.0)])
def test_its_range_is_noted(ratio, limit):
    note = cohen_coon(pt.models.ProcessModel(K=3.0, T=1.0, L=ratio)).notes[0]
    assert (note.code, note.measured, note.limit) == ("T02", ratio, limit)
