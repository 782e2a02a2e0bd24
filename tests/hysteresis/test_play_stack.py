"""Stacks of plays: the oracle's numbers, exact inverses, fits, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from oracles import play as oracle
from plantune.errors import DataError, NotIdentifiable, UsageError
from plantune.hysteresis import PlayStack


def some_stack(seed, n=None):
    """A stack, a third of its weights zero, and a record that moves all of it."""
    g = np.random.default_rng(seed)
    n = n or int(g.integers(1, 101))
    r = np.append(0.0, np.cumsum(g.exponential(size=n - 1)))
    w = g.uniform(0, 1, n) * (g.random(n) < 0.7)
    w[0] = g.uniform(0.02, 2)
    if seed % 3 == 0:
        w[1:] *= -0.9 * w[0] / max(w[1:].sum(), 1e-9)
    stack = PlayStack(r=r, w=w, offset=10 * g.normal())
    return stack, g.standard_normal(300).cumsum() * max(r[-1], 1.0) / 10


def swing(N, seed=0, turns=9):
    """A decaying swing of growing and falling loops, from the virgin state."""
    t = np.arange(N) / N
    return 5 * np.sin(2 * np.pi * turns * t + seed) * (1 - 0.9 * t)


def test_the_oracle_gives_the_same_from_any_state():
    stack, x = some_stack(1, 20)
    z = oracle.plays(x, stack.r)
    went_on = PlayStack(r=stack.r, w=stack.w, z0=z[99]).simulate(x[100:])
    assert went_on == approx(z[100:] @ stack.w, abs=1e-12)


@given(st.integers(0, 10_000))
def test_the_round_trip_is_exact(seed):
    """Issue 6: below 1e-12 of the range, up to 100 plays, from any state."""
    stack, x = some_stack(seed)
    stream = stack.stream()
    y = np.append(stream.run(x[:100]), stack.simulate(x)[100:])
    later = PlayStack(r=stack.r, w=stack.w, offset=stack.offset, z0=stream.state)
    for model, rows in [(stack, slice(0, None)), (later, slice(100, None))]:
        back = model.inverse().simulate(y[rows])
        assert np.abs(back - x[rows]).max() < 1e-12 * np.ptp(x)


def test_the_inverse_is_that_of_the_oracle():
    stack, x = some_stack(2, 12)
    z = oracle.plays(x, stack.r)[-1]
    inverse = PlayStack(r=stack.r, w=stack.w, z0=z).inverse()
    r, w = oracle.inverse(stack.r, stack.w)
    assert inverse.r == approx(r) and inverse.w == approx(w, abs=1e-12)
    assert inverse.z0 == approx(oracle.inverse_state(stack.w, z))
    again = inverse.inverse()
    assert again.r == approx(stack.r) and again.w == approx(stack.w) and again.z0 == approx(z)


def test_widths_that_rounding_makes_one_are_one_play():
    stack = PlayStack(r=[0, 1, np.nextafter(1, 2), 2], w=[1, -0.999, 0.5, 0.5])
    inverse = stack.inverse()
    assert len(inverse.r) == 3 and inverse.w.sum() == approx(1 / 1.001)
    x = swing(300)
    assert inverse.simulate(stack.simulate(x)) == approx(x, abs=1e-12)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"r": [0, 1], "w": [0, 1]}, "r = 0.0"),
        ({"r": [0, 1, 2, 3], "w": [1, -0.5, -0.5, 1]}, "-0.500000 at r = 2.0"),
        ({"r": [0, 1], "w": [0.3, -0.1 - 0.2]}, "partial sum"),
        ({"r": [0.5, 1], "w": [1, 1]}, "first play"),
        ({"r": [0, 1], "w": [1, 1], "z0": [0, 3]}, "plays 0 and 1"),
    ],
)
def test_what_has_no_inverse_says_which_play_is_to_blame(fields, said):
    with pytest.raises(UsageError, match=said):
        PlayStack(**fields).inverse()


# -- identification ---------------------------------------------------------------------


def test_the_fit_is_the_oracle_s():
    g = np.random.default_rng(5)
    x = swing(400)
    r = oracle.thresholds(x, 10)
    y = oracle.stack(x, r, g.uniform(0, 1, 10)) - 3 + 0.1 * g.standard_normal(len(x))
    found, theirs = PlayStack.identify(x, y, n=10), oracle.fit(x, y, r, offset=True)
    assert found.w == approx(theirs.w, abs=1e-9) and found.offset == approx(theirs.offset, abs=1e-9)
    assert found.identified.rms == approx(np.sqrt(np.mean((theirs.y - y) ** 2)))
    assert found.identified.names[-1] == "offset" and len(found.identified.sd) == 11


def test_standard_deviations_are_those_of_300_runs():
    x, r = swing(300), [0, 1, 2, 3]
    y = oracle.stack(x, r, [1, 0.5, 0.5, 0.5])
    g = np.random.default_rng(6)
    runs = [PlayStack.identify(x, y + 0.05 * g.standard_normal(300), r=r) for _ in range(300)]
    spread = np.std([[*run.w, run.offset] for run in runs], axis=0)
    said = np.mean([run.identified.sd for run in runs], axis=0)
    assert said == approx(spread, rel=0.15)  # sd of a sd over 300 runs: 4 %


def test_rows_not_used_choose_the_number_of_plays():
    g = np.random.default_rng(7)
    x = swing(1000)
    y = oracle.stack(x, oracle.thresholds(x, 5), [1, 0.4, 0.3, 0.2, 0.1])
    y += 0.02 * g.standard_normal(1000)
    found = PlayStack.identify(x, y)
    tried = dict(found.identified.tried)
    assert len(found.r) == 5 and tried[5] < 1.05 * min(tried.values()) < tried[3]


def test_rows_that_only_set_the_memory_are_skipped():
    x = np.append(swing(400, turns=3)[200:], swing(400))
    start = np.array([4.0, 3.0, 2.0])
    y = oracle.stack(x, [0, 1, 2], [1, 0.5, 0.5], z0=start)
    found = PlayStack.identify(x, y, r=[0, 1, 2], skip=300)
    assert found.w == approx([1, 0.5, 0.5], abs=1e-9) and found.identified.N == 300


def test_a_stage_that_has_been_up_before_is_fitted_after_its_first_rise():
    """0 to 100 V: half widths above 50 V move in the first rise alone."""
    rec = pt.datasets.piezo_stage(cycles=2, drift=0, digit=0)
    x, y = rec.u[:, 0], rec.y[:, 0]
    (note,) = [n for n in PlayStack.identify(x, y, asymmetric=True).notes if n.code == "H06"]
    assert note.remedy.startswith("skip=1000")
    found = PlayStack.identify(x, y, asymmetric=True, skip=1000)
    assert found.identified.rms < 1e-3 * np.ptp(y) and found.identified.N == 3001
    assert "H06" not in [n.code for n in found.notes] and found.r[-1] < 50


def test_a_loop_that_runs_clockwise_points_to_maxwell_slip():
    x = np.tile(np.concatenate([np.linspace(-1, 1, 100), np.linspace(1, -1, 100)]), 3)
    stop = oracle.stop(x, 0.3)
    notes = PlayStack.identify(x, 2 * x + stop, n=5).notes
    assert [n.code for n in notes if n.code == "H02"] and "MaxwellSlip" in notes[-1].remedy
    play = oracle.play(x, 0.3)
    assert "H02" not in [n.code for n in PlayStack.identify(x, 2 * x + play, n=5).notes]
    with pytest.raises(NotIdentifiable, match="constant") as refused:
        PlayStack.identify(x, stop - x, n=5)
    assert refused.value.code == "X04" and "MaxwellSlip" in refused.value.remedy


def test_a_first_rise_alone_is_a_doubt():
    x = np.linspace(0, 1, 200)
    found = PlayStack.identify(x, oracle.stack(x, [0, 0.5], [1, 1]), r=[0, 0.5])
    assert found.w == approx([1, 1], abs=1e-9)
    assert [note.code for note in found.notes] == ["H03"]


def test_weights_at_zero_are_told():
    x = swing(400)
    y = oracle.stack(x, [0, 1, 2], [1, 0, 1]) + 1e-3 * np.cos(np.arange(400))
    found = PlayStack.identify(x, y - 0.01 * oracle.play(x, 1), r=[0, 1, 2])
    assert [note.text for note in found.notes] == ["at zero: w1"]
    assert found.identified.sd[1] == 0


def test_input_beyond_what_was_fitted_is_told():
    x = swing(300)
    found = PlayStack.identify(x, x, n=3)
    assert found.check_range(0.9 * x) == ()
    (note,) = found.check_range([1.0, -7.0])
    assert note.code == "H04" and note.measured == -7
    assert PlayStack(r=[0], w=[1]).check_range([100.0]) == ()


X = swing(100)


@pytest.mark.parametrize(
    ("x", "y", "options", "error", "code"),
    [
        (X, X[:-1], {}, DataError, "D09"),
        (X, X, {"n": 0}, UsageError, "U01"),
        (X, X, {"n": "many"}, UsageError, "U01"),
        (X, X, {"asymmetric": True, "even": True}, UsageError, "U01"),
        (X, X, {"r": [1, 0]}, UsageError, "U01"),
        (np.full(100, 2.0), X, {}, NotIdentifiable, "X01"),
        (np.repeat([0.0, 1, 0, 1], 25), X, {"n": 8}, NotIdentifiable, "X02"),
        (X[:15], X[:15], {}, NotIdentifiable, "X03"),
        (X[:40], X[:40], {"n": 60}, NotIdentifiable, "X03"),
        (X, np.random.default_rng(1).standard_normal(100), {"n": 5}, NotIdentifiable, "X04"),
        (X, np.zeros(100), {"n": 5}, NotIdentifiable, "X04"),
    ],
)
def test_what_cannot_be_fitted_is_refused(x, y, options, error, code):
    with pytest.raises(error) as refused:
        PlayStack.identify(x, y, **options)
    assert refused.value.code == code and refused.value.remedy


# relative error in percent, as the oracle has it; free signs do not help, nor do more plays
PIEZO = {"08kv": 12.92, "1kv": 11.56, "11kv": 12.73, "15kv": 15.99, "19kv": 28.71}


def test_butterfly_loops_of_a_piezo_are_no_stack_of_plays(data):
    path = data("piezo_kv") / "MeasurementData.mat"
    for name, percent in PIEZO.items():
        rec = pt.read(path, u=f"Vplus_{name}", y=f"Displacement_{name}", Ts=1.0)
        found = PlayStack.identify(rec.u[:, 0], rec.y[:, 0], n=10)
        assert 100 * found.identified.relative == approx(percent, abs=0.005)
        assert "H01" in [note.code for note in found.notes]
