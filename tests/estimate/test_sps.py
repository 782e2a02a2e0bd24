"""Sign-perturbed sums: exact regions for few rows and noise of any symmetric kind."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import uncertainty

TRUE = np.array([0.7, -0.3, 2.0])


def regression(seed, N=40):
    """Return a finite impulse response with heavy tails whose size changes from row to row."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=N + 1)
    phi = np.column_stack([u[1:], u[:-1], np.ones(N)])
    return phi, phi @ TRUE + rng.standard_t(2, size=N) * np.linspace(0.1, 1.0, N)


@pytest.mark.parametrize("runs", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_regions_hold_the_truth_as_often_as_they_say(runs):
    held = [pt.estimate.sps(*regression(s), seed=s).contains(TRUE) for s in range(runs)]
    # METHODS 2.4 counted .941 +- .006 with 1500 regions.
    assert abs(np.mean(held) - 0.95) < 3 * np.sqrt(0.95 * 0.05 / runs)


def test_membership_agrees_with_the_oracle_but_for_the_signs():
    phi, y = regression(1)
    region = pt.estimate.sps(phi, y, m=1000, q=50)
    rng = np.random.default_rng(2)
    near = region.theta + rng.normal(size=(40, 3)) * (region.high - region.theta) / 2
    ours = region.contains(near)
    oracle = [uncertainty.inside(phi, y, t, m=1000, q=50, seed=3) for t in near]
    assert 5 < ours.sum() < 40
    assert (ours == oracle).mean() > 0.9


def test_the_estimate_is_inside_and_the_intervals_hold_the_region():
    phi, y = regression(5)
    region = pt.estimate.sps(phi, y)
    assert region.theta == approx(np.linalg.lstsq(phi, y, rcond=None)[0])
    assert region.contains(region.theta)
    rng = np.random.default_rng(6)
    inside = (p := region.theta + rng.normal(size=(4000, 3)))[region.contains(p)]
    assert len(inside) > 20
    assert (region.low <= inside).all()
    assert (inside <= region.high).all()
    assert region.confidence == approx(0.95)
    assert "theta3" in str(region)


def test_scaling_the_output_scales_the_region():
    phi, y = regression(7)
    one, ten = pt.estimate.sps(phi, y), pt.estimate.sps(phi, 10 * y)
    assert ten.low == approx(10 * one.low)
    assert ten.radius == approx(100 * one.radius)


def arx(seed, N=60):
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=N), 0.2 * rng.standard_t(2, size=N)
    y = np.zeros(N)
    for t in range(1, N):
        y[t] = 0.7 * y[t - 1] + 0.5 * u[t - 1] + 0.4 + e[t]
    return pt.Record(u=u, y=y, Ts=1.0)


@pytest.mark.parametrize("runs", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_regions_of_arx_hold_the_truth(runs):
    held = []
    for seed in range(runs):
        rec = arx(seed)
        fit = pt.estimate.arx(rec, 1, 1, 1)
        held.append(pt.estimate.sps_arx(rec, fit, [-0.7, 0.5, 0.4], seed=seed))
    assert abs(np.mean(held) - 0.95) < 3 * np.sqrt(0.95 * 0.05 / runs)


def test_arx_agrees_with_the_oracle_but_for_the_signs():
    rec = arx(3)
    fit = pt.estimate.arx(rec, 1, 1, 1)
    u, y = rec.u[:, 0], rec.y[:, 0]
    perturbed = uncertainty.perturbed_arx(u, y, 1, 1, 1)
    phi = np.column_stack([-y[:-1], u[:-1], np.ones(len(y) - 1)])
    rng = np.random.default_rng(4)
    centre = np.linalg.lstsq(phi, y[1:], rcond=None)[0]
    near = centre + rng.normal(size=(20, 3)) * [0.06, 0.06, 0.1]
    ours = pt.estimate.sps_arx(rec, fit, near, m=400, q=20)
    kw = {"m": 400, "q": 20, "seed": 5, "perturbed": perturbed}
    oracle = [uncertainty.inside(phi, y[1:], t, **kw) for t in near]
    assert 2 < sum(oracle) < 20
    assert (ours == oracle).mean() > 0.85


def test_the_box_of_arx_holds_the_estimate_and_what_is_inside():
    rec = arx(3)
    fit = pt.estimate.arx(rec, 1, 1, 1)
    region = pt.estimate.sps_arx(rec, fit, m=40, q=2)
    assert region.names == ("a1", "b1", "d") and region.confidence == approx(0.95)
    assert region.theta[:2] == approx(fit.theta)
    assert region.theta[2] == approx(fit.offset[0] * (1 + fit.theta[0]))
    assert region.contains(region.theta)
    rng = np.random.default_rng(7)
    width = region.high - region.low
    points = region.theta + rng.normal(size=(300, 3)) * width / 3
    inside = points[region.contains(points)]
    assert len(inside) > 20
    assert (inside > region.low - 0.05 * width).all() and (
        inside < region.high + 0.05 * width
    ).all()
    assert "d" in str(region) and "95 %" in str(region)


@pytest.mark.parametrize("runs", [25, pytest.param(1000, marks=pytest.mark.slow)])
def test_intervals_of_arx_hold_each_parameter(runs):
    """Of a box around a region of three at least 95 % each; binomial, three deviations allowed."""
    held = np.zeros(3)
    for seed in range(runs):
        rec = arx(seed)
        region = pt.estimate.sps_arx(rec, pt.estimate.arx(rec, 1, 1, 1), m=40, q=2, seed=seed)
        held += (region.low < [-0.7, 0.5, 0.4]) & (region.high > [-0.7, 0.5, 0.4])
    assert (held / runs >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / runs)).all()


def test_what_gives_no_region_is_refused():
    phi, y = regression(1)
    for m, q in [(5, 5), (5, 0)]:
        with pytest.raises(pt.UsageError, match="`q`"):
            pt.estimate.sps(phi, y, m=m, q=q)
    with pytest.raises(pt.DataError):
        pt.estimate.sps(phi[:-1], y)
    with pytest.raises(pt.NotIdentifiable):
        pt.estimate.sps(np.ones((40, 2)), y)
    with pytest.raises(pt.UsageError, match="`theta`"):
        pt.estimate.sps(phi, y).contains([1.0])
