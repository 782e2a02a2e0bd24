"""The oracles of recursive estimation and of the auto-tuner agree with closed forms and figures."""

import numpy as np
import pytest
from numpy.linalg import inv
from pytest import approx
from scipy import signal

from oracles import (
    bound,
    document_tuner,
    fopdt,
    loop,
    peaks,
    pem,
    recursion,
    sampled_loop,
    scenarios,
)

# -- least squares -----------------------------------------------------------------------


def rows(seed, N=60, n=3):
    rng = np.random.default_rng(seed)
    phi = rng.normal(size=(N, n))
    return phi, phi @ [1.0, -2.0, 0.5] + 0.1 * rng.normal(size=N)


@pytest.mark.parametrize("lam", [1.0, 0.9])
def test_exponential_forgetting_is_weighted_ridge_regression(lam):
    """Source 000, (2.2-13) to (2.2-15); ERRATA 2: from alpha I it is ridge with 1/alpha."""
    phi, y = rows(1)
    N, alpha = len(y), 100.0
    weight = lam ** np.arange(N - 1, -1, -1)
    information = lam**N / alpha * np.eye(3) + (phi.T * weight) @ phi
    found = recursion.least_squares(phi, y, alpha, lam=lam)
    assert found.theta[-1] == approx(inv(information) @ (phi.T * weight) @ y, rel=1e-12)
    assert found.P == approx(inv(information), rel=1e-11)


def test_directional_forgetting_moves_the_information_along_phi_alone():
    phi, _ = rows(2)
    P, lam = np.diag([1.0, 2.0, 3.0]), 0.9
    for row in phi[:5]:
        q = row @ P @ row
        information = inv(P) + (lam - (1 - lam) / q) * np.outer(row, row)
        exponential = recursion.exponential(P, row, lam)[1]
        _, P = recursion.directional(P, row, lam)
        assert inv(P) == approx(information, rel=1e-9)
        # along phi: learn, then forget; exponential forgetting forgets, then learns
        assert row @ P @ row == approx(q / (1 + q) / lam)
        assert row @ exponential @ row == approx(q / lam / (1 + q / lam))


def test_directional_forgetting_keeps_what_is_not_excited():
    phi = np.tile([1.0, 1.0, 0.0], (3000, 1))
    y = np.random.default_rng(3).normal(size=3000)
    kept = recursion.least_squares(phi, y, 1.0, method="directional", lam=0.98)
    lost = recursion.least_squares(phi, y, 1.0, method="exponential", lam=0.98)
    across = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    assert across @ kept.P @ across == approx(1.0) and kept.P[2, 2] == approx(1.0)
    assert across @ lost.P @ across > 1e20


def test_variable_forgetting_keeps_the_weighted_loss():
    """S(t) = lam(t) S(t-1) + eps^2/(1 + q) stays at sum0; Fortescue et al. 1981, (8) to (10)."""
    phi, y = rows(4)
    sum0 = 0.5
    found = recursion.least_squares(phi, y, 10.0, method="variable", sum0=sum0, lam_min=0.0)
    P, theta = 10.0 * np.eye(3), np.zeros(3)
    counted = 0
    for row, target, lam in zip(phi, y, found.lam, strict=True):
        q, eps = row @ P @ row, target - row @ theta
        if lam > 0:
            assert lam * sum0 + eps**2 / (1 + q) == approx(sum0)
            counted += 1
        else:
            break
        information = lam * (inv(P) + np.outer(row, row))
        theta = theta + P @ row / (1 + q) * eps
        P = inv(information)
    assert counted > 0 and found.lam.min() >= 0 and found.lam.max() <= 1


def test_a_random_walk_of_one_parameter_settles_at_its_riccati_equation():
    R1, R2 = 0.3, 2.0
    found = recursion.least_squares(
        np.ones((200, 1)), np.zeros(200), 1.0, method="random walk", R1=R1, R2=R2
    )
    # p^2 = R1 (p + R2) for the variance before the measurement
    assert found.P[0, 0] == approx((R1 + np.sqrt(R1**2 + 4 * R1 * R2)) / 2)


def test_without_a_walk_the_kalman_filter_is_least_squares():
    phi, y = rows(5)
    walk = recursion.least_squares(phi, y, 10.0, method="random walk", R1=0.0)
    assert walk.theta == approx(recursion.least_squares(phi, y, 10.0).theta, rel=1e-12)


