"""ARX with regressors of one's own: numbers, rows, simulation, recursion, refusals."""

import copy
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pytest import approx

import plantune as pt

TERMS = ["u(t-1)*y(t-1)", "positive(u(t-2))", "sign(y(t-1)-y(t-2))"]


def made(N=400, seed=0, level=3.0):
    """Data of a model with products and directions."""
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=N), 0.1 * rng.normal(size=N)
    y = np.full(N, level)
    for t in range(2, N):
        y[t] = 0.6 + 0.7 * y[t - 1] + 0.5 * u[t - 1] + 0.05 * u[t - 1] * y[t - 1]
        y[t] += 0.3 * max(u[t - 2], 0) - 0.1 * np.sign(y[t - 1] - y[t - 2]) + e[t]
    return u, y


def columns(u, y, rows):
    """The regressor of `made`, written out."""
    t = np.asarray(rows)
    product, up = u[t - 1] * y[t - 1], np.maximum(u[t - 2], 0)
    moves = np.sign(y[t - 1] - y[t - 2])
    return np.c_[-y[t - 1], u[t - 1], product, up, moves, np.ones(len(t))]


def test_the_fit_is_lstsq_on_explicit_columns():
    u, y = made()
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 1, 1, 1, regressors=TERMS)
    phi = columns(u, y, range(2, 400))
    theta, rss, *_ = np.linalg.lstsq(phi, y[2:], rcond=None)
    assert_allclose([*fit.theta, fit.offset[0]], theta, rtol=1e-9)
    P = rss[0] / (398 - 6) * np.linalg.inv(phi.T @ phi)
    assert_allclose(fit.P, P, rtol=1e-6, atol=1e-12)
    assert fit.N == 398 and fit.loss == approx(rss[0] / 398)
    assert fit.names == ("a1", "b1", *TERMS)


def test_segments_and_rows_that_do_not_count():
    u, y = made()
    valid = np.ones((400, 1), bool)
    valid[300] = False
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=[0, 200], valid=valid)
    fit = pt.estimate.arx(rec, 1, 1, 1, regressors=TERMS)
    rows = [t for t in range(2, 400) if t not in (200, 201, 300, 301, 302)]
    held = rec.y[:, 0]
    theta = np.linalg.lstsq(columns(u, held, rows), held[rows], rcond=None)[0]
    assert fit.N == len(rows)
    assert_allclose([*fit.theta, fit.offset[0]], theta, rtol=1e-9)


def test_a_linear_term_is_a_coefficient_of_arx():
    rec = pt.datasets.hair_dryer()
    plain = pt.estimate.arx(rec, 2, 2, 3)
    own = pt.estimate.arx(rec, 1, 1, 3, regressors=["0 - y(t-2)", "u(t-4)"])
    assert_allclose(own.theta[[0, 2, 1, 3]], plain.theta, rtol=1e-10)
    assert own.fpe == approx(plain.fpe) and own.N == plain.N
    # The output at rest is the same; one as the level O, the other from its constant.
    rest = np.full(800, rec.u[0, 0])
    assert own.simulate(rest)[-1] == approx(plain.simulate(rest)[-1], rel=1e-9)
    assert_allclose(own.predict(rec), plain.predict(rec), atol=1e-9)


def test_a_function_does_what_a_term_does():
    u, y = made()
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=[0, 200])

    def up(rec):
        x = np.maximum(np.roll(rec.u[:, 0], 2), 0.0)
        x[np.r_[rec.starts, rec.starts + 1]] = np.nan
        return x

    by_name = pt.estimate.arx(rec, 1, 1, 1, regressors=["positive(u(t-2))"])
    given = pt.estimate.arx(rec, 1, 1, 1, regressors=[("up", up)])
    assert_allclose(given.theta, by_name.theta, rtol=1e-12)
    assert given.names[-1] == "up" and given.N == by_name.N
    assert_allclose(given.predict(rec, 5)[10:190], by_name.predict(rec, 5)[10:190], rtol=1e-10)
    assert_allclose(given.predict(rec, None)[10:190], by_name.predict(rec, None)[10:190])


def test_a_simulation_starts_where_it_is_told():
    u, y = made()
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 1, 1, 1, regressors=TERMS)
    a, b, *g = fit.theta
    run = list(y[:2])
    for t in range(2, 50):
        x = columns(u, np.array(run), [t])[0]
        run.append(float(x @ [a, b, *g, fit.offset[0]]))
    assert_allclose(fit.model.simulate(u[:50], x0=y[:2]), run, rtol=1e-12)
    assert_allclose(fit.predict(pt.Record(u=u, y=y, Ts=0.1), None)[2:50], run[2:], rtol=1e-12)


