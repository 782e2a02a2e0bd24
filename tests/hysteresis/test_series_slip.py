"""Elements in series: table 4.1 of source 002, their inverse, and how they are learnt."""

import doctest
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from hysteresis.loops import LOOPS, cosine, plays
from oracles import series_slip as oracle
from plantune.errors import DataError, NotIdentifiable, NumericsError, UsageError
from plantune.hysteresis import SeriesSlip, SeriesSlipLearner

TABLE = SeriesSlip(up=oracle.TABLE_4_1.up, down=oracle.TABLE_4_1.down)
WALK = 50 + np.random.default_rng(7).standard_normal(2000).cumsum()


def oracle_of(x, model):
    return oracle.anchored(x, model.up.tolist(), model.down.tolist(), F0=model.up[0, 1])


# -- the model ---------------------------------------------------------------------------


def test_table_4_1_gives_the_numbers_of_errata():
    """44.13 um at 100 V, 21.87 and 27.43 at 50 V, and 5.6 um of a jump where it turns there."""
    y = TABLE.simulate([0.0, 50.0, 100.0, 50.0])
    assert y == approx([1.205, 21.8741, 44.1306, 27.4304], abs=5e-5)
    assert np.diff(TABLE.simulate([0.0, 50.0, 49.9999]))[1] == approx(5.556, abs=1e-3)


def test_prints_table_4_1():
    rows = [line.split() for line in str(TABLE).splitlines()]
    assert rows[0] == ["element", "input", "x_b", "F_i", "k"]
    assert [row[2:] for row in rows[1:]] == [
        ["0", "1.205", "0.3547"],
        ["9.1877", "3.9765", "0.3547"],
        ["19.538", "8.3145", "0.44513"],
        ["97.908", "43.862", "0.2777"],
        ["65.378", "33.981", "0.42597"],
        ["21.593", "14.46", "0.59484"],
    ]
    assert [row[1] for row in rows[1:]] == ["rising"] * 3 + ["falling"] * 3


def test_every_sample_is_that_of_the_oracle():
    assert TABLE.simulate(WALK) == approx(oracle_of(WALK, TABLE), abs=1e-12)


def test_live_is_replay_and_goes_on_from_a_pickle():
    stream, y = TABLE.stream(), TABLE.simulate(WALK)
    assert np.array_equal([stream.step(x) for x in WALK[:900]], y[:900])
    assert np.array_equal(pickle.loads(pickle.dumps(stream)).run(WALK[900:]), y[900:])


def test_what_is_no_reading_holds_the_output():
    stream = TABLE.stream()
    held = stream.step(50.0)
    assert stream.step(float("nan")) == held == stream.step(50.0)


def test_a_million_cycles_do_not_drift():
    stream, x = TABLE.stream(), np.tile(cosine(20)[:-1], 1000)
    first = stream.run(x)[20:40]
    for _ in range(999):
        last = stream.run(x)[-20:]
    assert np.array_equal(first, last)
    # Summed up instead, as the text has it, each cycle leaves 2.2 um.
    assert oracle.drift(TABLE.up.tolist(), TABLE.down.tolist(), 0, 100) == approx(2.2171, abs=1e-4)


def test_closed_elements_meet_and_sum_up_to_nothing():
    loop = TABLE.closed()
    up, down = loop.up.tolist(), loop.down.tolist()
    assert loop.up[:2, 2] == approx([0.302, 0.419], abs=5e-4)  # chords of ERRATA
    assert oracle.drift(up, down, 0, 97.908) == approx(0, abs=1e-12)
    x = np.r_[np.linspace(0, 97.908, 4000), np.linspace(97.908, 0, 4000)]
    assert np.abs(np.diff(loop.simulate(x))).max() < 1.1 * 97.908 / 4000