def test_growing_forgetting_starts_and_ends_where_it_should():
    lam = recursion.growing(np.arange(3000), lam0=0.95, lam_inf=0.995, rho=0.99)
    assert lam[0] == approx(0.95) and lam[-1] == approx(0.995)
    # MATLAB's form of the same: lam(t) = rho lam(t-1) + (1 - rho) lam_inf
    assert lam[1:] == approx(0.99 * lam[:-1] + 0.01 * 0.995)


# -- guard -------------------------------------------------------------------------------


@pytest.mark.parametrize("z, samples", [(6.0, 2), (60.0, 2), (-2.75, 5), (1.75, 9), (0.75, None)])
def test_cusum_alarms_when_the_drift_is_outrun(z, samples):
    """Each sample adds min(|z|, 6) - 0.75; the alarm is at more than 8."""
    guard = recursion.Guard(s2=4.0, rate=0.0)
    alarms = [guard.look(2.0 * z * np.sqrt(1.5), 0.5) for _ in range(40)]
    assert (alarms.index(True) + 1 if any(alarms) else None) == samples


def test_the_scale_of_normal_innovations_is_nearly_their_variance():
    rng = np.random.default_rng(6)
    guard = recursion.Guard(s2=5.0, threshold=np.inf)
    path = []
    for eps in np.sqrt(3.0) * rng.normal(size=20_000):
        guard.look(eps, 0.0)
        path.append(guard.s2)
    # E min(z^2, 9 s^2) = s^2 has the root s^2 = 0.9945; 0.01 averages 200 samples at a time
    assert np.mean(path[1000:]) == approx(3.0 * 0.9945, rel=0.03)


def test_outliers_move_the_scale_a_little_and_the_estimate_within_six_sigma():
    guard = recursion.Guard(s2=1.0)
    assert guard.cut(1e6, 3.0) == 12.0 and guard.cut(-1e6, 0.0) == -6.0
    guard.look(1e6, 0.0)
    assert guard.s2 == approx(1 + 0.01 * 8)


# -- stability ---------------------------------------------------------------------------


def test_projected_polynomials_are_stable():
    rng = np.random.default_rng(7)
    for n in (1, 2, 3, 4):
        for _ in range(200):
            c = recursion.projected(3 * rng.normal(size=n), np.zeros(n))
            assert np.max(np.abs(np.roots(np.r_[1, c]))) < 1 - 1e-9, c


def test_projection_leaves_what_is_well_inside():
    for c in ([0.9], [-0.5, 0.3], [0.1, 0.2, -0.3]):
        assert list(recursion.projected(c, np.zeros(len(c)))) == c


# -- the family --------------------------------------------------------------------------

FAMILY = {
    "arx": (dict(na=2, nb=2, nk=3), [-1.2, 0.4, 0.5, -0.2]),
    "armax": (dict(na=1, nb=1, nc=1, nk=2), [-0.8, 0.5, 0.6]),
    "oe": (dict(nb=2, nf=2, nk=1), [0.5, 0.2, -1.1, 0.3]),
    "bj": (dict(nb=1, nc=1, nd=2, nf=1, nk=1), [0.5, 0.4, -0.9, 0.2, -0.7]),
    "all": (dict(na=1, nb=2, nc=2, nd=1, nf=2, nk=2), [-0.3, 1, 0.4, 0.5, 0.2, -0.6, -0.9, 0.2]),
}


def made(name, N, seed=1, sd=0.1, offset=0.0):
    sizes, theta = FAMILY[name]
    model = pem.orders(**sizes)
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 3 + 1), 3)[:N]
    return model, theta, u, pem.simulate(model, theta, u, sd * rng.normal(size=N), offset)


@pytest.mark.parametrize("shifted", [False, True])
@pytest.mark.parametrize("name", FAMILY)
def test_with_theta_held_errors_and_gradient_are_those_of_the_batch(name, shifted):
    model, theta, u, y = made(name, 80, offset=2.0)
    theta = np.r_[theta, 0.7] * 1.02
    held = recursion.PredictionError(
        model, 0.0, theta, centred=False, first=0, shifted=shifted, limits=(2.0, 2.0)
    )
    eps, psi = [], []
    for pair in zip(u, y, strict=True):
        eps.append(held.step(*pair)[0])
        psi.append(held.psi[0])
    batch, J = pem.Problem(model, u, y, x0="zero")(theta)
    assert eps == approx(batch, abs=1e-12)
    # entries of the batch's psi of which the lags are missing are zero too
    assert np.array(psi) == approx(-J, abs=1e-12)


