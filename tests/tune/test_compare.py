"""Rules side by side: the rows are the rules one by one, and nothing that is wrong is dropped."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from pytest import approx

import plantune as pt
from oracles import loop

OP1 = pt.models.ProcessModel(K=5.939, T=0.1491, L=0.1)
DEFAULT = (
    partial(pt.tune.imc_pi, gain_margin=3),
    pt.tune.simc,
    pt.tune.ziegler_nichols,
    pt.tune.refined_ziegler_nichols,
)


@pytest.fixture(scope="module")
def comparison():
    return pt.tune.compare(OP1)


def test_rows_are_the_rules_one_by_one(comparison):
    t_end = float(comparison.rows[0].set_point.t[-1])
    for row, rule in zip(comparison.rows, DEFAULT, strict=True):
        alone = rule(OP1)
        assert (row.tuning.rule, row.tuning.controller) == (alone.rule, alone.controller)
        assert row.tuning.margins == alone.margins
        step = pt.simulate.step(OP1, alone.controller, t_end)
        assert_array_equal(row.set_point.y, step.y)
        assert_array_equal(row.load.y, pt.simulate.load_step(OP1, alone.controller, t_end).y)
        assert row.set_point.indices == step.indices


def test_load_steps_have_the_known_errors(comparison):
    """METHODS 3.1, three digits."""
    iae = [row.load.indices.iae for row in comparison.rows]
    assert iae == approx([1.13, 1.19, 1.33, 1.53], abs=5e-3)


def test_a_load_step_is_what_an_independent_simulation_gives():
    """Method of steps; the product's straight line between nodes costs about 1e-6."""
    ours = pt.simulate.load_step(OP1, pt.tune.simc(OP1).controller, t_end=3.0)
    pid = pt.tune.simc(OP1).controller
    ref = loop.Continuous(OP1.K, OP1.T, OP1.L, pid.Kp, pid.Ti, t_end=3.0, r=0.0, d=1.0)
    assert ours.y == approx(ref.y(ours.t), abs=2e-5)
    assert ours.u == approx(ref.u(ours.t), abs=2e-5)


def test_the_error_of_a_load_that_does_not_ring_is_the_integral_time_over_the_gain():
    """The integral of e must bring u to -1: Ti/Kp; within the e^-8 that is left."""
    slow = pt.models.ProcessModel(K=-2.0, T=20.0, L=1.0)
    pid = pt.tune.imc_pi(slow, tau_c=2.0).controller
    assert pt.simulate.load_step(slow, pid).indices.iae == approx(-pid.Ti / pid.Kp, rel=5e-4)


def test_simc_recovers_faster_where_the_plant_is_slow():
    slow = pt.models.ProcessModel(K=2.0, T=20.0, L=1.0)
    rows = pt.tune.compare(slow, [partial(pt.tune.imc_pi, tau_c=1.0), pt.tune.simc]).rows
    imc, simc = (row.load.indices.iae for row in rows)
    assert simc < 0.5 * imc


def test_all_rules_are_simulated_over_the_same_seconds(comparison):
    for row in comparison.rows:
        assert_array_equal(row.set_point.t, comparison.rows[0].set_point.t)
        assert_array_equal(row.load.t, row.set_point.t)
    assert pt.tune.compare(OP1, t_end=2.5).rows[-1].load.t[-1] == approx(2.5)


def test_unstable_and_weak_loops_stay_with_what_is_wrong():
    wrong_sign, hasty = pt.models.PID(Kp=-0.1, Ti=0.15), pt.models.PID(Kp=0.3, Ti=0.15)
    both = pt.tune.compare(OP1, [wrong_sign, hasty, pt.tune.simc])
    assert [row.tuning.margins.stable for row in both.rows] == [False, True, True]
    assert [note.code for note in both.notes] == ["C07"] * 3
    assert "unstable" in both.notes[0].text and both.notes[0].text.startswith(str(wrong_sign))
    assert all(str(hasty) in note.text for note in both.notes[1:])
    assert np.isnan(both.rows[0].set_point.indices.settling)
    assert "unstable" in str(both)


