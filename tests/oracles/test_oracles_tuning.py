"""The oracles of tuning and closed-loop simulation agree with printed numbers and closed forms."""

import warnings

import numpy as np
import pytest
from pytest import approx
from scipy import interpolate, optimize, signal, special

from oracles import delayed, fopdt, imc, loop, optimum, peaks, rational, relay, shaping
from oracles import sampled_loop as sl
from oracles.sampled_loop import Pid

OP1 = dict(K=5.939, T=0.1491, L=0.1)

# -- rational dead time ----------------------------------------------------------------


def draw(rng, delay):
    """Draw a plant of either sign and settings of which about half are stable."""
    K = rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1)
    T, L = 10 ** rng.uniform(-1, 1, 2)
    Kp = rng.uniform(-1, 3) * (T / L) / K
    Ki = rng.uniform(-0.5, 3) / (K * L)
    Kd = rng.uniform(-1.5, 1.5) * T / K if delay == "pade" else 0.0
    return K, T, L, Kp, Ki, Kd


@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_printed_transfer_functions_are_the_products(delay):
    rng = np.random.default_rng(1)
    for _ in range(50):
        K, T, L, Kp, Ki, Kd = draw(rng, delay)
        sys = rational.closed_loop(K, T, L, Kp, Ki, Kd, delay=delay)
        forms = [
            rational.printed(K, T, L, Kp, Ki, Kd, delay=delay),
            rational.printed_ti(K, T, L, Kp, Kp / Ki, Kd / Kp, delay=delay),
        ]
        s = 0.3 + 0.7j
        for form in forms:
            for name, (num, den) in form.items():
                found = np.polyval(num, s) / np.polyval(den, s)
                n, d = sys[name]
                assert found == approx(np.polyval(n, s) / np.polyval(d, s), rel=1e-10), name


def test_all_outputs_follow_from_the_loop_gain():
    K, T, L, Kp, Ki, Kd = -2.0, 3.0, 0.7, -0.6, -0.2, -0.1
    s = 0.2 + 1.1j
    G = K / (T * s + 1) * (1 - L / 2 * s) / (1 + L / 2 * s)
    C = Kp + Ki / s + Kd * s
    sys = rational.closed_loop(K, T, L, Kp, Ki, Kd, delay="pade")
    expected = {
        "Y/R": C * G,
        "U/R": C,
        "E/R": 1,
        "Y/P": G,
        "U/P": 1,
        "E/P": -G,
        "Y/D": 1,
        "U/D": -C,
        "E/D": -1,
    }
    for name, (num, den) in sys.items():
        assert np.polyval(num, s) / np.polyval(den, s) == approx(expected[name] / (1 + C * G))


@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_routh_conditions_are_those_of_the_roots(delay):
    rng = np.random.default_rng(2)
    seen = []
    for _ in range(3000):
        case = draw(rng, delay)
        den = rational.characteristic(*case, delay=delay)
        truth = rational.stable(den)
        seen.append(truth)
        assert all(v > 0 for v in rational.routh(*case, delay=delay).values()) == truth, case
        assert rational.hurwitz(den) == truth, case
        if truth:
            assert all(v > 0 for v in rational.routh_implied(*case, delay=delay).values()), case
    assert 0.1 < np.mean(seen) < 0.9


def test_the_uncorrected_condition_is_wrong_in_some_cases():
    """(3.4-27) as printed lacks the leading coefficient; ERRATA 3.1 counts 6 %."""
    rng = np.random.default_rng(3)
    wrong = 0
    for _ in range(2000):
        K, T, L, Kp, Ki, Kd = draw(rng, "pade")
        values = rational.routh(K, T, L, Kp, Ki, Kd, delay="pade")
        lead = T * L - K * Kd * L
        printed = values["3.4-27"] + 2 * K * Ki * lead - 2 * K * Ki > 0
        others = all(v > 0 for k, v in values.items() if k != "3.4-27")
        wrong += (others and printed) != (others and values["3.4-27"] > 0)
    assert 10 < wrong


@pytest.mark.parametrize("which", ["Kp", "Ki", "Kd"])
@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_the_interval_ends_where_the_roots_reach_the_axis(delay, which):
    rng = np.random.default_rng(4)
    counted = 0
    while counted < 30:
        K, T, L, Kp, Ki, Kd = draw(rng, "pade")
        case = dict(Kp=Kp, Ki=Ki, Kd=Kd)
        found = rational.interval(which, K, T, L, **case, delay=delay)
        here = rational.stable(rational.characteristic(K, T, L, **case, delay=delay))
        assert (found is not None) == here
        if not here:
            continue
        counted += 1

        def at(x, gains=case, K=K, T=T, L=L):
            if which == "Kp":
                gains = {k: v * x / gains["Kp"] for k, v in gains.items()}
            else:
                gains = {**gains, which: x}
            return rational.stable(rational.characteristic(K, T, L, **gains, delay=delay))

        low, high = found
        ends = [e for e in found if np.isfinite(e)]
        size = max(abs(e) for e in [*ends, case[which]])
        step = 1e-5 * min(size, high - low)
        for end, out in ((low, -1), (high, 1)):
            if np.isfinite(end):
                assert at(end - out * step) and not at(end + out * step)
        inside = np.linspace(max(low, -10 * size), min(high, 10 * size), 41)[1:-1]
        assert all(at(x) for x in inside)


def test_taylor_interval_is_the_printed_inequality():
    K, T, L = OP1.values()
    low, high = rational.interval("Ki", K, T, L, 0.1, 0.5, delay="taylor")
    assert (low, high) == approx((0.0, (K * 0.1 + 1) / (K * L)))  # (3.4-22)
    # (3.4-20) in Ti holds for all Kp when Ti > L: the bound is (3.4-21)
    assert rational.interval("Kp", K, T, L, 0.1, 0.5, delay="taylor") == approx((0.0, T / (K * L)))


