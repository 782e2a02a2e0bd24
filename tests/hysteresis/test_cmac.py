"""CMAC: the oracle's tables to the last digits, and what happens beside a controller."""

import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import cmac as oracle
from plantune.errors import UsageError

LOW, HIGH, CELLS, LAYERS, BETA = -1.0, 2.0, 25, 8, 0.3
S = np.random.default_rng(6).standard_normal(500).cumsum() / 8


def fresh(**options):
    given = {"range": (LOW, HIGH), "cells": CELLS, "layers": LAYERS, "beta": BETA}
    return pt.hysteresis.Cmac(**{**given, **options})


def test_tables_and_outputs_are_those_of_the_oracle():
    ours, theirs = fresh(), oracle.cmac(LOW, HIGH, CELLS, LAYERS, BETA, tables=2)
    way = 0
    for t, s in enumerate(S):
        way = way if t == 0 or s == S[t - 1] else int(s < S[t - 1])
        assert ours.recall(s) == approx(theirs.recall(s, way), abs=1e-13)
        ours.learn(np.sin(s))
        theirs.learn(s, np.sin(s), way)
    assert np.abs(ours.w - theirs.w).max() < 1e-13


def test_a_signal_that_stands_goes_on_in_its_table():
    cmac = fresh(beta=1.0)
    for s in (0.0, 1.0, 0.5):
        cmac.recall(s)
        cmac.learn(3.0)
    assert cmac.recall(0.5) == approx(3.0) and cmac.w[1].any()


def test_a_dead_zone_leaves_so_much_unlearnt():
    cmac = fresh(dead_zone=0.25, beta=1.0)
    for _ in range(3):
        cmac.recall(0.3)
        cmac.learn(2.0)
    assert cmac.recall(0.3) == approx(1.75)


def test_a_pickled_memory_goes_on():
    cmac = fresh()
    for s in S[:250]:
        cmac.recall(s)
        cmac.learn(s**2)
    again = pickle.loads(pickle.dumps(cmac))
    assert repr(again) == repr(cmac)
    for s in S[250:]:
        assert again.recall(s) == cmac.recall(s)
        again.learn(s**2)
        cmac.learn(s**2)
    assert np.array_equal(again.w, cmac.w)
    assert cmac.w.shape == (2, LAYERS, CELLS + 1)


@pytest.mark.parametrize(
    "change",
    [{"range": (1.0, 1.0)}, {"cells": 0}, {"layers": 0}, {"cells": 10**9}, {"beta": 0.0},
     {"beta": 1.1}, {"dead_zone": -1.0}],
)  # fmt: skip
def test_what_is_no_memory_is_refused(change):
    with pytest.raises(UsageError):
        fresh(**change)


def test_a_state_of_another_memory_is_refused():
    with pytest.raises(UsageError, match="state"):
        fresh().state = np.zeros(7)


# -- beside a controller, source 002, figure 3.3 -------------------------------------------------

PLANT = pt.hysteresis.PlayStack(r=np.arange(10) / 10, w=np.r_[1.0, np.full(9, 0.1)])
REFERENCE = 0.8 * np.sin(2 * np.pi * np.arange(400) / 200)


def test_it_learns_from_pass_to_pass_what_the_controller_did():
    cmac = fresh(range=(-0.8, 0.8))
    pid = pt.models.PID(Kp=0.3, Ts=1.0)
    run = pt.hysteresis.track(PLANT, REFERENCE, 1.0, pid=pid, cmac=cmac, passes=20)
    assert run.pass_rms[19] < 0.2 * run.pass_rms[0] and not run.notes
    # One table a direction has no memory for minor loops, and cells are wide: it never ends at 0.
    assert run.pass_rms[19] > 1e-4


def test_beside_an_integral_a_full_step_is_refused_and_a_smaller_one_is_noted():
    pid = pt.models.PID.integral(0.3, Ts=1.0)
    with pytest.raises(UsageError, match="beta"):
        pt.hysteresis.track(PLANT, REFERENCE, 1.0, pid=pid, cmac=fresh(beta=1.0))
    run = pt.hysteresis.track(PLANT, REFERENCE, 1.0, pid=pid, cmac=fresh(beta=0.1))
    assert [note.code for note in run.notes] == ["M02"]
    run = pt.hysteresis.track(PLANT, REFERENCE, 1.0, pid=pid, cmac=fresh(dead_zone=0.05))
    assert not run.notes