@pytest.mark.parametrize("terms", [["sign(y(t-1))"], TERMS])
def test_the_recursion_ends_at_the_batch_and_goes_on_where_it_stopped(terms):
    u, y = made()
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=[0, 150])
    batch = pt.estimate.arx(rec, 1, 1, 1, regressors=terms)
    whole = pt.recursive.TermARX(1, 1, 1, regressors=terms)
    eps = whole.run(rec)
    assert_allclose([*whole.theta, whole.offset], [*batch.theta, *batch.offset], rtol=1e-8)
    assert_allclose(whole.sd, batch.sd, rtol=0.2)  # its noise is that of the last errors
    live = pt.recursive.TermARX(1, 1, 1, regressors=terms)
    ours = []
    for k in range(400):
        if k in rec.starts:
            live.restart()
        if k % 37 == 5:
            live = pickle.loads(pickle.dumps(copy.deepcopy(live)))
        ours.append(live.step(u[k], y[k]))
    assert np.array_equal(ours, eps, equal_nan=True)
    assert np.array_equal(live.theta, whole.theta) and live.offset == whole.offset


def test_a_missing_output_is_not_learnt_by_the_recursion():
    u, y = made()
    valid = np.ones((400, 1), bool)
    valid[[120, 300]] = False
    rec = pt.Record(u=u, y=y, Ts=0.1, valid=valid)
    own = pt.recursive.TermARX(1, 1, 1, regressors=TERMS)
    eps = own.run(rec)
    assert np.isnan(eps[120:123]).all() and np.isfinite(eps[123])
    batch = pt.estimate.arx(rec, 1, 1, 1, regressors=TERMS)
    assert_allclose(own.theta, batch.theta, rtol=1e-8)


def test_the_recursion_follows_a_friction_that_changes():
    rng = np.random.default_rng(3)
    N, u = 4000, np.repeat(rng.choice([-5.0, 5.0], 400), 10)
    y = np.zeros(N)
    for t in range(1, N):
        friction = 0.4 if t < 2000 else 0.8
        y[t] = 0.9 * y[t - 1] + 0.5 * u[t - 1] - friction * np.sign(y[t - 1]) + 0.05 * rng.normal()
    own = pt.recursive.TermARX(1, 1, 1, regressors=["sign(y(t-1))"], lam=0.99)
    for t in range(N):
        own.step(u[t], y[t])
        if t == 1999:
            assert own.theta[2] == approx(-0.4, abs=0.05)
    assert own.theta[2] == approx(-0.8, abs=0.05)


def moved_carriage(seed=0, N=4000):
    """A printer's carriage whose friction is 1.2 V to the right and 2.0 V to the left."""
    motor = pt.datasets.PRINTER_MOTOR
    a = np.exp(-motor.Ts / motor.Tm)
    b = motor.K * (1 - a)
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-12, 12, N // 50), 50)
    y = np.zeros(N)
    for t in range(1, N):
        friction = 1.2 * (y[t - 1] > 0) - 2.0 * (y[t - 1] < 0)
        y[t] = a * y[t - 1] + b * (u[t - 1] - friction) + 0.01 * rng.normal()
    return pt.Record(u=u, y=y, Ts=motor.Ts, u_names=["voltage"], y_names=["speed"]), b


def test_both_frictions_of_a_motor_are_found():
    rec, b = moved_carriage()
    est, val = rec.split(0.5)
    sides = ["positive(sign(speed(t-1)))", "negative(sign(speed(t-1)))"]
    own = pt.estimate.arx(est, 1, 1, 1, regressors=sides, offset=False)
    right, left = -own.theta[2:] / own.theta[1]
    assert right == approx(1.2, abs=0.03) and left == approx(2.0, abs=0.03)
    assert (abs(own.theta[2:] - [-b * 1.2, -b * 2.0]) < 3 * own.sd[2:]).all()
    linear = pt.estimate.arx(est, 1, 1, 1)
    judged, bare = pt.validate.check(val, own), pt.validate.check(val, linear)
    assert judged and judged.fit > 99.0 and bare.fit < 95.0
    assert not [note for note in judged.notes if note.code in ("V02", "V10")]
    # What friction explains is what the linear model leaves: errors that follow the direction.
    direction = np.sign(val.y[bare.rows - 1, 0])
    assert abs(np.corrcoef(bare.errors, direction)[0, 1]) > 0.3
    direction = np.sign(val.y[judged.rows - 1, 0])
    assert abs(np.corrcoef(judged.errors, direction)[0, 1]) < 0.1


