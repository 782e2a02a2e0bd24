"""The delta rule: independent oracle, closed forms, and counts of coverage."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import uncertainty

W = np.array([0.2, 1.0, 4.0])


def second_order(N=500, seed=1, Ts=0.5):
    """Simulate b/f = [.5 .2] / [-1.5 .7], nk 2, white noise on the output."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 5), 5)
    plant = pt.models.PolyModel(A=[1], B=[0.5, 0.2], F=[1, -1.5, 0.7], nk=2, Ts=Ts)
    return pt.Record(u=u, y=plant.simulate(u) + 0.3 * rng.normal(size=N) + 20.0, Ts=Ts)


@pytest.fixture(scope="module")
def fit():
    return pt.estimate.oe(second_order(), 2, 2, 2)


def sd_of(fit, g):
    return np.sqrt(np.diag(uncertainty.delta(g, fit.theta, fit.P[:4, :4])[1]))


def test_curves_have_the_bands_of_the_oracle(fit):
    n = np.arange(20)
    y, sd = fit.step(0.5 * n)
    assert y == approx(uncertainty.step(fit.theta[:2], fit.theta[2:], 2, 20), rel=1e-9, abs=1e-12)
    assert sd == approx(
        sd_of(fit, lambda t: uncertainty.step(t[:2], t[2:], 2, 20)), rel=1e-5, abs=1e-9
    )
    magnitude, phase = fit.bode(W)
    expected = sd_of(fit, lambda t: uncertainty.bode(t[:2], t[2:], 2, W, 0.5))
    assert magnitude.sd / magnitude.value == approx(expected[:3], rel=1e-5)
    assert np.radians(phase.sd) == approx(expected[3:], rel=1e-5)


def test_gain_and_roots_have_the_spread_of_the_oracle(fit):
    K, sd = fit.derived()["K"]
    assert approx(uncertainty.gain(fit.theta[:2], fit.theta[2:])) == K
    assert sd == approx(sd_of(fit, lambda t: uncertainty.gain(t[:2], t[2:]))[0], rel=1e-6)
    expected = sd_of(fit, lambda t: uncertainty.roots(t[2:]))
    for pole in fit.poles():
        assert [pole.sd_real, pole.sd_imag] == approx([expected[0], expected[2]], rel=1e-5)
    (zero,) = fit.zeros()
    assert zero.value.real == approx(-fit.theta[1] / fit.theta[0])
    of_zero = sd_of(fit, lambda t: np.array([-t[1] / t[0]]))
    assert zero.sd_real == approx(of_zero[0], rel=1e-6)


def test_frequency_and_damping_of_a_pair_follow_from_its_pole(fit):
    def pair(theta):
        s = np.log(max(np.roots(np.r_[1, theta[2:]]), key=lambda z: z.imag)) / 0.5
        return np.array([abs(s), -s.real / abs(s)])

    expected = sd_of(fit, pair)
    for k, name in enumerate(["w_n", "zeta"]):
        value, sd = fit.derived()[name]
        assert value == approx(pair(fit.theta)[k])
        assert sd == approx(expected[k], rel=1e-5)


def test_first_order_has_the_printed_slopes():
    fit = pt.estimate.arx(pt.datasets.engine_loop(noise_var=1.5), 1, 1, 6)
    slopes = uncertainty.fopdt_slopes(fit.theta, fit.Ts)
    P = fit.P[:2, :2]
    derived = fit.derived()
    assert derived.names == ("K", "T", "L")
    assert derived.sd[:2] == approx(np.sqrt(np.diag(slopes @ P @ slopes.T)), rel=1e-9)
    assert derived["L"][0] == approx(5 * fit.Ts)
    assert np.isnan(derived["L"][1])


def test_process_models_carry_theirs():
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    derived = fit.derived()
    assert derived.names == ("K", "T", "L")
    assert derived.values == approx(fit.theta)
    assert derived.sd == approx(fit.sd)
    (pole,) = fit.poles()
    assert pole.value == approx(-1 / fit.model.T)
    assert pole.sd_real == approx(fit.sd[1] / fit.model.T**2)
    y, sd = fit.step([100.0])
    assert (y[0], sd[0]) == approx((fit.theta[0], fit.sd[0]), rel=1e-6)


def test_a_plain_regression_has_no_model_to_derive_from():
    fit = pt.estimate.least_squares([[1.0], [2.0], [3.0]], [1.0, 2.0, 2.5])
    for ask in (fit.derived, fit.poles, fit.zeros, lambda: fit.step([1.0])):
        with pytest.raises(pt.UsageError, match="no model"):
            ask()


@pytest.mark.parametrize("runs", [60, pytest.param(1000, marks=pytest.mark.slow)])
def test_intervals_of_what_is_derived_hold_the_truth(runs):
    plant = pt.models.PolyModel(A=[1], B=[0.5, 0.2], F=[1, -1.5, 0.7], nk=2, Ts=0.5)
    s = np.log(max(plant.poles(), key=lambda z: z.imag)) / 0.5
    truth = np.array([3.5, abs(s), -s.real / abs(s)])
    t = np.array([2.0, 6.0])
    held = np.zeros(5)
    for seed in range(runs):
        fit = pt.estimate.oe(second_order(seed=seed), 2, 2, 2)
        derived = fit.derived()
        y, sd = fit.step(t)
        apart = np.r_[derived.values - truth, y - plant.step(t)] / np.r_[derived.sd, sd]
        held += abs(apart) < 1.96
    # 95 %, less three binomial standard deviations, and as much more.
    assert (abs(held / runs - 0.95) < 3 * np.sqrt(0.95 * 0.05 / runs) + 0.01).all(), held / runs
