"""Process models of every code: profiles, pairs of poles, integrators, several inputs, noise."""

import numpy as np
import pytest
from pytest import approx
from scipy.stats import f as f_law

import plantune as pt
from oracles import delay_profile, fopdt, process_models
from plantune.io import load_model, save_model

TS, O = 0.02, 3.0

# code, theta in the oracle's order of names
CODES = [
    ("P0D", [2.0, 0.12]),
    ("P0DI", [2.0, 0.107]),
    ("P1", [2.0, 0.15]),
    ("P1D", [-5.939, 0.1491, 0.107]),
    ("P1Z", [2.0, 0.15, 0.05]),
    ("P1DZ", [2.0, 0.15, 0.12, 0.05]),
    ("P1DI", [2.0, 0.15, 0.107]),
    ("P2", [2.0, 0.3, 0.1]),
    ("P2U", [2.0, 0.3, 0.3]),
    ("P2D", [2.0, 0.3, 0.1, 0.107]),
    ("P2DU", [2.0, 0.15, 0.4, 0.107]),
    ("P2DZ", [2.0, 0.3, 0.1, 0.107, -0.1]),
    ("P2DI", [2.0, 0.3, 0.1, 0.107]),
    ("P3D", [2.0, 0.3, 0.2, 0.1, 0.107]),
    ("P3DU", [2.0, 0.15, 0.4, 0.1, 0.107]),
    ("P2DIZU", [2.0, 0.15, 0.4, 0.107, 0.1]),
]


def data(code, theta, sd=0.0, seed=0, N=500, hold=12):
    """Return u and y of a plant that was in motion before the record."""
    u = fopdt.hold_input(N + 250, hold, seed)
    y = process_models.simulate(code, theta, u, TS, O)
    return u[250:], (y + sd * np.random.default_rng(10**6 + seed).normal(size=N + 250))[250:]


def fitted(code, theta, sd=0.0, seed=0, **options):
    u, y = data(code, theta, sd, seed)
    return pt.estimate.process(pt.Record(u=u, y=y, Ts=TS), code, **options)


def in_order(code, fit):
    """Return theta in the oracle's order; the lags may have changed places."""
    by = dict(zip(fit.names, fit.theta, strict=True))
    lags = sorted((by[n] for n in by if n[0] == "T" and n[1:].isdigit()), reverse=True)
    own = iter(lags if "U" not in code else [by[n] for n in ("T1", "T2") if n in by])
    names = process_models.code(code).names
    times = {n: next(own) for n in names if n not in by or n in ("T1", "T2", "T3")}
    return np.array([times.get(n, by.get(n)) for n in names])


@pytest.mark.parametrize("code, theta", CODES)
def test_noise_free_data_give_the_plant_back(code, theta):
    fit = fitted(code, theta)
    assert fit.status == "converged"
    assert in_order(code, fit) == approx(theta, rel=1e-5)  # triple lags lose digits
    assert fit.offset[0] == approx(0.0 if "I" in code else O, abs=1e-6)


COMPARED = [case for case in CODES if case[0] in ("P2D", "P2DU", "P2DZ", "P1DI")]


@pytest.mark.parametrize("code, theta", COMPARED)
def test_the_fit_is_the_oracle_s(code, theta):
    """Same rows, same loss, parameters and deviations; the oracle has a start at the truth."""
    u, y = data(code, theta, sd=0.1, seed=3)
    fit = pt.estimate.process(pt.Record(u=u, y=y, Ts=TS), code)
    model = process_models.code(code)
    tries = [theta[1 : 1 + len(model.nonlinear)]]
    ref = process_models.fit(code, u, y, TS, tries, (500 - fit.N) * TS)
    assert fit.loss == approx(ref.loss, rel=1e-8)
    sd = dict(zip(ref.names, ref.sd, strict=True))
    gap = np.abs(in_order(code, fit) - ref.theta) / ref.sd
    assert (gap < 5e-3).all()  # where the loss is flat to rounding
    assert fit.offset[0] == approx(ref.offset, abs=5e-3 * ref.P[-1, -1] ** 0.5)
    assert fit.sd[0] == approx(sd["K"], rel=2e-3)
    assert fit.offset_sd == approx(ref.P[-1, -1] ** 0.5, rel=2e-3)


def test_the_interval_of_the_delay_is_the_profile_s():
    """The oracle's least loss at both ends has risen by 1.1 F(1, N - n)."""
    u, y = data("P2D", [2.0, 0.3, 0.1, 0.107], sd=0.1, seed=3)
    fit = pt.estimate.process(pt.Record(u=u, y=y, Ts=TS), "P2D")
    low, high = fit.interval("L")
    L_max = (500 - fit.N) * TS
    ref = process_models.fit("P2D", u, y, TS, [[0.3, 0.1, 0.107]], L_max)
    rss = delay_profile.profile("P2D", u, y, TS, ref, [low, high], L_max)
    rise = (rss / ref.rss - 1) * ref.free / f_law.ppf(0.95, 1, ref.free)
    assert rise == approx([1.1, 1.1], rel=0.02)
    assert fit.sd[list(fit.names).index("L")] == approx((high - low) / 2 / 1.96)