def test_step_responses_equal_scipy_and_the_printed_fractions():
    K, T, L = OP1.values()
    t = np.linspace(0.0, 2.0, 51)[1:]
    for delay, Kd in (("taylor", 0.0), ("pade", 0.005)):
        num, den = rational.closed_loop(K, T, L, 0.1, 0.7, Kd, delay=delay)["Y/R"]
        y = rational.step(num, den, t)
        assert y == approx(signal.step((num, den), T=np.append(0, t))[1][1:], abs=1e-9)
        q0, p, q = rational.partial_fractions(num, den)
        assert q0 == approx(1)  # (3.4-35), (3.4-41)
        assert y == approx(1 + (np.exp(-np.outer(t, p)) @ q).real, abs=1e-11)


def test_step_response_holds_for_a_double_pole_and_an_impulse():
    t = np.array([0.1, 1.0, 3.0])
    assert rational.step([1.0], [1.0, 2.0, 1.0], t) == approx(1 - (1 + t) * np.exp(-t), abs=1e-13)
    assert rational.step([1.0], [1.0, 0.0], t) == approx(t, abs=1e-13)
    # s + 2 over 1: an impulse and the constant 2
    assert rational.step([1.0, 2.0], [1.0], t) == approx([2, 2, 2])
    assert rational.step_impulse([1.0, 2.0], [1.0]) == 1
    num, den = rational.closed_loop(1.0, 1.0, 1.0, 0.5, 0.4, 0.1, delay="pade")["U/R"]
    assert rational.step_impulse(num, den) == approx(0.1 / 0.9)  # Kd/(1 - K Kd/T)


def test_final_values_are_those_of_integral_action():
    K, T, L = OP1.values()
    sys = rational.closed_loop(K, T, L, 0.1, 0.7, 0.004, delay="pade")
    end = {name: rational.step(n, d, [60.0])[0] for name, (n, d) in sys.items()}
    # (3.4-51), (3.4-53): U = R/K
    assert end["Y/R"] == approx(1) and end["U/R"] == approx(1 / K)
    for name in ("E/R", "Y/P", "U/P", "E/P", "Y/D"):
        assert end[name] == approx(0, abs=1e-12)


# -- exact dead time -------------------------------------------------------------------


def plants(rng):
    """Draw numerator and denominator: self-regulating, integrating, inverse response, unstable."""
    num, den = np.array([10 ** rng.uniform(-1, 1)]), np.array([1.0])
    for _ in range(rng.integers(1, 4)):
        den = np.polymul(den, [10 ** rng.uniform(-1, 1), 1.0])
    if rng.random() < 0.3:
        T, zeta = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-2, 0)
        den = np.polymul(den, [T**2, 2 * zeta * T, 1.0])
    if rng.random() < 0.3:
        num = np.polymul(num, [-(10 ** rng.uniform(-1, 1)), 1.0])
    kind = rng.random()
    if kind < 0.3:
        den = np.polymul(den, [1.0, 0.0])
    elif kind < 0.45:
        den = np.polymul(den, [10 ** rng.uniform(0, 1), -1.0])
    return num, den


def test_two_ways_agree_on_the_stability_of_random_loops():
    rng = np.random.default_rng(5)
    seen = []
    for _ in range(80):
        num, den = plants(rng)
        L = 10 ** rng.uniform(-1, 1)
        P, Q = delayed.loop(
            num,
            den,
            10 ** rng.uniform(-2, 1) * rng.choice([1, 1, 1, -1]),
            rng.choice([np.inf, 10 ** rng.uniform(-1, 1.5)]),
            rng.choice([0, 10 ** rng.uniform(-1, 0)]),
            rng.choice([0, 10 ** rng.uniform(-2, 0)]),
            rng.choice(["d1", "y2"]),
        )
        stable = delayed.stable(P, Q, L)
        if delayed.neutral_ratio(P, Q) >= 1:
            assert not stable
            continue
        seen.append(stable)
        s = delayed.rightmost(P, Q, L)
        assert (s.real < 0) == stable, (P, Q, L, s)
    assert 0.15 < np.mean(seen) < 0.85


def test_the_rightmost_root_of_an_integrator_is_lamberts():
    """S + k e^(-Ls) = 0 has the root W(-kL)/L."""
    for k in (0.2, np.exp(-1) * 0.99, 1.0, 1.6, 9.0):
        L = 0.7
        s = delayed.rightmost([1.0, 0.0], [k / L], L)
        expected = special.lambertw(-k) / L
        assert s == approx(complex(expected.real, abs(expected.imag)), rel=1e-9)
        assert delayed.stable([1.0, 0.0], [k / L], L) == (k < np.pi / 2)


def test_all_roots_to_the_right_are_counted():
    """S + k e^(-s): one more pair for every pi/2 + 2 pi n that k passes."""
    for k, pairs in ((1.5, 0), (1.6, 1), (7.8, 1), (7.9, 2), (14.2, 3)):
        assert delayed.unstable_roots([1.0, 0.0], [k], 1.0) == 2 * pairs


@pytest.mark.parametrize("sign", [1, -1])
def test_gain_interval_of_known_loops(sign):
    # integrator with P: K Kp L < pi/2
    low, high = delayed.gain_interval([2.0 * sign], [1.0, 0.0], 0.3, 0.5 * sign)
    ends = sorted((0.0, sign * np.pi / 2 / 0.6))
    assert (low, high) == approx(ends, rel=1e-12)
    # IMC-PI on FOPDT cancels the pole: K Kp/T L < pi/2; source 001, (3.6-35)
    K, T, L = OP1.values()
    ends = sorted((0.0, sign * np.pi * T / (2 * K * L)))
    assert delayed.gain_interval([sign * K], [T, 1.0], L, sign * 0.1, T) == approx(ends, rel=1e-12)
    # P on FOPDT: -1 < K Kp < -1/cos(wL) with tan(wL) = -wT
    w = optimize.brentq(lambda w: np.tan(w * L) + w * T, 0.51 * np.pi / L, 0.99 * np.pi / L)
    ends = sorted((-sign / K, sign * np.hypot(1, w * T) / K))
    assert delayed.gain_interval([sign * K], [T, 1.0], L, sign * 0.1) == approx(ends, rel=1e-12)


