"""Preisach: relays one by one, closed forms, curves there and back, the inverse, the fit."""

import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import play, preisach
from plantune.errors import NotIdentifiable, UsageError

LEVELS = np.linspace(-1.0, 1.0, 13)
N = len(LEVELS) - 1
RNG = np.random.default_rng(11)
MU = np.tril(RNG.random((N, N)))
CELLS = preisach.cells(N)
WALK = np.clip(np.cumsum(RNG.standard_normal(4000)) / 6, -1.3, 1.3)
WALK = np.clip(WALK - WALK.mean(), -1, 1)


def model(mu=MU, levels=LEVELS, **options):
    return pt.hysteresis.Preisach(levels=levels, mu=mu, **options)


def flat(mu):
    return mu[CELLS[:, 0], CELLS[:, 1]]


# -- the operator --------------------------------------------------------------------------------


def test_on_the_levels_it_is_the_relays_one_by_one():
    x = LEVELS[RNG.integers(0, N + 1, 600)]
    ours = model(start="negative").simulate(x)
    assert np.abs(ours - preisach.output(x, LEVELS, flat(MU))).max() < 1e-11 * MU.sum()


@pytest.mark.parametrize("start", [-1.0, "virgin"])
def test_between_the_levels_it_is_the_interpolated_table(start):
    x = WALK[:800]
    ours = model(start="negative" if start == -1.0 else start).simulate(x)
    theirs = preisach.by_table(x, preisach.everett(flat(MU)), LEVELS, start)
    # The oracle reaches the virgin state by 2000 pairs of extremes, a staircase along the line.
    assert np.abs(ours - theirs).max() < (1e-11 if start == -1.0 else 1e-5) * MU.sum()


def test_on_uneven_levels_too():
    levels = np.sort(np.concatenate([LEVELS, 0.9 + 0.001 * np.arange(5)]))
    mu = np.tril(RNG.random((len(levels) - 1,) * 2))
    cells = preisach.cells(len(levels) - 1)
    table = preisach.everett(mu[cells[:, 0], cells[:, 1]])
    ours = model(mu, levels, start="negative").simulate(WALK[:800])
    assert np.abs(ours - preisach.by_table(WALK[:800], table, levels)).max() < 1e-11 * mu.sum()


def test_a_stack_of_plays_is_one():
    r, w = (LEVELS[6:9] - LEVELS[6]) / 2, [1.0, 0.5, 0.25]
    relays = model(None, everett=preisach.play_everett(LEVELS, r, w))
    x = LEVELS[RNG.integers(0, N + 1, 500)]
    assert np.abs(relays.simulate(x) - play.stack(x, r, w)).max() < 1e-12


def test_the_first_rise_of_symmetric_weights_is_e_of_x_and_minus_x():
    mu = np.zeros((N, N))
    for i, j in CELLS:
        mu[i, j] = mu[N - 1 - j, N - 1 - i] = MU[i, j]
    x = np.linspace(0, 1, 300)
    table = preisach.everett(flat(mu))
    first = [preisach.interpolate(table, LEVELS, s, -s) for s in x]
    assert np.abs(model(mu).simulate(x) - first).max() < 1e-12 * mu.sum()
    assert np.abs(model(mu).simulate(-x) + first).max() < 1e-12 * mu.sum()


@pytest.mark.parametrize("ends", [(-1.0, 0.4), (-0.3, 1.0), (0.0, 1.0), (-1.0, 0.0), (0.2, 1.0)])
def test_virgin_is_every_relay_below_the_antidiagonal_up(ends):
    """Zero within the range or not: against relays on a fine grid, half a cell apart at most."""
    levels = np.linspace(*ends, 41)
    mu = np.full((40, 40), 1.0) * np.tri(40)
    cells, scale = preisach.cells(40), mu.sum()
    x = np.clip(WALK[:500] * 0.9, *ends)
    relays = preisach.relays(x, levels, "virgin") @ mu[cells[:, 0], cells[:, 1]]
    assert np.abs(model(mu, levels).simulate(x) - relays).max() < 0.06 * scale


