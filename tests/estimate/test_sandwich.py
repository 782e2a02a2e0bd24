"""Residuals that are not white: sandwich and block bootstrap."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import uncertainty
from plantune import _core
from plantune.estimate.fit import refit_arguments
from plantune.notes import DEFAULT_LIMITS

TS = 0.02
A = float(np.exp(-TS / 0.15))


def record(pole, seed, N=1000, sd=1.0):
    """Simulate a slow first order with AR(1) noise of variance sd^2 at its output."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N), rng.integers(5, 16, N))[: N + 300]
    y = lfilter([-6 * (1 - A)], [1, -A], np.r_[np.zeros(6), u[:-6]])
    e = lfilter([1], [1, -pole], rng.normal(size=N + 300)) * np.sqrt(1 - pole**2) * sd
    return pt.Record(u=u[300:], y=(y + e)[300:] + 4.0, Ts=TS)


def scores(rec, fit):
    psi, eps, _ = _core.scores(rec, *refit_arguments(rec, fit), DEFAULT_LIMITS)
    return psi, eps


def test_scores_give_the_covariance_of_the_fit_back():
    rec = record(0.0, 1)
    for fit in (pt.estimate.oe(rec, 1, 1, 6), pt.estimate.armax(rec, 1, 1, 1, 6)):
        psi, eps = scores(rec, fit)
        assert eps @ eps / len(eps) == approx(fit.loss, rel=1e-9)
        s2 = eps @ eps / (len(eps) - psi.shape[1] - fit.x0.size)
        assert s2 * np.linalg.inv(psi.T @ psi) == approx(fit.P, rel=1e-5)


@pytest.mark.parametrize("pole", [0.0, 0.8, 0.95])
def test_the_sandwich_is_that_of_the_oracle(pole):
    rec = record(pole, 2)
    fit = pt.estimate.oe(rec, 1, 1, 6)
    wide = pt.estimate.sandwich(rec, fit)
    psi, eps = scores(rec, fit)
    expected = uncertainty.sandwich_ar(eps, psi)
    # The oracle counts no initial state, and cuts the correlation at 200 lags.
    assert wide.P == approx(expected, rel=2e-2)
    assert wide.sd == approx(np.sqrt(np.diag(wide.P))[:2])
    assert wide.notes[-1].code == "V12"
    assert wide.theta is fit.theta


def test_products_are_summed_where_the_regressor_holds_noise():
    rec = record(0.8, 2)
    fit = pt.estimate.arx(rec, 1, 1, 6)
    psi, eps = scores(rec, fit)
    r = abs(eps[1:] @ eps[:-1]) / (eps @ eps)
    lags = int(np.ceil((6**0.5 * r / (1 - r * r)) ** (2 / 3) * len(eps) ** (1 / 3)))
    wide = pt.estimate.sandwich(rec, fit)
    assert wide.P == approx(uncertainty.sandwich(eps, psi, lags), rel=1e-6)
    assert "not white" in wide.notes[-1].text


def test_white_residuals_cost_nothing():
    rec = record(0.0, 3)
    fit = pt.estimate.arx(rec, 4, 4, 6)
    wide = pt.estimate.sandwich(rec, fit)
    assert wide.sd == approx(fit.sd, rel=0.3)


def test_only_the_record_of_the_fit_is_taken():
    rec, other = record(0.5, 1), record(0.5, 2)
    fit = pt.estimate.oe(rec, 1, 1, 6)
    for widen in (pt.estimate.sandwich, pt.estimate.bootstrap):
        with pytest.raises(pt.UsageError, match="not the record of the fit"):
            widen(other, fit)
        with pytest.raises(pt.UsageError, match="SRIVC"):
            widen(rec, pt.estimate.srivc(rec, 1))
    for wrong in ({"runs": 1}, {"block": 0}, {"block": 5000}):
        with pytest.raises(pt.UsageError):
            pt.estimate.bootstrap(rec, fit, **wrong)


def covered(pole, runs, widen):
    """Return the shares of intervals for K and T's pole that hold the truth."""
    truth, held = np.array([-6 * (1 - A), -A]), np.zeros(2)
    for seed in range(runs):
        rec = record(pole, seed, sd=2.0)
        fit = widen(rec, pt.estimate.oe(rec, 1, 1, 6))
        held += abs(fit.theta - truth) < 1.96 * fit.sd
    return held / runs


@pytest.mark.parametrize("pole", [0.0, 0.8, 0.95])
@pytest.mark.parametrize("runs", [50, pytest.param(1000, marks=pytest.mark.slow)])
def test_intervals_hold_where_plain_ones_do_not(pole, runs):
    share = covered(pole, runs, pt.estimate.sandwich)
    # Recipes: .965 .96; .945 .95; .94 .905.  Three binomial standard deviations below .93 (.90).
    least = 0.90 if pole == 0.95 else 0.93
    assert (share > least - 3 * np.sqrt(least * (1 - least) / runs)).all(), share
    if pole > 0:
        plain = covered(pole, runs, lambda _, fit: fit)
        assert plain.min() < 0.8, plain


def test_the_bootstrap_agrees_with_the_sandwich():
    rec = record(0.8, 4, sd=0.5)
    fit = pt.estimate.oe(rec, 1, 1, 6)
    drawn = pt.estimate.bootstrap(rec, fit, runs=300)
    wide = pt.estimate.sandwich(rec, fit)
    assert drawn.block > 10
    assert drawn.estimates.shape == (300, 3)
    # Blocks cut the correlation at their ends: some 10 % too narrow.
    assert drawn.fit.sd == approx(wide.sd, rel=0.3)
    assert (drawn.low[:2] < fit.theta).all()
    assert (fit.theta < drawn.high[:2]).all()
    again = pt.estimate.bootstrap(rec, fit, runs=300)
    assert (again.estimates == drawn.estimates).all()
    assert "blocks of" in str(drawn)