def test_gain_interval_of_an_ideal_pid_ends_at_the_neutral_bound():
    """C G tends to Kp Td K/T at infinity, and that must stay below 1; Td = T here: K Kp < 1."""
    assert delayed.gain_interval([1.0], [2.0, 1.0], 0.5, 0.3, 4.0, 2.0)[1] == approx(1.0)


def test_gain_interval_of_an_unstable_plant_has_a_lower_border():
    low, high = delayed.gain_interval([1.0], [1.0, -1.0], 0.4, 1.5)
    w = optimize.brentq(lambda w: np.tan(w * 0.4) - w, 0.1, np.pi / 0.8 - 1e-6)
    assert (low, high) == approx((1.0, np.hypot(1, w)), rel=1e-12)


def test_at_the_border_a_root_lies_on_the_axis():
    rng = np.random.default_rng(6)
    counted = 0
    while counted < 15:
        num, den = plants(rng)
        L, Ti = 10 ** rng.uniform(-1, 1, 2)
        pid = dict(Ti=3 * Ti, Td=0.1 * Ti, Tf=0.02 * Ti, filter="y2")
        Kp = 10 ** rng.uniform(-2, 0)
        found = delayed.gain_interval(num, den, L, Kp, **pid)
        if found is None:
            continue
        counted += 1
        for end in found:
            if 0 < end < np.inf:
                s = delayed.rightmost(*delayed.loop(num, den, end, **pid), L)
                assert abs(s.real) < 1e-7 * (abs(s) + 1 / L)


def test_the_next_delay_is_the_delay_margin():
    K, T, L = OP1.values()
    Kp, Ti = loop.imc_pi(K, T, L, (6 / np.pi - 1) * L)
    P, Q = delayed.loop([K], [T, 1.0], Kp, Ti)
    assert delayed.next_delay(P, Q, L) - L == approx(loop.margins(K, T, L, Kp, Ti).delay)


# -- peaks and margins of rational loops -----------------------------------------------


@pytest.mark.parametrize("zeta", [1e-6, 1e-3, 0.1, 0.7])
def test_the_peak_of_a_resonance_is_the_closed_form(zeta):
    value, w = peaks.peak([9.0], [1.0, 6 * zeta, 9.0])
    assert value == approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=1e-14)
    assert w == approx(3 * np.sqrt(1 - 2 * zeta**2), rel=1e-14)


def test_peaks_at_the_ends_of_the_axis():
    assert peaks.peak([1.0], [1.0, 1.0]) == (1.0, 0.0)
    assert peaks.peak([2.0, 1.0], [1.0, 1.0]) == (2.0, np.inf)
    assert peaks.peak([1.0], [1.0, 0.0]) == (np.inf, 0.0)
    assert peaks.peak([1.0, 0.0], [1.0, 0.5], dt=0.1) == approx((2.0, np.pi / 0.1))
    assert peaks.peak([0.5, 0.0], [1.0, -0.5], dt=0.1) == approx((1.0, 0.0))


def test_a_double_integrator_has_the_known_margins():
    # CG = (s + 1)/s^2: |CG| = 1 at w^2 = (1 + sqrt 5)/2, phase margin atan w, no gain margin
    m = peaks.margins([1.0, 1.0], [1.0, 0.0, 0.0])
    w = np.sqrt((1 + np.sqrt(5)) / 2)
    assert (m.w_phase, m.phase_deg) == approx((w, np.degrees(np.arctan(w))), rel=1e-14)
    assert m.gain == np.inf and m.delay == approx(np.arctan(w) / w)
    # 1/(s + 1)^3: gain margin 8 at sqrt 3
    m = peaks.margins([1.0], [1.0, 3.0, 3.0, 1.0])
    assert (m.gain, m.w_gain) == approx((8, np.sqrt(3)), rel=1e-14)


def test_sampled_margins_are_the_closed_form():
    # CG = k/(z - 1): on the circle -k/2 - ..., Re = -k/2 everywhere, -1 at pi with factor 2/k
    m = peaks.margins([0.5], [1.0, -1.0], dt=0.1)
    assert (m.gain, m.w_gain) == approx((4, np.pi / 0.1))
    theta = 2 * np.arcsin(0.25)  # |e^jx - 1| = 2 sin(x/2)
    assert (m.w_phase, np.radians(m.phase_deg)) == approx((theta / 0.1, np.pi / 2 - theta / 2))
    assert m.delay == approx((np.pi / 2 - theta / 2) / (theta / 0.1))


@pytest.mark.parametrize("dt", [None, 0.01])
def test_no_point_near_a_pole_is_higher_than_the_peak(dt):
    counted = 0
    for seed in range(3):
        case = peaks.random_loop(seed)
        if dt:
            case = peaks.sampled(*case, dt)
            if not peaks.stable(*case, dt):
                continue
        counted += 1
        for num, den in peaks.closed(*case).values():
            value, at = peaks.peak(num, den, dt)
            if at < np.inf:
                assert peaks.modulus(num, den, at, dt) == approx(value, rel=1e-9)
            poles = np.roots(np.array(den, float)).astype(complex)
            w = np.abs(np.imag(poles if dt is None else np.log(poles) / dt))
            near = np.outer(
                w[w > 0], 1 + np.append(-np.logspace(-9, -1, 9), np.logspace(-9, -1, 9))
            )
            near = np.append(near.ravel(), np.logspace(-2, np.log10(np.pi / (dt or 0.001)), 50))
            for x in near[near <= np.pi / (dt or 0.001)]:
                assert peaks.modulus(num, den, x, dt) <= value * (1 + 1e-12)
    assert counted > 1