@pytest.mark.parametrize("method", ["rml", "els"])
def test_arx_is_least_squares_with_history_rows_left_out(method):
    model, _, u, y = made("arx", 60, offset=30.0)
    found = recursion.run(recursion.PredictionError(model, 50.0, method=method, lam=0.95), u, y)
    v, z = u - u[0], y - y[0]
    phi = np.array([[-z[t - 1], -z[t - 2], v[t - 3], v[t - 4], 1] for t in range(4, 60)])
    plain = recursion.least_squares(phi, z[4:], 50.0, lam=0.95)
    assert found.theta[4:] == approx(plain.theta, abs=1e-12)
    assert np.isnan(found.eps[:4]).all() and found.eps[4:] == approx(plain.eps, abs=1e-12)


@pytest.mark.parametrize("name", FAMILY)
def test_rml_ends_near_the_batch_minimum(name):
    model, theta, u, y = made(name, 4000, offset=5.0)
    estimator = recursion.PredictionError(
        model, 10.0, lam=lambda t: recursion.growing(t, rho=0.998)
    )
    recursion.run(estimator, u, y)
    batch = pem.fit(model, u, y, theta)
    # the same asymptotic distribution, Ljung 1999, 11.4; the wrong theta of the start costs a
    # share of it, most for the eight coefficients of "all"
    share = (estimator.theta[:-1] - batch.theta) / batch.sd
    assert np.max(np.abs(share)) < 2.5, share
    assert estimator.physical_offset() == approx(batch.offset, abs=0.02)


def test_els_and_rml_both_find_armax_and_differ_on_the_way():
    model, theta, u, y = made("armax", 4000)
    ends = []
    for method in ("els", "rml"):
        estimator = recursion.PredictionError(model, 10.0, method=method, lam=recursion.growing)
        recursion.run(estimator, u, y)
        ends.append(estimator.theta)
        assert estimator.theta[:3] == approx(theta, abs=0.06)
    assert np.max(np.abs(ends[0] - ends[1])) > 1e-6


def test_shifted_and_filtered_anew_are_the_same_for_first_orders():
    model, _, u, y = made("armax", 300)
    paths = [
        recursion.run(recursion.PredictionError(model, 10.0, shifted=s), u, y).theta
        for s in (False, True)
    ]
    assert np.array_equal(*paths)


def test_double_and_extended_precision_agree_to_the_doubles_rounding():
    model, _, u, y = made("all", 500)
    ends = []
    for dtype in (float, np.longdouble):
        estimator = recursion.PredictionError(model, 10.0, lam=0.99, dtype=dtype)
        recursion.run(estimator, u, y)
        assert estimator.theta.dtype == estimator.P.dtype == np.dtype(dtype)
        ends.append(estimator.theta.astype(float))
    assert ends[0] == approx(ends[1], abs=1e-9)


@pytest.mark.parametrize("cut, off", [(False, 0.3), (True, 0.1)])
@pytest.mark.parametrize("c", [-0.8, 0.6])
def test_an_offset_step_is_an_alarm_that_opens_the_offset(c, cut, off):
    """With c = a each sample after the step is off by 60 sd; a whole residual in phi moves c."""
    model, _, u, _ = made("armax", 1200)
    theta = [-0.8, 0.5, c]
    y = pem.simulate(model, theta, u, 0.1 * np.random.default_rng(1).normal(size=1200), 5.0)
    y[700:] += 6.0
    estimator = recursion.PredictionError(
        model, 10.0, lam=recursion.growing, guard=recursion.Guard(s2=0.01), cut_residual=cut
    )
    found = recursion.run(estimator, u, y)
    late = found.alarms[found.alarms > 100]
    assert 701 <= late[0] <= 704 and late[-1] < 750  # at 50 Hz within a second: one alarm
    assert estimator.theta[:2] == approx(theta[:2], abs=0.01)
    assert estimator.theta[2] == approx(c, abs=off)
    assert estimator.physical_offset() == approx(11.0, abs=0.05)


def test_first_order_parameters_are_those_of_errata_3_3():
    Ts, K, T, L = 0.02, -5.939, 0.1491, 0.1
    pole = np.exp(-Ts / T)
    for sizes, theta in (
        (dict(na=1, nb=1, nc=1, nk=6), [-pole, K * (1 - pole), 0.3, 0]),
        (dict(nb=1, nf=1, nk=6), [K * (1 - pole), -pole, 0]),
    ):
        estimator = recursion.PredictionError(pem.orders(**sizes), 1.0, theta)
        assert estimator.first_order(Ts) == approx((K, T, L))