def covered(code, theta, sd, runs):
    """Count the runs whose 95 % interval holds the truth, per parameter and the offset."""
    names, inside = process_models.code(code).names, np.zeros(len(theta) + 1)
    for seed in range(runs):
        fit = fitted(code, theta, sd, seed)
        ends = [fit.interval(name) for name in names]
        reach = 1.96 * fit.offset_sd
        ends.append((fit.offset[0] - reach, fit.offset[0] + reach))
        inside += [low <= x <= high for (low, high), x in zip(ends, [*theta, O], strict=True)]
    return inside


COVERED = [("P1D", [-5.939, 0.1491, 0.107], 2.0), ("P2DU", [2.0, 0.15, 0.4, 0.107], 0.3)]


@pytest.mark.parametrize("code, theta, sd", COVERED)
def test_intervals_cover_the_truth(code, theta, sd):
    """Of 40 runs 38 expected, 33 within 3.6 deviations of the count."""
    inside = covered(code, theta, sd, 40)
    assert inside.min() >= 33, inside


@pytest.mark.slow
@pytest.mark.parametrize("code, theta, sd", COVERED)
def test_intervals_cover_the_truth_in_93_to_97_of_100_runs(code, theta, sd):
    """Issue 7: seeds 0 to 999; measured .946 to .961 for P1D, .946 to .953 for P2DU."""
    inside = covered(code, theta, sd, 1000)
    assert inside.min() >= 930 and inside.max() <= 970, inside


def closed_loop(seed, N=20_000):
    """METHODS 1.7: op-1 in a tight loop, equation noise of variance 15 with C = 1 + 0.5 q^-1."""
    K, T, Kp, Ki, offset = -5.939, 0.1491, -0.1315, -0.8816, 583.451
    rng = np.random.default_rng(seed)
    e = 15**0.5 * np.random.default_rng(99 + seed).normal(size=N)
    r = np.repeat(400 + 50 * rng.choice([-1.0, 1.0], N), rng.integers(10, 26, N))[:N]
    a = np.exp(-TS / T)
    u, y, total, x, u0 = np.empty(N), np.empty(N), 0.0, 400 - offset, (400 - offset) / K
    for t in range(N):
        v = e[t] + (0.5 * e[t - 1] if t else 0.0)
        x = a * x + K * (1 - a) * (u[t - 6] if t >= 6 else u0) + v
        y[t] = x + offset
        total += Ki * TS * (r[t] - y[t])
        u[t] = u0 + Kp * (r[t] - y[t]) + total
    return pt.Record(u=u, y=y, Ts=TS)


def test_a_noise_model_takes_the_bias_of_a_closed_loop_away():
    rec = closed_loop(0)
    fit = pt.estimate.process(rec, "P1D", noise="arma")
    assert (np.abs(fit.theta - [-5.939, 0.1491, 0.1]) < 3 * fit.sd).all()
    assert fit.sampled.C[1] == approx(0.5, abs=0.05)
    assert fit.sampled.D[1] == approx(-np.exp(-TS / 0.1491), abs=0.01)
    one = fit.predict(rec) - rec.y[:, 0]
    assert np.mean(one[50:] ** 2) == approx(fit.loss, rel=0.01)


@pytest.mark.slow
def test_closed_loop_gains_and_times_are_unbiased():
    """Issue 7: within 0.5 % in K and T; -.04 and -.04 % of 20 seeds, sd of the mean .22, .27."""
    fits = [pt.estimate.process(closed_loop(seed), "P1D", noise="arma") for seed in range(20)]
    errors = np.mean([fit.theta[:2] / [-5.939, 0.1491] - 1 for fit in fits], axis=0)
    assert (np.abs(errors) < 0.005).all(), errors


def two_inputs(sd=0.0, N=600):
    u = np.c_[fopdt.hold_input(N + 250, 12, 1), fopdt.hold_input(N + 250, 9, 7)]
    first = process_models.simulate("P1D", [2.0, 0.15, 0.107], u[:, 0], TS, O)
    second = process_models.simulate("P2D", [-1.0, 0.2, 0.1, 0.05], u[:, 1], TS)
    y = first + second + sd * np.random.default_rng(3).normal(size=len(u))
    return pt.Record(u=u[250:], y=y[250:], Ts=TS)


def test_several_inputs_have_a_code_each():
    rec = two_inputs()
    fit = pt.estimate.process(rec, ["P1D", "P2D"])
    assert list(fit.names) == ["K[u1]", "T[u1]", "L[u1]", "K[u2]", "T1[u2]", "T2[u2]", "L[u2]"]
    assert fit.theta == approx([2.0, 0.15, 0.107, -1.0, 0.2, 0.1, 0.05], rel=1e-6)
    assert fit.plants[0].L == approx(0.107) and fit.plants[1].T == approx((0.2, 0.1))
    assert np.abs(fit.predict(rec) - rec.y[:, 0])[30:].max() < 1e-9


