"""Delay scan: the sample delay, with the order of the model chosen along with it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import plantune as pt
from oracles import fopdt

TS = 0.02


def first_order(delay, sd=0.0, N=500, seed=1):
    """Simulate a first-order plant whose first effect comes `delay` samples later."""
    u = fopdt.hold_input(N, 7, seed)
    y = fopdt.simulate(u, -5.939, 0.1491, (delay - 1) * TS, TS, offset=583.451)
    return u, y + sd * np.random.default_rng(seed + 1).normal(size=N)


def test_hair_dryer_has_three_samples():
    """DESIGN 4: a first-order scan would say 4."""
    rec = pt.datasets.hair_dryer()
    scan = pt.analyze.delay(rec, nk=(0, 20))
    assert scan.nk == 3
    assert len(scan.loss) == 21  # the range is inclusive


def test_engine_loop_without_noise_has_six_samples():
    """METHODS 8.1: L = 0.100 s at 0.02 s means u(t - 6)."""
    assert pt.analyze.delay(pt.datasets.engine_loop(L=0.1), nk=(0, 20)).nk == 6


@pytest.mark.parametrize("seed", range(5))
def test_engine_loop_with_noise_has_six_samples(seed):
    rec = pt.datasets.engine_loop(noise_var=1.5, seed=seed, L=0.1, t_end=60.0)
    assert pt.analyze.delay(rec, nk=(0, 20)).nk == 6


@given(delay=st.integers(1, 15))
def test_scan_finds_every_whole_delay(delay):
    u, y = first_order(delay, sd=0.3)
    assert pt.analyze.delay(pt.Record(u=u, y=y, Ts=TS), nk=(0, 20)).nk == delay


@pytest.mark.parametrize("shift", [1, 2, 4])
def test_shifting_a_signal_moves_nk_as_much(shift):
    u, y = first_order(4, sd=0.3)
    later = pt.Record(u=u[shift:], y=y[:-shift], Ts=TS)
    earlier = pt.Record(u=u[:-shift], y=y[shift:], Ts=TS)
    assert pt.analyze.delay(later, nk=(0, 20)).nk == 4 + shift
    assert pt.analyze.delay(earlier, nk=(0, 20)).nk == 4 - shift


def test_level_and_units_do_not_move_the_delay():
    u, y = first_order(6, sd=0.3)
    assert pt.analyze.delay(pt.Record(u=1e-6 * u + 3, y=1e6 * y - 7e5, Ts=TS)).nk == 6


def test_segments_are_scanned_as_one_record():
    parts = [first_order(6, sd=0.3, N=200, seed=s) for s in (1, 2, 3)]
    rec = pt.Record.join([pt.Record(u=u, y=y, Ts=TS) for u, y in parts])
    assert pt.analyze.delay(rec, nk=(0, 20)).nk == 6


def test_the_winner_has_the_least_loss_or_less_delay():
    u, y = first_order(6, sd=0.3)
    scan = pt.analyze.delay(pt.Record(u=u, y=y, Ts=TS), nk=(2, 12))
    loss = np.asarray(scan.loss, float)
    assert loss.shape[0] == 11 and np.isfinite(loss).all()
    assert scan.nk in np.ravel(scan.candidates)
    assert scan.runner_up != scan.nk
    assert loss[scan.nk - 2] <= 1.01 * loss.min()  # X06: nearer than 1 % is a tie


def test_a_winner_at_the_end_of_the_range_is_noted():
    """BAD_INPUTS X05."""
    u, y = first_order(12, sd=0.3)
    scan = pt.analyze.delay(pt.Record(u=u, y=y, Ts=TS), nk=(0, 8))
    if scan.nk == 8:
        assert "X05" in [note.code for note in scan.notes]
