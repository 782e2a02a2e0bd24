"""The oracles of non-parametric and subspace analysis against closed forms, tables and scipy."""

import numpy as np
import pytest
import scipy.signal
from pytest import approx
from scipy.signal import lfilter
from scipy.stats import multivariate_normal

from oracles import (
    bound,
    compression,
    delay_ways,
    excitation,
    experiment_design,
    frequency,
    impulse,
    informative,
    irregular,
    noise,
    offset_steps,
    pbsid,
    spectrum,
    subspace,
)


def held(N, hold, rng):
    return np.repeat(rng.choice([-1.0, 1.0], size=-(-N // hold)), hold)[:N]


def ar1(N, phi, rng):
    e = rng.normal(size=N)
    e[0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], e) * np.sqrt(1 - phi**2)


# -- noise -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rms", "var", "snr"),
    [
        (342.4082, 1.1488, 50.0885),
        (259.0533, 2.4065, 44.4538),
        (967.4381, 6.7016, 51.4507),
        (867.8685, 8.3371, 49.5589),
    ],
)
def test_snr_of_the_printed_tables(rms, var, snr):
    """Source 001, tables 3.5-3 and 3.5-4."""
    y = np.sqrt(rms**2 - var) + np.sqrt(var) * np.array([1.0, -1.0])
    got = noise.moments(y)
    assert got[1:3] == approx((rms, var))
    assert got[3] == approx(snr, abs=2e-4)  # four digits of var


def test_autocorrelation_of_a_sine_is_a_cosine():
    N = 20000
    R = noise.autocorrelation(np.sin(2 * np.pi * 0.05 * np.arange(N)), 40)
    l = np.arange(41)
    assert R == approx((1 - l / N) * np.cos(2 * np.pi * 0.05 * l), abs=1e-3)


@pytest.mark.parametrize("step", [0.01, 0.1, 0.37])
def test_resolution_is_found_and_not_invented(step):
    rng = np.random.default_rng(0)
    y = 50 + ar1(3000, 0.9, rng)
    assert noise.resolution(np.round(y / step) * step) == approx(step, rel=1e-9)
    assert noise.resolution(y) is None


def test_stationarity_holds_its_level_on_coloured_noise():
    alarms = 0
    for seed in range(60):
        x = ar1(2000, 0.9, np.random.default_rng(seed))
        alarms += np.min(noise.stationary(x[:1000], x[1000:])) < 0.01
    assert alarms <= 5
    x = ar1(2000, 0.5, np.random.default_rng(0))
    assert noise.stationary(x[:1000], 1.5 * x[1000:])[1] < 1e-3
    assert noise.stationary(x[:1000], 1 + x[1000:])[0] < 1e-3


# -- spectra and frequency responses -----------------------------------------------------


@pytest.mark.parametrize("N", [256, 255])
def test_periodogram_obeys_parseval_and_scipy(N):
    x = np.random.default_rng(1).normal(size=N)
    w, P = spectrum.periodogram(x, 0.02)
    assert np.sum(P) * w[1] == approx(np.mean(x**2), rel=1e-12)
    f, Q = scipy.signal.periodogram(x, 50.0, detrend=False)
    assert w == approx(2 * np.pi * f)
    assert P == approx(Q / (2 * np.pi))


def test_welch_is_scipys():
    x = np.random.default_rng(2).normal(size=1000)
    w, P, ratio = spectrum.welch(x, 0.1, 128)
    f, Q = scipy.signal.welch(x, 10.0, nperseg=128, detrend=False)
    assert w == approx(2 * np.pi * f)
    assert P == approx(Q / (2 * np.pi))
    assert ratio == approx(19 / 18 / 14, rel=0.01)  # 14 segments


def test_bands_of_the_density_cover():
    w = np.linspace(0.3, 2.8, 20)
    true = 2 * np.abs(1 + 0.5 * np.exp(-1j * w)) ** 2 / (2 * np.pi)
    inside = []
    for seed in range(60):
        e = np.random.default_rng(seed).normal(size=2001)
        P, ratio = spectrum.blackman_tukey(e[1:] + 0.5 * e[:-1], 1.0, 30, w)
        low, high = spectrum.band(P, ratio)
        inside.append((low < true) & (true < high))
    assert np.mean(inside) == approx(0.95, abs=0.03)


def test_etfe_is_exact_on_a_periodic_record():
    base = excitation.prbs(7)
    u = np.tile(base, 12)
    y = lfilter([0, 0, 0.3], [1, -0.7], u)
    w, G = frequency.etfe(u[-127:], y[-127:], 1.0)
    z = np.exp(1j * w)
    assert pytest.approx(0.3 / (z * (z - 0.7)), abs=1e-9) == G


def test_bands_of_the_response_cover():
    inside = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        u = held(4200, 5, rng)
        y = lfilter([0, 0, 0.2], [1, -0.8], u) + 0.2 * rng.normal(size=4200)
        w, G, g2, ratio = frequency.welch(u[200:], y[200:], 1.0, 256)
        z = np.exp(1j * w)
        part = (w < 1.0) & (g2 > 0.3)
        inside.append((np.abs(G - 0.2 / (z * (z - 0.8))) < frequency.radius(G, g2, ratio))[part])
    assert np.mean(np.concatenate(inside)) == approx(0.95, abs=0.03)


def test_spa_and_smoothed_etfe_come_near_the_truth():
    rng = np.random.default_rng(3)
    u = held(4000, 2, rng)
    y = lfilter([0, 0.2], [1, -0.8], u)
    w, G, *_ = frequency.smoothed(u, y, 1.0, 4)
    true = 0.2 / (np.exp(1j * w) - 0.8)
    assert np.median(np.abs(G - true) / np.abs(true)) < 0.01
    w = np.array([0.05, 0.2, 0.5])
    true = 0.2 / (np.exp(1j * w) - 0.8)
    assert np.abs(frequency.spa(u, y, 1.0, 200, w)[0] - true) == approx(0, abs=0.02)


# -- impulse response and delay ----------------------------------------------------------


def engine_record(seed, N=360, hold=5, amplitude=5.0, sd=2.0):
    """The engine in open loop, u +-5 held for 5 samples, white noise of 2 on y; METHODS 2.3."""
    rng = np.random.default_rng([seed, 7])
    p = bound.Engine()
    u = amplitude * held(N, hold, rng)
    g = np.where(np.arange(61) >= p.nk, p.K * (1 - p.a) * p.a ** (np.arange(61.0) - p.nk), 0.0)
    y = lfilter(np.concatenate([np.zeros(p.nk), [p.K * (1 - p.a)]]), [1, -p.a], u)
    return u, y + p.O + sd * rng.normal(size=N), g[1:]


def test_evidence_is_the_normal_density_without_the_level():
    rng = np.random.default_rng(4)
    Phi, y = rng.normal(size=(12, 3)), rng.normal(size=12)
    K = impulse.kernel("dc", 3, 0.8, 0.5)
    cost, s2 = impulse.evidence(Phi, y, K)
    P, v = impulse.without_level(Phi, y)
    density = multivariate_normal(np.zeros(11), s2 * (np.eye(11) + P @ K @ P.T)).logpdf(v)
    assert cost + 11 * (1 + np.log(2 * np.pi)) == approx(-2 * density)


@pytest.mark.parametrize("kind", ["tc", "dc", "ss"])
def test_posterior_with_a_wide_prior_is_least_squares(kind):
    u, y, _ = engine_record(0, hold=1)
    Phi, target = impulse.rows(u, y, 8)
    g = impulse.least_squares(Phi, target)[0]
    K = 1e6 * impulse.kernel(kind, 8, 0.9, 0.5)
    assert impulse.posterior(Phi, target, K, 1.0)[0] == approx(g, rel=1e-3, abs=1e-3)


def test_kernel_on_the_engine():
    """METHODS 2.3: least squares .55, TC .12; with dead taps .05."""
    least, tc = [], []
    for seed in range(2):
        u, y, g = engine_record(seed)
        Phi, target = impulse.rows(u, y, 60)
        size = np.linalg.norm(g)
        least.append(np.linalg.norm(impulse.least_squares(Phi, target)[0] - g) / size)
        tc.append(np.linalg.norm(impulse.fit(Phi, target, "tc", 5).g - g) / size)
    assert np.median(least) == approx(0.6, abs=0.25)
    assert max(tc) < 0.15


def test_dead_taps_find_the_delay():
    u, y, _ = engine_record(1)
    Phi, target = impulse.rows(u[:220], y[:220], 25)
    cost = [impulse.fit(Phi, target, "tc", d).cost for d in (4, 5, 6)]
    assert np.argmin(cost) == 1  # nk = 6


def test_four_ways_on_a_slow_clock():
    rng = np.random.default_rng(5)
    u = held(800, 12, rng)
    y = lfilter([0, 0, 0, 0, 0.1], [1, -0.9], u) + 0.02 * rng.normal(size=800)
    assert np.argmax(np.abs(delay_ways.raw(u, y, 20))) > 5  # late, as ERRATA says
    assert delay_ways.pre_whitened(u, y, 20)[1] == 4
    assert delay_ways.least(delay_ways.arx_scan(u, y, 10)) == 4
    scan = delay_ways.oe_scan(u, y, 6, (1,))
    assert delay_ways.least(scan) == 4
    assert delay_ways.weights(scan)[4] > 0.99


# -- subspace ----------------------------------------------------------------------------


def hair_dryer(data):
    text = (data("hair_dryer") / "slicot_IB01AD.dat").read_text()
    values = np.array(" ".join(text.split("\n")[2:]).split(), float)
    return values[:1000, None], values[1000:2000, None]


PRINTED = {  # SLICOT-Reference, examples/results/IB01AD.res and IB01BD.res
    "sv": (
        "69.8841 14.9963 3.6675 1.9677 0.3000 0.2078 0.1651 0.1373 "
        "0.1133 0.1059 0.0856 0.0784 0.0733 0.0678 0.0571"
    ),
    "A": [
        [0.8924, 0.3887, 0.1285, 0.1716],
        [-0.0837, 0.6186, -0.6273, -0.4582],
        [0.0052, 0.1307, 0.6685, -0.6755],
        [0.0055, 0.0734, -0.2148, 0.4788],
    ],
    "B": [[-0.2142], [-0.1968], [0.0525], [0.0361]],
    "C": [[-0.4442, 0.6663, 0.3961, 0.4102]],
    "D": [[-0.0041]],
    "K": [-1.9513, -0.1867, 0.6348, -0.3486],
}


def test_hair_dryer_through_slicots_settings(data):
    u, y = hair_dryer(data)
    W1, U, S = subspace.singular(u, y, 15)
    assert approx([float(v) for v in PRINTED["sv"].split()], abs=5.1e-5) == S
    A, C, G = subspace.a_and_c(W1, U, S, 4, 1, scaled=False)
    B, D = subspace.b_and_d_by_states(u, y, 15, A, C, G)
    printed = [np.array(PRINTED[k]) for k in "ABCD"]
    got = subspace.markov(A, B, C, D, 20)
    assert got == approx(subspace.markov(*printed, 20), abs=1e-4)
    K, Q, R, S = subspace.kalman(u, y, 15, A, C, G, rows=1000)
    sign = np.sign(C[0]) * np.sign(printed[2][0])
    assert K[:, 0] * sign == approx(PRINTED["K"], abs=2e-4)
    assert (Q[0, 0], R[0, 0], S[0, 0]) == approx((0.0052, 0.0012, -0.0025), abs=5.1e-5)


def random_system(seed, n=4, m=2, ny=3):
    rng = np.random.default_rng(seed)
    A = np.zeros((n, n))
    for i in range(0, n, 2):
        r, angle = rng.uniform(0.3, 0.95), rng.uniform(0.05, 3)
        c, s = r * np.cos(angle), r * np.sin(angle)
        A[i : i + 2, i : i + 2] = [[c, s], [-s, c]]
    T = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return (
        T @ A @ T.T,
        rng.normal(size=(n, m)),
        rng.normal(size=(ny, n)),
        rng.normal(size=(ny, m)),
    )


@pytest.mark.parametrize("method", ["moesp", "n4sid", "cva"])
@pytest.mark.parametrize("by", ["simulation", "states"])
def test_exact_records_give_the_system(method, by):
    true = random_system(0)
    rng = np.random.default_rng(1)
    u = rng.normal(size=(300, 2))
    y = subspace.simulate(*true, u, rng.normal(size=4))
    got = subspace.identify(u, y, 4, 6, method, by)
    assert subspace.markov(got.A, got.B, got.C, got.D, 10) == approx(
        subspace.markov(*true, 10), abs=1e-6
    )


def test_simulation_carries_the_offset():
    true = random_system(0)
    u = np.random.default_rng(1).normal(size=(300, 2))
    y = subspace.simulate(*true, u, np.zeros(4)) + np.array([1.0, -2.0, 3.0])
    B, D, O, _ = subspace.b_and_d_by_simulation(u, y, true[0], true[2])
    assert true[1] == approx(B)
    assert true[3] == approx(D)
    assert approx([1.0, -2.0, 3.0]) == O


def test_first_order_plants():
    for seed in range(25):
        rng = np.random.default_rng(seed)
        a, b = rng.uniform(-0.99, 0.99), rng.choice([-1, 1]) * rng.uniform(0.5, 5)
        u = rng.choice([-1.0, 1.0], 500)
        y = lfilter([0, b], [1, -a], u) + 0.01 * rng.normal(size=500)
        got = subspace.identify(u[:, None], y[:, None], 1, 8)
        assert got.A[0, 0] == approx(a, abs=0.01)
        assert (got.C @ got.B).item() == approx(b, abs=0.01)


@pytest.mark.parametrize("slowest", [-4.0, -2.0])
def test_exact_frequency_data(slowest):
    for seed in range(10):
        true = random_system(seed)
        w = np.logspace(slowest, np.log10(3), 60)
        z = np.exp(1j * w)
        G = subspace.freqresp(*true, z)
        *got, S = subspace.from_frequency(z, G, 4, 6)
        assert np.abs(subspace.freqresp(*got, z) - G).max() / np.abs(G).max() < 1e-10
        assert S[3] / S[4] > 1e7


def test_two_segments_count_like_one_record_each():
    true = random_system(2)
    rng = np.random.default_rng(2)
    u = rng.normal(size=(240, 2))
    y = np.vstack(
        [subspace.simulate(*true, u[s], rng.normal(size=4)) for s in (slice(100), slice(100, 240))]
    )
    got = subspace.identify(u, y, 4, 6, starts=(0, 100))
    assert subspace.markov(got.A, got.B, got.C, got.D, 8) == approx(
        subspace.markov(*true, 8), abs=1e-8
    )
    assert got.x0.shape == (2, 4)


def test_unstable_poles_are_reflected():
    A = subspace.stable(np.array([[1.25, 1.0], [0.0, 0.5]]))
    assert np.sort(np.linalg.eigvals(A)) == approx([0.5, 0.8])


def test_balanced_truncation_keeps_its_bound():
    A, B, C, _ = random_system(3)
    Ar, Br, Cr, h, limit = subspace.balanced(A, B, C, 2)
    z = np.exp(1j * np.linspace(0, np.pi, 400))
    zero = np.zeros((3, 2))
    error = subspace.freqresp(A, B, C, zero, z) - subspace.freqresp(Ar, Br, Cr, zero, z)
    worst = np.linalg.svd(error, compute_uv=False).max()
    assert h[2] <= worst <= limit


def test_pbsid_is_not_bent_by_the_loop():
    p = bound.Engine(Kp=-0.1315, Ki=-0.8816)
    errors = {"pbsid": [], "states": []}
    z = np.exp(1j * 2 * np.pi * 0.5 * p.Ts)
    true = p.K * (1 - p.a) / (z - p.a) * z ** (1 - p.nk)
    for seed in range(6):
        r = bound.set_points(3000, 1, (10, 25), seed)
        e = np.sqrt(15) * np.random.default_rng([seed, 1]).normal(size=(3000, 1))
        u, y = bound.simulate(p, r, e, noise="equation")
        *model, _, _ = pbsid.identify(u, y, 6, 20, 12)
        errors["pbsid"].append(subspace.freqresp(*model, z[None])[0, 0, 0] / true - 1)
        model = subspace.by_past_states(u - u.mean(), y - y.mean(), 6, 15)
        errors["states"].append(subspace.freqresp(*model, z[None])[0, 0, 0] / true - 1)
    assert abs(np.mean(errors["pbsid"])) < 0.015
    assert abs(np.mean(errors["states"])) > 0.02


# -- excitation and design ---------------------------------------------------------------


@pytest.mark.parametrize("n", [3, 5, 7, 9])
def test_prbs_is_of_maximal_length(n):
    u = excitation.prbs(n)
    M = 2**n - 1
    r = excitation.periodic_correlation(u)
    assert r[0] == 1
    assert r[1:] == approx(-1 / M)
    assert np.abs(np.fft.fft(np.repeat(u, 3))) ** 2 / (3 * M) == approx(
        excitation.held_spectrum(u, 3), abs=1e-8
    )


def test_gbn_has_its_correlation():
    u = excitation.gbn(200000, 0.1, np.random.default_rng(0))
    r = noise.autocorrelation(u, 5)
    assert r == approx(0.8 ** np.arange(6), abs=0.02)


def test_schroeder_phases_keep_the_crest_low():
    lines = np.arange(1, 31)
    assert excitation.crest(excitation.multisine(512, lines)) < 1.8
    drawn = [
        excitation.crest(excitation.multisine(512, lines, rng=np.random.default_rng(s)))
        for s in range(20)
    ]
    assert 2.2 < np.median(drawn) < 4


def test_order_of_excitation():
    t = np.arange(1000)
    assert excitation.order(np.sin(0.3 * t), 8) == 2
    assert excitation.order(np.sin(0.3 * t) + np.sin(0.9 * t), 8) == 4
    assert excitation.order(excitation.prbs(9), 8) == 8
    assert excitation.order(np.ones(100), 4) == 0


def test_chirp_and_staircase():
    u = excitation.chirp(10000, 0.01, 0.1, 5.0)
    crossings = np.sum(np.diff(np.sign(u)) != 0)
    assert crossings == approx(2 * 100 * (0.1 + 5.0) / 2, abs=2)
    assert list(excitation.staircase([1, 3], 2)) == [1, 1, 3, 3]


P1D = (2.0, 10.0, 3.37, 5.0)


def test_sensitivities_are_slopes():
    rng = np.random.default_rng(6)
    t = np.arange(120.0)
    u = held(120, 12, rng)
    psi = experiment_design.sensitivities(P1D, u, t, t)
    for i in range(4):
        h = 1e-5
        up, down = (
            experiment_design.response(np.array(P1D) + s * h * np.eye(4)[i], u, t, t)
            for s in (1, -1)
        )
        assert psi[:, i] == approx((up - down) / (2 * h), abs=1e-6)


def test_predicted_deviations_are_those_of_simulated_experiments():
    """150 experiments: a standard deviation is known to 6 %."""
    rng = np.random.default_rng(7)
    t = np.arange(200.0)
    u = held(200, 12, rng)
    u[0] = 0
    y = experiment_design.response(P1D, u, t, t)
    psi = experiment_design.sensitivities(P1D, u, t, t)
    predicted = experiment_design.predicted(psi, experiment_design.ar1(200, 0.2, 0.0))
    got = [
        experiment_design.estimate(
            y + 0.2 * np.random.default_rng(s).normal(size=200), u, t, t, P1D
        )[0]
        for s in range(150)
    ]
    assert np.std(got, axis=0) == approx(predicted, rel=0.16)


# -- messy records -----------------------------------------------------------------------


def test_swinging_door_keeps_its_promise():
    y = ar1(2000, 0.95, np.random.default_rng(8))
    kept = compression.swinging_door(y, 0.3)
    assert len(kept) < 1000
    assert np.abs(compression.refilled(y, kept, "line") - y).max() < 0.6 + 1e-12
    kept = compression.exception(y, 0.3)
    assert np.abs(compression.refilled(y, kept, "hold") - y).max() <= 0.3


def test_compression_is_seen_and_not_invented():
    for seed in range(8):
        y = 50 + ar1(2000, 0.95, np.random.default_rng(seed))
        for step in (0.01, 0.1, 0.5):
            assert compression.compressed(np.round(y / step) * step) is None
        assert compression.compressed(y) is None
        assert compression.compressed(y.astype(np.float32).astype(float)) is None
        door, dead = compression.swinging_door(y, 0.2), compression.exception(y, 0.2)
        for how in ("line", "hold"):
            assert compression.compressed(compression.refilled(y, door, how)) == how
            assert compression.compressed(compression.refilled(y, dead, how)) == how


def test_offset_steps_are_found_and_not_invented():
    found = 0
    for seed in range(40):
        e = ar1(1000, 0.5, np.random.default_rng(seed))
        assert offset_steps.steps(e) == []
        e[400:] += 3.0
        c = offset_steps.steps(e)
        found += len(c) == 1 and abs(c[0] - 400) <= 3
    assert found >= 38


def test_scan_is_the_gain_of_least_squares():
    e = np.random.default_rng(9).normal(size=50)
    c = 17
    X = np.column_stack([np.ones(50), np.arange(50) >= c])
    rss = np.sum((e - X @ np.linalg.lstsq(X, e, rcond=None)[0]) ** 2)
    assert offset_steps.scan(e)[c] == approx((np.sum((e - e.mean()) ** 2) - rss) / (rss / 48))


def test_a_line_is_not_a_step():
    e = np.random.default_rng(10).normal(size=1000)
    ramp, step = e + np.linspace(0, 3, 1000), e + 2.0 * (np.arange(1000) > 500)
    assert offset_steps.line_gain(ramp) > offset_steps.scan(ramp)[10:-10].max()
    assert offset_steps.line_gain(step) < offset_steps.scan(step)[10:-10].max()


def test_a_load_step_is_carried_by_the_fit():
    rng = np.random.default_rng(11)
    t = np.arange(300.0)
    u = held(300, 12, rng)
    u[0] = 0
    y = experiment_design.response(P1D, u, t, t) + 2.0 * (t >= 180) + 0.1 * rng.normal(size=300)
    p, found, _ = offset_steps.fit_with_steps(y, u, t, (2.0, 15.0, 5.0, 5.0))
    assert found == [180]
    assert p[:3] == approx(P1D[:3], rel=0.05)


def test_laguerre_functions_are_orthonormal():
    pulse = np.zeros(600)
    pulse[0] = 1.0
    L = informative.laguerre(pulse, 5, 0.8)
    assert L.T @ L == approx(np.eye(5), abs=1e-9)


def test_informative_windows():
    quiet, moved = 0, 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        v = 0.3 * ar1(400, 0.98, rng) + 0.03 * rng.normal(size=400)
        r = np.zeros(400)
        r[230:290], r[290:350] = 1.0, -0.5
        u, y, x, I = np.zeros(400), np.zeros(400), 0.0, 0.0
        for t in range(400):
            x = 0.88 * x + 0.18 * (u[t - 4] if t >= 4 else 0.0)
            y[t] = x + v[t]
            I += 0.08 * (r[t] - y[t])
            u[t] = 0.7 * (r[t] - y[t]) + I
        for name, w in (("quiet", slice(0, 200)), ("moved", slice(200, 400))):
            _, condition, _, p = informative.tests(u[w], y[w])
            hit = p < 1e-6 and condition < 100
            quiet, moved = quiet + (hit and name == "quiet"), moved + (hit and name == "moved")
    assert quiet == 0
    assert moved >= 8


def test_information_of_a_still_window_is_none():
    still = np.ones(100)
    assert np.all(np.isinf(informative.information(still, still, 1.0, 2.0, 10.0, 3.0, 0.1)))


def test_transition_and_sum_of_steps_agree_at_any_stamps():
    rng = np.random.default_rng(12)
    t = np.cumsum(rng.exponential(4.0, 12))
    u = rng.normal(size=12)
    stamps = np.sort(rng.uniform(t[0], t[-1] + 5, 60))
    one = irregular.response(irregular.p1d(2.0, 5.0), 2.3, u, t, stamps, 1.0)
    assert one == approx(experiment_design.response((2.0, 5.0, 2.3, 1.0), u, t, stamps), abs=1e-12)
    step = irregular.response(irregular.p2d(2.0, 5.0, 3.0), 1.0, [0.0, 1.0], [0.0, 2.0], stamps)
    x = np.maximum(stamps - 3.0, 0.0)
    assert step == approx(2 * (1 - (5 * np.exp(-x / 5) - 3 * np.exp(-x / 3)) / 2), abs=1e-12)


def test_missing_outputs_are_left_out():
    rng = np.random.default_rng(13)
    t = np.arange(150.0)
    u = held(150, 10, rng)
    u[0] = 0
    y = experiment_design.response(P1D, u, t, t)
    y[rng.random(150) < 0.3] = np.nan
    p, rss = irregular.fit(y, u, t, t, (1.5, 8.0, 3.0, 0.0))
    assert p == approx(P1D, rel=1e-5)
    assert rss < 1e-9


def test_decimation_stops_what_would_alias():
    t = np.arange(4000)
    assert np.std(irregular.decimate(np.sin(2 * np.pi * 0.097 * t), 10)[50:]) < 1e-3
    assert irregular.decimate(np.ones(100), 10) == approx(1.0)