# -- Cramer-Rao bound --------------------------------------------------------------------

ENGINE = bound.Engine()


def engine_records(runs, N=250, noise="output", c=0.0, hold=10):
    r = bound.set_points(N, runs, hold, seed=3)
    e = np.sqrt(1.5) * np.random.default_rng(4).normal(size=r.shape)
    return (*bound.simulate(ENGINE, r, e, noise, c), e)


@pytest.mark.parametrize("side", ["right", "left"])
def test_output_sensitivities_are_slopes_of_the_superposed_steps(side):
    u = engine_records(1)[0]
    psi = bound.sensitivities(ENGINE, u, side=side)
    p, h = np.array([ENGINE.K, ENGINE.T, ENGINE.L, ENGINE.O]), 1e-6

    def y(x):
        K, T, L, O = x
        # at rest at the first input; K u_rest + O moves with K
        return fopdt.simulate(u[:, 0], K, T, L, ENGINE.Ts, O, before=ENGINE.u_rest)

    for i, step in enumerate(np.eye(4) * h):
        low = 0.0 if i == 2 and side == "right" else 1.0
        high = 0.0 if i == 2 and side == "left" else 1.0
        slope = (y(p + high * step) - y(p - low * step)) / ((low + high) * h)
        # one-sided slopes err by h/2 times the curvature of about 1e5
        assert psi[i][:, 0] == approx(slope, rel=1e-4, abs=1e-5 if i != 2 else 0.02), "KTLO"[i]


@pytest.mark.parametrize("c", [0.0, -0.5])
def test_equation_noise_sensitivities_are_slopes_of_the_errors(c):
    u, y, e = engine_records(1, noise="equation", c=c)
    psi = bound.sensitivities(ENGINE, u, y, e, c)
    u, y = u[:, 0], y[:, 0]

    def errors(x):
        K, T, _, O, c = x
        a, out, e_old, y_old = np.exp(-ENGINE.Ts / T), [], 0.0, ENGINE.level
        for k in range(len(u)):
            acting = u[k - 6] if k >= 6 else ENGINE.u_rest
            e_old = y[k] - a * y_old - (1 - a) * (K * acting + O) - c * e_old
            y_old = y[k]
            out.append(e_old)
        return np.array(out)

    p, h = np.array([ENGINE.K, ENGINE.T, ENGINE.L, ENGINE.O, c]), 1e-6
    # at k = 0 the rest before says y_old = level and K u_rest + O = level: slopes hold there too
    assert errors(p) == approx(e[:, 0], abs=1e-9)
    for i in (0, 1, 3, 4):
        step = h * np.eye(5)[i]
        slope = -(errors(p + step) - errors(p - step)) / (2 * h)
        assert psi[i][:, 0] == approx(slope, rel=1e-5, abs=1e-5)


def test_maximum_likelihood_attains_the_bound():
    """Gauss-Newton on y = K x(T) + O, with the truth as start: 400 records of 5 s."""
    u, y, _ = engine_records(400)
    found = []
    for j in range(u.shape[1]):
        x = np.array([ENGINE.K, ENGINE.T, ENGINE.O])
        for _ in range(4):
            here = bound.Engine(K=x[0], T=x[1], O=x[2])
            # u before the record is that of the loop at rest, whatever the model says
            at_rest = np.vstack([np.full((6, 1), ENGINE.u_rest), u[:, j : j + 1]])
            v, a = at_rest[: len(u), 0], here.a
            unit, by_T = np.zeros(len(u)), np.zeros(len(u))
            old, slope, da = ENGINE.u_rest, 0.0, a * here.Ts / here.T**2
            for k in range(len(u)):
                slope = a * slope + da * (old - v[k])
                old = a * old + (1 - a) * v[k]
                unit[k], by_T[k] = old, here.K * slope
            J = np.column_stack([unit, by_T, np.ones(len(u))])
            x = x + np.linalg.lstsq(J, y[:, j] - here.K * unit - here.O, rcond=None)[0]
        found.append(x)
    rms = np.sqrt(np.mean((np.array(found) / [ENGINE.K, ENGINE.T, ENGINE.O] - 1) ** 2, axis=0))
    sd = bound.averaged(bound.sensitivities(ENGINE, u)[[0, 1, 3]], 1.5, "rms")
    # 400 errors: 3.5 %
    assert rms == approx(sd / np.abs([ENGINE.K, ENGINE.T, ENGINE.O]), rel=0.12)


