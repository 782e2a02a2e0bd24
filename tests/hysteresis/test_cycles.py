"""Cycles and their repeatability, and the stage on which a second cycle is predicted."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from hysteresis.loops import cosine
from oracles import cycles as oracle
from plantune.datasets import PIEZO_STAGE, piezo_stage
from plantune.errors import DataError, NotIdentifiable, UsageError
from plantune.hysteresis import SeriesSlip, cycles, repeatability


@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("phase", [0, 170, 500, 900])
def test_turning_points_are_those_of_the_oracle(noise, phase):
    x = cosine(1000, 4)[phase:] + noise * np.random.default_rng(phase).normal(size=4001 - phase)
    found, expected = cycles(x, band=5.0), oracle.turning_points(x, 5.0)
    inner = [t for t in expected[1:-1]]
    assert [t for t in found.turns if t in inner] == inner
    # Whole cycles from lowest to lowest: the oracle takes a part at an end for a whole.
    whole = [c for c in oracle.split(x, 5.0) if x[c[0]] < 5 and x[c[2]] < 5]
    assert list(found.whole) == whole and len(found) == (4 if phase == 0 else 3)


def test_incomplete_cycles_are_kept_apart():
    """50 + 50 sin, from 50 V on: one whole cycle between two parts."""
    x = 50 + 50 * np.sin(2 * np.pi * np.arange(2001) / 1000)
    found = cycles(x)
    assert found.whole == ((750, 1250, 1750),)
    assert (found.first, found.last) == (slice(0, 750), slice(1751, 2001))
    assert [x[rows].argmax() for rows in found] == [500]


def test_repeatability_is_that_of_the_oracle():
    """Of two cycles; interpolation may differ where x stands still."""
    x, y = oracle.stage(drift=0.5)
    found = repeatability(x, y)
    largest, rms = oracle.repeatability(x, y, *oracle.split(x, 1.0))
    assert (found.largest, found.rms) == approx((largest, rms), abs=1e-9)


def test_repeatability_of_several_is_over_all_pairs():
    t = np.arange(4001) / 1000
    x = cosine(1000, 4)
    y = x + np.random.default_rng(4).normal(size=4)[np.minimum(t.astype(int), 3)]
    found = repeatability(x, y)
    levels = np.c_[found.up, found.down]
    pairs = [levels[a] - levels[b] for a in range(4) for b in range(a)]
    assert found.largest == approx(np.abs(pairs).max())
    assert found.rms == approx(np.sqrt(np.mean(np.square(pairs))))
    assert found.largest == max(found.largest_up, found.largest_down)


def test_a_loop_that_repeats_has_none():
    found = repeatability(cosine(500, 3), PIEZO_STAGE.loop(cosine(500, 3)))
    assert found.largest < 1e-9


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda: cycles([1.0, 1.0]), NotIdentifiable, "move"),
        (lambda: cycles([]), NotIdentifiable, "move"),
        (lambda: cycles([0.0, 1.0], band=-1.0), UsageError, "band"),
        (lambda: cycles([0.0, np.nan]), UsageError, "x"),
        (lambda: repeatability(cosine(100), cosine(100)), NotIdentifiable, "1 whole"),
        (lambda: repeatability(cosine(100), cosine(99)), DataError, "100"),
    ],
)
def test_refusals(call, error, says):
    with pytest.raises(error, match=says):
        call()


# -- the stage ---------------------------------------------------------------------------


def test_the_stage_is_what_source_002_measured():
    rec = piezo_stage(cycles=2, drift=0.0)
    assert rec.N == 4001 and (rec.u.min(), rec.u.max()) == (0.0, 100.0)
    assert 59 < np.ptp(rec.y) < 61.5
    digits = rec.y / (2000 / 2**14)
    assert np.abs(digits - np.round(digits)).max() < 1e-9
    loop = PIEZO_STAGE.loop(rec.u[:, 0])
    up, down = loop[500], loop[1500]  # both at 50 V
    assert 4 < down - up < 9


def test_the_stage_is_repeatable_and_its_seed_counts():
    assert piezo_stage(noise_sd=0.1).same_as(piezo_stage(noise_sd=0.1))
    assert not piezo_stage(noise_sd=0.1).same_as(piezo_stage(noise_sd=0.1, seed=1))
    noise = piezo_stage(noise_sd=0.1, digit=0).y - piezo_stage(digit=0).y
    assert np.std(noise) == approx(0.1, rel=0.05)


def test_drift_shows_in_the_repeatability():
    exact = [piezo_stage(drift=d, digit=0.0) for d in (0.0, 1.0)]
    rms = [repeatability(r.u[:, 0], r.y[:, 0]).rms for r in exact]
    assert rms[1] - rms[0] == approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    "wrong", [{"cycles": 0}, {"rows": 5}, {"seed": -1}, {"noise_sd": -1.0}, {"digit": -1.0}]
)
def test_the_stage_refuses_what_it_cannot_simulate(wrong):
    with pytest.raises(UsageError) as refusal:
        piezo_stage(**wrong)
    assert refusal.value.code == "U01"


@pytest.mark.parametrize(
    ("drift", "threshold"), [(0.6, 0.5), (1.0, 0.5), (0.3, 0.25), (0.6, 0.25), (1.0, 0.25)]
)
def test_a_second_cycle_is_predicted_as_well_as_the_loop_repeats(drift, threshold):
    """Source 002, 4.5; re-anchored by one constant where the second cycle begins."""
    rec = piezo_stage(cycles=2, drift=drift)
    x, y = rec.u[:, 0], rec.y[:, 0]
    first, second = cycles(x)
    model = SeriesSlip.identify(x[first], y[first], threshold)
    again = model.through(x[second][0], y[second][0])
    e = y[second] - again.simulate(x[second])
    own = repeatability(x, y)
    assert np.abs(e).max() < own.largest and np.sqrt(np.mean(e**2)) < own.rms
    # Without that constant it is not.
    assert np.abs(y[second] - model.simulate(x[second])).max() > own.largest


def test_a_wrong_direction_is_refused():
    with pytest.raises(UsageError, match="direction"):
        pt.hysteresis.SeriesSlip(up=[(0, 0, 1)]).through(0.0, 0.0, "left")