def test_through_moves_by_one_constant():
    moved = TABLE.through(50.0, 30.0, "down")
    assert moved.simulate([100.0, 50.0])[1] == approx(30.0, abs=1e-12)
    assert np.ptp(np.r_[moved.up - TABLE.up, moved.down - TABLE.down][:, 1]) < 1e-12
    assert np.array_equal(moved.up[:, [0, 2]], TABLE.up[:, [0, 2]])


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"up": [(1, 0, 1), (0, 0, 1)]},
        {"up": [(0, 0, 1), (0, 1, 1)]},
        {"down": [(0, 0, 1), (1, 0, 1)]},
        {"up": [(0, float("nan"), 1)]},
        {"up": [(0, 1)]},
        {"up": [0, 1, 2]},
    ],
)
def test_what_is_no_group_is_refused(fields):
    with pytest.raises(UsageError, match=next(iter(fields), "up")):
        SeriesSlip(**fields)


# -- its inverse -------------------------------------------------------------------------


def test_inverse_is_exact_inside_elements_and_crosses_gaps_at_the_breakpoint():
    """Against the oracle on the branches; the round trip is off by the gap at most."""
    inverse = TABLE.inverse()
    for group, way, y in (
        (TABLE.up, 1, np.linspace(1.3, 44.0, 500)),
        (TABLE.down, -1, np.linspace(43.8, 2.0, 500)),
    ):
        before = [y[0] - 0.1] if way > 0 else [0.0, 44.0]
        x = inverse.simulate(np.r_[before, y])[len(before) :]
        there = [oracle.inverse(v, TABLE.up.tolist(), TABLE.down.tolist(), way) for v in y]
        assert x == approx(there, abs=1e-12)
        back = TABLE.simulate(np.r_[0.0 if way > 0 else 100.0, x])[1:]
        ends = group[:-1, 1] + group[:-1, 2] * np.diff(group[:, 0])
        gaps = np.abs(group[1:, 1] - ends)
        inside = ~np.any(
            [(y > min(a, b)) & (y < max(a, b)) for a, b in zip(ends, group[1:, 1], strict=True)],
            axis=0,
        )
        assert back[inside] == approx(y[inside], abs=1e-12)
        assert np.abs(back - y).max() <= gaps.max()


def test_inverse_of_a_closed_loop_is_exact_all_around():
    loop = TABLE.closed()
    y = loop.simulate(cosine(500) * 0.97908)
    assert loop.simulate(loop.inverse().simulate(y)) == approx(y, abs=1e-12)
    assert len(loop.inverse().up) == len(loop.up)


@given(
    st.lists(
        st.tuples(st.floats(0.1, 5), st.floats(-2, 2), st.floats(0.05, 3)), min_size=1, max_size=6
    )
)
def test_round_trip_is_off_by_the_largest_gap_at_most(steps):
    """Any rising group: widths of the elements, jumps between them, slopes."""
    x_b, y_b, k = 0.0, 0.0, 1.0
    up, ends = [(x_b, y_b, k)], []
    for width, jump, slope in steps:
        ends.append(y_b + k * width)
        x_b, y_b, k = x_b + width, ends[-1] + jump, slope
        up.append((x_b, y_b, k))
    model = SeriesSlip(up=up)
    y = np.linspace(0, max(ends[-1], y_b) + 3, 400)
    back = model.simulate(model.inverse().simulate(y))
    reached = np.maximum.accumulate(ends)
    gaps = np.maximum(0, model.up[1:, 1] - reached)
    assert np.abs(back - y).max() <= gaps.max() + 1e-9


def test_inverse_of_a_falling_slope_is_refused():
    with pytest.raises(UsageError, match="slope"):
        SeriesSlip(up=[(0, 0, 1), (1, 1, -0.2)]).inverse()


# -- learning ----------------------------------------------------------------------------


@pytest.mark.parametrize("N", [100, 200, 500, 1000, 4000])
@pytest.mark.parametrize("loop", LOOPS.values(), ids=LOOPS)
def test_three_or_four_elements_a_direction_at_half_a_micrometre(loop, N):
    """Source 002, 4.5: 60 um, threshold 0.5 um."""
    x, y = loop(N)
    model = SeriesSlip.identify(x, y, threshold=0.5)
    assert {len(model.up), len(model.down)} <= {3, 4} and not model.notes
    assert model.identified.worst < 0.53
    assert model.identified.worst == approx(np.abs(y - model.simulate(x)).max())