def test_bounds_of_the_engine_loop_are_those_of_methods():
    """METHODS 1.1: 1.2, 2.0 % at 2 s; 0.5, 1.0 at 5 s; 0.3, 0.7 at 10 s, of 60 records.

    They are those of K, T, O (the delay known), of the time from the first move, and a mean of
    the records' own bounds; ARMAX noise of 8 and 13 % at 2 s is their rms with C = 1.
    """
    # 60 records scatter by 5 %, and the figures are rounded
    white = 100 * bound.bound(runs=600, average="mean")[:, :2]
    assert white == approx(np.array([[1.2, 2.0], [0.5, 1.0], [0.3, 0.7]]), rel=0.13)
    heavy = 100 * bound.bound((2.0,), runs=600, noise="equation", parameters="KTOc")[0, :2]
    assert heavy == approx([8, 13], rel=0.10)


def test_records_that_differ_have_a_larger_bound_than_their_mean_information():
    rms, mean, info = (bound.bound(average=how)[0] for how in ("rms", "mean", "information"))
    assert np.all(info < mean) and np.all(mean < rms)


def test_an_unknown_delay_costs_t_and_l_more_than_k():
    known = bound.bound(parameters="KTO")
    unknown = bound.bound(parameters="KTLO")
    ratio = unknown[-1, :2] / known[-1, :2]
    assert 1.0 < ratio[0] < 1.3 and 1.5 < ratio[1] < 2.0


def test_an_offset_alone_is_known_to_sigma_over_root_n():
    sd = bound.bound(parameters="O", times=(2.0, 8.0), runs=3)[:, 0]
    assert sd == approx(np.sqrt(1.5 / np.array([100, 400])))


# -- the document's auto-tuner -------------------------------------------------------------

HOLDS = [10, 25, (10, 25)]  # 0.2 s, 0.5 s, and drawn between


def tuned(hold, seed, seconds, wait=0, **settings):
    """Return the log, and the rows at which K and T are within 5 % and L is right."""
    s = document_tuner.Settings(**settings)
    r = bound.set_points(round(seconds / s.Ts), 1, hold, seed, wait)[:, 0]
    log = document_tuner.run(r, s)
    near = (abs(log.K / s.K - 1) < 0.05) & (abs(log.T / s.T - 1) < 0.05)
    return log, near & (abs(log.L - s.L) < s.Ts / 4)


def for_good(near, Ts=0.02):
    """Return the time from which `near` holds to the end."""
    wrong = np.flatnonzero(~near)
    return Ts * (wrong[-1] + 1 if len(wrong) else 0)


def test_the_band_pass_has_the_printed_coefficient_and_settling_time():
    s = document_tuner.Settings()
    band = document_tuner.BandPass(s)
    _, poles, gain = signal.sos2zpk(band.sos)
    assert gain == approx(0.0001416, abs=5e-8)  # (3.7-6)
    assert np.max(np.abs(poles)) == approx(0.994332, abs=5e-7)  # ERRATA 3.3
    y = np.array([band(1.0) for _ in range(1500)])
    level = 0.02 * np.max(np.abs(y))
    last = np.flatnonzero(np.abs(y) > level)[-1]
    share = (abs(y[last]) - level) / (abs(y[last]) - abs(y[last + 1]))
    # ERRATA 3.3: 13.558 s, the document 13.5565
    assert s.Ts * (last + share) == approx(13.558, abs=1e-3)


def test_a_steady_filter_stays_at_zero():
    band = document_tuner.BandPass(document_tuner.Settings(filter="steady"))
    assert np.max(np.abs([band(583.451) for _ in range(300)])) < 1e-9


@pytest.mark.parametrize("start", ["zero", "rest"])
def test_the_documents_loop_is_the_corrected_simulator(start):
    s = document_tuner.Settings(O=583.451, start=start)
    r = bound.set_points(300, 1, 10)[:, 0]
    engine = document_tuner.Loop(s)
    u, y = np.array([engine.step(x) for x in r]).T
    rest = (400 - s.O) / s.K if start == "rest" else 0.0
    plant = sampled_loop.Varying(s.K, s.T, 5, s.O, s.Ts, 300, before=rest)
    # before the start e = 0 where the loop rests, and is taken as 0 where it starts at zero
    before = 400.0 if start == "rest" else s.O
    pid = sampled_loop.Pid(s.Kp, s.Kp / s.Ki)
    other = sampled_loop.run(plant, pid, s.Ts, r, r_before=before, u_before=rest)
    assert y == approx(other.y, abs=1e-9) and u == approx(other.u, abs=1e-9)


