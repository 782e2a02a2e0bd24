"""Process models: Huber, sandwich, bootstrap, and what a larger structure holds."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import uncertainty

TRUE = pt.models.ProcessModel(K=2.0, T=0.5, L=0.123)


def record(seed, pole=0.0, N=500, sd=0.1):
    """A record from the middle of a run, so that its start is not at rest."""
    rng = np.random.default_rng([seed, 3])
    u = np.repeat(rng.choice([-1.0, 1.0], (N + 200) // 7 + 1), 7)[: N + 200]
    v = lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.normal(size=N + 200))
    y = TRUE.simulate(u, Ts=0.05) + 4.0 + sd * v
    return pt.Record(u=u[200:], y=y[200:], Ts=0.05)


def spiked(rec, seed):
    rng = np.random.default_rng(seed)
    y = rec.y[:, 0].copy()
    where = rng.choice(np.arange(30, rec.N - 10), 5, replace=False)
    y[where] += rng.choice([-1.0, 1.0], 5) * 2.0
    return pt.Record(u=rec.u, y=y, Ts=rec.Ts)


@pytest.mark.parametrize("code", ["P1D", "P2D"])
def test_five_spikes_move_nothing_by_two_percent(code):
    for seed in range(4):
        clean = pt.estimate.process(record(seed), "P1D")
        plain, robust = (
            pt.estimate.process(spiked(record(seed), seed), code, robust=wanted)
            for wanted in (False, True)
        )
        if code == "P1D":
            assert robust.theta[:2] == approx(clean.theta[:2], rel=0.02)
            assert abs(robust.theta - clean.theta).max() < 0.5 * abs(clean.sd).max()
            assert robust.sd == approx(clean.sd, rel=0.25)
        assert robust.theta[0] == approx(clean.theta[0], rel=0.01)
        assert (robust.sd[0] < plain.sd[0]) and "D19" in [note.code for note in robust.notes]


def test_white_residuals_cost_nothing():
    rec = record(1)
    fit = pt.estimate.process(rec)
    wide = pt.estimate.sandwich(rec, fit)
    assert wide.theta == approx(fit.theta)
    assert wide.sd == approx(fit.sd, rel=0.25)
    assert wide.notes[-1].code == "V12"


def scores(rec, fit):
    """Return errors, and derivatives by K, T, L, O and the initial state, by differences."""
    h, rows = 1e-5, slice(rec.N - fit.N, None)

    def simulated(theta):
        return pt.models.ProcessModel(*theta).simulate(rec.u[:, 0] - rec.u[0, 0], Ts=rec.Ts)

    columns = [
        (simulated(fit.theta + d) - simulated(fit.theta - d)) / (2 * h) for d in h * np.eye(3)
    ]
    t = np.arange(rec.N) * rec.Ts
    free = np.exp(-t / fit.theta[1]) * np.where(t > fit.theta[2], 1.0, 1.0)
    J = np.column_stack([*columns, np.ones(rec.N), free])[rows]
    eps = (rec.y[:, 0] - fit.predict(rec, None))[rows]
    return eps, J


def test_the_sandwich_is_that_of_the_oracle():
    rec = record(2, pole=0.8, N=1000)
    fit = pt.estimate.process(rec)
    eps, J = scores(rec, fit)
    # Of the state before row 0 only its decay is left where residuals begin.
    P = uncertainty.sandwich_ar(eps, J)
    plain = eps @ eps / (len(eps) - 5) * np.linalg.inv(J.T @ J)
    wide = pt.estimate.sandwich(rec, fit)
    grown = np.sqrt(np.diag(P) / np.diag(plain))[:3]
    assert wide.sd / fit.sd == approx(grown, rel=0.08)
    for name in fit.intervals:
        (low, high), (a, b) = fit.intervals[name], wide.intervals[name]
        assert (b - a) / (high - low) == approx(
            wide.sd[fit.names.index(name)] / fit.sd[fit.names.index(name)]
        )


def covers(runs, widen):
    held = np.zeros(3)
    for seed in range(runs):
        rec = record(seed, pole=0.8)
        fit = widen(rec, pt.estimate.process(rec))
        ends = np.array([fit.interval(name) for name in fit.names])
        held += (ends[:, 0] < [2.0, 0.5, 0.123]) & (ends[:, 1] > [2.0, 0.5, 0.123])
    return held / runs


@pytest.mark.parametrize("runs", [40, pytest.param(400, marks=pytest.mark.slow)])
def test_sandwich_intervals_hold_the_truth_under_slow_noise(runs):
    held = covers(runs, pt.estimate.sandwich)
    assert (held > 0.95 - 0.02 - 3 * np.sqrt(0.95 * 0.05 / runs)).all()
    assert held[0] > covers(runs, lambda rec, fit: fit)[0] + 0.1


@pytest.mark.parametrize(("code", "noise"), [("P1D", "white"), ("P2D", "white"), ("P1D", (0, 1))])
def test_the_spread_of_drawn_records_is_the_covariance_where_residuals_are_white(code, noise):
    rng = np.random.default_rng(4)
    plant = TRUE if code == "P1D" else pt.models.ProcessModel(K=2.0, T=(0.5, 0.2), L=0.123)
    u = np.repeat(rng.choice([-1.0, 1.0], 80), 7)
    e = rng.normal(size=560)
    v = e if noise == "white" else lfilter([1], [1, -0.6], e)
    rec = pt.Record(u=u, y=plant.simulate(u, Ts=0.05) + 4.0 + 0.05 * v, Ts=0.05)
    fit = pt.estimate.process(rec, code, noise=noise)
    drawn = pt.estimate.bootstrap(rec, fit, runs=120, block=1)
    # 120 runs give a deviation to 7 %; the profile of T and L is a little wider than their spread.
    assert drawn.fit.sd == approx(fit.sd, rel=0.3)
    assert drawn.names == (*fit.names, "offset")
    assert drawn.fit.intervals.keys() == fit.intervals.keys()
    again = pt.estimate.bootstrap(rec, fit, runs=120, block=1)
    assert (again.estimates == drawn.estimates).all()


def test_another_record_is_refused():
    fit = pt.estimate.process(record(1))
    for widen in (pt.estimate.sandwich, pt.estimate.bootstrap):
        with pytest.raises(pt.UsageError, match="record"):
            widen(record(2), fit)


def test_a_step_test_from_rest_is_found_again():
    u = np.repeat([0.0, 1.0], [40, 260])
    y = TRUE.simulate(u, Ts=0.05) + 0.02 * np.random.default_rng(1).normal(size=300)
    rec = pt.Record(u=u, y=y, Ts=0.05)
    fit = pt.estimate.process(rec)
    assert fit.N == rec.N
    assert pt.estimate.sandwich(rec, fit).sd == approx(fit.sd, rel=0.3)


@pytest.mark.parametrize("smaller, larger", [("P1D", "P2D"), ("P2D", "P2DU"), ("P2D", "P3D")])
def test_a_larger_structure_never_ends_above_a_smaller(smaller, larger):
    """On a step test, whose rows do not depend on the delay; a lag of 0.02 samples costs 2e-6."""
    fitted = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        u = np.repeat([0.0, 1.0, -0.5], [40, 200, 260])
        y = TRUE.simulate(u, Ts=0.05) + 0.1 * rng.normal(size=500)
        rec = pt.Record(u=u, y=y, Ts=0.05)
        try:
            one, two = (pt.estimate.process(rec, code) for code in (smaller, larger))
        except pt.NotIdentifiable as error:
            assert error.code == "X10"  # a lag that is none
            continue
        fitted += 1
        assert one.N == two.N
        assert two.loss <= one.loss * (1 + 1e-5)
    assert fitted > 0


def test_the_reaction_curve_is_no_worse_with_a_second_lag(data):
    rec = pt.read(data("process_reaction_curve") / "prc.csv", u="CV", y="PV", Ts=1.0)
    one, two = (pt.estimate.process(rec, code) for code in ("P1D", "P2D"))
    assert two.loss <= one.loss * (1 + 1e-9)


def test_the_offset_of_an_integrating_fit_is_a_drift():
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 8)
    plant = pt.models.ProcessModel(K=0.5, T=0.4, L=0.1, integrating=True)
    y = plant.simulate(u, Ts=0.1) + 0.3 * 0.1 * np.arange(480) + 0.01 * rng.normal(size=480)
    fit = pt.estimate.process(pt.Record(u=u, y=y, Ts=0.1), "P1DI")
    assert fit.offset[0] == approx(0.3, abs=0.02)
    own = fit.model.simulate(u, Ts=0.1) + fit.offset[0] * 0.1 * np.arange(480)
    assert fit.simulate(u, Ts=0.1) == approx(own, rel=1e-12)
    K = fit.names.index("K")
    assert fit.interval("K") == approx(
        (fit.theta[K] - 1.96 * fit.sd[K], fit.theta[K] + 1.96 * fit.sd[K])
    )
