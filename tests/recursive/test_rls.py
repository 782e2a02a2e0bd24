"""Recursive least squares against the least squares that it is."""

import doctest
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from contract.records import check_refusal


def rows(N=60, n=3, seed=4, sd=0.1):
    """Return phi (N, n) and y (N,) of known parameters and some noise."""
    rng = np.random.default_rng(seed)
    phi = rng.normal(size=(N, n))
    return phi, phi @ np.arange(1.0, n + 1) + sd * rng.normal(size=N)


def weighted(phi, y, lam, P0, theta0):
    """Minimise the sum of `lam^(t-k) e(k)^2` and the fading distance to the start, by lstsq."""
    N = len(y)
    w = np.sqrt(lam ** np.arange(N - 1, -1.0, -1.0))
    start = lam ** (N / 2) * np.linalg.inv(np.linalg.cholesky(P0))
    left, right = np.r_[start, w[:, None] * phi], np.r_[start @ theta0, w * y]
    theta = np.linalg.lstsq(left, right)[0]
    return theta, np.linalg.inv(left.T @ left)


@pytest.mark.parametrize("alpha", [1e-2, 1.0, 100.0, 1e6])
def test_without_forgetting_it_is_ridge_regression_with_weight_1_over_P0(alpha):
    """ERRATA 2 measures 4e-15 on the example of source 000; here the columns are well scaled."""
    phi, y = rows()
    rls = pt.recursive.RLS(3, P0=alpha)
    rls.run(phi, y)
    ridge = np.linalg.solve(phi.T @ phi + np.eye(3) / alpha, phi.T @ y)
    assert rls.theta == approx(ridge, rel=2e-14)
    assert rls.P == approx(np.linalg.inv(phi.T @ phi + np.eye(3) / alpha), rel=1e-12, abs=1e-15)


@settings(max_examples=40)
@given(
    n=st.integers(1, 6),
    N=st.integers(1, 120),
    lam=st.floats(0.9, 1.0),
    seed=st.integers(0, 10_000),
)
def test_with_forgetting_it_is_weighted_least_squares(n, N, lam, seed):
    phi, y = rows(N, n, seed)
    rng = np.random.default_rng(seed)
    half, theta0 = rng.normal(size=(n, n)), rng.normal(size=n)
    P0 = half @ half.T + 0.1 * np.eye(n)
    rls = pt.recursive.RLS(n, lam=lam, P0=P0, theta0=theta0)
    assert rls.P == approx(P0, rel=1e-12, abs=1e-12)
    rls.run(phi, y)
    theta, P = weighted(phi, y, lam, P0, theta0)
    # lstsq and the inverse lose the condition number of the start, here up to 1e4.
    assert rls.theta == approx(theta, rel=1e-9, abs=1e-10)
    assert rls.P == approx(P, rel=1e-8, abs=1e-9 * P.max())


def test_it_ends_where_the_batch_estimator_does():
    """DESIGN 6: the batch answer and the recursion with lam = 1 agree to 1e-9."""
    rec = pt.datasets.engine_loop(noise_var=0.0)
    fit = pt.estimate.arx(rec, 1, 1, 6)
    u, y = rec.u[:, 0], rec.y[:, 0] - rec.y[0, 0]
    phi = np.c_[-y[5:-1], u[: len(u) - 6], np.ones(len(u) - 6)]
    rls = pt.recursive.RLS(3, P0=1e14)
    rls.run(phi, y[6:])
    assert rls.theta[:2] == approx(fit.theta, rel=1e-9)


def test_the_error_returned_is_the_prior_one():
    phi, y = rows()
    rls, before = pt.recursive.RLS(3, lam=0.98), np.zeros(3)
    for phi_k, y_k in zip(phi, y, strict=True):
        assert rls.update(phi_k, y_k) == approx(y_k - phi_k @ before, rel=1e-12, abs=1e-14)
        before = rls.theta


def test_run_is_update_in_a_loop():
    phi, y = rows(200)
    at_once, one_by_one = (pt.recursive.RLS(3, lam=0.97) for _ in range(2))
    halves = np.r_[at_once.run(phi[:80], y[:80]), at_once.run(phi[80:], y[80:])]
    assert halves.tolist() == [one_by_one.update(*row) for row in zip(phi, y, strict=True)]
    assert at_once.theta.tolist() == one_by_one.theta.tolist()


def test_a_pickle_goes_on_to_the_last_bit():
    phi, y = rows(100)
    one = pt.recursive.RLS(3, lam=0.97, P0=10.0, theta0=[1, 2, 3])
    one.run(phi[:50], y[:50])
    other = pickle.loads(pickle.dumps(one))
    assert one.run(phi[50:], y[50:]).tolist() == other.run(phi[50:], y[50:]).tolist()
    assert one.P.tolist() == other.P.tolist() and other.lam == 0.97 and other.n == 3


