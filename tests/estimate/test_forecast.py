"""Forecasts: closed forms, statsmodels, coverage, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pytest import approx

import plantune as pt


def armax_data(N=600, seed=0):
    rng = np.random.default_rng(seed)
    u, e = np.repeat(rng.choice([-1.0, 1.0], N // 5), 5), 0.3 * rng.normal(size=N)
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + u[t - 1] + 0.5 * u[t - 2]
        y[t] += e[t] + 0.6 * e[t - 1]
    return pt.Record(u=u, y=y + 4.0, Ts=0.1)


def test_an_autoregression_has_its_closed_form():
    rec = armax_data()
    fit = pt.estimate.arx(rec, 1, 1, 1)
    a, b = fit.theta
    ahead = fit.forecast(rec, np.zeros(5), parameters=False)
    level, y, u, variance = fit.offset[0], rec.y[-1, 0], rec.u[-1, 0], 0.0
    y = y - level
    for k in range(5):
        y = -a * y + b * u
        u = 0.0
        variance = variance * a**2 + fit.loss * fit.N / (fit.N - 3)
        assert ahead.y[k] == approx(level + y, rel=1e-10)
        assert ahead.sd[k] == approx(variance**0.5, rel=1e-10)


def test_armax_forecasts_as_statsmodels_does():
    statespace = pytest.importorskip("statsmodels.tsa.statespace.sarimax")
    rec = armax_data()
    fit = pt.estimate.armax(rec, 2, 2, 1, 1)
    ahead = fit.forecast(rec, np.ones(8), parameters=False)
    # SARIMAX puts the inputs through A of its own; so B u filtered by 1/A goes in as known.
    plant = fit.model.simulate(np.r_[rec.u[:, 0], np.ones(8)])
    peer = statespace.SARIMAX(rec.y[:, 0] - fit.offset[0] - plant[:600], order=(2, 0, 1))
    variance = fit.loss * fit.N / (fit.N - len(fit.P))
    theta = [-fit.theta[0], -fit.theta[1], fit.theta[4], variance]
    theirs = peer.filter(theta).get_forecast(8)
    assert_allclose(ahead.y, fit.offset[0] + plant[600:] + theirs.predicted_mean, atol=2e-4)
    assert_allclose(ahead.sd, theirs.se_mean, rtol=1e-6)


FULL = pt.models.PolyModel(
    A=[1, -0.9], B=[1, 0.5], C=[1, 0.6], D=[1, -0.4, 0.1], F=[1, -0.5], nk=1, Ts=0.1
)


def filtered(num, den, x):
    """`num/den x` from rest, written out."""
    y = np.zeros(len(x))
    for t in range(len(x)):
        y[t] = sum(c * x[t - j] for j, c in enumerate(num) if j <= t)
        y[t] -= sum(c * y[t - j] for j, c in enumerate(den) if 0 < j <= t)
    return y


def full_data(N=400, seed=0):
    """Record of `FULL`, and its noise."""
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=N), 0.3 * rng.normal(size=N)
    noise = filtered(FULL.C, np.convolve(FULL.D, FULL.A), e)
    return pt.Record(u=u, y=FULL.simulate(u) + noise, Ts=0.1), e


def weights(k):
    """First terms of `C/(D A)`."""
    return filtered(FULL.C, np.convolve(FULL.D, FULL.A), np.r_[1.0, np.zeros(k - 1)])


@pytest.mark.parametrize("k", [1, 3, 10])
def test_predictions_leave_out_the_noise_to_come(k):
    """Of a model with A, B, C, D and F: `y(t) - sum_{j<k} h_j e(t-j)`."""
    rec, e = full_data()
    to_come = np.convolve(weights(k), e)[: rec.N]
    # The initial state is estimated; what is wrong of it dies out with the roots of C and F.
    ours = FULL.predict(rec, k)[100:]
    assert_allclose(ours, (rec.y[:, 0] - to_come)[100:], atol=1e-9)


def test_a_forecast_is_the_prediction_made_from_the_same_rows():
    rec, e = full_data()
    past = rec.take(slice(0, 390))
    known = replace(
        pt.estimate.oe(past, 1, 1), model=FULL, offset=np.zeros(1), loss=0.09, P=np.empty((0, 0))
    )
    ahead = known.forecast(past, rec.u[390:])
    to_come = np.convolve(weights(10), e[390:])[:10]
    assert_allclose(ahead.y, rec.y[390:, 0] - to_come, atol=1e-9)
    assert_allclose(ahead.sd, 0.3 * np.sqrt(np.cumsum(weights(10) ** 2)), rtol=1e-12)


def test_several_inputs_are_forecast_and_printed():
    rng = np.random.default_rng(1)
    u = rng.normal(size=(500, 2))
    plant = pt.models.PolyModel(A=[1, -0.7], B=[[1.0], [0.5, -0.2]], nk=[1, 2], Ts=1.0)
    y = 2 + plant.simulate(u) + 0.01 * rng.normal(size=500)
    rec = pt.Record(u=u[:480], y=y[:480], Ts=1.0, u_names=["steam", "feed"])
    fit = pt.estimate.oe(rec, [1, 2], [1, 1], [1, 2])
    ahead = fit.forecast(rec, u[480:])
    assert (abs(ahead.y - y[480:]) < 5 * ahead.sd).all() and ahead.sd.max() < 0.015
    text = fit.equation()
    assert all(f"\n{name}(q) = " in text for name in ("B1", "B2", "F1", "F2"))


def test_process_models_forecast_what_they_simulate():
    rec = pt.datasets.engine_loop(noise_var=1.5)
    est, val = rec.split(0.5)
    fit = pt.estimate.process(est, "P1D")
    ahead = fit.forecast(est, val.u[:200])
    assert_allclose(ahead.y, fit.predict(rec, None)[est.N : est.N + 200], atol=0.05)
    assert ahead.t[0] == approx(val.time[0])
    assert (ahead.sd >= fit.loss**0.5).all()


def test_the_band_covers_what_comes():
    inside = []
    for seed in range(60):
        rec = armax_data(seed=seed)
        past = rec.take(slice(0, 400))
        fit = pt.estimate.armax(past, 2, 2, 1, 1)
        ahead = fit.forecast(past, rec.u[400:420])
        low, high = ahead.band().T
        inside.append((low < rec.y[400:420, 0]) & (rec.y[400:420, 0] < high))
    # 60 records of 20 rows that depend on each other: 0.95 within three of their deviations.
    assert 0.90 < np.mean(inside) < 0.99


def test_parameters_widen_the_band():
    rec = armax_data(N=100)
    fit = pt.estimate.arx(rec, 2, 2, 1)
    plain, wide = fit.forecast(rec, np.ones(30), parameters=False), fit.forecast(rec, np.ones(30))
    assert np.array_equal(plain.y, wide.y) and (wide.sd > plain.sd).all()


def test_refusals():
    rec = armax_data()
    fit = pt.estimate.arx(rec, 2, 2, 1)
    for wrong in ([], np.ones((3, 2)), [np.nan]):
        with pytest.raises(pt.PlantuneError):
            fit.forecast(rec, wrong)
    short = pt.Record(u=rec.u, y=rec.y, Ts=0.1, starts=[0, 598])
    with pytest.raises(pt.NotIdentifiable, match="last segment"):
        fit.forecast(short, [1.0])
    own = pt.estimate.arx(rec, 1, 1, 1, regressors=["sign(y(t-1))"])
    with pytest.raises(pt.UsageError, match="own"):
        own.forecast(rec, [1.0])
    with pytest.raises(pt.UsageError):
        pt.estimate.least_squares([[1.0], [2.0]], [1.0, 2.0]).forecast(rec, [1.0])


@pytest.mark.parametrize(
    "fit",
    [
        lambda rec: pt.estimate.arx(rec, 2, 2, 3),
        lambda rec: pt.estimate.armax(rec, 2, 2, 1, 3),
        lambda rec: pt.estimate.oe(rec, 2, 2, 3, offset=False),
        lambda rec: pt.estimate.process(rec, "P1D"),
    ],
)
def test_a_fit_prints_as_equations_and_survives_a_file(tmp_path, fit):
    ours = fit(pt.datasets.hair_dryer())
    text = ours.equation()
    assert text.count("(0.") >= len(ours.theta)
    pt.estimate.save_fit(tmp_path / "fit.json", ours)
    back = pt.estimate.load_fit(tmp_path / "fit.json")
    assert back.equation() == text and back.notes == ours.notes
    assert np.array_equal(back.theta, ours.theta) and np.array_equal(back.P, ours.P)
    with pytest.raises(pt.DataError):
        pt.io.save_model(tmp_path / "model.json", ours.model)
        pt.estimate.load_fit(tmp_path / "model.json")
