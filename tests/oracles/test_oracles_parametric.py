"""The oracles of parametric identification agree with each other, closed forms and bounds."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter
from scipy.stats import norm

from oracles import (
    bound,
    delay_profile,
    feedback,
    fopdt,
    iv4,
    lsq,
    matrix_arx,
    nist_nonlinear,
    pem,
    poly_family,
    process_models,
    robust,
    srivc,
    uncertainty,
    wnsf,
)


def held(N, hold, seed):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.choice([-1.0, 1.0], size=-(-N // hold)), hold)[:N]


# -- polynomial family -------------------------------------------------------------------

CASES = {
    "ARX": (poly_family.arx(na=2, nb=2, nk=1), [-1.5, 0.7, 1.0, 0.5]),
    "ARMAX": (poly_family.armax(na=2, nb=1, nc=1, nk=1), [-1.5, 0.7, 1.0, 0.5]),
    "OE": (poly_family.oe(nb=1, nf=2, nk=2), [1.0, -1.5, 0.7]),
    "BJ": (poly_family.bj(nb=1, nc=1, nd=1, nf=1, nk=2), [0.3, 0.5, -0.9, -0.8]),
    "ARARX": (poly_family.ararx(na=1, nb=2, nd=1, nk=1), [-0.8, 1.0, 0.5, -0.6]),
    "ARARMAX": (poly_family.ararmax(na=1, nb=1, nc=1, nd=1, nk=0), [-0.8, 1.0, 0.4, -0.6]),
    "two inputs": (
        poly_family.bj(2, nb=(2, 1), nc=1, nd=2, nf=(1, 2), nk=(1, 3)),
        [0.5, 0.3, 0.7, 0.4, -0.9, 0.2, -0.8, -1.2, 0.5],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_gradient_is_the_complex_step(case):
    model, theta = CASES[case]
    rng = np.random.default_rng(1)
    u, y = rng.normal(size=(40, len(model.nb))), rng.normal(size=40)
    exact = poly_family.gradient_by_step(model, theta, u, y, 0.3)
    assert poly_family.gradient(model, theta, u, y, 0.3) == approx(exact, abs=1e-12)


@pytest.mark.parametrize("case", CASES)
def test_simulation_and_predictor_are_inverse(case):
    model, theta = CASES[case]
    rng = np.random.default_rng(2)
    u, e = rng.normal(size=(60, len(model.nb))), rng.normal(size=60)
    y = pem.simulate(model, theta, u, e)
    assert poly_family.errors(model, theta, u, y) == approx(e, abs=1e-10)
    problem = pem.Problem(model, u, y, offset=False, x0="zero")
    assert problem(np.asarray(theta))[0] == approx(e, abs=1e-10)


def test_information_is_the_mean_over_records():
    model, theta = CASES["BJ"]
    u, sums = held(200, 4, 0), 0.0
    for seed in range(300):
        e = 0.5 * np.random.default_rng(seed).normal(size=200)
        J = poly_family.gradient(model, theta, u, pem.simulate(model, theta, u, e))[:, :-1]
        sums = sums + J.T @ J / 0.25 / 300
    expected = poly_family.information(model, theta, u, 0.25, offset=False)
    s = np.sqrt(np.diag(expected))
    assert sums / np.outer(s, s) == approx(expected / np.outer(s, s), abs=0.03)


@pytest.mark.parametrize("case", ["ARX", "ARMAX", "OE", "BJ"])
def test_bound_is_what_pem_states(case):
    model, theta = CASES[case]
    u = held(4000, 4, 3)
    y = pem.simulate(model, theta, u, 0.5 * np.random.default_rng(4).normal(size=4000), offset=2.0)
    f = pem.fit(model, u, y, theta)
    bound = np.sqrt(np.diag(poly_family.bound(model, theta, u, 0.25)))[:-1]
    assert f.sd == approx(bound, rel=0.08)


@pytest.mark.parametrize("case", ["ARMAX", "OE"])
def test_starts_reach_one_minimum(case):
    model, theta = CASES[case]
    u, rng = held(400, 3, 5), np.random.default_rng(6)
    y = pem.simulate(model, theta, u, 0.3 * rng.normal(size=400), offset=-7.0)
    starts = [theta, poly_family.two_stage(model, u, y - y[0])]
    best, losses = poly_family.best_of(model, u, y, starts)
    assert losses == approx(best.loss, rel=1e-9)
    start = poly_family.random_start(model, u, y, rng)
    A, _, C, _, F = model.polynomials(start)
    assert all(np.all(np.abs(np.roots(p)) < 1) for p in (A, C, *F))


# -- instruments and null space ----------------------------------------------------------


def test_null_space_relations_hold_at_the_truth():
    b, c, d, f, nk, n = [0.3, 0.2], [0.5], [-0.7], [-1.2, 0.5], 2, 400
    impulse = np.eye(n + 1)[0]
    a = lfilter(np.r_[1, d], np.r_[1, c], impulse)
    bn = lfilter(np.r_[0, 0, b], np.r_[1, f], a)
    eta = np.r_[a[1:], bn[nk:]]
    g, Q, _ = wnsf.relations(eta, n, 2, 1, 1, 2, nk)
    assert Q @ np.r_[b, c, d, f] == approx(g, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_wnsf_comes_close_to_pem(seed):
    u = held(1000, 4, seed)
    for model, theta, n in (
        (poly_family.bj(nb=2, nc=1, nd=1, nf=2, nk=2), [0.3, 0.2, 0.5, -0.8, -1.5, 0.7], 40),
        (poly_family.oe(nb=2, nf=2, nk=2), [0.3, 0.2, -1.5, 0.7], 60),
    ):
        e = 0.3 * np.random.default_rng(seed + 50).normal(size=1000)
        y = pem.simulate(model, theta, u, e, offset=5.0)
        best = pem.fit(model, u, y, theta)
        w = wnsf.fit(u, y, 2, model.nc, model.nd, 2, 2, n=n)
        assert np.all(np.abs(w.theta - best.theta) < 2 * best.sd)
        assert w.sd == approx(best.sd, rel=0.25)


def test_steiglitz_mcbride_finds_oe_without_noise():
    model, theta = CASES["OE"]
    u = held(300, 3, 1)
    y = pem.simulate(model, theta, u, offset=4.0)
    assert wnsf.steiglitz_mcbride(u, y, 1, 2, 2) == approx(theta, abs=1e-8)


def test_instruments_are_unbiased_where_least_squares_is_not():
    theta, least, found = np.array([-1.5, 0.7, 0.3, 0.2]), [], []
    oe = poly_family.oe(nb=2, nf=2, nk=2)
    for seed in range(8):
        u, e = held(400, 4, seed), np.random.default_rng(seed).normal(size=400)
        y = pem.simulate(oe, [0.3, 0.2, -1.5, 0.7], u, 0.3 * e, offset=5.0)
        least.append(lsq.arx(u, y, 2, 2, 2).theta)
        fit = iv4.iv4(u, y, 2, 2, 2, rounds=5)
        found.append((fit.theta - theta) / fit.sd)
        assert fit.offset == approx(5.0, abs=0.4)
    assert np.all(np.abs(np.mean(found, axis=0)) < 3.5 / np.sqrt(8))
    assert abs(np.mean(least, axis=0)[0] + 1.5) > 0.05


def test_instruments_honour_segments_and_inputs():
    rng = np.random.default_rng(0)
    u = rng.normal(size=(300, 2))
    model = poly_family.arx(2, na=1, nb=(1, 2), nk=(1, 2))
    theta = [-0.8, 1.0, 0.5, 0.3]
    y = np.r_[
        pem.simulate(model, theta, u[:120], offset=2.0),
        pem.simulate(model, theta, u[120:], offset=2.0),
    ]
    assert iv4.iv4(u, y, 1, (1, 2), (1, 2), starts=(0, 120)).theta == approx(theta, abs=1e-9)


@pytest.mark.parametrize(
    ("code", "theta", "n", "nb", "truth"),
    [
        ("P1D", [-5.939, 0.1491, 0.107], 1, 1, [0.1491, -5.939]),
        ("P2DU", [2.0, 0.15, 0.4, 0.107], 2, 1, [0.0225, 0.12, 2.0]),
    ],
)
def test_refined_instruments_find_the_plant_and_its_delay(code, theta, n, nb, truth):
    u = held(400, 10, 0)
    y = process_models.simulate(code, theta, u, 0.02, 583.0)
    f = srivc.fit(u, y, 0.02, n, nb, (0.08, 0.14))
    assert np.r_[f.a, f.b] == approx(truth, rel=1e-4)
    assert f.L == approx(0.107, abs=1e-5) and f.offset == approx(583.0, abs=1e-3)


# -- process models ----------------------------------------------------------------------

PLANTS = [
    ("P0D", [1.0, 0.1072]),
    ("P1", [2.0, 0.1]),
    ("P1D", [-5.939, 0.1491, 0.107]),
    ("P1DZ", [1.0, 0.1, 0.1072, 0.3]),
    ("P1DI", [2.0, 0.1, 0.1]),
    ("P2D", [2.0, 0.1, 0.3, 0.107]),
    ("P2D", [2.0, 0.2, 0.2, 0.04]),
    ("P2DU", [2.0, 0.1, 0.4, 0.1072]),
    ("P2UZ", [1.0, 0.1, 1.2, 0.1]),
    ("P3DZ", [2.0, 0.1, 0.2, 0.3, 0.1072, -0.4]),
    ("P3DUZI", [2.0, 0.1, 0.3, 0.05, 0.1072, 0.1]),
]


@pytest.mark.parametrize(("code", "theta"), PLANTS)
def test_samples_do_not_depend_on_the_grid(code, theta):
    u, R = held(200, 7, 0), 4
    y = process_models.simulate(code, theta, u, 0.02, 1.0)
    fine = process_models.simulate(code, theta, np.repeat(u, R), 0.02 / R, 1.0)
    assert y == approx(fine[::R], abs=1e-8)


@pytest.mark.parametrize(("code", "theta"), [p for p in PLANTS if p[0] not in ("P0D", "P1")])
def test_complex_step_is_the_slope(code, theta):
    model, Ts = process_models.code(code), 0.02
    u = held(60, 7, 0)[:, None]
    p = process_models.to_samples(model, theta[1 : 1 + len(model.nonlinear)], Ts)
    h = 1e-6
    for k in range(len(p)):
        z, up, down = p.astype(complex), p.copy(), p.copy()
        z[k], up[k], down[k] = z[k] + 1e-30j, up[k] + h, down[k] - h
        if model.D and abs(p[-1] - round(p[-1])) < 1e-6:
            down[k] = p[k]  # whole delay: the derivative towards larger L
        step, above, below = (
            process_models.columns([model], q, u, (0,), 10)[1] for q in (z, up, down)
        )
        slope = (above - below) / (up[k] - down[k])
        assert step.imag / 1e-30 == approx(slope, rel=1e-5, abs=1e-5 * np.abs(slope).max())


def test_first_order_is_the_sum_of_steps():
    u = held(300, 10, 0)
    theta = [-5.939, 0.1491, 0.107]
    one = fopdt.simulate(u, *theta, 0.02, 583.0)
    assert process_models.simulate("P1D", theta, u, 0.02, 583.0) == approx(one, abs=1e-10)


def test_first_order_fit_is_the_brute_one():
    u, rng = held(200, 10, 1), np.random.default_rng(3)
    y = fopdt.simulate(u, -5.9, 0.15, 0.107, 0.02, 583.0) + 0.2 * rng.normal(size=200)
    brute = fopdt.brute_fit(u, y, 0.02, 10, (0.1, 0.25), (0.06, 0.15), grid=(6, 9))
    f = process_models.fit("P1D", u, y, 0.02, [[0.2, 0.12]], 0.2)
    assert f.theta == approx(brute.theta, rel=1e-8)
    assert f.sd == approx(brute.sd, rel=1e-6)
    assert f.offset == approx(brute.offset, rel=1e-8) and f.N == brute.N


@pytest.mark.parametrize(
    ("code", "theta"),
    [
        ("P2DU", [2.0, 0.15, 0.4, 0.107]),
        ("P2DZ", [2.0, 0.1, 0.3, 0.107, -0.1]),
        ("P1DI", [2.0, 0.1, 0.107]),
    ],
)
def test_fit_finds_the_plant_in_two_segments(code, theta):
    u, Ts = held(400, 10, 2), 0.02
    y = process_models.simulate(code, theta, u, Ts)
    y[150:] = process_models.simulate(code, theta, u[150:], Ts)
    y += 0.7 * Ts * np.arange(400) if "I" in code else 3.0
    p0 = 1.2 * np.array(theta[1 : 1 + len(process_models.code(code).nonlinear)])
    f = process_models.fit(code, u, y, Ts, [p0], 0.2, starts=(0, 150))
    assert f.theta == approx(theta, rel=1e-5)
    assert f.offset == approx(0.7 if "I" in code else 3.0, rel=1e-5)


def test_two_inputs_have_own_plants():
    u = np.column_stack([held(400, 10, 2), held(400, 7, 3)])
    y = process_models.simulate("P1D", [2.0, 0.15, 0.05], u[:, 0], 0.02, 1.0)
    y = y + process_models.simulate("P1D", [-1.0, 0.4, 0.107], u[:, 1], 0.02)
    f = process_models.fit(["P1D", "P1D"], u, y, 0.02, [[0.2, 0.06, 0.3, 0.1]], 0.2)
    assert f.theta == approx([2.0, 0.15, 0.05, -1.0, 0.4, 0.107], rel=1e-5)


def test_profile_of_a_well_known_delay_is_the_normal_interval():
    u, rng = held(400, 15, 4), np.random.default_rng(5)
    y = process_models.simulate("P2DU", [2.0, 0.15, 0.4, 0.107], u, 0.02, 3.0)
    y += 0.1 * rng.normal(size=400)
    f = process_models.fit("P2DU", u, y, 0.02, [[0.15, 0.4, 0.107]], 0.3)
    low, high = delay_profile.profile_interval("P2DU", u, y, 0.02, f, 0.3)
    k = f.names.index("L")
    assert [low, high] == approx(f.theta[k] + np.array([-1.97, 1.97]) * f.sd[k], abs=0.1 * f.sd[k])


# -- uncertainty -------------------------------------------------------------------------


def test_delta_rule_is_the_closed_form():
    theta, P = np.array([-0.8745, 0.745]), np.array([[1e-4, 2e-5], [2e-5, 4e-4]])
    value, cov, G = uncertainty.delta(lambda x: uncertainty.fopdt(x, 0.02), theta, P)
    slopes = uncertainty.fopdt_slopes(theta, 0.02)
    assert value == approx([0.745 / 0.1255, 0.02 / -np.log(0.8745)], rel=1e-12)
    assert G == approx(slopes, rel=1e-7) and cov == approx(slopes @ P @ slopes.T, rel=1e-6)
    b, f = theta[1:], theta[:1]
    w = np.array([1e-6, 10.0])
    assert uncertainty.bode(b, f, 2, w, 0.02)[0] == approx(np.log(uncertainty.gain(b, f)))
    assert uncertainty.roots([-1.2, 0.52]) == approx([0.6, 0.6, -0.4, 0.4])
    assert uncertainty.step(b, f, 2, 200)[-1] == approx(uncertainty.gain(b, f), rel=1e-6)


def test_sandwich_is_the_usual_one_for_white_errors_and_right_for_coloured():
    N, white, coloured, by_ar, found = 2000, [], [], [], []
    x = lfilter([1.0], [1, -0.9], np.random.default_rng(0).normal(size=N))
    X = np.column_stack([x, np.ones(N)])
    for seed in range(60):
        e = np.random.default_rng(seed + 1).normal(size=N)
        v = lfilter([1.0], [1, -0.8], e)
        theta = np.linalg.lstsq(X, v, rcond=None)[0]
        found.append(theta)
        white.append(uncertainty.sandwich(e, X, lags=0)[0, 0])
        coloured.append(np.sqrt(np.diag(uncertainty.sandwich(v - X @ theta, X, lags=30))))
        if seed < 10:
            by_ar.append(np.sqrt(np.diag(uncertainty.sandwich_ar(v - X @ theta, X))))
    assert np.sqrt(np.mean(white)) == approx(np.sqrt(np.linalg.inv(X.T @ X)[0, 0]), rel=0.05)
    assert np.mean(coloured, axis=0) == approx(np.std(found, axis=0), rel=0.25)
    assert np.mean(by_ar, axis=0) == approx(np.std(found, axis=0), rel=0.25)


def test_block_bootstrap_knows_the_colour():
    N, X = 600, np.ones((600, 1))
    e = lfilter([1.0], [1, -0.7], np.random.default_rng(0).normal(size=N))
    means = uncertainty.bootstrap(lambda y: [y.mean()], np.zeros(N), e, 40, 300)
    assert np.std(means) == approx(1 / 0.3 / np.sqrt(N), rel=0.25)
    assert np.std(means) == approx(
        np.sqrt(uncertainty.sandwich(e - e.mean(), X, lags=30)[0, 0]), rel=0.25
    )


def test_sign_perturbed_sums_cover_what_they_say():
    count, N = 0, 40
    for seed in range(500):
        rng = np.random.default_rng(seed)
        phi = rng.normal(size=(N, 2))
        e = rng.standard_t(2, N) * np.linspace(0.2, 3, N)
        count += uncertainty.inside(phi, phi @ [1.0, -0.5] + e, np.array([1.0, -0.5]), 20, 2, seed)
    assert count / 500 == approx(0.9, abs=0.04)  # confidence 1 - 2/20


def test_sign_perturbed_sums_cover_arx():
    count, theta = 0, np.array([-0.8, 1.0, 0.5])
    for seed in range(100):
        rng = np.random.default_rng(seed)
        u, e = held(41, 3, seed), rng.laplace(size=41)
        y = lfilter([0, 1.0], [1, -0.8], u) + lfilter([1.0], [1, -0.8], e + 0.5)
        phi, target, _ = lsq.arx_rows(u, y, 1, 1, 1)
        again = uncertainty.perturbed_arx(u, y, 1, 1, 1)
        count += uncertainty.inside(phi, target, theta, 20, 2, seed, again)
        if seed == 0:
            assert again(theta, target - phi @ theta) == approx(phi)
    assert count / 100 == approx(0.9, abs=0.09)


# -- feedback and relation ---------------------------------------------------------------


def test_feedback_is_seen_in_a_loop_and_nowhere_else():
    for seed in range(8):
        rng = np.random.default_rng(seed)
        e = rng.normal(size=(500, 1))
        r = bound.set_points(500, 1, (10, 25), seed)
        u, y = bound.simulate(bound.Engine(), r, 0.3 * e)
        assert feedback.p_of_feedback(u, y) < 1e-3
        assert feedback.p_of_feedback(u, y, r) < 1e-3
        for u in (held(500, 8, seed), np.cumsum(rng.normal(size=500))):
            y = lfilter([0, 0, 0.3], [1, -0.85], u) + 0.3 * e[:, 0]
            assert feedback.p_of_feedback(u, y) > 1e-3
            assert feedback.p_of_no_relation(u, y) < 1e-6


def test_no_relation_is_claimed_as_often_as_said():
    p = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        p.append(feedback.p_of_no_relation(held(300, 5, seed), np.cumsum(rng.normal(size=300))))
    assert np.mean(np.array(p) < 0.05) == approx(0.05, abs=0.04)


# -- robust ------------------------------------------------------------------------------


def test_huber_is_as_efficient_as_the_text_says():
    clean, dirty, sd = [], [], []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        X = np.column_stack([rng.normal(size=200), np.ones(200)])
        e = rng.normal(size=200)
        f = robust.regression(X, e)
        clean.append([f.theta[0], np.linalg.lstsq(X, e, rcond=None)[0][0]])
        sd.append(f.sd[0])
        e[:10] += 50
        dirty.append(robust.regression(X, e).theta[0])
    spread = np.std(clean, axis=0)
    assert (spread[1] / spread[0]) ** 2 == approx(0.95, abs=0.05)  # 95 % at c = 1.345
    assert np.mean(sd) == approx(spread[0], rel=0.12)
    assert np.std(dirty) < 1.4 * spread[0]


def test_huber_brings_output_error_back():
    model, theta = poly_family.oe(nb=1, nf=1, nk=6), [-0.745, -0.8745]
    u = held(600, 10, 0)
    rng = np.random.default_rng(1)
    y = pem.simulate(model, theta, u, 0.1 * rng.normal(size=600), offset=3.0)
    clean = pem.fit(model, u, y, theta)
    y[rng.choice(600, 12, replace=False)] += 25 * rng.choice([-1, 1], 12)
    spiked = pem.fit(model, u, y, theta)
    problem = pem.Problem(model, u, y)
    f = robust.nonlinear(problem, problem.start(spiked.theta))
    assert np.max(np.abs(f.x[:2] / clean.theta - 1)) < 0.005
    assert np.max(np.abs(spiked.theta / clean.theta - 1)) > 0.02
    assert f.sd[:2] == approx(clean.sd, rel=0.2)


# -- NIST nonlinear ----------------------------------------------------------------------


@pytest.mark.parametrize("name", nist_nonlinear.FORMULAS)
def test_nist_nonlinear_from_both_starts(data, name):
    p = nist_nonlinear.read(data("nist_strd"), name)
    rss = np.sum(nist_nonlinear.errors(p, p.certified) ** 2)
    if name != "Lanczos1":  # whose residuals are below what eleven digits of b can give
        assert rss == approx(p.rss, rel=1e-9)
    for start in p.starts:
        b = nist_nonlinear.scipy_fit(p, start)
        assert nist_nonlinear.digits(b, p.certified) > 6
        assert nist_nonlinear.cosine(p, b) < 1e-4 or name == "Lanczos1"


# -- several outputs ---------------------------------------------------------------------


def test_matrix_arx_is_least_squares_and_its_transfer():
    rng = np.random.default_rng(0)
    A = np.array([np.eye(2), [[-0.8, 0.1], [0.2, -0.5]], [[0.1, 0.0], [0.05, 0.1]]])
    B = rng.normal(size=(2, 2, 3))
    U, E = rng.normal(size=(400, 3)), 0.1 * rng.normal(size=(400, 2))
    Y = matrix_arx.simulate(A, B, 1, U, E, offset=np.array([3.0, -40.0]))
    f = matrix_arx.fit(Y, U, 2, 2, 1)
    assert np.all(np.abs(f.A[1:] - A[1:]) < 0.05) and np.all(np.abs(f.B - B) < 0.05)
    assert f.offset == approx([3.0, -40.0], abs=0.3)
    # one output at a time, the other one an input
    both = np.column_stack([Y[:, 1], U])
    one = lsq.arx(both, Y[:, 0], 2, 2, 1)
    assert one.theta[:2] == approx(f.A[1:, 0, 0], abs=1e-9)
    assert one.theta[2:4] == approx(-f.A[1:, 0, 1], abs=1e-9)
    assert np.max(np.abs(matrix_arx.poles(A))) < 1
    z = 1.0
    dc = np.linalg.solve(A.sum(axis=0), B.sum(axis=0))
    assert matrix_arx.transfer(A, B, 1, z) == approx(dc)
    step = matrix_arx.simulate(A, B, 1, np.tile([1.0, 0, 0], (200, 1)))
    assert step[-1] == approx(dc[:, 0], rel=1e-8)
    noise_free = matrix_arx.simulate(A, B, 1, U)
    exact = matrix_arx.fit(noise_free, U, 2, 2, 1)
    assert exact.A == approx(A, abs=1e-9) and exact.B == approx(B, abs=1e-9)


def test_bands_of_matrix_arx_cover():
    A, B = np.array([np.eye(2), [[-0.8, 0.1], [0.2, -0.5]]]), np.ones((1, 2, 1))
    count = []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        E = rng.normal(size=(300, 2)) @ [[1.0, 0.5], [0.0, 1.0]]
        U = rng.normal(size=(300, 1))
        f = matrix_arx.fit(matrix_arx.simulate(A, B, 1, U, E), U, 1, 1, 1, offset=False)
        truth = np.vstack([A[1].T, B[0].T])
        count.append(np.abs(f.Theta - truth) < norm.ppf(0.975) * f.sd)
    assert np.mean(count) == approx(0.95, abs=0.03)