def test_scaling_a_column_scales_its_parameter():
    phi, y = rows()
    plain, scaled = pt.recursive.RLS(3, P0=1e12), pt.recursive.RLS(3, P0=1e12)
    plain.run(phi, y)
    scaled.run(phi * [1.0, 2.0, 0.5], y)
    assert scaled.theta * [1.0, 2.0, 0.5] == approx(plain.theta, rel=1e-9)


def test_the_covariance_stays_symmetric_and_positive():
    """A full matrix loses symmetry: right at 3000 samples, wrong at 6000 with lambda 0.995."""
    rng = np.random.default_rng(3)
    u, y, v = rng.normal(size=60_000), 0.0, 0.0
    rls, phis, ys = pt.recursive.RLS(4, lam=0.995), [], []
    for k in range(2, len(u)):
        phis.append([-y, -v, u[k - 1], u[k - 2]])
        y, v = 1.6 * y - 0.66 * v + 0.04 * u[k - 1] + 0.02 * u[k - 2], y
        ys.append(y)
    phis, ys = np.array(phis), np.array(ys) + 0.01 * rng.normal(size=len(ys))
    for part in range(0, len(ys), 6000):
        rls.run(phis[part : part + 6000], ys[part : part + 6000])
        assert (rls.P == rls.P.T).all() and (rls.factors[1] > 0).all()
        assert np.linalg.eigvalsh(rls.P).min() > 0
    expected, P = weighted(phis[-8000:], ys[-8000:], 0.995, np.eye(4), np.zeros(4))
    assert rls.theta == approx(expected, rel=1e-9)  # what lies 8000 samples back weighs 4e-18
    assert rls.P == approx(P, rel=1e-7)
    U, D = rls.factors
    assert U @ np.diag(D) @ U.T == approx(rls.P, rel=1e-12)


@pytest.mark.parametrize("lam", [0.98, 0.995])
def test_constant_data_with_forgetting_never_overflow(lam):
    """NaN after 78 955 samples in a prototype; N07: a million samples, then a step."""
    N, phi = 1_000_000, [-0.7, 0.3, 1.0]
    rls = pt.recursive.RLS(3, lam=lam)
    rls.run(np.tile(phi, (N, 1)), np.full(N, 2.0))
    assert np.isfinite(rls.P).all() and np.isfinite(rls.theta).all()
    assert rls.theta @ phi == approx(2.0, rel=1e-12)
    assert (rls.factors[1] <= 1e18).all() and np.trace(rls.P) < 1e19  # entries of U up to 1.2
    true = np.array([0.5, -1.0, 2.65])  # which also gives the constant 2
    fresh = np.random.default_rng(1).normal(size=(20, 3))
    rls.run(fresh, fresh @ true)
    assert rls.theta == approx(true, rel=1e-6)


def test_the_example_of_the_docstring_runs():
    examples = doctest.DocTestFinder().find(pt.recursive.RLS, "RLS", globs={})
    results = [doctest.DocTestRunner().run(example) for example in examples]
    assert sum(tried for _, tried in results) == 5 and not any(failed for failed, _ in results)


@pytest.mark.parametrize(
    "arguments",
    [
        {"n": 0},
        {"n": -1},
        {"n": 2.5},
        {"n": 2, "lam": 0.0},
        {"n": 2, "lam": 1.2},
        {"n": 2, "lam": np.nan},
        {"n": 2, "P0": 0.0},
        {"n": 2, "P0": np.inf},
        {"n": 2, "P0": [[1.0, 2.0], [2.0, 1.0]]},
        {"n": 2, "P0": [[1.0, 2.0], [0.0, 9.0]]},
        {"n": 2, "P0": [[1.0, np.nan], [np.nan, 1.0]]},
        {"n": 2, "P0": np.eye(3)},
        {"n": 2, "theta0": [1.0]},
        {"n": 2, "theta0": [1.0, np.nan]},
    ],
)
def test_what_no_estimator_can_be_is_refused(arguments):
    with pytest.raises(pt.UsageError) as caught:
        pt.recursive.RLS(**arguments)
    check_refusal(caught.value, "U01", ())


@pytest.mark.parametrize(
    ("phi", "y", "code"),
    [
        ([1.0], 0.0, "U01"),
        ([1.0, 2.0, 3.0], 0.0, "U01"),
        ([1.0, np.nan], 0.0, "U01"),
        ([1.0, 2.0], np.inf, "U01"),
        ([1e200, 0.0], 0.0, "N02"),
    ],
)
def test_a_sample_that_is_none_is_refused_and_changes_nothing(phi, y, code):
    rls, other = (pt.recursive.RLS(2) for _ in range(2))
    for each in (rls, other):
        each.update([1.0, 2.0], 3.0)
    with pytest.raises(pt.PlantuneError) as caught:
        rls.update(phi, y)
    check_refusal(caught.value, code, ())
    assert rls.update([0.5, 1.0], 2.0) == other.update([0.5, 1.0], 2.0)
    assert rls.P.tolist() == other.P.tolist()