def test_a_rule_that_refuses_becomes_a_note():
    no_delay = pt.models.ProcessModel(K=2.0, T=5.0, L=0.0)
    left = pt.tune.compare(no_delay, [partial(pt.tune.simc, tau_c=1.0), pt.tune.ziegler_nichols])
    assert [row.tuning.rule for row in left.rows] == ["SIMC, tau_c = 1"]
    assert [note.code for note in left.notes] == ["M12"]
    assert "Ziegler-Nichols" in left.notes[0].text


def test_where_no_rule_serves_the_refusal_is_raised():
    with pytest.raises(pt.NotIdentifiable) as refusal:
        pt.tune.compare(pt.models.ProcessModel(K=2.0, T=5.0, L=0.0))
    assert refusal.value.code == "M12"


@pytest.mark.parametrize(
    "plant, rules",
    [
        (OP1, ["IMC-PI", "SIMC", "Ziegler-Nichols", "refined Ziegler-Nichols"]),
        (
            pt.models.ProcessModel(K=0.5, T=2.0, L=1.0, integrating=True),
            ["SIMC", "lambda", "AMIGO", "Tyreus-Luyben", "Ziegler-Nichols"],
        ),
        (
            pt.models.ProcessModel(K=0.5, T=(2.0, 1.0), L=1.0, Tz=-0.5),
            ["IMC-PI", "IMC-PID", "SIMC", "SIMC PID", "AMIGO"],
        ),
        (
            pt.models.TransferFunction([1.0], [1.0, 3.0, 3.0, 1.0]),
            ["IMC-PI", "IMC-PID", "SIMC", "SIMC PID", "AMIGO"],
        ),
    ],
    ids=["one lag", "integrating", "inverse", "transfer function"],
)
def test_by_default_the_rules_are_those_that_serve_the_plant(plant, rules, monkeypatch):
    """The responses are those of `simulate`; here only what is tuned counts."""
    from plantune.tune import compare as verb

    module = __import__("sys").modules[verb.__module__]
    monkeypatch.setattr(module, "step", lambda *_: None)
    monkeypatch.setattr(module, "load_step", lambda *_: None)
    comparison = pt.tune.compare(plant, t_end=1.0)
    assert [row.tuning.rule.split(",")[0] for row in comparison.rows] == rules
    assert all(row.tuning.margins.stable for row in comparison.rows)
    assert not [note for note in comparison.notes if note.severity == "error"]


@pytest.mark.parametrize("rules", [[], ["simc"], [pt.tune.simc(OP1)]])
def test_what_is_no_rule_is_refused(rules):
    with pytest.raises(pt.UsageError, match="rules"):
        pt.tune.compare(OP1, rules)


def test_a_plant_much_slower_than_its_delay_is_served():
    """The nodes follow the delay, the recovery the time constant: a thousand times longer."""
    slow = pt.models.ProcessModel(K=0.5, T=1000.0, L=1.0)
    rows = pt.tune.compare(slow, [partial(pt.tune.imc_pi, tau_c=1.0), pt.tune.simc]).rows
    imc, simc = (row.load.indices.iae for row in rows)
    assert imc > 100 * simc  # Ti is 1000 s and 8 s, the gain the same; 5 % of imc is cut off


def test_a_fit_brings_bands_and_its_source():
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    comparison = pt.tune.compare(fit, [pt.tune.simc, pt.tune.ziegler_nichols])
    assert comparison.source == fit.source
    assert all(row.tuning.bands for row in comparison.rows)


def test_what_holds_for_all_rules_is_said_once():
    comparison = pt.tune.compare(OP1, delay_at_least=0.2, limits=pt.Limits(C07=1.9))
    assert [note.code for note in comparison.notes[:2]] == ["T01", "C07"]
    assert comparison.model.L == 0.2
    assert sum("limit C07" in note.text for note in comparison.notes) == 1


def test_it_prints_as_a_table(comparison):
    lines = str(comparison).splitlines()
    settings, steps = lines[1:6], lines[7:12]
    for block in (settings, steps):
        assert len({len(line) for line in block}) == 1  # columns line up
        assert [line.split("  ")[0] for line in block[1:]] == [
            row.tuning.rule for row in comparison.rows
        ]
    assert settings[1].split()[-5:] == ["9.542", "15.71", "60", "5.236", "1.631"]