def test_one_member_of_the_bank_is_the_rml_written_out():
    u, y, _ = engine_records(1)
    u, y = u[:, 0] - 30.0, y[:, 0] - 400.0
    bank = document_tuner.Bank(document_tuner.Settings())
    assert list(bank.nk) == [4, 5, 6, 7, 8, 9, 10, 11]
    errors = []
    for k in range(len(u)):
        bank.remember(u[k])
        errors.append(bank.learn(y[k]))
        bank.y_old = y[k]
    for j in (0, 2):
        model = pem.orders(na=1, nb=1, nc=1, nk=int(bank.nk[j]))
        alone = recursion.PredictionError(
            model, 1e4, lam=0.995, offset=False, centred=False, first=0
        )
        found = recursion.run(alone, u, y)
        assert np.array(errors)[:, j] == approx(found.eps, abs=1e-6)
        assert bank.theta[j] == approx(alone.theta, abs=1e-8)


def test_a_delay_moves_one_sample_when_both_minima_have_asked_for_it_five_times():
    choice = document_tuner.DelayChoice(document_tuner.Settings(), 8)
    best = np.ones(8)
    best[6] = 0.0
    used = [choice.step(best) for _ in range(15)]
    assert used == [4] * 4 + [5] * 5 + [6] * 6
    best = np.ones(8)
    best[1] = 0.0  # the present error asks for less, the window for what it has seen
    used = [choice.step(best) for _ in range(30)]
    # from the 16th on the window of 50 has more of the new: 6, 5, 4 ...
    assert used[:15] == [6] * 15 and used[-1] < 6


def test_a_model_is_accepted_after_a_window_within_limits_and_spread():
    s = document_tuner.Settings()
    classifier = document_tuner.Classifier(s)
    good = np.array([-6.0, 0.15, 0.1])
    seen = [classifier.step(good) for _ in range(60)]
    assert [x is not None for x in seen] == [False] * 49 + [True] * 11
    assert seen[-1] == approx(good)
    assert classifier.step(np.array([6.0, 0.15, 0.1])) is None  # beyond a limit
    assert [classifier.step(good) is None for _ in range(50)] == [True] * 49 + [False]
    # one in fifty off by d: the spread is d sqrt(49)/50, and 2 % is d = 0.143
    assert classifier.step(np.array([-6.0 * 1.13, 0.15, 0.1])) is not None
    classifier.k -= 1
    assert classifier.step(np.array([-6.0 * 1.16, 0.15, 0.1])) is None


@pytest.mark.parametrize("hold", HOLDS)
def test_without_offset_it_converges_soon_after_one_window(hold):
    """Table 3.7-3: first at 1.18 s, theory reached at 1.88 s; ERRATA 3.4: 1.38 s."""
    log, near = tuned(hold, 1, 4)
    assert 1.0 < log.t[log.accepted[0]] < 1.9 and for_good(near) < 1.9
    ends = [log.K[-1], log.T[-1], log.L[-1], log.Kp[-1], log.Ki[-1]]
    assert ends == approx([-5.939, 0.1491, 0.10, -0.1315, -0.8816], rel=5e-4)


@pytest.mark.parametrize("hold", HOLDS)
def test_with_offset_the_transient_of_the_filter_decides(hold):
    """ERRATA 3.4: 16 to 26 s to within 5 %, in some settings later than 30 s."""
    faster = [for_good(tuned(hold, seed, 28, O=583.451, lam=0.99)[1]) for seed in range(3)]
    assert 15 < np.median(faster) < 26 and max(faster) < 27
    if hold != 10:
        assert for_good(tuned(hold, 0, 30, O=583.451)[1]) == approx(30.0)


def test_with_offset_early_accepted_models_are_wrong_by_tens_of_percent():
    off = []
    for seed in range(4):
        log, _ = tuned(10, seed, 15, O=583.451)
        off += [
            max(abs(log.K[k] / -5.939 - 1), abs(log.T[k] / 0.1491 - 1)) for k in log.accepted[:1]
        ]
    assert np.median(off) > 0.3


@pytest.mark.parametrize("hold", HOLDS)
def test_a_filter_started_at_rest_removes_the_transient(hold):
    log, near = tuned(hold, 1, 4, wait=1, O=583.451, start="rest", filter="steady")
    assert 1.0 < log.t[log.accepted[0]] < 1.9 and for_good(near) < 1.9
    assert [log.Kp[-1], log.Ki[-1]] == approx([-0.1315, -0.8816], rel=5e-4)