@pytest.mark.parametrize("consecutive", [1, 3])
@pytest.mark.parametrize("loop", LOOPS.values(), ids=LOOPS)
def test_elements_are_those_of_the_oracle(loop, consecutive):
    x, y = loop(1000)
    model = SeriesSlip.identify(x, y, 0.5, consecutive)
    expected = oracle.identify(x, y, 0.5, consecutive=consecutive, back=True)
    assert model.up == approx(np.array(expected.up), abs=1e-9)
    assert model.down == approx(np.array(expected.down), abs=1e-9)


def test_slope_of_an_element_is_recursive_least_squares():
    x = np.linspace(0, 3, 40)
    y = 1 + 0.4 * x + 0.05 * np.sin(9 * x)
    learner, rls = SeriesSlipLearner(threshold=10.0, P0=7.0), pt.recursive.RLS(1, P0=7.0)
    learner.run(x, y)
    rls.run((x - x[0])[1:, None], (y - y[0])[1:])
    assert learner.model.up[0] == approx([0, y[0], rls.theta[0]], abs=1e-14)


def test_errors_are_those_before_learning_and_live_is_replay():
    x, y = LOOPS["asymmetric"](400)
    learner, again = SeriesSlipLearner(threshold=0.5), SeriesSlipLearner(threshold=0.5)
    errors = learner.run(x, y)
    assert np.array_equal([again.step(*sample) for sample in zip(x, y, strict=True)], errors)
    assert errors[0] == 0 and errors[1] == approx(y[1] - y[0])
    assert np.array_equal(learner.model.up, again.model.up)
    assert learner.elements == (len(learner.model.up), len(learner.model.down))


@pytest.mark.parametrize("k", [0, 1, 7, 203, 390, 650])
def test_a_pickled_learner_goes_on(k):
    x, y = (np.tile(s[:-1], 2) for s in LOOPS["10 plays"](400))
    y = y + 0.2 * np.random.default_rng(0).normal(size=800)
    learner = SeriesSlipLearner(0.5, 3, noise_sd=0.2)
    learner.run(x[:k], y[:k])
    again = pickle.loads(pickle.dumps(learner))
    assert np.array_equal(again.run(x[k:], y[k:]), learner.run(x[k:], y[k:]))
    assert np.array_equal(again.model.down, learner.model.down)
    assert (again.threshold, again.consecutive, again.noise_sd) == (0.5, 3, 0.2)


def test_a_million_cycles_learn_one_loop():
    """No anchor moves, no element is added; 1000 cycles a block."""
    x, y = (np.tile(s[:-1], 1000) for s in plays(10)(24))
    learner = SeriesSlipLearner(threshold=0.5)
    learner.run(x, y)
    first = learner.model
    for _ in range(999):
        learner.run(x, y)
    last = learner.model
    assert np.array_equal(first.up, last.up) and np.array_equal(first.down, last.down)
    assert sum(learner.elements) <= 8


def test_a_minor_stretch_does_not_replace_a_major_one():
    x = np.r_[np.linspace(0, 100, 200), np.linspace(100, 0, 200), np.linspace(0, 30, 50)]
    learner = SeriesSlipLearner(threshold=0.5)
    learner.run(x, 0.5 * x)
    assert learner.model.up[0, 0] == 0 and np.ptp(x[400:]) == 30
    learner.run(np.linspace(30, 20, 20), 0.5 * np.linspace(30, 20, 20))
    assert learner.model.down[0, 0] == 100


def test_a_band_bears_noise_of_the_input():
    x, y = LOOPS["asymmetric"](2000)
    noisy = x + 0.05 * np.random.default_rng(1).normal(size=len(x))
    model = SeriesSlip.identify(noisy, y, 0.5, band=0.5)
    assert len(model.up) in (3, 4, 5) and len(model.down) in (3, 4, 5)
    assert np.abs(model.simulate(x) - y).max() < 0.7


