"""The oracles agree with printed numbers, closed forms and other libraries."""

from math import degrees, pi

import numpy as np
import pytest
from pytest import approx
from scipy import optimize, signal

from oracles import fopdt, loop, lsq, pem, resid

OP1 = dict(K=5.939, T=0.1491, L=0.1)
TAU_C = (6 / pi - 1) * 0.1  # gain margin 3: 001, (3.6-41)


# -- least squares ---------------------------------------------------------------------


def test_arx_on_the_hair_dryer_gives_the_known_numbers(data):
    u, y = np.loadtxt(data("hair_dryer") / "dryer.dat").T[:, :300]
    if np.std(u) < np.std(y):  # columns are power, temperature
        u, y = y, u
    fit = lsq.arx(u - u.mean(), y - y.mean(), 2, 2, 3, offset=False)
    assert fit.N == 296
    assert fit.theta == approx(
        [-1.273739, 0.393546, 0.066618, 0.044482], abs=5e-7
    )  # printed digits
    assert fit.loss == approx(0.00168531, abs=5e-9)


def test_arx_returns_the_truth_without_noise_over_segments_and_inputs():
    rng = np.random.default_rng(1)
    u = rng.normal(size=(120, 2))
    y = np.zeros(120)
    starts = (0, 50)
    for first, end in lsq.segments(120, starts):
        y[first : first + 4] = rng.normal(size=4)
        for t in range(first + 4, end):
            y[t] = (
                1.2 * y[t - 1]
                - 0.4 * y[t - 2]
                + 0.5 * u[t - 1, 0]
                + 0.1 * u[t - 2, 0]
                - 0.3 * u[t - 4, 1]
                + 0.6
            )
    fit = lsq.arx(u, y, 2, [2, 1], [1, 4], starts)
    assert fit.N == 120 - 2 * 4  # drop max(na, nb + nk - 1) = 4 a segment
    assert fit.theta == approx([-1.2, 0.4, 0.5, 0.1, -0.3], abs=1e-12)
    assert fit.offset == approx(0.6 / 0.2, abs=1e-11)


def test_arx_covariance_is_that_of_repeated_noise():
    rng = np.random.default_rng(2)
    u = fopdt.hold_input(400, 3, 5)
    runs = []
    for _ in range(400):
        y = np.zeros(400)
        e = 0.1 * rng.normal(size=400)
        for t in range(1, 400):
            y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 1] + 1.0 + e[t]
        fit = lsq.arx(u, y, 1, 1, 1)
        runs.append([*fit.theta, fit.offset])
    spread = np.std(runs, axis=0)
    assert spread == approx(
        np.sqrt(np.diag(fit.P)), rel=0.15
    )  # 400 runs: 3.5 % sd; start transient 5 %


def test_exact_solution_agrees_with_the_certified_wampler_coefficients():
    x = np.arange(21.0)
    X = np.vander(x, 6, increasing=True)
    assert lsq.exact(X, (X @ np.ones(6))) == approx(np.ones(6), rel=1e-15)
    assert lsq.digits([1.001, 2.0], [1.0, 2.0]) == approx([3.0, 15.0], abs=1e-9)


# -- first order plus dead time --------------------------------------------------------


@pytest.mark.parametrize("L", [0.0, 0.1, 0.107, 0.033])
def test_step_superposition_equals_the_exact_recursion(L):
    """METHODS 1.5: y = a y(-1) + b1 u(-m-1) + b2 u(-m-2)."""
    K, T, Ts = -5.939, 0.1491, 0.02
    u = fopdt.hold_input(200, 4, 3)
    m = int(np.floor(L / Ts + 1e-9))
    f = L - m * Ts
    a = np.exp(-Ts / T)
    b1, b2 = K * (1 - np.exp(-(Ts - f) / T)), K * (np.exp(-(Ts - f) / T) - a)
    y = np.zeros(200)
    for t in range(1, 200):
        y[t] = a * y[t - 1]
        y[t] += b1 * u[t - m - 1] if t > m else 0.0
        y[t] += b2 * u[t - m - 2] if t > m + 1 else 0.0
    assert fopdt.simulate(u, K, T, L, Ts) == approx(y, abs=1e-12)