@pytest.mark.parametrize("dt, tol", [(None, 1e-8), (0.05, 1e-5)])
def test_margins_and_ms_agree_with_python_control(dt, tol):
    """Sampled, its floats lose half the digits and sometimes a crossing: those are left out."""
    counted = 0
    for seed in range(16):
        case = peaks.random_loop(seed, zeta=(0.05, 0.7), modes=1)
        if dt:
            case = peaks.sampled(*case, dt)
            if not peaks.stable(*case, dt):
                continue
        num, den = peaks.open_loop(*case)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of its own accuracy
            ref = peaks.with_control(np.array(num, float), np.array(den, float), dt)
        m = peaks.margins(num, den, dt)
        counted += 1
        assert peaks.sensitivities(*case, dt).Ms == approx(ref.Ms, rel=tol)
        if ref.w_phase > 0 and abs(peaks.modulus(num, den, ref.w_phase, dt) - 1) < tol:
            assert abs(m.phase_deg) == approx(abs(ref.phase_deg), rel=tol)
        if ref.gain > 1 and np.isfinite(ref.gain):
            assert m.gain == approx(ref.gain, rel=tol)
    assert counted > 8


# -- internal model control ------------------------------------------------------------


def test_imc_pid_has_the_printed_constants():
    assert imc.w_gain_pid() == approx(2.458714, abs=5e-7)  # ERRATA 3.3
    assert imc.T_F_pid(1.0, gain_margin=3) == approx(1.433589, abs=5e-7)
    assert imc.T_F_pid(1.0, phase_margin=np.pi / 3) == approx(0.637557, abs=5e-7)
    gain, w, phase, _ = imc.margins_pid(0.3, imc.T_F_pid(0.3, gain_margin=3))
    assert (gain, w * 0.3) == approx((3, 2.458714), abs=5e-7)
    assert np.degrees(phase) == approx(74.3, abs=0.05)


@pytest.mark.parametrize("ratio", [0.3, 0.6376, 1.4336, 5.0])
def test_imc_margins_are_those_of_the_loop(ratio):
    K, T, L = OP1.values()
    for margins, settings in (
        (imc.margins_pi, imc.pi(K, T, L, ratio * L)),
        (imc.margins_pid, imc.pid(K, T, L, ratio * L)),
    ):
        gain, w_gain, phase, w_phase = margins(L, ratio * L)
        m = loop.margins(K, T, L, *settings)
        assert (m.gain, m.w_gain) == approx((gain, w_gain), rel=1e-10)
        assert (np.radians(m.phase_deg), m.w_phase) == approx((phase, w_phase), rel=1e-9)


def test_imc_pi_gives_back_the_margin_asked_for():
    assert imc.T_F_pi(1.0, gain_margin=3) == approx(6 / np.pi - 1)  # (3.6-45)
    assert imc.T_F_pi(1.0, phase_margin=np.pi / 3) == approx(6 / np.pi - 1)
    assert imc.margins_pi(0.2, imc.T_F_pi(0.2, gain_margin=4.5))[0] == approx(4.5)
    assert imc.margins_pid(0.2, imc.T_F_pid(0.2, phase_margin=1.2))[2] == approx(1.2)


@pytest.mark.parametrize("delay, settings", [("taylor", imc.pi), ("pade", imc.pid)])
def test_imc_of_the_approximate_plants_is_pi_and_pid(delay, settings):
    K, T, L, T_F = -2.0, 3.0, 0.7, 0.9
    nC, dC = imc.controller_polynomials(*rational.plant(K, T, L, delay), T_F)
    s = 0.4 + 1.3j
    Kp, Ti, Td = (*settings(K, T, L, T_F), 0.0)[:3]
    assert np.polyval(nC, s) / np.polyval(dC, s) == approx(Kp * (1 + 1 / (Ti * s) + Td * s))


@pytest.mark.parametrize("allpass", [False, True])
def test_imc_of_a_plant_with_inverse_response_and_delay(allpass):
    num, den, L = [-2.0, 1.0, 6.0], [1.0, 4.0, 5.0, 2.0], 0.4  # a zero at 2, one at -1.5
    T_F, gamma, s = 0.5, 3, 0.2 + 0.9j
    G = np.polyval(num, s) / np.polyval(den, s) * np.exp(-L * s)
    (nm, dm), (plus, mirror, _) = imc.split(num, den, L, allpass)
    G_plus = np.polyval(plus, s) / np.polyval(mirror, s) * np.exp(-L * s)
    assert np.polyval(nm, s) / np.polyval(dm, s) * G_plus == approx(G)
    F = 1 / (T_F * s + 1) ** gamma
    if allpass:
        assert abs(np.polyval(plus, 3j) / np.polyval(mirror, 3j)) == approx(1)
    C = imc.controller(num, den, L, T_F=T_F, gamma=gamma, allpass=allpass)(s)
    assert C * G / (1 + C * G) == approx(F * G_plus)  # (3.6-13)
    C_imc = C / (1 + C * G)
    assert imc.responses(C_imc, G, G)["Y/R"] == approx(F * G_plus)
    # a wrong model: the classical loop with C = C_IMC/(1 - C_IMC G*), (3.6-14)
    found, wrong = imc.responses(C_imc, 1.3 * G, G), 1.3 * G
    assert found["Y/R"] == approx(C * wrong / (1 + C * wrong))
    assert found["U/R"] == approx(C / (1 + C * wrong))
    assert found["E/R"] == approx((1 - C_imc * G) / (1 + C_imc * 0.3 * G))


def test_costs_with_dead_time_compensation():
    assert imc.costs(0.1, (6 / np.pi - 1) * 0.1) == approx(imc.costs_gain_margin_3(0.1))
    assert imc.costs_gain_margin_3(1.0)[2] == approx(2.2377, abs=5e-5)  # ERRATA 3.1
    t = np.linspace(0, 40, 400_001)
    e = np.where(t < 1, 1.0, np.exp(-np.maximum(t - 1, 0) / 0.9))
    assert imc.costs_sampled(e, 1e-4) == approx(imc.costs(1.0, 0.9), rel=2e-4)