def test_several_inputs_are_the_oracle_s():
    rec = two_inputs(sd=0.1)
    fit = pt.estimate.process(rec, ["P1D", "P2D"])
    tries = [[0.15, 0.107, 0.2, 0.1, 0.05]]
    ref = process_models.fit(["P1D", "P2D"], rec.u, rec.y, TS, tries, (rec.N - fit.N) * TS)
    assert fit.loss == approx(ref.loss, rel=1e-8)
    assert (np.abs(fit.theta - ref.theta) < 5e-3 * ref.sd).all()


def test_two_equal_lags_are_quoted_as_their_pair():
    fit = fitted("P2D", [2.0, 0.2, 0.2, 0.107], sd=0.1, seed=1)
    assert "X10" in [note.code for note in fit.notes]
    at = list(fit.names).index
    assert abs(fit.theta[at("zeta")] - 1.0) < 3 * fit.sd[at("zeta")]
    assert abs(fit.theta[at("T")] - 0.2) < 3 * fit.sd[at("T")]


def test_an_integrator_has_a_drift_and_no_gain():
    u, y = data("P1DI", [2.0, 0.15, 0.107])
    rec = pt.Record(u=u, y=y + 0.7 * TS * np.arange(500), Ts=TS)
    fit = pt.estimate.process(rec, "P1DI")
    assert "M01" in [note.code for note in fit.notes]
    assert fit.offset[0] == approx(0.7, rel=1e-6)
    assert np.abs(fit.predict(rec) - rec.y[:, 0])[30:].max() < 1e-7
    assert fit.simulate(np.zeros(51), Ts=TS)[-1] == approx(0.7, rel=1e-6)


def test_an_inverse_response_is_named():
    fit = fitted("P2DZ", [2.0, 0.3, 0.1, 0.107, -0.1], sd=0.1)
    assert "X12" in [note.code for note in fit.notes]


def test_models_survive_a_round_trip(tmp_path):
    model = fitted("P2DU", [2.0, 0.15, 0.4, 0.107], sd=0.1).model
    save_model(tmp_path / "model.json", model)
    assert load_model(tmp_path / "model.json") == model


@pytest.mark.parametrize("code", ["P4D", "p1d", "P1X", "P1U", "P0Z", "P2DD", ""])
def test_unknown_codes_name_those_allowed(code):
    u, y = data("P1D", [2.0, 0.15, 0.1])
    with pytest.raises(pt.PlantuneError, match="P") as refusal:
        pt.estimate.process(pt.Record(u=u, y=y, Ts=TS), code)
    assert refusal.value.code == "U01"


def test_unknown_noise_and_names_are_refused():
    u, y = data("P1D", [2.0, 0.15, 0.1], sd=0.1)
    rec = pt.Record(u=u, y=y, Ts=TS)
    with pytest.raises(pt.PlantuneError, match="arma"):
        pt.estimate.process(rec, "P1D", noise="pink")
    with pytest.raises(pt.PlantuneError, match="K, T, L"):
        pt.estimate.process(rec, "P1D").interval("Tz")


def test_no_relation_is_refused_for_every_order():
    u, _ = data("P1D", [2.0, 0.15, 0.1])
    y = np.random.default_rng(5).normal(size=500)
    for code in ("P1D", "P2D", "P2DU", "P1DZ"):
        with pytest.raises(pt.NotIdentifiable) as refusal:
            pt.estimate.process(pt.Record(u=u, y=y, Ts=TS), code)
        assert refusal.value.code == "X04"


def test_refusals_speak_of_all_inputs():
    rng = np.random.default_rng(1)
    u = rng.choice([-1.0, 1.0], (120, 2)).repeat(5, axis=0)
    names = {"u_names": ["heat", "flow"], "y_names": ["temp"]}
    unrelated = pt.Record(u=u, y=rng.normal(size=600), Ts=1.0, **names)
    with pytest.raises(pt.NotIdentifiable, match="heat and flow explain nothing of temp") as caught:
        pt.estimate.process(unrelated, "P1D")
    assert caught.value.code == "X04"
    before = rng.choice([-1.0, 1.0], 60).repeat(5)
    late = np.concatenate([before, u[:-300, 1]]) + 0.02 * rng.normal(size=600)
    with pytest.raises(pt.NotIdentifiable, match="follows flow only") as caught:
        pt.estimate.process(pt.Record(u=u, y=late, Ts=1.0, **names), "P1D")
    assert (caught.value.code, caught.value.where[0]) == ("X05", "flow")
    with pytest.raises(pt.NotIdentifiable, match="nk = 300 of flow"):
        pt.estimate.oe(pt.Record(u=u, y=late, Ts=1.0, **names), 1, 1, [1, 300])