@pytest.mark.parametrize("hold", HOLDS)
def test_a_bank_opened_after_the_transient_accepts_at_20_s(hold):
    logs = [tuned(hold, seed, 27, O=583.451, opens=18.0)[0] for seed in range(3)]
    assert np.median([log.t[log.accepted[0]] for log in logs]) == approx(20.0, abs=1.0)


# -- scenarios -----------------------------------------------------------------------------


def ran(scenario, pid=None, switch=None):
    """Return t, r, u, y (4, N), and the loop; `switch` = (row, pid) changes the gains there."""
    run, out = scenarios.Loop(scenario), []
    while not run.done:
        if switch and run.k == switch[0]:
            pid = switch[1]
        out.append(run.step(pid))
    return np.array(out).T, run


def test_the_engine_scenario_is_the_engine_loop():
    (_, r, u, y), run = ran(scenarios.engine(3, sd=1.2, seconds=6.0))
    others = bound.simulate(bound.Engine(), r[:, None], run.noise[:, None])
    assert u == approx(others[0][:, 0], abs=1e-9) and y == approx(others[1][:, 0], abs=1e-9)
    assert set(np.diff(np.flatnonzero(np.diff(r)))) <= set(range(10, 300))
    assert set(r) == {350.0, 400.0, 450.0} and r[0] == 400.0


@pytest.mark.parametrize("L", [0.0, 0.1, 0.107, 0.0333])
def test_the_scenarios_plant_has_any_delay(L):
    plant = scenarios.Plant(2.0, 0.3, L, 5.0)
    s = scenarios.Scenario(plant, 0.1, 0.3, level=0.0, seconds=4.0)
    (_, _, u, y), _ = ran(s)
    assert y == approx(fopdt.simulate(u, 2.0, 0.3, L, s.Ts, 5.0, before=s.rest), abs=1e-9)


def test_a_plant_change_is_that_of_the_corrected_simulator():
    s = scenarios.engine(1, seconds=8.0, events=[scenarios.plant_change(4.0)])
    (_, r, u, y), run = ran(s)
    k = np.arange(len(r))
    plant = sampled_loop.Varying(
        # x(k+1) is made with what holds at k; there with what holds at k + 1
        np.where(k > 200, -11.878, -5.939), 0.1491, np.where(k > 200, 8, 5), 583.451, s.Ts, len(r),
        before=s.rest,
    )  # fmt: skip
    pid = sampled_loop.Pid(s.Kp, s.Kp / s.Ki)
    other = sampled_loop.run(plant, pid, s.Ts, r, r_before=400.0, u_before=s.rest)
    assert y == approx(other.y, abs=1e-8) and u == approx(other.u, abs=1e-8)
    assert (run.plant.K, run.plant.L) == approx((-11.878, 0.16))


def test_faults_do_what_they_are_called():
    faults = [
        scenarios.offset_step(2.0),
        scenarios.frozen_input(4.0, until=5.0),
        scenarios.stuck_sensor(6.0, until=7.0),
    ]
    (_, _, u, y), run = ran(scenarios.engine(2, seconds=8.0, sd=1.0, events=faults))
    (_, _, u0, y0), _ = ran(scenarios.engine(2, seconds=8.0, sd=1.0))
    assert np.array_equal(y[:100], y0[:100]) and y[100] - y0[100] == approx(-60.0)
    assert run.plant.O == approx(523.451)
    assert np.ptp(u[199:250]) == 0 and np.ptp(u[250:]) > 0
    assert np.ptp(y[299:350]) == 0 and y[350] != y[349]
    assert np.array_equal(u[:100], u0[:100])


def test_new_gains_do_not_bump_and_are_used_at_once():
    s = scenarios.engine(4, seconds=4.0)
    first, new = (s.Kp, s.Ki), (-0.1315, -0.8816)
    (_, r, u, y), _ = ran(s, first, switch=(120, new))
    e = r - y
    step = np.diff(u)
    for rows, (Kp, Ki) in ((slice(0, 119), first), (slice(119, None), new)):
        law = Kp * np.diff(e) + Ki * s.Ts * e[1:]
        assert step[rows] == approx(law[rows], abs=1e-9)
    same, _ = ran(s, sampled_loop.Pid(s.Kp, integral=s.Ki))
    assert np.array_equal(same[2], ran(s)[0][2])  # objects with Kp and Ki serve as well


