"""The oracles of hysteresis agree with closed forms and with the printed numbers."""

import itertools

import numpy as np
import pytest
from pytest import approx

from oracles import bouc_wen, cmac, creep, cycles, play, preisach, series_slip

# -- play, stop, slip --------------------------------------------------------------------


def walk(seed, N=400, size=1.0):
    return size * np.random.default_rng(seed).uniform(-1, 1, N)


def some_stack(n=12, seed=3):
    rng = np.random.default_rng(seed)
    return np.arange(n) / n, np.append(0.5, rng.uniform(0, 0.2, n - 1))


def test_play_follows_a_lag_behind_and_holds_in_between():
    assert play.play([0, 0.5, 2, 1.5, 0.5, -1], 1) == approx([0, 0, 1, 1, 1, 0])


def test_maxwell_slip_is_the_stop_of_r_f_over_k():
    """Source 002, (7a), (7b); METHODS 4."""
    x, k, f = walk(1), np.array([1.0, 2.0, 0.5]), np.array([0.3, 0.2, 0.4])
    stops = np.column_stack([play.stop(x, r) for r in f / k])
    assert play.maxwell(x, k, f) == approx(stops @ k, abs=1e-14)


def test_branches_are_the_virgin_curve_at_twice_the_size():
    """Masing's rule."""
    r, w = some_stack()
    x = np.concatenate([np.linspace(0, 0.9, 10), np.linspace(0.9, -0.7, 30)])
    y = play.stack(x, r, w)
    assert y[9] == approx(play.virgin_curve(0.9, r, w))
    for t in range(10, 40):
        assert y[9] - y[t] == approx(play.branch(0.9, x[t], r, w))


def test_inverse_of_the_stack_is_exact_from_any_state():
    r, w = some_stack()
    x = walk(2)
    back = play.inverse(r, w)
    assert play.stack(play.stack(x, r, w), *back) == approx(x, abs=1e-13)
    z0 = play.plays(walk(5), r)[-1]
    y = play.stack(x, r, w, z0)
    assert play.stack(y, *back, play.inverse_state(w, z0)) == approx(x, abs=1e-13)
    assert play.inverse(*back)[0] == approx(r, abs=1e-13)
    assert play.inverse(*back)[1] == approx(w, abs=1e-13)


def test_two_elements_invert_as_on_paper():
    """y = z_0 + z_1, r = 1: the virgin curve x for x < 1, 2 x - 1 beyond."""
    r, w = play.inverse([0, 1], [1, 1])
    assert r == approx([0, 1]) and w == approx([1, -0.5])


ASYMMETRIC = np.array([0, 0.2, 0.5, -0.2, -0.4]), np.array([1.0, 0.3, 0.2, -0.2, 0.4])


def test_inverse_of_the_modified_stack_is_exact():
    r, w = some_stack()
    x = walk(4)
    y = play.modified(x, r, w, *ASYMMETRIC)
    assert play.modified_inverse(y, r, w, *ASYMMETRIC) == approx(x, abs=1e-13)


def test_dead_zones_invert():
    h = np.linspace(-3, 3, 61)
    y = play.dead_zones(h, *ASYMMETRIC)
    assert play.dead_zones(y, *play.inverse_dead_zones(*ASYMMETRIC)) == approx(h, abs=1e-14)


def test_warp_and_unwarp_invert():
    kappa, s = np.array([-1, -0.5, 0.1, 0.6, 1]), np.array([2, 0.5, 1, 3])
    y = np.linspace(-2, 2, 81)
    assert play.warp([0.0], kappa, s) == approx([0])
    assert play.unwarp(play.warp(y, kappa, s), kappa, s) == approx(y, abs=1e-13)


def test_nnls_finds_the_stack_that_made_the_data():
    r, w = some_stack()
    x = walk(6, 600, 1.1)
    assert play.fit(x, play.stack(x, r, w), r).w == approx(w, abs=1e-10)
    found = play.fit(x, play.stack(x, r, w) - 0.3, r, offset=True)
    assert found.offset == approx(-0.3, abs=1e-10)
    slips = x[:, None] - play.plays(x, r)[:, 1:]
    assert play.fit_stops(x, x + slips @ w[1:], r).w == approx([1, *w[1:]], abs=1e-10)