def test_a_larger_extreme_wipes_out_the_smaller_ones():
    one, other = model().stream(), model().stream()
    one.run(np.array([0.2, -0.3, 0.5, -0.1, 0.4, 0.0, 0.7]))
    other.run(np.array([0.7]))
    assert one.state[0] == 0.7
    rest = WALK[:300]
    loud = np.concatenate([[-0.8], rest])
    assert np.abs(one.run(loud) - other.run(loud)).max() < 1e-12 * MU.sum()
    assert len(one.state) == len(other.state)


def test_minor_loops_between_the_same_ends_are_congruent():
    loops = []
    for before in ([-1.0, 0.3], [1.0, -0.9, 0.3], [0.6, -0.2, 0.3]):
        stream = model().stream()
        stream.run(np.array(before))
        loop = stream.run(np.concatenate([np.linspace(0.3, -0.1, 30), np.linspace(-0.1, 0.3, 30)]))
        loops.append(loop - loop[0])
        assert loop[-1] == approx(loop[0], abs=1e-12 * MU.sum())
    assert np.abs(np.array(loops) - loops[0]).max() < 1e-12 * MU.sum()


def test_repeated_loops_take_no_memory():
    stream = model().stream()
    stream.run(np.tile([1.0, -1.0, 0.5, -0.5], 500))
    assert len(stream.state) <= 3 + 2 * 5


def test_beyond_the_levels_it_is_saturated():
    relays = model(offset=2.0)
    assert relays.simulate([7.0, -7.0]) == approx([2 + MU.sum(), 2 - MU.sum()])


# -- curves and tables ---------------------------------------------------------------------------


def staircase(levels):
    """Up to each level and down again, through all levels on the way."""
    steps = [np.concatenate([levels[: a + 1], levels[a - 1 :: -1]]) for a in range(1, len(levels))]
    return np.concatenate(steps)


def test_weights_and_table_are_each_others_inverse():
    again = pt.hysteresis.Preisach(levels=LEVELS, everett=model().everett)
    assert np.abs(again.mu - MU).max() < 1e-13 * MU.sum()
    assert model().everett == approx(preisach.everett(flat(MU)), abs=1e-12 * MU.sum())


@pytest.mark.parametrize("sign", [1, -1])
def test_curves_give_the_model_and_the_model_the_curves(sign):
    """Falling curves from below, and, with both signs turned, rising ones from above."""
    truth = model(offset=-3.0, start="negative")
    x = staircase(LEVELS) if sign > 0 else -staircase(-LEVELS[::-1])
    y = truth.simulate(np.concatenate([[1.0], x]))[1:] if sign < 0 else truth.simulate(x)
    forc = pt.hysteresis.forc(x, y)
    assert forc.rising == (sign < 0) and len(forc.curves) == N
    again = pt.hysteresis.Preisach.from_forc(forc, start="negative")
    assert again.levels == approx(LEVELS) and again.offset == approx(-3.0)
    assert np.abs(again.mu - MU).max() < 1e-12 * MU.sum()
    assert np.abs(again.simulate(WALK) - truth.simulate(WALK)).max() < 1e-11 * MU.sum()
    assert forc.curves[-1][0][0] == LEVELS[-1] if sign > 0 else forc.curves[0][0][0] == LEVELS[0]


def test_curves_may_come_in_any_order():
    x = np.concatenate(
        [np.concatenate([LEVELS[: a + 1], LEVELS[a - 1 :: -1]]) for a in (7, 2, 12, 4)]
    )
    forc = pt.hysteresis.forc(x, model(start="negative").simulate(x))
    assert forc.levels == approx(LEVELS[[0, 2, 4, 7, 12]])
    assert forc.everett[4, 0] == approx(MU.sum())


@pytest.mark.parametrize("x", [WALK, np.linspace(-1, 1, 50), np.zeros(20)])
def test_what_is_no_family_of_curves_is_refused(x):
    with pytest.raises(NotIdentifiable, match="turns"):
        pt.hysteresis.forc(x, x)


# -- the inverse ---------------------------------------------------------------------------------


@pytest.mark.parametrize("start", ["virgin", "negative"])
@pytest.mark.parametrize("levels", [LEVELS, LEVELS - 0.6, LEVELS + 0.7])
def test_the_inverse_finds_the_output_again(start, levels):
    relays = model(MU + 0.01 * np.tri(N), levels, offset=5.0, start=start)
    total = relays.mu.sum()
    y = 5 + total * np.clip(WALK, -0.999, 0.999)
    x = relays.inverse().simulate(y)
    assert np.abs(relays.simulate(x) - y).max() < 1e-12 * total


