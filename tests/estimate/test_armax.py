"""ARMAX: consistent under coloured noise of the equation, where ARX is not."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import pem

SECOND = pem.orders(na=2, nb=2, nc=2)
THETA = [-1.5, 0.7, 0.5, 0.2, -0.9, 0.3]
# The engine of source 001 at its first operating point, sampled at 20 ms: a, b and a c.
ENGINE = (-np.exp(-0.02 / 0.1491), -5.939 * (1 - np.exp(-0.02 / 0.1491)), 0.8)


def plant(N=400, seed=1, sd=0.1):
    """Simulate a second-order plant on white input and white noise."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=N)
    return u, pem.simulate(SECOND, THETA, u, sd * rng.normal(size=N))


def test_parameters_are_named_by_polynomial_and_input():
    u, y = plant()
    fit = pt.estimate.armax(pt.Record(u=u, y=y, Ts=0.1), 2, 2, 1)
    assert fit.names == ("a1", "a2", "b1", "b2", "c1")
    two = np.column_stack([u, np.roll(u, 7)])
    rec = pt.Record(u=two, y=y, Ts=0.1, u_names=["power", "fan"])
    fit = pt.estimate.armax(rec, 2, [2, 1], 1)
    assert fit.names == ("a1", "a2", "b1[power]", "b2[power]", "b1[fan]", "c1")


@pytest.mark.parametrize("offset", [True, False])
def test_without_c_it_is_least_squares(offset):
    u, y = plant()
    rec = pt.Record(u=u, y=y + 3.0, Ts=0.1, starts=(0, 150))
    fit = pt.estimate.armax(rec, 2, 3, 0, 2, offset=offset)
    ref = pt.estimate.arx(rec, 2, 3, 2, offset=offset)
    assert fit.N == ref.N
    assert fit.theta == approx(ref.theta, rel=1e-9, abs=1e-11)
    assert fit.offset == approx(ref.offset, rel=1e-9)
    assert fit.loss == approx(ref.loss, rel=1e-11)
    assert fit.P == approx(ref.P, rel=1e-7, abs=1e-9 * np.abs(ref.P).max())


def test_coloured_noise_does_not_bias_it_as_it_does_arx():
    seeds, found = 100, {"armax": [], "arx": []}
    for seed in range(seeds):
        u, y = plant(1000, seed, sd=0.5)
        rec = pt.Record(u=u, y=y, Ts=0.1)
        found["armax"].append(pt.estimate.armax(rec, 2, 2, 2).theta[:4])
        found["arx"].append(pt.estimate.arx(rec, 2, 2).theta)

    def bias(thetas):  # in standard errors of the mean
        return np.abs(np.mean(thetas, axis=0) - THETA[:4]) / (np.std(thetas, axis=0) / seeds**0.5)

    # u(t-1) is white and independent of all else in the regressor: no bias of b1 at all.
    assert bias(found["armax"]).max() < 2
    assert bias(found["arx"])[[0, 1, 3]].min() > 30


def test_the_hair_dryer_is_simulated_on_fresh_rows():
    """Rows 0 to 299, then 800 to 899, each about its own means, as the demonstrations do.

    An independent search reaches 92.9 % when the level of the hundred rows is estimated with
    their initial state, and 88.3 % when it is held at their mean.
    """
    rec = pt.datasets.hair_dryer()
    est, val = (pt.prep.detrend(rec.take(slice(*rows))) for rows in ((0, 300), (800, 900)))
    fit = pt.estimate.armax(est, 2, 2, 2, 3, offset=False)
    model = pem.orders(na=2, nb=2, nc=2, nk=3)
    u, y = est.u, est.y[:, 0]
    ref = pem.fit(model, u, y, pem.arx_start(model, u, y, offset=False), offset=False)
    assert fit.theta == approx(ref.theta, rel=1e-7)
    assert fit.loss == approx(ref.loss, rel=1e-10)
    assert pt.validate.check(val, fit).fit >= 88
    assert pt.validate.check(val, fit, offset="estimate").fit >= 92


def tight_loop(seed, N=3000):
    """Put a sampled PI around the engine; the noise of its equation is coloured."""
    rng = np.random.default_rng(seed)
    (a, b, c), Kp, Ki, Ts = ENGINE, -0.1315, -0.8816, 0.02  # METHODS 1.7
    e = np.sqrt(15) * rng.normal(size=N)
    r = 50 * rng.choice([-1.0, 1.0], N // 10).repeat(10)
    u, y, integral = np.zeros(N), np.zeros(N), 0.0
    for t in range(N):
        y[t] = e[t] + (c * e[t - 1] - a * y[t - 1] if t else 0.0) + (b * u[t - 6] if t > 5 else 0.0)
        integral += Ts * (r[t] - y[t])
        u[t] = Kp * (r[t] - y[t]) + Ki * integral
    return pt.Record(u=u, y=y, Ts=Ts)


def test_in_a_closed_loop_the_true_noise_model_is_what_counts():
    """The direct method is consistent with it; OE and ARX on the same records are not."""
    a, b, c = ENGINE
    runs = {"armax": ([], [a, b, c]), "oe": ([], [b, a]), "arx": ([], [a, b])}
    for seed in range(30):
        rec = tight_loop(seed)
        runs["armax"][0].append(pt.estimate.armax(rec, 1, 1, 1, 6).theta)
        runs["oe"][0].append(pt.estimate.oe(rec, 1, 1, 6).theta)
        runs["arx"][0].append(pt.estimate.arx(rec, 1, 1, 6).theta)
    bias = {
        name: np.abs(np.mean(found, axis=0) - truth) / (np.std(found, axis=0) / 30**0.5)
        for name, (found, truth) in runs.items()
    }
    assert bias["armax"].max() < 2.5
    assert bias["oe"].max() > 6 and bias["arx"].max() > 12
