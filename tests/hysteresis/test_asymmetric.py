"""Asymmetric stacks: the oracle's numbers, exact inverses, one convex fit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

from oracles import play as oracle
from plantune.errors import UsageError
from plantune.hysteresis import AsymmetricStack, PlayStack

# Of the oracle: dead zones d with weights v; and the same as knots and slopes.
D, V = np.array([0, 0.3, 0.9, -0.5, -1.1]), np.array([1.2, 0.5, -0.7, -0.4, 0.6])
ZONES = {"knots": [-1.1, -0.5, 0.3, 0.9], "slopes": [1.4, 0.8, 1.2, 1.7, 1.0]}


def some(seed):
    """A stack, and a record that moves all of it."""
    g = np.random.default_rng(seed)
    n, m = int(g.integers(1, 101)), int(g.integers(1, 30))
    r = np.append(0.0, np.cumsum(g.exponential(size=n - 1)))
    x = g.standard_normal(300).cumsum() * max(r[-1], 1.0) / 10
    w = np.append(g.uniform(0.1, 2), g.uniform(0, 1, n - 1)) / n
    H = np.abs(PlayStack(r=r, w=w).simulate(x)).max()
    knots = np.sort(g.uniform(-H, H, m - 1))
    slopes, offset = g.uniform(0.1, 2, m), float(10 * g.normal())
    return AsymmetricStack(r=r, w=w, knots=knots, slopes=slopes, offset=offset), x


def test_the_oracle_gives_the_same():
    r, w = np.array([0, 0.3, 0.8]), np.array([1, 0.4, 0.3])
    x = 2 * np.sin(np.arange(300) / 20) * np.linspace(1, 0.1, 300)
    stack = AsymmetricStack(r=r, w=w, **ZONES, offset=3)
    y = oracle.modified(x, r, w, D, V)
    assert stack.simulate(x) == approx(y + 3, abs=1e-13)
    inverse = stack.inverse()
    assert inverse.simulate(y + 3) == approx(oracle.modified_inverse(y, r, w, D, V), abs=1e-13)


@given(st.integers(0, 10_000))
def test_the_round_trip_is_exact(seed):
    stack, x = some(seed)
    stream = stack.stream()
    y = np.append(stream.run(x[:100]), stack.simulate(x)[100:])
    inverse = stack.inverse()
    assert np.abs(inverse.simulate(y) - x).max() < 1e-12 * np.ptp(x)
    later = AsymmetricStack(
        r=stack.r, w=stack.w, knots=stack.knots, slopes=stack.slopes, z0=stream.state
    )
    back = later.inverse().simulate(y[100:] - stack.offset)
    assert np.abs(back - x[100:]).max() < 1e-12 * np.ptp(x)
    again = inverse.inverse()
    assert again.knots == approx(stack.knots) and again.slopes == approx(stack.slopes)


def test_run_is_step_in_a_loop_and_streams_go_on():
    stack, x = some(4)
    for model, signal in [(stack, x), (stack.inverse(), stack.simulate(x))]:
        stream = model.stream()
        assert np.array_equal([stream.step(v) for v in signal], model.simulate(signal))


@pytest.mark.parametrize(
    "fields",
    [
        {"knots": [0], "slopes": [1]},
        {"knots": [1, 0], "slopes": [1, 1, 1]},
        {"knots": [0], "slopes": [1, 0]},
        {"knots": [0], "slopes": [1, -1]},
        {"knots": [], "slopes": []},
    ],
)
def test_curves_that_do_not_rise_are_refused(fields):
    with pytest.raises(UsageError):
        AsymmetricStack(r=[0], w=[1], **fields)


# -- identification ---------------------------------------------------------------------


def test_the_convex_fit_finds_the_truth():
    r = np.array([0, 0.5, 1.0, 1.5])
    x = 2 * np.sin(np.arange(800) / 15) * np.linspace(1, 0.05, 800)
    kappa = np.linspace(-3, 3, 5)
    h = oracle.stack(x, r, [1, 0.3, 0.2, 0.1])
    low, high = h.min(), h.max()
    knots = low + (high - low) * np.array([0.3, 0.6])
    truth = AsymmetricStack(r=r, w=[1, 0.3, 0.2, 0.1], knots=knots, slopes=[0.5, 1, 2], offset=1)
    y = truth.simulate(x)
    found = PlayStack.identify(x, y, r=r, asymmetric=True, segments=60)
    assert len(kappa) and found.identified.rms < 3e-3 * np.ptp(y)
    assert found.simulate(x[::-1]) == approx(truth.simulate(x[::-1]), abs=0.02 * np.ptp(y))


TRUTHS = {
    "square": (lambda h: h + 0.25 * h**2, 40, 0.5, 0.02),
    "cubic": (lambda h: h + 0.25 * h**2 + 0.1 * h**3, 200, 0.306, 0.0153),
    "sinh": (lambda h: np.sinh(1.2 * h), 200, 0.306, 0.0153),
}


def wander(g, N=2000):
    """Four sines after a ramp to both ends of the range."""
    t = np.arange(N * 5 // 6) / (N * 5 // 6)
    phases = zip([3, 7.3, 11.1, 17], g.uniform(0, 2 * np.pi, 4), strict=True)
    x = sum(np.sin(2 * np.pi * f * t + p) for f, p in phases)
    x = x / np.abs(x).max()
    ramp = np.interp(np.arange(N // 6), [0, N / 24, N / 8, N / 6], [0, 1, -1, x[0]])
    return np.append(ramp, x)


@pytest.mark.parametrize("name", TRUTHS)
def test_an_asymmetric_stage_under_noise(name):
    """Issue 6: noise of 0.1 %, at most 0.05 % of the range on new data, of every one of 12 seeds.

    None of the truths is in the class: more plays than are fitted, and a smooth curve.
    """
    S, n, w0, w = TRUTHS[name]
    r = np.arange(n) / n
    plays = PlayStack(r=r, w=np.append(w0, w * np.exp(-3 * r[1:])))

    def stage(x):
        return S(plays.simulate(x))

    left = []
    for seed in range(12):
        g = np.random.default_rng(seed)
        x, new = wander(g), wander(g)
        y, wish = stage(x), stage(new)
        noisy = y + 1e-3 * np.ptp(y) * g.standard_normal(len(y))
        found = PlayStack.identify(x, noisy, asymmetric=True)
        symmetric = PlayStack.identify(x, noisy, n=30)
        signals = [
            found.simulate(new),
            stage(found.inverse().simulate(wish)),  # feed-forward
            symmetric.simulate(new),
        ]
        left.append([np.sqrt(np.mean((v - wish) ** 2)) / np.ptp(wish) for v in signals])
    model, feed_forward, symmetric = np.max(left, axis=0)
    assert model < 5e-4 and feed_forward < 5e-4
    assert np.min(left, axis=0)[2] > 20 * model


def test_the_symmetric_stack_leaves_what_the_source_of_the_method_says():
    """Feed-forward with the inverse of a symmetric stack leaves 1 to 2 %."""
    S, n, w0, w = TRUTHS["square"]
    r = np.arange(n) / n
    plays = PlayStack(r=r, w=np.append(w0, w * np.exp(-3 * r[1:])))
    x = wander(np.random.default_rng(0))
    y = S(plays.simulate(x))
    inverse = PlayStack.identify(x, y, n=20).inverse()
    left = S(plays.simulate(inverse.simulate(y))) - y
    assert 0.5e-2 < np.sqrt(np.mean(left**2)) / np.ptp(y) < 4e-2


def test_segments_without_a_slope_take_a_neighbour_s():
    """A curve that jumps: y skips the segments across the jump."""
    x = np.sin(np.arange(600) / 10) * np.linspace(1, 0.1, 600)
    y = x + (x > 0.3)
    found = PlayStack.identify(x, y, n=3, asymmetric=True)
    assert "H05" in [note.code for note in found.notes]
    assert np.all(found.slopes > 0) and np.isfinite(found.slopes).all()
    assert found.identified.rms < 0.2


def test_standard_deviations_have_the_size_of_the_spread():
    """Not more: y stands on both sides of the fit, so that they are those of the first order."""
    r = np.array([0, 0.4, 0.8])
    x = np.sin(np.arange(600) / 10) * np.linspace(1, 0.1, 600)
    y = PlayStack(r=r, w=[1, 0.5, 0.3]).simulate(x)
    g = np.random.default_rng(2)
    runs = [
        PlayStack.identify(x, y + 3e-3 * g.standard_normal(600), r=r, asymmetric=True, segments=3)
        for _ in range(60)
    ]
    values = [[*run.w, *run.slopes, run.offset] for run in runs]
    said = np.mean([run.identified.sd for run in runs], axis=0)
    spread = np.std(values, axis=0)
    assert said[3 + 1] == spread[3 + 1] == 0  # sets the scale
    ratio = np.delete(said / np.maximum(spread, 1e-12), 4)
    assert np.all((ratio > 0.4) & (ratio < 2.5))