def test_superposition_equals_scipy_on_an_oversampled_input():
    K, T, L, Ts = 2.0, 0.5, 0.13, 0.1
    u = fopdt.hold_input(60, 3, 8)
    fine = np.repeat(u, 100)  # 1 ms; the delay is 130 of them
    t = 1e-3 * np.arange(len(fine))
    delayed = np.concatenate([np.zeros(130), fine[:-130]])
    A, B, C, D, _ = signal.cont2discrete(
        tuple(np.atleast_2d(v) for v in (-1 / T, K / T, 1.0, 0.0)), 1e-3
    )
    y = signal.dlsim((A, B, C, D, 1e-3), delayed)[1].ravel()[::100]
    assert fopdt.simulate(u, K, T, L, Ts) == approx(y, abs=1e-11)
    assert len(t) == 6000


@pytest.mark.parametrize("L", [0.1, 0.107])
def test_brute_fit_returns_the_truth_without_noise(L):
    u = 50 + 5 * fopdt.hold_input(150, 12, 4)
    y = fopdt.simulate(u, -5.939, 0.1491, L, 0.02, offset=583.451, x0=40.0, before=50.0)
    fit = fopdt.brute_fit(u, y, 0.02, 12, (0.03, 1.0), (0.0, 0.22))
    assert [*fit.theta, fit.offset] == approx([-5.939, 0.1491, L, 583.451], rel=1e-8)


def test_brute_fit_intervals_cover_the_truth():
    u = fopdt.hold_input(300, 12, 4)
    clean = fopdt.simulate(u, -5.939, 0.1491, 0.107, 0.02, offset=583.451)
    truth = np.array([-5.939, 0.1491, 0.107, 583.451])
    inside = []
    for seed in range(100):
        y = clean + np.sqrt(0.2) * np.random.default_rng(seed).normal(size=300)
        fit = fopdt.brute_fit(u, y, 0.02, 12, (0.08, 0.3), (0.06, 0.16), grid=(4, 6))
        inside.append(np.abs([*fit.theta, fit.offset] - truth) < 1.96 * np.sqrt(np.diag(fit.P)))
    assert np.mean(inside) == approx(0.95, abs=0.04)  # 400 dependent counts: sd about 0.015


# -- margins ---------------------------------------------------------------------------


def test_margins_of_imc_pi_at_operating_point_1():
    m = loop.margins(**OP1, Kp=0.1491 / (5.939 * 0.6 / pi), Ti=0.1491)
    assert m.gain == approx(3, rel=1e-12)
    assert m.gain_db == approx(9.5424, abs=5e-5) and m.w_gain == approx(15.708, abs=5e-4)
    assert m.phase_deg == approx(60, abs=1e-10) and m.w_phase == approx(pi / 0.6, rel=1e-12)
    assert m.delay == approx((pi / 3) / (pi / 0.6), rel=1e-11)
    assert m.Ms == approx(1.63, abs=0.005)  # METHODS 3.1, `seed IMC`


@pytest.mark.parametrize(
    "K, T, L, Kp, Ti, printed",
    [
        # 001, table 3.6-5: last digits of the text carry its own grid, hence 5e-4 relative
        (5.939, 0.1491, 0.1, 0.9 * 0.1491 / 0.5939, 0.3, (6.20957, 17.485, 66.341, 7.27992)),
        # ERRATA 3.2, operating point 5
        (8.137, 0.4145, 0.1, 0.9 * 0.4145 / 0.8137, 0.3, (4.409, 15.120, 31.77, 9.257)),
        (8.137, 0.4145, 0.1, 0.0938, 0.1684, (16.525, 13.304, 47.49, 3.129)),
    ],
)
def test_margins_reproduce_the_printed_tables(K, T, L, Kp, Ti, printed):
    m = loop.margins(K, T, L, Kp, Ti)
    assert (m.gain_db, m.w_gain, m.phase_deg, m.w_phase) == approx(printed, rel=5e-4)


@pytest.mark.parametrize("ratio, gain, phase", [(1.433589, 3.0, 74.3), (0.637557, None, 60.0)])
def test_margins_of_imc_pid_reproduce_the_printed_choices(ratio, gain, phase):
    K, T, L = OP1.values()
    m = loop.margins(K, T, L, *loop.imc_pid(K, T, L, ratio * L))  # ERRATA 3.3
    assert m.phase_deg == approx(phase, abs=0.05 if gain else 1e-4)
    if gain:
        assert m.gain == approx(gain, rel=1e-6) and m.w_gain * L == approx(2.458714, abs=5e-7)


