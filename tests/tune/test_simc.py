"""SIMC: the printed settings and margins of its source, and its PID in series form."""

from dataclasses import replace
from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.models import ProcessModel
from plantune.tune import margins, simc
from tune.test_half_rule import PRINTED, transfer

# Skogestad 2003, tables 3 and 4: Kc, t_I, t_D of the series form, and Ms.  Left out: E6 PI, printed
# with a dead time of 1.69 where the rule gives 1.188; and the gain of E8 PID, printed 1.5.
SETTINGS = {
    ("E1", "PI"): (5.5, 0.8, 0, 1.56),
    ("E2", "PI"): (0.85, 2.5, 0, 1.66),
    ("E2", "PID"): (1.30, 2, 1.2, 1.73),
    ("E3", "PI"): (2.33, 1.05, 0, 1.55),
    ("E3", "PID"): (6.67, 0.4, 0.15, None),
    ("E4", "PI"): (0.3, 1.5, 0, 1.46),
    ("E4", "PID"): (0.5, 1.5, 1, 1.43),
    ("E5", "PI"): (3.72, 1.1, 0, 1.59),
    ("E5", "PID"): (17.9, 0.224, 0.22, None),
    ("E6", "PID"): (1.40, 2.86, 1.33, 1.23),
    ("E7", "PI"): (0.214, 1.5, 0, 1.66),
    ("E7", "PID"): (0.3, 1.5, 1, 1.85),
    ("E8", "PI"): (0.33, 12, 0, 1.76),
    ("E9", "PI"): (0.5, 1.5, 0, 1.61),
    ("E9", "PID"): (0.5, 1, 1, 1.59),
    ("E10", "PI"): (5.25, 16, 0, 1.72),
    ("E10", "PID"): (10, 8, 2, 1.65),
    ("E11", "PI"): (0.7, 7, 0, 1.63),
    ("E11", "PID"): (1, 6, 3, 1.66),
    ("E12", "PI"): (7.41, 1, 0, 1.66),
    ("E13", "PI"): (2.88, 4.5, 0, 1.74),
    ("E14", "PI"): (0.5, 8, 0, 2.0),
    ("E15", "PI"): (0.5, 1, 0, 2.0),
}


def series(pid):
    """Give Kc and both times of Kc (1 + 1 / (a s)) (1 + b s), the larger time first."""
    split = sqrt(max(1 - 4 * pid.Td / pid.Ti, 0.0))
    large, small = pid.Ti / 2 * (1 + split), pid.Ti / 2 * (1 - split)
    return pid.Kp * large / pid.Ti, large, small


@pytest.mark.parametrize("case", SETTINGS, ids=" ".join)
def test_printed_settings_come_out(case):
    """To the printed digits; Ms of the settings without our filter."""
    (name, controller), (Kc, t_I, t_D, Ms) = case, SETTINGS[case]
    tuning = simc(PRINTED[name][0], controller=controller)
    gain, large, small = series(tuning.controller)
    # Which of both times integrates cannot be seen from the standard form.
    assert sorted((large, small)) == approx(sorted((t_I, t_D)), rel=5e-3, abs=1e-9)
    assert gain * t_I / large == approx(Kc, rel=1.1e-2)
    if Ms is not None:
        bare = margins(tuning.model, replace(tuning.controller, Tf=0.0))
        assert bare.stable and bare.Ms == approx(Ms, abs=0.012)


@pytest.mark.parametrize(
    "plant, gain, phase, Ms, Mt",
    [
        (ProcessModel(K=3.0, T=4.0, L=1.0), 3.14, 61.4, 1.59, 1.00),
        (ProcessModel(K=3.0, T=(), L=1.0, integrating=True), 2.96, 46.9, 1.70, 1.30),
    ],
)
def test_printed_margins_come_out(plant, gain, phase, Ms, Mt):
    """Skogestad 2003, table 2."""
    m = simc(plant).margins
    assert (m.gain, m.Ms, m.Mt) == approx((gain, Ms, Mt), abs=5e-3)
    assert m.phase_deg == approx(phase, abs=0.1)


gains = st.one_of(st.floats(0.01, 100.0), st.floats(-100.0, -0.01))


@given(K=gains, T1=st.floats(0.1, 100.0), ratio=st.floats(0.01, 1.0), L=st.floats(0.01, 10.0))
def test_a_second_lag_is_cancelled(K, T1, ratio, L):
    T2 = ratio * T1
    tuning = simc(ProcessModel(K=K, T=(T2, T1), L=L), controller="PID")
    pid = tuning.controller
    Kc, t_I = T1 / (K * 2 * L), min(T1, 8 * L)
    assert pid.Kp == approx(Kc * (1 + T2 / t_I), rel=1e-9)
    assert (pid.Ti, pid.Td) == approx((t_I + T2, t_I * T2 / (t_I + T2)), rel=1e-9)
    assert pid.Tf == approx(min(pid.Td, L) / 10, rel=1e-9)
    # Without the filter the loop is that of the first lag alone.
    bare = margins(tuning.model, replace(pid, Tf=0.0))
    alone = simc(ProcessModel(K=K, T=T1, L=L)).margins
    assert (bare.gain, bare.Ms) == approx((alone.gain, alone.Ms), rel=1e-6)


@given(K=gains, T=st.floats(0.0, 50.0), L=st.floats(0.01, 10.0), speed=st.floats(0.1, 10.0))
def test_integrating_plants_are_served(K, T, L, speed):
    times = (T,) if T > 0.01 else ()
    plant = ProcessModel(K=K, T=times, L=L, integrating=True)
    tuning = simc(plant, speed * L, controller="PID")
    pid, t_D = tuning.controller, sum(times)
    t_I = 4 * (1 + speed) * L
    assert pid.Kp == approx((1 + t_D / t_I) / (K * (1 + speed) * L), rel=1e-9)
    assert (pid.Ti, pid.Td) == approx((t_I + t_D, t_I * t_D / (t_I + t_D)), rel=1e-9)
    assert not [note for note in tuning.notes if note.code == "T05"]


def test_the_pi_takes_a_lag_of_an_integrating_plant_for_delay():
    plant = ProcessModel(K=0.5, T=4.0, L=1.0, integrating=True)
    ours, bare = simc(plant), simc(ProcessModel(K=0.5, T=(), L=3.0, integrating=True))
    assert ours.controller == bare.controller and ours.tau_c == 3.0
    assert [note.code for note in ours.notes if note.code == "T05"]


def test_a_pid_on_one_lag_is_the_pi():
    plant = ProcessModel(K=-2.0, T=20.0, L=1.0)
    assert simc(plant, controller="PID").controller == simc(plant).controller


def test_a_reduced_model_is_named_and_margins_are_of_the_plant():
    G = transfer(1.0, [1, 1, 1, 1])
    tuning = simc(G)
    (note,) = (note for note in tuning.notes if note.code == "T05")
    assert note.severity == "info" and str(pt.tune.half_rule(G)) in note.text
    assert tuning.model is G
    assert tuning.margins == margins(G, tuning.controller)