def test_limits_hold_and_the_law_goes_on_from_them():
    s = scenarios.engine(5, seconds=6.0, low=25.0, high=36.0)
    (_, r, u, y), _ = ran(s)
    e = r - y
    law = u[:-1] + s.Kp * np.diff(e) + s.Ki * s.Ts * e[1:]
    assert u[1:] == approx(np.clip(law, 25.0, 36.0), abs=1e-9)
    assert np.sum(u == 25.0) > 5 and np.sum(u == 36.0) > 5


def test_scenarios_are_the_same_for_the_same_seed_and_differ_otherwise():
    one, two = (ran(scenarios.random_plant(7, seconds=3.0))[0] for _ in range(2))
    assert np.array_equal(one, two)
    assert scenarios.random_plant(8).plant != scenarios.random_plant(7).plant
    plants = [scenarios.random_plant(seed) for seed in range(60)]
    for s in plants:
        assert 1.2 < scenarios.Ms(s.plant, s.Kp, s.Ki, s.Ts) < 1.4
        assert 4 * s.Ts <= s.plant.T <= 25 * s.Ts and s.low < s.rest < s.high
        assert round(s.plant.L / s.Ts) in range(2, 11)
    assert 15 < sum(s.plant.K > 0 for s in plants) < 45


@pytest.mark.parametrize("L", [0.1, 0.067])
@pytest.mark.parametrize("gain", [0.5, 1.0, 2.0])
def test_ms_is_the_peak_by_polynomial_roots(L, gain):
    plant = scenarios.Plant(-5.939, 0.1491, L)
    Kp, Ki, Ts = -0.1315 * gain, -0.8816 * gain, 0.02
    a, b1, b2, m = plant.held(Ts)
    b2 = b2 if L == 0.067 else 0.0
    G = np.trim_zeros([b1, b2], "b"), np.polymul([1, -a], [1] + [0] * (m + (L == 0.067)))
    exact = peaks.sensitivities(*G, [Kp + Ki * Ts, -Kp], [1.0, -1.0], Ts).Ms
    assert scenarios.Ms(plant, Kp, Ki, Ts) == approx(exact, rel=1e-9)


def test_ms_of_a_fast_sampled_loop_is_that_of_the_continuous_one():
    K, T, L = 2.0, 1.0, 0.5
    Kp, Ti = loop.imc_pi(K, T, L, 0.5)
    w = np.geomspace(0.1, 20, 4000)
    continuous = np.max(1 / np.abs(1 + loop.open_loop(w, K, T, L, Kp, Ti)))
    sampled = scenarios.Ms(scenarios.Plant(K, T, L), Kp, Kp / Ti, 1e-3)
    assert sampled == approx(continuous, rel=3e-3)


def test_an_unstable_loop_has_infinite_ms_and_grows():
    rng = np.random.default_rng(9)
    seen = []
    for seed in range(40):
        s = scenarios.random_plant(seed, seconds=20.0, sd=0.0, low=-np.inf, high=np.inf)
        f = rng.uniform(3, 25)
        pid = (f * s.Kp, f * s.Ki)
        size = np.max(np.abs(np.roots(scenarios.characteristic(s.plant, *pid, s.Ts))))
        if abs(size - 1) < 0.02:
            continue
        (_, _, u, _), _ = ran(s, pid)
        grows = np.max(np.abs(u - s.rest)) > 1e4 * s.amplitude / abs(s.plant.K)
        assert grows == np.isinf(scenarios.Ms(s.plant, *pid, s.Ts)) == (size > 1)
        seen.append(grows)
    assert 0.2 < np.mean(seen) < 0.8


def test_the_documents_gains_do_not_survive_the_plant_change():
    """K times 2 and 3 samples more: gain margin 3 becomes 3/2 * 0.1/0.16 < 1."""
    s = scenarios.engine()
    changed = scenarios.after(s.plant, scenarios.plant_change(0.0), s.Ts)
    assert scenarios.Ms(s.plant, -0.1315, -0.8816, s.Ts) == approx(1.757, abs=1e-3)
    assert scenarios.Ms(changed, -0.1315, -0.8816, s.Ts) == np.inf
    assert scenarios.Ms(changed, s.Kp, s.Ki, s.Ts) == approx(2.22, abs=0.01)
    Kp, Ki = document_tuner.imc_pi(changed.K, changed.T, changed.L, 3.0)
    assert scenarios.Ms(changed, Kp, Ki, s.Ts) < 1.75