def test_costs_of_pi_with_the_exact_delay():
    c = imc.pi_delay_costs(3.0)
    assert (c.ise, c.iae, c.itae) == approx((1.6539867, 2.1378556, 2.8556538), abs=5e-8)
    assert (c.overshoot, c.settling) == approx((5.643415, 6.03673), abs=5e-6)
    assert c.ise == approx(imc.pi_delay_ise(3.0), rel=1e-14)
    assert imc.pi_delay_costs(2.0, t_end=40).ise == approx(imc.pi_delay_ise(2.0), rel=1e-9)
    k = np.pi / 6
    assert float(imc.pi_delay_error(k, 2.5)) == approx(1 - k * 1.5 + (0.5 * k) ** 2 / 2)


# -- sampled loop ----------------------------------------------------------------------


@pytest.mark.parametrize("L", [0.0, 0.1, 0.107, 0.033])
def test_sampled_pi_equals_the_superposition_of_steps(L):
    K, T, Ts, N = 5.939, 0.1491, 0.02, 120
    rng = np.random.default_rng(7)
    d, noise = 0.1 * rng.normal(size=N), 0.2 * rng.normal(size=N)
    run = sl.run(sl.Plant([K], [T, 1.0], L, Ts), Pid(0.09, 0.15), Ts, np.ones(N), d=d, noise=noise)
    ref = loop.sampled_pi(K, T, L, 0.09, 0.15, Ts, np.ones(N), d, noise)
    assert run.y == approx(ref.y, abs=1e-11) and run.u == approx(ref.u, abs=1e-11)
    t = rng.uniform(0, N * Ts, 60)
    assert run.at(t) == approx(ref.at(t), abs=1e-11)
    assert run.at(run.t) == approx(run.y, abs=1e-12)


@pytest.mark.parametrize(
    "num, den", [([1.0, 2.0], [1.0, 0.3, 4.0]), ([-0.5, 1.0], [1.0, 1.0, 0.0])]
)
def test_the_plant_equals_a_finely_sampled_one(num, den):
    Ts, L, fine = 0.1, 0.237, 100  # the delay is 237 fine samples
    u = np.repeat(np.random.default_rng(8).normal(size=12), 5)
    plant, y = sl.Plant(num, den, L, Ts), []
    for v in u:
        y.append(plant.output())
        plant.advance(v)
    A, B, C, D = signal.tf2ss(num, den)
    system = (*signal.cont2discrete((A, B, C, D), Ts / fine)[:4], Ts / fine)
    delayed_u = np.concatenate([np.zeros(237), np.repeat(u, fine)])[: fine * len(u)]
    assert y == approx(signal.dlsim(system, delayed_u)[1].ravel()[::fine], abs=1e-10)


@pytest.mark.parametrize("filter", ["d1", "y2"])
def test_sampled_pid_is_its_transfer_functions(filter):
    """P = b z^-4/(1 - a z^-1); y = P (F_r r - F_y y), polynomials in q^-1."""
    K, T, L, Ts, N = 2.0, 0.8, 0.3, 0.1, 80
    p = Pid(0.4, 0.9, 0.2, 0.07, b=0.7, c=0.3, filter=filter)
    run = sl.run(sl.Plant([K], [T, 1.0], L, Ts), p, Ts, np.ones(N))
    a, t, s = np.exp(-Ts / T), p.Tf, np.array([1.0, -1.0]) / Ts  # q^0 first
    one = np.array([1.0])

    def add(*terms):
        out = np.zeros(max(map(len, terms)))
        for term in terms:
            out[: len(term)] += term
        return out

    if filter == "d1":
        lag = add(one, t * s)
        den = np.convolve(s, lag)  # of Kp + Ki/s + Kd s/(Tf s + 1)
        parts = [np.convolve(s, lag), lag, np.convolve(s, s)]
        filt = one
    else:
        den, filt = s, add(one, t * s, t**2 / 2 * np.convolve(s, s))
        parts = [s, one, np.convolve(s, s)]
    r_num = add(p.b * p.Kp * parts[0], p.Ki * parts[1], p.c * p.Kd * parts[2])
    y_num = add(p.Kp * parts[0], p.Ki * parts[1], p.Kd * parts[2])
    nP, dP = np.array([0, 0, 0, 0, K * (1 - a)]), np.array([1, -a])
    # y = nP (r_num filt r - y_num y)/(dP den filt)
    num = np.convolve(np.convolve(nP, r_num), filt)
    char = add(np.convolve(np.convolve(dP, den), filt), np.convolve(nP, y_num))
    assert run.y == approx(signal.lfilter(num, char, np.ones(N)), abs=1e-11)


def test_anti_windup_holds_the_integral_as_written():
    plant = dict(num=[1.0], den=[10.0, 1.0], L=0.5, Ts=0.5)
    r = np.where(np.arange(120) < 60, 1.0, 0.3)
    runs = {
        name: sl.run(
            sl.Plant(**plant), Pid(5.0, 3.0), 0.5, r, low=-0.2, high=1.1, antiwindup=name, Tt=2.0
        )
        for name in ("clamp", "back", None)
    }
    for run in runs.values():
        assert run.u.min() >= -0.2 and run.u.max() <= 1.1 and run.u.max() == approx(1.1)
    held = runs["clamp"]
    out = (held.v > 1.1) & (r > held.y)
    assert out[1:].any() and np.all(np.diff(held.I)[out[1:]] == 0)
    back = runs["back"]
    step = np.diff(back.I) - 5 / 3 * 0.5 * (r - back.y)[1:]
    assert step == approx(0.5 / 2 * (back.u - back.v)[1:], abs=1e-12)
    over = {name: run.y.max() for name, run in runs.items()}
    assert over["clamp"] < over[None] and over["back"] < over[None]
    # the reversed plant is the mirror image
    turned = sl.run(
        sl.Plant([-1.0], [10.0, 1.0], 0.5, 0.5), Pid(-5.0, 3.0), 0.5, r, low=-1.1, high=0.2
    )
    assert turned.u == approx(-held.u, abs=1e-12)