@pytest.mark.parametrize(
    "term",
    ["exp(u(t-1))", "y(t)", "u(t+1)", "volt(t-1)", "__import__('os')", "3", "u(t-1", "sign(y)"],
)
def test_what_cannot_be_read_is_refused(term):
    with pytest.raises(pt.UsageError, match="regressor") as refused:
        pt.estimate.arx(pt.datasets.hair_dryer(), 2, 2, 3, regressors=[term])
    assert refused.value.code == "U01" and refused.value.remedy


@pytest.mark.parametrize(
    "terms, code, said",
    [
        (["u(t-3)"], "X08", "cannot be told apart"),
        (["2*u(t-3) - 1"], "X08", "cannot be told apart"),
        (["sign(u(t-1))"], "X01", "takes one value"),
    ],
)
def test_what_the_data_cannot_tell_is_refused(terms, code, said):
    with pytest.raises(pt.NotIdentifiable, match=said) as refused:
        pt.estimate.arx(pt.datasets.hair_dryer(), 2, 2, 3, regressors=terms)
    assert refused.value.code == code


def test_misuse_is_refused():
    rec = pt.datasets.hair_dryer()
    arx, own = pt.estimate.arx, pt.recursive.TermARX
    for wrong in ([3], [("x", 3)], ["u(t-1)", "u(t-1)"], [("x", lambda rec: rec.u)]):
        with pytest.raises(pt.UsageError):
            arx(rec, 2, 2, 3, regressors=wrong)
    reads_y = ("before", lambda rec: np.r_[np.nan, rec.y[:-1, 0] ** 2])
    fit = arx(rec, 2, 2, 3, regressors=[reads_y])
    assert np.isfinite(fit.predict(rec)[5:]).all()
    for far in (lambda: fit.simulate([1.0, 2.0]), lambda: fit.predict(rec, 2)):
        with pytest.raises(pt.UsageError, match="reads y"):
            far()
    with pytest.raises(pt.NumericsError, match="bounds"):
        pt.models.TermModel(
            A=[1], B=[[]], nk=[1], regressors=["square(y(t-1))"], g=[2], d=2
        ).simulate(np.zeros(50))
    u, y = made()
    both = ["positive(u(t-1))", "negative(u(t-1))"]
    with pytest.raises(pt.NotIdentifiable, match="cannot be told apart") as refused:
        arx(pt.Record(u=u, y=y, Ts=0.1), 1, 1, 1, regressors=both)
    assert "nb=0" in refused.value.remedy
    assert arx(pt.Record(u=u, y=y, Ts=0.1), 1, 0, 1, regressors=both).names == ("a1", *both)
    with pytest.raises(pt.UsageError, match="TermARX"):
        pt.recursive.ARX(1, 1, 1, regressors=["u(t-1)"])
    with pytest.raises(pt.UsageError):
        own(1, 1, 1, regressors=["u2(t-1)"])
    with pytest.raises(pt.UsageError):
        own(1, 1, 1, regressors=["u(t-1)"]).step(np.nan, 1.0)


def test_a_model_with_terms_survives_the_round_trip(tmp_path):
    u, y = made()
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 1, 1, 1, regressors=TERMS)
    pt.io.save_model(tmp_path / "model.json", fit.model)
    again = pt.io.load_model(tmp_path / "model.json")
    assert again.same_as(fit.model)
    assert np.array_equal(again.simulate(u), fit.model.simulate(u))
    pt.estimate.save_fit(tmp_path / "fit.json", fit)
    back = pt.estimate.load_fit(tmp_path / "fit.json")
    assert str(back) == str(fit) and np.array_equal(back.P, fit.P) and back.rows.dtype == np.int64
    own = pt.estimate.arx(
        pt.Record(u=u, y=y, Ts=0.1), 1, 1, 1, regressors=[("x", lambda r: r.u[:, 0])]
    )
    with pytest.raises(pt.UsageError):
        pt.io.save_model(tmp_path / "own.json", own.model)
