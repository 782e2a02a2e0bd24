"""Steps of the level: found where they are, not invented, told from a line."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import offset_steps as oracle


def ar1(N, phi, seed):
    e = np.random.default_rng(seed).normal(size=N)
    e[0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], e) * np.sqrt(1 - phi**2)


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.8])
@pytest.mark.parametrize("size", [0.0, 1.0, 4.0])
def test_the_steps_are_those_of_the_direct_scan(phi, size):
    for seed in range(8):
        e = ar1(1000, phi, seed) + size * (np.arange(1000) >= 400)
        found = pt.analyze.offset_steps(e)
        if found.slope is None:
            assert found.at.tolist() == oracle.steps(e)
        assert size > 0 or len(found.at) == 0


def test_a_step_is_found_with_its_size_within_its_deviation():
    off = []
    for seed in range(40):
        e = ar1(1000, 0.5, 100 + seed) + 3.0 * (np.arange(1000) >= 400)
        found = pt.analyze.offset_steps(e)
        assert any(abs(found.at - 400) <= 10)
        k = int(abs(found.at - 400).argmin())
        if len(found.at) == 1:
            off.append((found.sizes[k] - 3.0) / found.sd[k])
    assert len(off) >= 36
    assert np.std(off) == approx(1.0, abs=0.3)  # 40 draws: +-0.11, and R is summed up to a band


def test_a_ramp_is_a_line_and_a_step_is_none():
    lines = sum(
        pt.analyze.offset_steps(ar1(1000, 0.0, s) + np.linspace(0, 3, 1000)).slope is not None
        for s in range(30)
    )
    steps = sum(
        pt.analyze.offset_steps(ar1(1000, 0.0, s) + 2.0 * (np.arange(1000) > 500)).slope is None
        for s in range(30)
    )
    assert (lines, steps) == (30, 30)


@pytest.mark.slow
def test_counts_over_many_signals():
    """In white noise hardly a false step in 300; 1 sd found in 94 %, 2 sd always."""
    none = sum(len(pt.analyze.offset_steps(ar1(1000, 0.0, s)).at) for s in range(300))
    near = {
        size: sum(
            bool((abs(pt.analyze.offset_steps(x).at - 400) <= 10).any())
            for x in (ar1(1000, 0.0, s) + size * (np.arange(1000) >= 400) for s in range(100))
        )
        for size in (1.0, 2.0)
    }
    assert none <= 2
    assert near[1.0] >= 88
    assert near[2.0] >= 99


def test_rows_that_do_not_count_are_left_out_and_times_are_the_records():
    y = 5.0 * (np.arange(200) >= 120) + 0.1 * ar1(200, 0.0, 3)
    valid = np.ones(200, bool)
    valid[50:60] = False
    rec = pt.Record(u=np.zeros(200), y=np.where(valid, y, 1e6), Ts=2.0, t0=10.0, valid=valid)
    found = pt.analyze.offset_steps(rec)
    assert found.at.tolist() == [120]
    assert found.t.tolist() == [250.0]
    assert found.sizes == approx([5.0], abs=0.1)
    assert [note.code for note in found.notes] == ["M08"]


def test_what_the_input_explains_is_taken_off_first():
    rec = pt.datasets.engine_loop(noise_var=1.5)
    fit = pt.estimate.process(rec, "P1D")
    y = rec.y[:, 0] + 20.0 * (np.arange(rec.N) >= 1500)
    loaded = pt.Record(u=rec.u, y=y, Ts=rec.Ts)
    found = pt.analyze.offset_steps(loaded, fit)
    assert abs(found.at - 1500).min() <= 5


def test_refusals():
    with pytest.raises(pt.DataError) as caught:
        pt.analyze.offset_steps([1.0, np.nan, 2.0])
    assert caught.value.code == "D07"