def test_the_inverse_finds_the_input_again():
    relays = model()
    assert np.abs(relays.inverse().simulate(relays.simulate(WALK)) - WALK).max() < 1e-9


def test_where_nothing_happens_the_inverse_moves_as_little_as_it_can():
    mu = np.zeros((3, 3))
    mu[2, 0] = 1.0
    inverse = model(mu, [0.0, 1.0, 2.0, 3.0], start="negative").inverse()
    # Up at alpha in [2, 3], and not before the input is below 1 down again.
    assert inverse.simulate([-1.0, 0.0, 1.0, 1.0, 0.0]) == approx([0.0, 2.5, 3.0, 3.0, 0.5])


def test_beyond_saturation_the_inverse_is_the_end_of_the_range():
    assert model().inverse().simulate([1e9, -1e9]) == approx([1.0, -1.0])


def test_a_negative_weight_has_no_inverse():
    mu = MU.copy()
    mu[5, 2] = -0.5
    with pytest.raises(UsageError, match="nowhere negative"):
        model(mu).inverse()


# -- live, pickled, refused ----------------------------------------------------------------------


@pytest.mark.parametrize("relays", [model(), model(start="negative"), model().inverse()])
def test_live_is_replay_and_a_pickled_stream_goes_on(relays):
    stream = relays.stream()
    live = [stream.step(x) for x in WALK[:500]]
    assert np.array_equal(live, relays.simulate(WALK[:500]))
    again = pickle.loads(pickle.dumps(stream))
    assert np.array_equal(again.run(WALK[500:]), stream.run(WALK[500:]))
    assert again.model.same_as(relays) and type(again.model) is type(relays)


def test_what_is_no_number_leaves_the_state():
    stream = model().stream()
    stream.run(WALK[:50])
    before = stream.state
    assert np.isnan(stream.step(float("nan"))) and np.array_equal(stream.state, before)


@pytest.mark.parametrize("state", [[], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 2.0, 0.0], [9, 0, 1, 0, 0]])
def test_a_state_of_another_model_is_refused(state):
    with pytest.raises(UsageError, match="state"):
        model().stream().state = np.array(state, float)


@pytest.mark.parametrize(
    "fields",
    [
        {"levels": [0.0], "mu": []},
        {"levels": [1.0, 0.0], "mu": [[1.0]]},
        {"levels": [0.0, 1.0, 2.0], "mu": [[1.0]]},
        {"levels": [0.0, 1.0, 2.0], "mu": [[1.0, 1.0], [1.0, 1.0]]},
        {"levels": [0.0, 1.0], "mu": [[np.nan]]},
        {"levels": [0.0, 1.0]},
        {"levels": [0.0, 1.0], "mu": [[1.0]], "everett": [[0.0, 0.0], [1.0, 0.0]]},
        {"levels": [0.0, 1.0], "mu": [[1.0]], "start": "up"},
    ],
)
def test_parameters_that_are_none_are_refused(fields):
    with pytest.raises(UsageError):
        pt.hysteresis.Preisach(**fields)


# -- the fit -------------------------------------------------------------------------------------


def record(rng, n=2000, noise=1e-3):
    """An asymmetric stage, 0.1 % noise: four sines that reach both ends of the range."""
    t = np.arange(n) / n
    x = sum(
        np.sin(2 * np.pi * f * t + 6 * p)
        for f, p in zip((9, 23, 41, 67), rng.random(4), strict=True)
    )
    x = 2 * (x - x.min()) / np.ptp(x) - 1
    r = np.linspace(0, 1, 200)
    h = play.stack(x, r, 2 * np.exp(-2 * r) / 200 + 0.5 * (r == 0))
    y = h + 0.25 * h**2 + 0.1 * h**3
    return x, y, noise * np.ptp(y) * rng.standard_normal(n)


