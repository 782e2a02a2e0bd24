"""Output error: consistent under white noise of the output, where ARX is not."""

import numpy as np
import pytest
from pytest import approx
from scipy import signal

import plantune as pt
from oracles import pem

SECOND = pem.orders(nb=2, nf=2)
THETA = [0.5, 0.2, -1.5, 0.7]


def plant(N=400, seed=1, sd=0.1, theta=THETA):
    """Simulate a second-order plant on white input, white noise added to its output."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=N)
    return u, pem.simulate(SECOND, theta, u) + sd * rng.normal(size=N)


def test_parameters_are_named_by_polynomial_and_input():
    u, y = plant()
    fit = pt.estimate.oe(pt.Record(u=u, y=y, Ts=0.1), 2, 2)
    assert fit.names == ("b1", "b2", "f1", "f2")
    two = np.column_stack([u, np.roll(u, 7)])
    rec = pt.Record(u=two, y=y, Ts=0.1, u_names=["power", "fan"])
    fit = pt.estimate.oe(rec, [2, 1], [2, 1])
    assert fit.names == ("b1[power]", "b2[power]", "b1[fan]", "f1[power]", "f2[power]", "f1[fan]")


@pytest.mark.parametrize("offset", [True, False])
def test_without_f_it_is_least_squares(offset):
    u, y = plant()
    rec = pt.Record(u=u, y=y, Ts=0.1)
    fit = pt.estimate.oe(rec, 5, 0, 2, offset=offset)
    ref = pt.estimate.arx(rec, 0, 5, 2, offset=offset)
    assert fit.N == ref.N
    assert fit.theta == approx(ref.theta, rel=1e-9, abs=1e-11)
    assert fit.offset == approx(ref.offset, rel=1e-9)
    assert fit.loss == approx(ref.loss, rel=1e-11)
    assert fit.P == approx(ref.P, rel=1e-7, abs=1e-9 * np.abs(ref.P).max())


def test_holes_are_rows_that_do_not_count():
    """The input is known there, so the model runs on; their y is never read."""
    u, y = plant()
    valid = np.random.default_rng(2).random(400) > 0.1
    valid[[0, 1, 2, 399]] = False
    starts = (0, 150)
    rec = pt.Record(u=u, y=np.where(valid, y, np.nan), Ts=0.1, valid=valid, starts=starts)
    fit = pt.estimate.oe(rec, 2, 2)
    ref = pem.fit(SECOND, u, y, THETA, starts, valid=valid)
    assert fit.status == "converged"
    assert fit.N == ref.N == valid[2:150].sum() + valid[152:].sum()
    assert fit.theta == approx(ref.theta, rel=1e-7, abs=1e-7)
    assert fit.loss == approx(ref.loss, rel=1e-10)
    sd = np.sqrt(np.diag(ref.P))
    assert fit.P / np.outer(sd, sd) == approx(ref.P / np.outer(sd, sd), abs=1e-5)


def test_white_output_noise_does_not_bias_it_as_it_does_arx():
    seeds, found = 200, {"oe": [], "arx": []}
    for seed in range(seeds):
        u, y = plant(500, seed, sd=0.3)
        rec = pt.Record(u=u, y=y, Ts=0.1)
        found["oe"].append(pt.estimate.oe(rec, 2, 2).theta)
        found["arx"].append(np.roll(pt.estimate.arx(rec, 2, 2).theta, 2))

    def bias(thetas):  # in standard errors of the mean
        return np.abs(np.mean(thetas, axis=0) - THETA) / (np.std(thetas, axis=0) / seeds**0.5)

    # b1 is the first value of the impulse response: least squares gives it without bias.
    assert bias(found["oe"]).max() < 2
    assert bias(found["arx"])[1:].min() > 30


def test_a_resonance_is_found_from_its_own_starts():
    """Damping 0.05, noise 0.3 of y: the best minimum is where a search from the truth ends."""
    w, zeta = 0.6, 0.05
    B, F, _ = signal.cont2discrete(([w**2], [1, 2 * zeta * w, w**2]), 1.0)
    truth, found = np.r_[B[0, 1:], F[1:]], 0
    for seed in range(100):
        u, y = plant(500, seed, sd=0.0, theta=truth)
        y = y + 0.3 * np.std(y) * np.random.default_rng(seed + 1000).normal(size=500)
        fit = pt.estimate.oe(pt.Record(u=u, y=y, Ts=1.0), 2, 2)
        best = pem.fit(SECOND, u, y, truth)
        found += fit.status == "converged" and fit.loss < best.loss * (1 + 1e-9)
    assert found >= 95


def test_the_hair_dryer_is_simulated_on_fresh_rows():
    """Rows 0 to 299, then 800 to 899, each about its own means, as the demonstrations do.

    An independent search reaches 91.9 % when the level of the hundred rows is estimated with
    their initial state, and 87.5 % when it is held at their mean.
    """
    rec = pt.datasets.hair_dryer()
    est, val = (pt.prep.detrend(rec.take(slice(*rows))) for rows in ((0, 300), (800, 900)))
    fit = pt.estimate.oe(est, 2, 2, 3, offset=False)
    model = pem.orders(nb=2, nf=2, nk=3)
    u, y = est.u, est.y[:, 0]
    ref = pem.fit(model, u, y, pem.arx_start(model, u, y, offset=False), offset=False)
    assert fit.theta == approx(ref.theta, rel=1e-7)
    assert fit.loss == approx(ref.loss, rel=1e-10)
    assert pt.validate.check(val, fit, offset="estimate").fit >= 88


def test_two_resonances_of_the_robot_arm_are_simulated_on_the_other_half():
    """88.4 % at the best minimum: poles at 0.9963 and 0.9969 from the origin.

    An independent search gets there from ARX and from Steiglitz and McBride, but from one of
    twelve random pairs of poles only; the next minima simulate 79 % and 3 %.
    """
    est, val = pt.datasets.robot_arm().split(0.5)
    fit = pt.estimate.oe(est, 4, 4, 0)
    model = pem.orders(nb=4, nf=4, nk=0)
    u, y = est.u, est.y[:, 0]
    ref = pem.fit(model, u, y, pem.arx_start(model, u, y))
    assert fit.status == "converged"
    assert fit.loss == approx(ref.loss, rel=1e-10)
    assert fit.theta == approx(ref.theta, rel=1e-6)  # condition 1e5: both end 1e-7 from the best
    assert pt.validate.check(val, fit).fit >= 88