def test_a_butterfly_takes_plays_on_x_and_on_its_size():
    r, w = some_stack(6)
    x = walk(18, 400, 1.1)
    v = np.linspace(-0.1, 0.2, len(r))
    y = play.stack(x, r, w) + play.stack(abs(x), r, v) + 0.3
    found = play.fit_even(x, y, r, r)
    assert found.v == approx(v, abs=1e-10) and found.offset == approx(0.3, abs=1e-10)
    sparse = play.stack(x, r[[1, 4]], [1, 0.5]) + play.stack(abs(x), r[[0, 3]], [0.7, -0.3])
    odd, even = play.select_even(x, sparse, r, 2)
    assert odd == approx(r[[1, 4]]) and even == approx(r[[0, 3]])


def test_the_convex_fit_finds_the_modified_stack():
    r, w = some_stack()
    x = walk(7, 600)
    kappa, s = np.array([-2, -0.3, 0.4, 2]), np.array([1.3, 1.0, 0.7])
    y = play.unwarp(play.stack(x, r, w), kappa, s)
    found = play.fit_modified(x, y, r, kappa, 1)
    assert found.s == approx(s, abs=1e-9)
    assert found.w == approx(w, abs=1e-9)


def test_an_asymmetric_stage_under_noise():
    """METHODS 4: noise of 0.1 %, error on new data below 0.05 % of the range."""
    r_true = np.arange(40) / 40
    w_true = np.append(0.5, 0.02 * np.exp(-3 * r_true[1:]))
    t = np.arange(1500) / 1500
    x = np.sin(2 * np.pi * 9 * t) * (1 - 0.9 * t)
    chirp = 0.9 * np.sin(2 * np.pi * 30 * t**2)
    h = play.stack(x, r_true, w_true)
    y = h + 0.25 * h**2
    size = np.ptp(y)
    noisy = y + 1e-3 * size * np.random.default_rng(20).normal(size=len(t))
    r, kappa = np.arange(20) / 20, np.linspace(noisy.min(), noisy.max(), 13)
    found = play.fit_modified(x, noisy, r, kappa, 6)
    new = play.stack(chirp, r_true, w_true)
    new += 0.25 * new**2
    error = play.unwarp(play.stack(chirp, r, found.w), kappa, found.s) - new
    assert np.sqrt(np.mean(error**2)) < 5e-4 * size
    back = play.stack(play.warp(new, kappa, found.s), *play.inverse(r, found.w))
    left = play.stack(back, r_true, w_true)
    assert np.sqrt(np.mean((left + 0.25 * left**2 - new) ** 2)) < 5e-4 * size


def test_forgetting_without_forgetting_is_nnls_with_a_ridge():
    r, w = some_stack(4)
    x = walk(8, 60)
    path = play.fit_forgetting(x, play.stack(x, r, w), r, 1.0, 1e-12)
    assert path[-1] == approx(w, abs=1e-6)
    assert np.all(path >= 0)


# -- series slip -------------------------------------------------------------------------


def test_table_4_1_as_anchored_segments():
    """ERRATA 4: 44.13 at 100 V, 21.87 up and 27.43 down at 50 V."""
    T = series_slip.TABLE_4_1
    x = [0, 50, 100, 50]
    F = series_slip.anchored(x, T.up, T.down)
    assert F == approx([1.205, 21.874, 44.131, 27.430], abs=5e-4)


def test_table_4_1_misses_its_own_breakpoints():
    """ERRATA 4: by 0.49 to 0.87 um; a reversal at 50 V jumps by 5.6 um."""
    T = series_slip.TABLE_4_1
    gaps = [
        abs(y1 + k1 * (x2 - x1) - y2)
        for group in (T.up, T.down)
        for (x1, y1, k1), (x2, y2, _) in itertools.pairwise(group)
    ]
    assert gaps == approx([0.487, 0.667, 0.847, 0.870], abs=1e-3)
    jump = series_slip.value(T.down, 50, -1) - series_slip.value(T.up, 50, 1)
    assert jump == approx(5.556, abs=1e-3)


def test_the_series_form_of_table_4_1_drifts_until_closed():
    """ERRATA 4: 2.2 um per cycle."""
    T = series_slip.TABLE_4_1
    assert series_slip.drift(T.up, T.down, 0, 100) == approx(2.217, abs=1e-3)
    down = series_slip.closed(T.up, T.down, 0, 100)
    x = np.tile(np.append(np.linspace(0, 100, 50), np.linspace(98, 2, 49)), 4)
    F = series_slip.series(x, T.up, down)
    assert F[0] == approx(F[99 * 3], abs=1e-12)
    assert series_slip.series(x, T.up, T.down)[99] == approx(2.217, abs=1e-3)


