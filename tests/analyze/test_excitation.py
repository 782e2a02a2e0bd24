"""Excitation: order, crest, moves, levels, band, advice."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import excitation as oracle


def of(u, y=None, Ts=0.5, **fields):
    y = np.zeros(len(u)) if y is None else y
    return pt.analyze.excitation(pt.Record(u=u, y=y, Ts=Ts, **fields)).inputs[0]


def answered(u, a=0.9):
    """Return the output of a first-order plant with T + L of about ten rows."""
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = a * y[k - 1] + (1 - a) * u[k - 1]
    return y + 0.01 * np.random.default_rng(1).normal(size=len(u))


def test_a_held_prbs_is_described():
    u = 3 + 2 * oracle.prbs(6, hold=4)
    found = of(u)
    assert found.moves == np.count_nonzero(np.diff(u))
    assert found.crest == approx(oracle.crest(u - u.mean()))
    assert [level for level, _ in found.levels] == [1.0, 5.0]
    assert sum(share for _, share in found.levels) == approx(1.0)
    runs = np.diff(np.flatnonzero(np.concatenate([[True], np.diff(u) != 0, [True]])))
    assert found.longest_hold == 0.5 * runs.max()
    assert found.at_least and found.order == 20


@pytest.mark.parametrize("sines", [1, 2, 4])
def test_each_sine_supports_two(sines):
    t = np.arange(4000)
    u = sum(np.sin((0.15 + 0.25 * k) * t) for k in range(sines))
    found = of(u)
    assert found.order == 2 * sines == oracle.order(u, 12)
    assert [note.code for note in found.notes] == (["X02"] if sines == 1 else [])


def test_the_band_holds_nine_tenths_of_the_power():
    t = np.arange(2000)
    u = np.sin(2 * np.pi * 40 * t / 2000) + np.sin(2 * np.pi * 300 * t / 2000)
    low, high = of(u).band
    assert (low, high) == approx((2 * np.pi * 40 / 1000, 2 * np.pi * 300 / 1000))
    white = of(np.random.default_rng(1).normal(size=4000))
    assert white.band == approx((0.05 * np.pi / 0.5, 0.95 * np.pi / 0.5), rel=0.1)


def test_a_still_input_is_a_finding_and_no_refusal():
    found = of(np.full(100, 4.0))
    assert (found.order, found.moves) == (0, 0)
    assert [note.code for note in found.notes] == ["X01"]
    assert found.levels == ((4.0, 1.0),)


def test_advice_compares_the_clock_with_the_plant():
    rng = np.random.default_rng(2)
    fast = rng.choice([-1.0, 1.0], 2000)
    slow = np.repeat(rng.choice([-1.0, 1.0], 20), 100)
    right = np.repeat(rng.choice([-1.0, 1.0], 200), 10)
    said = {}
    for name, u in (("fast", fast), ("slow", slow), ("right", right)):
        report = pt.analyze.excitation(pt.Record(u=u, y=answered(u), Ts=0.5))
        assert report.memory == approx(5.0, rel=0.35)
        said[name] = " ".join(report["u"].advice)
    assert "starves the gain" in said["fast"]
    assert "starves lag and delay" in said["slow"]
    assert said["right"] == ""


def test_moves_are_not_counted_across_segments():
    u = np.concatenate([np.zeros(50), np.ones(50)])
    assert of(u, starts=[0, 50]).moves == 0
    assert of(u).moves == 1


def test_inputs_are_found_by_name():
    u = np.column_stack([oracle.prbs(7), np.arange(127) % 2])
    report = pt.analyze.excitation(
        pt.Record(u=u, y=np.zeros(127), Ts=1.0, u_names=["valve", "fan"])
    )
    assert report["fan"].name == "fan" and [one.name for one in report] == ["valve", "fan"]
    with pytest.raises(KeyError):
        report["pump"]