def test_rate_and_quanta_and_dead_band():
    plant = sl.Plant([1.0], [2.0, 1.0], 0.0, 0.1)
    run = sl.run(
        plant,
        Pid(3.0, 1.0),
        0.1,
        np.ones(80),
        rate=2.0,
        quantum_u=0.05,
        quantum_y=0.01,
        dead_band=0.12,
    )
    assert np.abs(np.diff(run.ym / 0.01 - np.round(run.ym / 0.01))).max() < 1e-9
    assert np.abs(run.u / 0.05 - np.round(run.u / 0.05)).max() < 1e-9
    assert np.abs(np.diff(run.u)).max() <= 0.2 + 0.05 + 1e-12
    before = np.append(0.0, run.position[:-1])
    moved = run.position != before
    assert np.all(np.abs(run.u - before)[moved] > 0.12)
    assert np.all(np.abs(run.u - before)[~moved] <= 0.12 + 1e-12)
    assert np.all(run.position[moved] == run.u[moved])
    assert 0 < moved.sum() < 79


def test_leaving_manual_and_new_settings_do_not_bump():
    Ts, N = 0.1, 60
    manual = np.where(np.arange(N) < 30, 0.8, np.nan)
    run = sl.run(
        sl.Plant([1.0], [0.05, 1.0], 0.0, Ts),
        Pid(2.0, 1.5, 0.3, 0.1),
        Ts,
        np.ones(N),
        manual=manual,
    )
    # at rest at y = 0.8: only the integral of e = 0.2 moves u
    assert run.y[29] == approx(0.8, abs=1e-12)
    assert run.u[30] - 0.8 == approx(2 / 1.5 * Ts * 0.2)
    settings = [Pid(2.0, 1.5)] * 20 + [Pid(0.4, 0.9, 0.2, 0.1)] * 20
    plant = sl.Varying(0.0, 1.0, 0, 0.0, Ts, 40)  # e stays 1
    run = sl.run(plant, settings, Ts, np.ones(40))
    assert run.u[20] - run.u[19] == approx(0.4 / 0.9 * Ts)


def test_a_schedule_of_pi_is_the_velocity_form():
    """Source 001, (3.7-25) as corrected: u += (Kp + Ki Ts) e(k) - Kp e(k-1)."""
    Ts, N = 0.02, 200
    axes = [np.array([0.0, 1.0, 3.0])]
    signals = np.linspace(-1, 4, N)[:, None]
    tables = {"Kp": np.array([0.05, 0.1, 0.02]), "Ti": np.array([0.1, 0.2, 0.4])}
    settings = sl.scheduled(Pid(1.0, 1.0), axes, tables, signals)
    assert (settings[0].Kp, settings[-1].Ti) == (0.05, 0.4)  # held beyond the edges
    r = np.sign(np.sin(np.arange(N) / 15))
    run = sl.run(sl.Plant([5.0], [0.15, 1.0], 0.1, Ts), settings, Ts, r)
    e = np.append(0.0, r - run.y)
    Kp, Ki = (np.array([getattr(p, n) for p in settings]) for n in ("Kp", "Ki"))
    assert run.u == approx(np.cumsum((Kp + Ki * Ts) * e[1:] - Kp * e[:-1]), abs=1e-11)


def test_lookup_is_multilinear_and_held_at_the_edges():
    rng = np.random.default_rng(9)
    axes = [np.sort(rng.uniform(0, 10, n)) for n in (4, 2, 5)]
    table = rng.normal(size=(4, 2, 5))
    ref = interpolate.RegularGridInterpolator(axes, table)
    for point in rng.uniform(-2, 12, (50, 3)):
        inside = [np.clip(x, a[0], a[-1]) for a, x in zip(axes, point, strict=True)]
        assert sl.lookup(axes, table, point) == approx(ref(inside)[0], abs=1e-12)
    for i, x in enumerate(axes[0]):
        assert sl.lookup(axes[:1], table[:, 0, 0], x) == approx(table[i, 0, 0])
    assert sl.lookup([[2.0]], [7.0], 5.0) == 7.0


def test_a_constant_varying_plant_is_the_sampled_one():
    K, T, Ts, N = -5.939, 0.1491, 0.02, 100
    pid = Pid(-0.018, 0.018 / 0.3385)
    fixed = sl.run(sl.Plant([K], [T, 1.0], 5 * Ts, Ts, offset=3.0), pid, Ts, np.full(N, 5.0))
    varying = sl.run(sl.Varying(K, T, 5, 3.0, Ts, N), pid, Ts, np.full(N, 5.0))
    assert varying.y == approx(fixed.y, abs=1e-11)
    # K doubles from sample 50 on: the next input counts twice, the past does not jump
    gains = np.where(np.arange(N) < 50, K, 2 * K)
    varying = sl.run(sl.Varying(gains, T, 5, 3.0, Ts, N), pid, Ts, np.full(N, 5.0))
    a = np.exp(-Ts / T)
    y, u = varying.y - 3.0, varying.u
    assert y[:50] == approx(fixed.y[:50] - 3.0, abs=1e-11)
    assert y[50] == approx(a * y[49] + 2 * K * (1 - a) * u[44])


def test_a_loop_at_rest_stays_at_rest():
    for filter in ("d1", "y2"):
        plant = sl.Plant([2.0], [1.0, 1.0], 0.25, 0.1, offset=10.0, before=3.0)
        pid = Pid(0.3, 1.0, 0.2, 0.1, b=0.5, c=1.0, filter=filter)
        run = sl.run(plant, pid, 0.1, np.full(30, 16.0), r_before=16.0, u_before=3.0)
        assert run.y == approx(16.0, abs=1e-12) and run.u == approx(3.0, abs=1e-12)


# -- relay -----------------------------------------------------------------------------

RELAYS = [
    dict(K=2.0, T=1.5, L=0.4, d1=1.0, d2=0.6, h=0.1),
    dict(K=-5.939, T=0.1491, L=0.1, d1=0.3, d2=0.5, h=0.2),
    dict(K=1.0, T=1.0, L=5.0, d1=1.0, d2=0.4, h=0.0),
    dict(K=1.0, T=50.0, L=1.0, d1=2.0, d2=1.0, h=0.01),
]