def test_table_4_1_read_literally():
    """ERRATA 4: at most 13.5 um going up and -68 um going down."""
    T = series_slip.TABLE_4_1
    v = np.linspace(0, 100, 401)
    assert max(series_slip.literal(x, T.up, 1) for x in v) == approx(13.5, abs=0.01)
    low = min(series_slip.literal(x, T.down, -1) for x in v[v < 97])
    assert low == approx(-67.9, abs=0.1)


def test_chained_elements_are_continuous():
    up = series_slip.chained(series_slip.TABLE_4_1.up)
    for (x1, y1, k1), (x2, y2, _) in itertools.pairwise(up):
        assert y1 + k1 * (x2 - x1) == approx(y2)


def test_a_broken_line_is_found_at_its_corner():
    x = np.append(np.linspace(0, 100, 1001), np.linspace(99.9, 0, 1000))
    y = np.interp(x, [0, 40, 100], [0, 10, 40])
    found = series_slip.identify(x, y, 0.05)
    assert [e[0] for e in found.up] == approx([0, 40], abs=0.6)
    assert [e[2] for e in found.up] == approx([0.25, 0.5], rel=1e-2)
    assert [e[2] for e in found.down] == approx([0.5, 0.25], rel=1e-2)


@pytest.mark.parametrize("back", [False, True])
def test_threshold_of_half_a_micrometre_on_a_loop_of_60(back):
    """ERRATA 4: 3 or 4 elements per direction, largest error 0.50 to 0.51 um."""
    x, y = cycles.stage(1000, cycles=1, drift=0.0, slow=0.0, digit=0)
    found = series_slip.identify(x, y, 0.5, back=back)
    assert len(found.up) == 3 and len(found.down) == 3
    assert abs(found.F - y).max() < (0.5 if back else 0.51) + 1e-12
    assert abs(series_slip.anchored(x, found.up, found.down, y[0]) - y).max() < 0.51


def test_noise_opens_elements_unless_several_samples_agree():
    """ERRATA 4: the threshold in standard deviations of the noise."""
    x, y = cycles.stage(2000, cycles=1, drift=0.0, slow=0.0, digit=0, noise=0.25)
    once, thrice = (series_slip.identify(x, y, 0.5, consecutive=n) for n in (1, 3))
    assert len(once.up) + len(once.down) > 100
    assert len(thrice.up) + len(thrice.down) <= 12


def test_the_inverse_of_anchored_segments():
    T = series_slip.TABLE_4_1
    for group, way in ((T.up, 1), (T.down, -1)):
        for v in (5.0, 15.0, 50.0, 70.0):
            y = series_slip.value(group, v, way)
            if y is not None:
                x = series_slip.inverse(y, T.up, T.down, way)
                assert series_slip.value(group, x, way) == approx(y, abs=1e-9)


# -- Preisach ----------------------------------------------------------------------------

LEVELS = np.linspace(-1, 1, 9)


def on_levels(seed, N=200):
    return np.random.default_rng(seed).choice(LEVELS, N)


def random_mu(seed=9):
    return np.random.default_rng(seed).uniform(0, 1, len(preisach.cells(len(LEVELS) - 1)))


def test_everett_and_weights_are_each_others_inverse():
    mu = random_mu()
    assert preisach.weights(preisach.everett(mu)) == approx(mu, abs=1e-12)


def test_the_table_says_what_the_relays_say():
    x, mu = on_levels(10), random_mu()
    relays = preisach.output(x, LEVELS, mu)
    assert preisach.by_table(x, preisach.everett(mu), LEVELS) == approx(relays, abs=1e-11)


def test_the_first_rise_of_a_symmetric_mu_is_e_x_minus_x():
    n = len(LEVELS) - 1
    place = {tuple(c): k for k, c in enumerate(preisach.cells(n))}
    mu = random_mu()
    mu = np.array([mu[k] + mu[place[n - 1 - j, n - 1 - i]] for (i, j), k in place.items()])
    E, x = preisach.everett(mu), LEVELS[4:]
    curve = [preisach.interpolate(E, LEVELS, a, -a) for a in x]
    assert preisach.by_table(x, E, LEVELS, "virgin") == approx(curve, abs=2e-2)
    assert preisach.output(x, LEVELS, mu, "virgin") == approx(curve, abs=1e-11)