def test_margins_agree_with_python_control_without_delay_effects():
    control = pytest.importorskip("control")
    K, T, L, Kp, Ti = 2.0, 3.0, 0.4, 1.1, 2.5
    w = np.geomspace(0.1, 10, 3001)
    frd = control.FRD(loop.open_loop(w, K, T, L, Kp, Ti), w)
    gm, pm, _, wpc, wgc, _ = control.stability_margins(frd)
    m = loop.margins(K, T, L, Kp, Ti)
    assert (m.gain, m.phase_deg, m.w_gain, m.w_phase) == approx(
        (gm, pm, wpc, wgc), rel=1e-4
    )  # its spline


# -- continuous closed loop ------------------------------------------------------------


def test_step_of_imc_pi_has_the_known_indices():
    L = 0.1
    run = loop.Continuous(**OP1, Kp=0.1491 / (5.939 * 0.6 / pi), Ti=0.1491, t_end=4.0)
    i = run.indices(final_u=1 / 5.939)
    assert i.overshoot == approx(5.643415, abs=5e-7)
    assert i.settling / L == approx(6.03673, abs=5e-6)
    assert (i.ise / L, i.iae / L, i.itae / L**2) == approx(
        (1.65398669, 2.13785560, 2.85565379), abs=1e-8
    )
    assert i.control_overshoot == approx(32.762, rel=3e-3)  # 001, table 3.6-4, on 20 ms samples


def test_step_of_imc_pi_is_the_finite_sum_of_its_delays():
    """IMC-PI cancels the pole, E(s) = 1/(s + k e^(-sL)): a finite sum on each delay."""
    K, T, L = OP1.values()
    Kp, Ti = loop.imc_pi(K, T, L, TAU_C)
    k = K * Kp / T
    run = loop.Continuous(K, T, L, Kp, Ti, t_end=1.2)
    t = np.linspace(0, 1.2, 241)
    # E(s) = 1/(s + k e^(-sL)): e(t) = sum_n (-k)^n (t - nL)^n / n!, for t > nL
    e = np.zeros_like(t)
    term = 1.0
    for n in range(13):
        term = term * (-k) / n if n else 1.0
        e += np.where(t > n * L, term * np.maximum(t - n * L, 0) ** n, 0.0) if n else 1.0
    assert run.y(t) == approx(1 - e, abs=1e-12)


def test_load_step_integral_is_ti_over_kp():
    K, T, L = OP1.values()
    Kp, Ti = loop.imc_pi(K, T, L, TAU_C)
    run = loop.Continuous(K, T, L, Kp, Ti, t_end=5.0, r=0.0, d=1.0)
    assert run.integral(lambda t: -run.y(t)) == approx(-Ti / Kp, rel=1e-9)  # final integral of e
    assert Ti / Kp == approx(1.13, abs=0.005)  # METHODS 3.1


@pytest.mark.parametrize(
    "Kp, Ti, settling, overshoot",
    [
        # 001, table 3.6-4, on 20 ms samples; ERRATA 3.2 for ZN's overshoot
        (0.9 * 0.1491 / 0.5939, 0.3, 1.1340, 6.39),
        (0.0787, 0.1118, 0.9604, 5.5742),
    ],
)
def test_step_of_other_rules_reproduces_the_table(Kp, Ti, settling, overshoot):
    i = loop.Continuous(**OP1, Kp=Kp, Ti=Ti, t_end=6.0).indices(final_u=1 / 5.939)
    assert i.settling == approx(settling, rel=3e-3)
    assert i.overshoot == approx(overshoot, rel=1e-2)


# -- sampled closed loop ---------------------------------------------------------------


def test_sampled_loop_equals_a_linear_recursion_for_a_whole_delay():
    K, T, L, Ts = 5.939, 0.1491, 0.1, 0.02
    Kp, Ti = loop.imc_pi(K, T, L, TAU_C)
    run = loop.sampled_pi(K, T, L, Kp, Ti, Ts, np.ones(150))
    # C = Kp ((1 + Ts/Ti) - z^-1)/(1 - z^-1), P = b z^-6/(1 - a z^-1)
    a = np.exp(-Ts / T)
    num = np.zeros(8)
    num[6:8] = K * (1 - a) * Kp * np.array([1 + Ts / Ti, -1])
    den = np.zeros(8)
    den[:3] = np.polymul([1, -1], [1, -a])
    y = signal.lfilter(num, den + num, np.ones(150))
    assert run.y == approx(y, abs=1e-11)
    assert run.at(run.t) == approx(run.y, abs=1e-12)