@pytest.mark.parametrize("case", RELAYS)
def test_the_relay_settles_to_the_closed_form(case):
    t_on, t_off = relay.times(**case)
    run = relay.Experiment(**case, t_end=60 * (t_on + t_off), bias=3.0, y_ref=7.0)
    on, off = run.cycles()
    assert (on[-1], off[-1]) == approx((t_on, t_off), rel=1e-6)  # slowest plant: not yet settled
    assert min(t_on, t_off) > case["L"]
    # one whole period late in the run: mean and extremes
    start = [t for t, level in run.switches if level > 0][-3]
    t = np.linspace(start, start + t_on + t_off, 4001)
    y = run.y(t) - 7.0
    mean = np.sum((y[1:] + y[:-1]) / 2) / 4000
    assert mean == approx(relay.mean(**case), rel=1e-4, abs=1e-5)
    assert relay.gain(t_on, t_off, relay.mean(**case), case["d1"], case["d2"]) == approx(case["K"])
    assert (y.min(), y.max()) == approx(relay.extremes(**case), rel=1e-3)


@pytest.mark.parametrize("case", RELAYS)
def test_the_times_of_a_cycle_give_back_the_plant(case):
    levels = {k: case[k] for k in ("d1", "d2", "h")}
    T, L = relay.invert(*relay.times(**case), case["K"], **levels)
    assert (T, L) == approx((case["T"], case["L"]), rel=1e-7)


def test_the_relay_record_is_the_plants_response():
    case = RELAYS[0]
    run = relay.Experiment(**case, t_end=20.0, bias=3.0, y_ref=7.0)
    rec = run.record(0.01)
    # superposition of the mean inputs of each sample, first order in the sample's length
    y = 7.0 + fopdt.simulate(rec.share - 3.0, 2.0, 1.5, 0.4, 0.01)
    assert rec.y == approx(y, abs=2 * 1.6 * 0.01 / 1.5 / 4)
    assert set(np.round(rec.u, 12)) == {4.0, 2.4}


def test_a_sampled_relay_tends_to_the_continuous_one():
    case = RELAYS[0]
    rec = relay.sampled(**case, Ts=0.002, N=20_000, bias=3.0, y_ref=7.0)
    moves = rec.t[1:][np.diff(rec.u) != 0]
    gaps = np.diff(moves)[-8:]
    assert sorted(gaps)[:4] == approx(4 * [min(relay.times(**case))], abs=0.005)
    assert sorted(gaps)[4:] == approx(4 * [max(relay.times(**case))], abs=0.005)
    assert rec.y == approx(7 + fopdt.simulate(rec.u - 3, 2.0, 1.5, 0.4, 0.002), abs=1e-9)


# -- loop shaping and rules ------------------------------------------------------------


def test_loop_shaping_gives_the_published_pi():
    def G(s):
        return 1 / (s + 1) ** 3

    Kp, Ki = shaping.pi(G, 0.5205, np.radians(60.0))
    assert Kp == approx(1.14, abs=5e-3) and Ki == approx(0.454, abs=5e-4)
    Kp, Ki = shaping.pi(G, 1.0, np.radians(43.997))
    assert (Kp, Ki) == approx((2.83, 0.0495), abs=5e-3) and Ki == approx(0.0495, abs=5e-5)
    assert shaping.pi(G, 1.0, np.radians(60.0)) is None
    assert np.degrees(shaping.pi_phase_margin_limit(G, 1.0)) == approx(45)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("phase", [35.0, 60.0, 75.0])
def test_shaped_loops_have_the_crossover_and_margin(sign, phase):
    def G(s):
        return sign * 2 * np.exp(-0.3 * s) / ((2 * s + 1) * (0.5 * s + 1))

    def y2(s):
        return 1 / (1 + 0.05 * s + (0.05 * s) ** 2 / 2)

    w, phi = 0.9, np.radians(phase)
    Kp, Ti, Td = shaping.pid(G, w, phi, 0.2, y2)
    assert Td == approx(0.2 * Ti) and np.sign(Kp) == sign
    s = 1j * w
    CG = Kp * (1 + 1 / (Ti * s) + Td * s) * y2(s) * G(s)
    assert abs(CG) == approx(1) and np.angle(-CG) == approx(phi)
    assert np.abs(shaping.pid_by_search(G, w, phi, 0.2, y2)) == approx(np.abs((Kp, Ti, Td)))
    found = shaping.pi(G, w, phi)
    assert (found is None) == (phi >= shaping.pi_phase_margin_limit(G, w, sign))
    if found:
        CG = (found[0] + found[1] / s) * G(s)
        assert abs(CG) == approx(1) and np.angle(-CG) == approx(phi)


def test_integrating_rules_are_limits_of_the_self_regulating_ones():
    K, L, T = 0.7, 1.3, 1e7
    assert shaping.amigo_pi(K * T, T, L) == approx(shaping.amigo_pi_integrating(K, L), rel=4e-3)
    assert shaping.amigo_pid(K * T, T, L) == approx(shaping.amigo_pid_integrating(K, L), rel=1e-5)
    Ku, Pu = shaping.ultimate_integrating(K, L)
    assert delayed.gain_interval([K], [1.0, 0.0], L, 0.1)[1] == approx(Ku)
    Kp, Ti = shaping.tyreus_luyben(Ku, Pu)
    assert (Kp * K * L, Ti / L) == approx((0.488, 8.8), abs=5e-4)


def test_lambda_on_an_integrator_puts_two_poles_at_lambda():
    K, L, lam = 0.7, 1.3, 2.0
    Kp, Ti = shaping.lambda_pi_integrating(K, L, lam)
    # s Ti s + K Kp (Ti s + 1)(1 - L s)
    den = np.polyadd([Ti, 0, 0], K * Kp * np.polymul([Ti, 1], [-L, 1]))
    assert den / den[-1] == approx([lam**2, 2 * lam, 1])