def test_the_fit_predicts_new_data_of_an_asymmetric_stage():
    """A smooth function of plays is no Preisach model; 0.15 to 0.3 % of the range were measured."""
    rng = np.random.default_rng(5)
    x, y, e = record(rng)
    found = pt.hysteresis.Preisach.identify(x, y + e)
    own = np.sqrt(np.mean((found.simulate(x) - y) ** 2)) / np.ptp(y)
    x, y, _ = record(rng)
    new = np.sqrt(np.mean((found.simulate(x) - y) ** 2)) / np.ptp(y)
    assert own < 1e-3 and new < 4e-3, (own, new)
    assert (found.mu >= 0).all()


def test_neighbours_fill_what_the_record_did_not_switch():
    """A stack of plays, from a record that rests in one half of its range but for one rise."""
    stack = pt.hysteresis.PlayStack(r=np.arange(10) / 10, w=np.full(10, 0.2))
    x = np.concatenate([0.8 * np.abs(WALK[:1500]), [-0.9, 0.9]])
    new = WALK[1500:]
    left = []
    for smooth in (0.0, 10.0):
        found = pt.hysteresis.Preisach.identify(
            x, stack.simulate(x), levels=np.linspace(-1, 1, 21), smooth=smooth
        )
        left.append(np.sqrt(np.mean((found.simulate(new) - stack.simulate(new)) ** 2)))
    assert left[1] < 0.3 * left[0], left


def test_the_fit_is_that_of_the_oracle():
    x = WALK[::8]
    y = model(offset=3.0).simulate(x) + 0.1 * RNG.standard_normal(len(x))
    levels = np.linspace(-1, 1, 6)
    ours = pt.hysteresis.Preisach.identify(
        x, y, levels=levels, ridge=0.5, smooth=0.0, start="negative"
    )
    mu, offset = preisach.fit(preisach.rows(x, levels), y, 0.5)
    cells = preisach.cells(5)
    assert ours.mu[cells[:, 0], cells[:, 1]] == approx(mu, abs=1e-6)
    assert ours.offset == approx(offset, abs=1e-6)
    assert ours.identified.rms == approx(np.sqrt(np.mean((ours.simulate(x) - y) ** 2)))


def test_levels_are_chosen_on_rows_not_used():
    x = WALK[:1500]
    coarse = np.linspace(x.min(), x.max(), 6)
    mu = np.tri(5)
    y = model(mu, coarse).simulate(x) + 0.05 * np.random.default_rng(2).standard_normal(len(x))
    found = pt.hysteresis.Preisach.identify(x, y, levels="auto")
    assert [n for n, _ in found.identified.tried] == [5, 10, 15, 20, 25]
    assert len(found.levels) - 1 == min(found.identified.tried, key=lambda t: t[1])[0]


def test_what_cannot_be_fitted_is_refused():
    identify = pt.hysteresis.Preisach.identify
    with pytest.raises(NotIdentifiable, match="throughout"):
        identify(np.ones(50), np.ones(50))
    for x, y, options in (
        (WALK, WALK[1:], {}),
        (WALK, WALK, {"ridge": 0.0}),
        (WALK, WALK, {"smooth": -1.0}),
        (WALK, WALK, {"levels": 0}),
        (WALK, WALK, {"levels": "many"}),
        (WALK, WALK, {"start": "up"}),
    ):
        with pytest.raises(UsageError):
            identify(x, y, **options)


# -- the figure ----------------------------------------------------------------------------------


def test_the_figure_shows_curves_and_weights():
    x = staircase(LEVELS)
    forc = pt.hysteresis.forc(x, model(start="negative").simulate(x))
    fig = pt.plot.forc(forc, x="field", y="output", y_unit="V")
    heat = next(trace for trace in fig.data if trace.type == "heatmap")
    z = np.array(heat.z, float)
    assert np.nanmax(np.abs(z - forc.mu)) == 0 and np.isnan(z[0, 1]) and heat.zmin == 0
    assert sum(trace.name == "measured" for trace in fig.data) == N
    assert fig.layout.xaxis2.title.text == "down at beta"
    assert heat.colorbar.title.text == "weight [V]"


def test_the_figure_shows_negative_weights_in_another_colour():
    mu = MU.copy()
    mu[5, 2] = -0.5
    (heat, _) = pt.plot.forc(model(mu)).data
    assert heat.zmin == -heat.zmax and len(heat.colorscale) == 3