def test_sampled_loop_tends_to_the_continuous_one():
    K, T, L = OP1.values()
    Kp, Ti = loop.imc_pi(K, T, L, TAU_C)
    smooth = loop.Continuous(K, T, L, Kp, Ti, t_end=1.0)
    gap = []
    for Ts in (0.004, 0.002):
        run = loop.sampled_pi(K, T, L, Kp, Ti, Ts, np.ones(round(1 / Ts)))
        gap.append(np.abs(run.y - smooth.y(run.t)).max())
    assert gap[0] < 0.03 and gap[1] == approx(gap[0] / 2, rel=0.1)  # first order in Ts


# -- prediction errors -----------------------------------------------------------------

# Every polynomial at once, two inputs, a direct term: theta = [a, b1, b2, c, d, f1, f2].
GENERAL = pem.orders(2, na=1, nb=(1, 2), nc=1, nd=2, nf=(1, 2), nk=(0, 2))
TRUTH = np.array([-0.5, 0.5, 0.3, 0.1, 0.6, -0.3, 0.2, -0.8, -1.1, 0.4])


def noisy(model, theta, N=300, sd=0.1, seed=1, offset=4.0):
    """Simulate a model from rest with white input and white noise; return u, y and the noise."""
    rng = np.random.default_rng(seed)
    u, e = rng.normal(size=(N, len(model.nb))), sd * rng.normal(size=N)
    return u, pem.simulate(model, theta, u, e, offset), e


def test_prediction_errors_of_the_truth_are_the_noise():
    u, y, e = noisy(GENERAL, TRUTH, offset=0.0)
    eps, _ = pem.Problem(GENERAL, u, y, offset=False, x0="zero")(TRUTH)
    assert eps == approx(e, abs=1e-12)


@pytest.mark.parametrize("x0", ["estimate", "zero"])
def test_the_jacobian_of_prediction_errors_is_their_slope(x0):
    u, y, _ = noisy(GENERAL, TRUTH)
    problem = pem.Problem(GENERAL, u, y, starts=(0, 120), x0=x0)
    x, h = problem.start(0.95 * TRUTH), 1e-5
    slope = [(problem(x + h * d)[0] - problem(x - h * d)[0]) / (2 * h) for d in np.eye(len(x))]
    assert problem(x)[1].T == approx(np.array(slope), abs=1e-7)  # h^2 times third derivatives


@pytest.mark.parametrize("offset", [True, False])
def test_without_c_d_and_f_the_minimum_is_that_of_least_squares(offset):
    model = pem.orders(1, na=2, nb=2, nk=2)
    u, y, _ = noisy(model, [-1.2, 0.4, 0.5, 0.1])
    fit = pem.fit(model, u, y, np.zeros(4), starts=(0, 120), offset=offset)
    ref = lsq.arx(u, y, 2, 2, 2, starts=(0, 120), offset=offset)
    assert fit.N == ref.N
    assert [*fit.theta, fit.offset, fit.loss] == approx(
        [*ref.theta, ref.offset, ref.loss], rel=1e-9
    )
    assert fit.P == approx(ref.P, rel=1e-8, abs=1e-9 * np.abs(ref.P).max())


def written_out(x, u, y, starts, na, nb, nc, nf, nk):
    """eps of A y = B/F u + d + C e, row by row, the past w and eps before row h in x.

    Both na and nf at once are not meant; x = [theta, d, past w and past eps per segment].
    """
    a, b, c, f, (d,), past = np.split(x, np.cumsum([na, nb, nc, nf, 1]))
    h, out = max(na, nk + nb - 1), []
    for (first, end), start in zip(
        lsq.segments(len(y), starts), np.split(past, len(starts)), strict=True
    ):
        w, eps = dict(enumerate(start[:nf], 1)), dict(enumerate(start[nf:], 1))
        w, eps = ({first + h - k: v for k, v in s.items()} for s in (w, eps))
        for t in range(first + h, end):
            w[t] = sum(b[i] * u[t - nk - i] for i in range(nb))
            w[t] -= sum(f[i] * w[t - 1 - i] for i in range(nf))
            eps[t] = y[t] + sum(a[i] * y[t - 1 - i] for i in range(na)) - w[t] - d
            eps[t] -= sum(c[i] * eps[t - 1 - i] for i in range(nc))
            out.append(eps[t])
    return np.array(out)


