"""Validation: fits, errors and residual correlations as plain sums, on fresh data."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import fopdt, lsq, resid

K, T, L, O, TS = -5.939, 0.1491, 0.1, 583.451, 0.02
ORDERS = (1, 1, 6)


def arx_record(N=1200, seed=1, sd=1.0):
    """Simulate the engine with equation noise: then ARX(1, 1, 6) is the truth."""
    u = 5 * fopdt.hold_input(N, 12, seed)
    a, b = np.exp(-TS / T), K * (1 - np.exp(-TS / T))
    e = sd * np.random.default_rng(seed + 1).normal(size=N)
    y = np.zeros(N)
    for t in range(1, N):
        y[t] = a * y[t - 1] + e[t] + (b * u[t - 6] if t >= 6 else 0.0)
    return pt.Record(u=u, y=y + O, Ts=TS), u, y + O


def percent(y, yhat):
    """Return 100 (1 - |y - yhat| / |y - mean y|); DESIGN 3."""
    return 100 * (1 - np.linalg.norm(y - yhat) / np.linalg.norm(y - y.mean()))


def test_fits_equal_the_definition_on_fresh_data():
    rec, u, y = arx_record()
    est, val = rec.split(0.5)
    fit = pt.estimate.arx(est, *ORDERS)
    verdict = pt.validate.check(val, fit)
    u, y, k = u[600:], y[600:], np.arange(600)
    (a, b), off = fit.theta, fit.offset[0]
    one = y.copy()
    one[6:] = -a * (y[5:-1] - off) + b * u[:-6] + off
    assert verdict.fit_1step == approx(percent(y[6:], one[6:]), abs=0.05)
    # The model's own offset, the initial state fitted to the data; first rows are history or not
    forced = lsq.simulate_arx(fit.theta, u, 1, 1, 6) + off
    free = (-a) ** k
    x0 = free[6:] @ (y - forced)[6:] / (free[6:] @ free[6:])
    sim = forced + x0 * free
    assert verdict.fit == approx(percent(y[6:], sim[6:]), abs=0.2)
    assert verdict.rmse == approx(np.sqrt(np.mean((y - sim)[6:] ** 2)), rel=5e-3)


def test_residual_correlations_are_normalised_sums():
    """On the rows it was fitted to the residual has mean 0, so no convention matters."""
    rec, u, y = arx_record()
    fit = pt.estimate.arx(rec, *ORDERS)
    curves = pt.validate.check(rec, fit).residuals
    ref = lsq.arx(u, y, *ORDERS)
    lags = np.asarray(curves.lags)
    use = lags >= 0
    auto = np.asarray(curves.autocorr, float).reshape(len(lags), -1)[:, 0]
    cross = np.asarray(curves.crosscorr, float)[0][np.asarray(curves.cross_lags) >= 0]
    assert auto[use] == approx(resid.autocorr(ref.eps, lags[use]), abs=1e-6)
    w = u[ref.rows] - u[ref.rows].mean()
    # the mean of u is taken over these rows or all: 6 of 1200 differ
    assert cross == approx(resid.crosscorr(ref.eps, w, lags[use]), abs=2e-3)
    assert np.min(curves.band) == approx(resid.auto_band(fit.N), rel=0.05)


def test_the_true_model_passes_and_its_curves_stay_in_the_band():
    passed, inside = 0, []
    for seed in range(30):
        est, val = arx_record(seed=seed)[0].split(0.5)
        verdict = pt.validate.check(val, pt.estimate.arx(est, *ORDERS))
        passed += bool(verdict)
        auto = np.asarray(verdict.residuals.autocorr, float).reshape(
            len(verdict.residuals.lags), -1
        )
        lags = np.asarray(verdict.residuals.lags)
        inside.append(np.abs(auto[lags > 0, 0]) < resid.auto_band(600))
    assert np.mean(inside) == approx(0.99, abs=0.015)  # some 700 counts: sd 0.4 %
    assert passed >= 24  # a band of 99 % a lag must not refuse every fifth true model


def test_a_wrong_delay_fails_and_says_so():
    est, val = arx_record(sd=0.3)[0].split(0.5)
    verdict = pt.validate.check(val, pt.estimate.arx(est, 1, 1, 1))
    assert not verdict
    assert len(verdict.notes) > 0


def test_a_perfect_model_has_100_percent_and_no_nan():
    """BAD_INPUTS N08: no division by a zero variance."""
    u = 5 * fopdt.hold_input(600, 12, 1)
    rec = pt.Record(u=u, y=fopdt.simulate(u, K, T, L, TS, offset=O), Ts=TS)
    est, val = rec.split(0.5)
    verdict = pt.validate.check(val, pt.estimate.process(est, "P1D"))
    assert verdict.fit == approx(100, abs=1e-4)  # theta to 1e-6
    assert verdict.rmse == approx(0, abs=1e-4)
    assert np.isfinite(np.ravel(verdict.residuals.autocorr)).all()


def test_process_models_are_simulated_with_an_estimated_state():
    """A record cut from a transient: without the state the fit would fall by tens of percent."""
    u = 5 * fopdt.hold_input(1200, 12, 3)
    y = fopdt.simulate(u, K, T, L, TS, offset=O, x0=200.0)
    y += np.random.default_rng(3).normal(size=1200)
    rec = pt.Record(u=u, y=y, Ts=TS)
    est, val = rec.split(0.5)
    fit = pt.estimate.process(est, "P1D")
    verdict = pt.validate.check(val, fit)
    rows, X = fopdt.columns(u[600:], fit.theta[1], fit.theta[2], TS, (0,), 6)
    forced = fit.theta[0] * X[:, 0] + fit.offset[0]
    yv = y[600:][rows]
    x0 = X[:, 2] @ (yv - forced) / (X[:, 2] @ X[:, 2])
    assert verdict.fit == approx(percent(yv, forced + x0 * X[:, 2]), abs=0.2)


def test_the_same_rows_twice_are_noted():
    """BAD_INPUTS M11, also after a split and a join."""
    rec = arx_record()[0]
    est, val = rec.split(0.5)
    fit = pt.estimate.arx(est, *ORDERS)
    assert "M11" in [note.code for note in pt.validate.check(est, fit).notes]
    assert "M11" not in [note.code for note in pt.validate.check(val, fit).notes]
    both = pt.Record.join([val, est])
    assert "M11" in [note.code for note in pt.validate.check(both, fit).notes]


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_units_do_not_change_the_verdict(scale):
    _, u, y = arx_record()
    fits = []
    for s in (1.0, scale):
        est, val = pt.Record(u=u, y=s * y, Ts=TS).split(0.5)
        fits.append(pt.validate.check(val, pt.estimate.arx(est, *ORDERS)))
    assert fits[1].fit == approx(fits[0].fit, rel=1e-7)
    assert fits[1].rmse / scale == approx(fits[0].rmse, rel=1e-7)


def test_a_bare_model_is_accepted():
    est, val = arx_record()[0].split(0.5)
    fit = pt.estimate.arx(est, *ORDERS)
    bare = pt.validate.check(val, fit.model, offset="estimate")
    assert bare.fit == approx(pt.validate.check(val, fit, offset="estimate").fit, abs=1e-6)


def test_the_offset_of_the_fit_is_held():
    """On a record that lies 50 higher the simulation is 50 too low."""
    rec, _, _ = arx_record()
    est, val = rec.split(0.5)
    fit = pt.estimate.arx(est, *ORDERS)
    high = pt.Record(u=val.u, y=val.y + 50.0, Ts=TS)
    assert pt.validate.check(high, fit, offset="estimate").rmse < 3
    assert pt.validate.check(high, fit).rmse == approx(50, rel=0.1)
