"""The recursive estimator in C against the core's, from any state."""

import ctypes

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from export import cc


def rows(N, n, seed=6):
    rng = np.random.default_rng(seed)
    phi = rng.normal(size=(N, n))
    return phi, phi @ np.arange(1.0, n + 1) + 0.1 * rng.normal(size=N)


def in_c(tmp_path, rls):
    """Compile an estimator; return its update and a reader of theta, or of D behind theta and U."""
    source = cc.compiled(tmp_path, pt.export.c_source(rls, prefix="est"), "est")
    source.init()
    vector = ctypes.c_double * rls.n
    at = {"theta": 0, "D": rls.n + max(1, rls.n * (rls.n - 1) // 2)}
    return (
        lambda phi, y: source.update(vector(*phi), y),
        lambda name="theta": source.state[at[name] : at[name] + rls.n],
    )


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("lam", [1.0, 0.97])
def test_every_error_and_parameter_is_the_cores(tmp_path, n, lam):
    rls = pt.recursive.RLS(n, lam=lam, P0=100.0)
    phi, y = rows(1100, n)
    rls.run(phi[:100], y[:100])
    update, state = in_c(tmp_path, rls)
    expected = rls.run(phi[100:], y[100:])
    # The same operations in the same order: a rounding or two where a compiler fuses them.
    assert [update(*row) for row in zip(phi[100:], y[100:], strict=True)] == approx(
        expected, rel=1e-12, abs=1e-13
    )
    assert state() == approx(rls.theta, rel=1e-12)


def test_forgetting_stops_at_the_same_bound(tmp_path):
    rls = pt.recursive.RLS(2, lam=0.9)
    update, state = in_c(tmp_path, rls)
    for _ in range(1000):
        assert update([1.0, 1.0], 3.0) == approx(rls.update([1.0, 1.0], 3.0), abs=1e-14)
    assert state("D") == approx(rls.factors[1], rel=1e-12) and max(state("D")) == rls.D_most
    update([1.0, -1.0], 0.5)
    rls.update([1.0, -1.0], 0.5)
    assert state() == approx(rls.theta, rel=1e-12)


@pytest.mark.parametrize(
    "sample", [([np.nan, 1.0], 1.0), ([1.0, 1.0], np.inf), ([1e200, 0.0], 1.0)]
)
def test_a_sample_that_is_none_is_not_learnt(tmp_path, sample):
    rls = pt.recursive.RLS(2, lam=0.9)
    update, state = in_c(tmp_path, rls)
    update([1.0, 2.0], 3.0)
    before = state()
    update(*sample)
    assert state() == before
    rls.update([1.0, 2.0], 3.0)
    assert update([0.5, 1.0], 2.0) == approx(rls.update([0.5, 1.0], 2.0), rel=1e-12)


@pytest.mark.parametrize("settings", [{"forgetting": "directional"}, {"lam0": 0.9}, {"clip": 6.0}])
def test_what_the_source_does_not_hold_is_refused(settings):
    with pytest.raises(pt.UsageError):
        pt.export.c_source(pt.recursive.RLS(2, lam=0.98, **settings))