@pytest.mark.parametrize(
    "sizes, theta",
    [
        (dict(na=2, nb=2, nc=2, nf=0, nk=1), [-1.2, 0.4, 0.5, 0.1, -0.7, 0.2]),
        (dict(na=0, nb=2, nc=0, nf=2, nk=3), [0.5, 0.1, -1.2, 0.4]),
    ],
)
def test_the_minimum_is_that_of_the_recursions_written_out(sizes, theta):
    """The start is another set of parameters here and the slope is taken by differences."""
    model, starts = pem.orders(**sizes), (0, 70)
    u, y, _ = noisy(model, theta, N=150)
    fit = pem.fit(model, u, y, theta, starts)
    past = np.zeros(2 * (sizes["nf"] + sizes["nc"]))
    other = optimize.least_squares(
        written_out,
        [*theta, 1.0, *past],
        method="lm",
        xtol=1e-12,
        ftol=1e-12,
        args=(u[:, 0], y, starts),
        kwargs=sizes,
    )
    assert len(other.fun) == fit.N
    assert 2 * other.cost == approx(fit.rss, rel=1e-9)
    assert other.x[: len(theta)] == approx(fit.theta, rel=1e-4)  # sqrt of what the cost leaves open
    assert fit.cosine < 1e-10


def test_holes_of_an_output_error_model_are_rows_that_do_not_count():
    model = pem.orders(nb=1, nf=1)
    u, y, _ = noisy(model, [0.5, -0.8])
    valid = np.ones(300, bool)
    valid[[0, 1, 40, 41, 200]] = False
    plain = pem.fit(model, u, np.where(valid, y, np.nan), [0.5, -0.8], valid=valid)
    assert plain.N == 299 - 4  # row 0 is history
    assert plain.theta == approx([0.5, -0.8], abs=5 * plain.sd.max())


@pytest.mark.slow
@pytest.mark.parametrize(
    "model, theta",
    [
        (pem.orders(nb=2, nf=2), [0.5, 0.1, -1.2, 0.4]),
        (pem.orders(na=2, nb=2, nc=1), [-1.2, 0.4, 0.5, 0.1, 0.6]),
    ],
)
def test_the_covariance_is_that_of_repeated_noise(model, theta):
    runs = []
    for seed in range(300):
        u, y, _ = noisy(model, theta, N=400, seed=seed)
        fit = pem.fit(model, u, y, theta)
        runs.append((np.r_[fit.theta, fit.offset] - [*theta, 4.0]) / np.sqrt(np.diag(fit.P)))
    assert np.std(runs, axis=0) == approx(1, abs=0.15)  # 300 runs: 4 % sd


# -- residuals -------------------------------------------------------------------------


def test_correlations_equal_numpy_on_one_segment():
    rng = np.random.default_rng(3)
    e, u = rng.normal(size=200), rng.normal(size=200)
    full = np.correlate(e, e, "full") / (e @ e)
    assert resid.autocorr(e, range(6)) == approx(full[199:205], abs=1e-13)
    cross = np.correlate(e, u, "full") / np.sqrt((e @ e) * (u @ u))
    assert resid.crosscorr(e, u, range(-4, 5)) == approx(cross[195:204], abs=1e-13)


def test_correlations_do_not_reach_across_segments():
    e = np.array([1.0, 2.0, 3.0, 4.0])
    assert resid.autocorr(e, [1], starts=(0, 2)) == approx([(2 + 12) / 30])
    assert resid.crosscorr(e, e, [-1], starts=(0, 2)) == approx([(2 + 12) / 30])


def test_bands_hold_99_percent_of_white_residuals():
    u = fopdt.hold_input(500, 5, 1)
    auto, cross = [], []
    for seed in range(300):
        e = np.random.default_rng(seed).normal(size=500)
        auto.append(np.abs(resid.autocorr(e, range(1, 21))) < resid.auto_band(500))
        cross.append(
            np.abs(resid.crosscorr(e, u, range(0, 21))) < resid.cross_band(e, u, range(0, 21))
        )
    # 6000 counts, correlated over lags in the second: sd 0.13 % and about 0.4 %
    assert np.mean(auto) == approx(0.99, abs=0.005)
    assert np.mean(cross) == approx(0.99, abs=0.012)


def test_the_phase_is_the_unwrapped_angle():
    w = np.geomspace(0.05, 400, 20_001)
    G = loop.open_loop(w, 2.0, 0.3, 0.05, 1.2, 0.4, 0.03, 0.004)
    found = loop.phase(w, 0.3, 0.05, 0.4, 0.03, 0.004)
    assert found == approx(np.unwrap(np.angle(G)), abs=1e-9)
    assert degrees(found[0]) == approx(-90, abs=3)