def test_a_play_stack_is_a_preisach_model():
    r, w = np.array([0, 0.25, 0.5, 0.75]) / 2, np.array([1, 0.5, 0.3, 0.2])
    E = preisach.play_everett(LEVELS, r, w)
    x = on_levels(11)
    assert preisach.by_table(x, E, LEVELS, "virgin") == approx(play.stack(x, r, w), abs=2e-3)


def test_reversal_curves_identify_the_relays():
    """Source 002, (2) to (4)."""
    mu = random_mu(12)
    E = preisach.forc(LEVELS, lambda x: preisach.output(x, LEVELS, mu))
    assert preisach.weights(E) == approx(mu, abs=1e-11)


def test_nnls_finds_the_relays():
    mu = random_mu(13)
    for x, states in ((on_levels(14, 400), preisach.relays), (walk(14, 300), preisach.rows)):
        S = states(x, LEVELS)
        found, offset = preisach.fit(S, S @ mu + 0.5, 1e-12)
        assert S @ found + offset == approx(S @ mu + 0.5, abs=1e-6)


# -- Bouc-Wen ----------------------------------------------------------------------------


def test_bouc_wen_of_a_displacement_is_made_of_exponentials():
    x = walk(15, 40, 1e-3)
    p = bouc_wen.BENCHMARK
    assert bouc_wen.of_displacement(x, p) == approx(bouc_wen.exponentials(x, p), abs=1e-8)


def test_bouc_wen_saturates():
    p = bouc_wen.SimpleNamespace(alpha=2.0, beta=1.0, gamma=0.7, delta=0.3, nu=1.5)
    z = bouc_wen.of_displacement([0, 30.0], p)
    assert z[-1] == approx(bouc_wen.limit(p), rel=1e-6)


def test_without_hysteresis_the_oscillator_is_linear():
    p = bouc_wen.SimpleNamespace(m=2.0, c=10.0, k=5e4, alpha=0.0, beta=0.0, gamma=0, delta=0, nu=1)
    w0, zeta = np.sqrt(p.k / p.m), p.c / 2 / np.sqrt(p.k * p.m)
    t = np.linspace(0, 0.2, 151)
    y = bouc_wen.oscillator(t, lambda _: 1.0, p)[0]
    wd = w0 * np.sqrt(1 - zeta**2)
    closed = 1 - np.exp(-zeta * w0 * t) * (np.cos(wd * t) + zeta * w0 / wd * np.sin(wd * t))
    assert y == approx(closed / p.k, abs=1e-13)


def test_newmark_comes_to_the_same_oscillation():
    Ts, N = 1 / 750, 150
    t = np.arange(N) * Ts
    u = 100 * np.sin(2 * np.pi * 20 * t)
    y = bouc_wen.oscillator(t, bouc_wen.periodic(u, Ts), bouc_wen.BENCHMARK)[0]
    fine, finer = (bouc_wen.newmark(u, Ts, bouc_wen.BENCHMARK, n) for n in (10, 20))
    assert abs(fine - y).max() == approx(4 * abs(finer - y).max(), rel=0.3)
    assert abs(finer - y).max() < 2e-3 * abs(y).max()


# -- creep, charge -----------------------------------------------------------------------


def test_creep_after_a_step():
    Ts, c, tau = 0.1, np.array([0.3, 0.2, 0.1]), creep.spaced(0.2, 20, 3)
    t = Ts * np.arange(100)
    closed = (1 - np.exp(-t[:, None] / tau)) @ c
    assert creep.creep(np.ones(100), Ts, c, tau) == approx(closed, abs=1e-14)
    assert tau == approx([0.2, 2, 20])
    x = walk(16, 300)
    y = 0.7 * x + creep.creep(x, Ts, c, tau)
    assert creep.fit(x, y, Ts, tau) == approx([0.7, *c], abs=1e-9)


def test_the_leak_of_source_002():
    """ERRATA 4: at 5 nA 20.7 Gohm and 103.5 V."""
    assert creep.leak_resistance(5e-9) == approx(20.7e9, rel=1e-3)
    V = 5e-9 * creep.leak_resistance(5e-9)
    assert V == approx(103.5, abs=0.05)
    assert creep.leak(V) == approx(5e-9, rel=1e-12)


