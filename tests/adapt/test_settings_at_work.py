"""What a user may set: operating points, nominal plants, rules, banks; and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from adapt.loops import asked, live, replayed
from oracles import scenarios
from plantune.adapt import AutoTuner, BankSettings, Sample, Settings
from plantune.models import PID, ProcessModel

ENGINE = scenarios.engine(3, wait=50, seconds=10.0)
K, T, L = -5.939, 0.1491, 0.1
NOMINAL = ProcessModel(K=-4.0, T=0.2, L=0.14)


def with_load(record, load):
    return replace(record, aux={"load": load})


def record(scenario):
    loop, rows = scenarios.Loop(scenario), []
    while not loop.done:
        rows.append(loop.step())
    _, r, u, y = np.array(rows).T
    return pt.Record(u=u, y=y, r=r, Ts=scenario.Ts)


def test_a_new_operating_point_begins_anew():
    rec = record(ENGINE)
    load = np.where(rec.time < 4.0, 10.0, 30.0)
    load[(rec.time >= 6.0) & (rec.time < 6.5)] = 25.5  # nearer to 20, within the limits of 30
    settings = asked(ENGINE, break_points={"load": [10.0, 20.0, 30.0]}, margins={"load": 6.0})
    log = pt.adapt.replay(with_load(rec, load), settings)
    assert [log.t[k] for k in np.flatnonzero(log.new_point)] == approx([0.0, 4.0])
    assert {log.operating_point[k] for k in range(len(log.t))} == {(0,), (2,)}
    begins = np.flatnonzero(log.new_point)[1]
    # what was learnt before is forgotten, and learnt again
    assert np.isnan(log.merged[begins]).all() and np.isnan(log.K[begins])
    again = np.flatnonzero(log.accepted & (log.t > 4.0))[0]
    assert 0.2 < log.t[again] - 4.0 < 2.0
    assert log.K[-1] == approx(K, rel=1e-6)


def test_no_operating_point_between_the_limits():
    rec = record(ENGINE)
    settings = asked(ENGINE, break_points={"load": [10.0, 30.0]}, margins={"load": 6.0})
    log = pt.adapt.replay(with_load(rec, np.full(rec.N, 20.0)), settings)
    assert set(log.operating_point) == {None}


@pytest.mark.parametrize("rate", [1.0, 0.5, 0.2])
def test_merging_keeps_the_share_of_the_nominal_plant(rate):
    """(3.7-17) to (3.7-19): K_e = K_n (1 - C) + K_a C; noise-free, K_a is the plant."""
    log = replayed(ENGINE, asked(ENGINE, nominal=NOMINAL, merge_rate=rate))
    nominal, plant = np.array([NOMINAL.K, NOMINAL.T, NOMINAL.L]), np.array([K, T, L])
    assert log.merged[-1] == approx((1 - rate) * nominal + rate * plant, rel=1e-6)
    merged = ProcessModel(*log.merged[-1])
    wanted = pt.tune.imc_pi(merged, gain_margin=3.0).controller
    assert log.target[-1] == approx([wanted.Kp, wanted.Kp / wanted.Ti], rel=1e-9)


@pytest.mark.parametrize(
    ("aim", "value"), [("gain_margin", 4.0), ("phase_margin", 65.0), ("tau_c", 0.25)]
)
def test_the_target_is_that_of_the_rule(aim, value):
    log = replayed(ENGINE, asked(ENGINE, **{aim: value}))
    wanted = pt.tune.imc_pi(ProcessModel(K=K, T=T, L=L), **{aim: value}).controller
    assert log.target[-1] == approx([wanted.Kp, wanted.Kp / wanted.Ti], rel=1e-5)


def test_the_posterior_rule_keeps_Ms_on_the_true_plant():
    """Ms as asked, and more integral action than IMC-PI has at that Ms: a load step costs less."""
    scenario = replace(ENGINE, sd=1.5**0.5, seconds=15.0)
    run = live(scenario, asked(scenario, rule="posterior", Ms=1.6, every=50))
    Ms = run.Ms_at(len(run.t) - 1)
    assert 1.4 < Ms <= 1.6 * 1.02
    c = run.decisions[-1].controller
    imc = pt.tune.imc_pi(ProcessModel(K=K, T=T, L=L), gain_margin=3.5).controller
    assert scenarios.Ms(run.plants[-1], imc.Kp, imc.Kp / imc.Ti, 0.02) == approx(Ms, abs=0.1)
    assert abs(c.Kp / c.Ti) > abs(imc.Kp / imc.Ti)


@pytest.mark.parametrize("delay", ["posterior", "counters"])
@pytest.mark.parametrize("method", ["rml", "els"])
def test_a_bank_with_offset_knows_the_plant(delay, method):
    log = replayed(ENGINE, asked(ENGINE, bank=BankSettings(delay=delay, method=method)))
    assert log.accepted.any()
    off = np.abs(np.array([log.K[-1] / K, log.T[-1] / T, log.L[-1] / L]) - 1)
    assert off.max() < 0.01


def test_a_stuck_sensor_and_missing_values_are_no_data():
    settings = asked(ENGINE)
    tuner, loop = AutoTuner(settings), scenarios.Loop(ENGINE)
    for k in range(400):
        t, r, u, y = loop.step()
        decision = tuner.step(Sample(t, r, u, None if k % 97 == 0 else y))
    assert decision.model.K == approx(K, rel=1e-6)


PI = PID(Kp=-0.018, Ti=0.0532)
GOOD = {"Ts": 0.02, "nk": (3, 11), "controller": PI}


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"gain_margin": 3.0, "tau_c": 0.1}, "gain_margin"),
        ({"break_points": {"load": [1.0]}}, "margins"),
        ({"Ts": 0.0}, "Ts"),
        ({"nk": (0, 5)}, "nk"),
        ({"nk": (6, 5)}, "nk"),
        ({"rows": 1}, "rows"),
        ({"rows": 20}, "rows"),
        ({"every": 0}, "every"),
        ({"rule": "best"}, "rule"),
        ({"rule": "posterior", "answer": "all"}, "answer"),
        ({"merge_rate": 0.0}, "merge"),
        ({"merge_rate": 1.5}, "merge"),
        ({"settled": 1}, "W"),
        ({"max_change": 1.0}, "max_change"),
        ({"dwell": -1.0}, "dwell"),
        ({"u_limits": (1.0, 1.0)}, "low"),
        ({"target": 0.0}, "target"),
        ({"K": (1.0, -1.0)}, "low"),
        ({"break_points": {"load": [2.0, 1.0]}, "margins": {"load": 1.0}}, "break_points"),
        ({"break_points": {"load": [1.0, 2.0]}, "margins": {"load": 0.0}}, "margins"),
        ({"bank": BankSettings(method="arx")}, "method"),
        ({"bank": BankSettings(delay="vote")}, "delay"),
    ],
    ids=str,
)
def test_wrong_settings_are_refused(changes, named):
    with pytest.raises(pt.UsageError) as caught:
        AutoTuner(Settings(**{**GOOD, **changes}))
    assert caught.value.code == "U01"
    assert named in str(caught.value)


def test_a_record_of_another_kind_is_refused():
    rec = record(replace(ENGINE, seconds=1.0))
    for settings, word in (
        (Settings(**{**GOOD, "Ts": 0.01}), "Ts"),
        (Settings(**GOOD, break_points={"load": [1.0]}, margins={"load": 1.0}), "load"),
    ):
        with pytest.raises(pt.UsageError, match=word):
            pt.adapt.replay(rec, settings)