def test_simc_on_an_integrator_has_the_printed_margins():
    Kp, Ti = shaping.simc_integrating(1.0, 1.0, 1.0)
    assert (Kp, Ti) == (0.5, 8.0)
    w = optimize.brentq(lambda w: abs(Kp * (1 + 1 / (8j * w)) / w) - 1, 0.1, 2)
    phase = np.pi + np.angle(1 + 1 / (8j * w)) - np.pi / 2 - w
    assert np.degrees(phase) == approx(46.9, abs=0.05)  # Skogestad 2003, table 1
    gain = delayed.gain_interval([1.0], [1.0, 0.0], 1.0, Kp, Ti)[1] / Kp
    assert gain == approx(2.96, abs=5e-3)


def test_the_half_rule_gives_the_printed_models():
    """Skogestad 2003, an inverse response over seven lags, one zero at -1/0.08.

    There (0.08 s + 1)/(0.2 s + 1) is taken as 1/(0.12 s + 1) first.
    """
    T = [2, 1, 0.4, 0.12, 0.05, 0.05, 0.05]
    (T1,), L = shaping.half_rule(T, Tz_inverse=[0.3])
    assert (T1, L) == approx((2.5, 1.47))
    (T1, T2), L = shaping.half_rule(T, Tz_inverse=[0.3], order=2)
    assert (T1, T2, L) == approx((2.0, 1.2, 0.77))
    # E1: 1/((s + 1)(0.2 s + 1)) as first order, tau_c = L: Kp = 5.5, Ti = 0.8
    (T1,), L = shaping.half_rule([1.0, 0.2])
    assert (T1 / (2 * L), min(T1, 8 * L)) == approx((5.5, 0.8))


def test_second_order_simc_cancels_the_second_lag():
    K, T1, T2, L = 3.0, 5.0, 2.0, 1.0
    Kp, Ti, Td = shaping.simc_second(K, T1, T2, L, L)
    for s in (0.3j, 1.7j):
        series = T1 / (2 * K * L) * (1 + 1 / (5 * s)) * (1 + T2 * s)
        assert Kp * (1 + 1 / (Ti * s) + Td * s) == approx(series)
    # (T1, T2) may come in either order; a slow lag gets Ti = 8 L
    assert shaping.simc_second(K, T2, T1, L, L) == (Kp, Ti, Td)
    Kp, Ti, Td = shaping.simc_integrating_lag(1.0, 2.0, 1.0, 1.0)
    assert (Kp, Ti, Td) == approx((0.5 * 1.25, 10.0, 1.6))


# -- the best PI -----------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["load", "setpoint"])
@pytest.mark.parametrize("T, Kp, Ti", [(1.491, 0.72, 1.42), (0.2, 0.3, 0.4), (5.0, 3.5, 2.5)])
def test_iae_equals_the_other_method_of_steps(T, Kp, Ti, kind):
    r = 1.0 if kind == "setpoint" else 0.0
    run = loop.Continuous(1.0, T, 1.0, Kp, Ti, t_end=60, r=r, d=1 - r)
    ref = run.integral(lambda t: np.abs(r - run.y(t)), run._cuts(lambda t: r - run.y(t)))
    assert optimum.iae(T, Kp, Ti, kind, t_end=60)[0] == approx(ref, rel=1e-11)
    assert optimum.Ms(T, Kp, Ti) == approx(loop.margins(1.0, T, 1.0, Kp, Ti).Ms, rel=1e-9)


def test_iae_without_overshoot_is_the_integral_time_over_the_gain():
    assert optimum.iae(1.491, 0.2, 1.6)[0] == approx(8.0, rel=1e-7)
    # IMC-PI at gain margin 3
    k = np.pi / 6
    assert optimum.iae(3.0, 3 * k, 3.0, "setpoint", t_end=60)[0] == approx(2.1378556, abs=5e-8)


def test_an_unstable_loop_has_no_finite_ms():
    assert optimum.Ms(1.0, 4.0, 1.0) == np.inf and np.isfinite(optimum.Ms(1.0, 1.2, 1.0))


def test_the_engine_loop_has_the_known_optimum():
    """METHODS 3.1: Kc = .1213, Ki = .855, IAE 1.17 at Ms = 1.59."""
    row = optimum.row("load", 0.1 / 0.1491, 1.59)
    Kp, Ti, value = optimum.scaled(row, 5.939, 0.1491, 0.1)
    assert (Kp, Kp / Ti, value) == approx((0.1213, 0.855, 1.17), rel=3e-3)


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(
            r, marks=[] if r.M == 1.59 else pytest.mark.slow, id=f"{r.kind}-{r.ratio:.2g}-{r.M}"
        )
        for r in optimum.ROWS
    ],
)
def test_the_table_holds_optima(row):
    T = 1 / row.ratio

    def value(Kp, Ti):
        return optimum.iae(T, Kp, Ti, row.kind)[0]

    assert optimum.Ms(T, row.Kp, row.Ti) <= row.M * (1 + 1e-6)
    assert delayed.stable(*delayed.loop([1.0], [T, 1.0], row.Kp, row.Ti), 1.0)
    assert value(row.Kp, row.Ti) == approx(row.iae, rel=1e-6)
    for Ti in (0.97 * row.Ti, 1.03 * row.Ti):
        top = optimum.largest_gain(T, Ti, row.M)
        gains = top if row.active else min(row.Kp, top)
        assert value(gains, Ti) >= row.iae * (1 - 1e-6)
    lower = value(0.98 * row.Kp, row.Ti)
    assert lower >= row.iae * (1 - 1e-6)


@pytest.mark.slow
def test_the_search_returns_a_row():
    found, row = optimum.search(2.0, 1.59, n=12), optimum.row("load", 0.5, 1.59)
    assert found.iae == approx(row.iae, rel=1e-6)
    assert (found.Kp, found.Ti) == approx((row.Kp, row.Ti), rel=1e-3)