@pytest.mark.parametrize("by", ["leak", "total"])
def test_the_leak_current_alone_holds_the_charge(by):
    C = 0.1e-6
    q0 = C * 5e-9 * creep.leak_resistance(5e-9)
    assert creep.charge(np.full(5, 5e-9), 10.0, C, q0, by) == approx(np.full(5, q0), rel=1e-9)


def test_the_charge_rises_like_the_current_and_creeps_when_it_stops():
    C, Ts = 0.1e-6, 0.5
    i = np.append(np.full(80, 300e-9), np.zeros(80))
    q = creep.charge(i, Ts, C)
    assert q[80] == approx(300e-9 * 40, rel=0.02)
    RC = creep.R * C  # the leak at its smallest: 2100 s
    assert -np.diff(q)[80:] == approx(q[80:-1] * Ts / RC, rel=0.02)


# -- loop and learning -------------------------------------------------------------------


def test_the_inverse_as_feed_forward_leaves_nothing():
    r, w = some_stack()
    d, v = ASYMMETRIC
    wish = 0.4 * np.sin(np.arange(400) / 30)
    feed = play.modified_inverse(wish, r, w, d, v)
    run = cmac.loop(wish, cmac.stage(r, w, d, v), 1e-3, 0.0, 0.0, feed=feed)
    assert run.y == approx(wish, abs=1e-13)


def test_pid_alone_leaves_more_than_with_the_inverse_of_a_wrong_model():
    r, w = some_stack()
    wish = 0.4 * np.sin(np.arange(400) / 30)
    feed = play.stack(wish, *play.inverse(r, 1.05 * w))
    alone = cmac.loop(wish, cmac.stage(r, w), 1e-3, 0.0, 300.0)
    ahead = cmac.loop(wish, cmac.stage(r, w), 1e-3, 0.0, 0.0, feed=feed)
    both = cmac.loop(wish, cmac.stage(r, w), 1e-3, 0.0, 300.0, feed=feed)
    size = [np.sqrt(np.mean(run.e**2)) for run in (alone, ahead, both)]
    assert size[2] < 0.5 * min(size[0], size[1])


def test_a_cmac_learns_a_function():
    net = cmac.cmac(-1, 1, 20, 8, 0.5)
    s = np.linspace(-1, 1, 200)
    for _ in range(60):
        for si in s:
            net.learn(si, np.sin(3 * si))
    error = [net.recall(si) - np.sin(3 * si) for si in s]
    assert np.std(error) < 0.02


def test_the_cmac_takes_over_from_the_pid():
    r, w = some_stack()
    wish = np.tile(0.4 * np.sin(2 * np.pi * np.arange(200) / 200), 30)
    net = cmac.cmac(-0.5, 0.5, 25, 8, 0.3, tables=2)
    run = cmac.loop(wish, cmac.stage(r, w), 1e-3, 0.3, 0.0, learner=net)
    first, last = run.e[:200], run.e[-200:]
    assert np.sqrt(np.mean(last**2)) < 0.05 * np.sqrt(np.mean(first**2))


def test_the_cmac_runs_away_when_it_learns_too_fast_beside_an_integrator():
    """Source 002, 3.3: it easily becomes unstable."""
    r, w = some_stack()
    wish = np.tile(0.4 * np.sin(2 * np.pi * np.arange(200) / 200), 30)
    net = cmac.cmac(-0.5, 0.5, 25, 8, 1.0, tables=2)
    run = cmac.loop(wish, cmac.stage(r, w), 1e-3, 0.0, 300.0, learner=net)
    assert abs(run.e[-200:]).max() > 100


# -- cycles ------------------------------------------------------------------------------


def test_cycles_are_found_under_noise():
    t = np.arange(3001) / 1000
    x = 50 - 50 * np.cos(2 * np.pi * t) + np.random.default_rng(17).normal(size=len(t))
    found = cycles.split(x, 10)
    assert len(found) == 3
    assert np.array(found)[:, 1] == approx([500, 1500, 2500], abs=40)


def test_repeatability_is_the_drift_of_an_ideal_stage():
    x, y = cycles.stage(drift=0.4, slow=0.0, digit=0)
    one, two = cycles.split(x, 1)
    largest, rms = cycles.repeatability(x, y, one, two)
    assert rms == approx(0.4, rel=0.05)
    assert largest < 1.5


def test_the_stage_moves_in_digits_of_122_nm():
    assert cycles.DIGIT == approx(0.12207, abs=1e-5)
    _, y = cycles.stage()
    steps = y / cycles.DIGIT
    assert steps == approx(np.round(steps), abs=1e-9)