def test_a_standstill_of_the_input_adds_no_element():
    """Creep at the top: no line can follow, and none is drawn upright."""
    x = np.r_[np.linspace(0, 50, 100), np.full(200, 50.0), np.linspace(50, 100, 100)]
    y = np.r_[np.linspace(0, 25, 100), 25 + 0.02 * np.arange(200), np.linspace(29, 54, 100)]
    model = SeriesSlip.identify(x, y, 0.5)
    assert len(model.up) <= 4 and np.all(np.diff(model.up[:, 0]) > 0)


@pytest.mark.parametrize(
    ("consecutive", "ratio", "mean"),
    [(3, 8, 6.1), (3, 4, 6.3), (3, 2, 8.5), (1, 8, 8.0), (5, 4, 6.1)],
)
def test_patience_keeps_noise_from_opening_elements(consecutive, ratio, mean):
    """Elements of both groups, six without noise, on the mean of 20 records; source 002, 4.3."""
    x, y = LOOPS["10 plays"](2000)
    counts = []
    for seed in range(20):
        noise = 0.5 / ratio * np.random.default_rng(seed).normal(size=len(y))
        model = SeriesSlip.identify(x, y + noise, 0.5, consecutive)
        counts.append(len(model.up) + len(model.down))
        assert np.abs(model.simulate(x) - y).max() < 1.0
    assert np.mean(counts) < mean


def test_one_exceedance_in_noise_runs_away_and_says_so():
    x, y = LOOPS["asymmetric"](2000)
    y = y + 0.25 * np.random.default_rng(0).normal(size=len(y))
    hasty = SeriesSlip.identify(x, y, 0.5, 1)
    assert len(hasty.up) + len(hasty.down) > 40
    assert {note.code for note in hasty.notes} == {"S01", "S03"}
    assert not SeriesSlip.identify(x, y, 0.5).notes  # three in a row, chosen by itself


def test_a_threshold_below_the_steps_of_y_is_noted():
    stage = pt.datasets.piezo_stage(1, digit=1.0)
    model = SeriesSlip.identify(stage.u[:, 0], stage.y[:, 0], 0.4)
    assert "S02" in {note.code for note in model.notes}


@pytest.mark.parametrize("rows", [slice(0, 400), slice(250, 700), slice(0, 990)])
def test_a_record_without_a_whole_cycle_is_noted(rows):
    x, y = LOOPS["10 plays"](1000)
    codes = {note.code for note in SeriesSlip.identify(x[rows], y[rows], 0.5).notes}
    assert ("S04" in codes) == (rows != slice(0, 990))


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        ({"threshold": 0.0}, UsageError),
        ({"threshold": float("nan")}, UsageError),
        ({"consecutive": 0}, UsageError),
        ({"P0": -1.0}, UsageError),
        ({"band": -1.0}, UsageError),
        ({"noise_sd": float("inf")}, UsageError),
        ({"y": np.zeros(3)}, DataError),
        ({"x": np.zeros(4)}, NotIdentifiable),
        ({"x": [0, 1, float("nan"), 2]}, UsageError),
    ],
)
def test_identify_refuses(wrong, error):
    arguments = {"x": [0.0, 1.0, 2.0, 1.0], "y": [0.0, 1.0, 2.0, 1.5]} | wrong
    with pytest.raises(error):
        SeriesSlip.identify(**arguments)


def test_a_sample_that_is_none_changes_nothing():
    learner = SeriesSlipLearner(threshold=0.5)
    with pytest.raises(NotIdentifiable, match="moved"):
        _ = learner.model
    learner.run([0.0, 1.0, 2.0], [0.0, 1.0, 2.0])
    before = learner.__getstate__()
    with pytest.raises(UsageError, match="`y`"):
        learner.step(3.0, float("nan"))
    with pytest.raises(NumericsError, match="overflow"):
        learner.step(1e200, 3.0)
    assert np.array_equal(learner.__getstate__(), before)
    with pytest.raises(UsageError, match="state"):
        learner.__setstate__(before[:-1])


def test_the_example_of_the_learner_runs():
    """A compiled class, which pytest does not look into."""
    (example,) = doctest.DocTestFinder().find(SeriesSlipLearner, "learner", module=False)[:1]
    assert doctest.DocTestRunner(verbose=False).run(example).failed == 0
