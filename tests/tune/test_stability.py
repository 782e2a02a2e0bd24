"""Stability of a loop and the room of its settings, source 001, 3.4.6, and with the exact delay."""

from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import delayed


def characteristic(K, T, L, Kp, Ki, Kd, delay):
    """Return den_C den_G + num_C num_G of K/(Ts + 1) with (3.4-3) or (3.4-5) under an ideal PID."""
    above, below = ([-L, 1], [1]) if delay == "taylor" else ([-L / 2, 1], [L / 2, 1])
    den = np.polymul(np.polymul([T, 1], below), [1, 0])
    return np.polyadd(den, np.polymul([Kd, Kp, Ki], np.multiply(K, above)))


def random_loop(rng, delay):
    """Draw a loop about as often stable as not."""
    T, L = 10 ** rng.uniform(-2, 2, 2)
    K = 10 ** rng.uniform(-2, 2) * rng.choice([-1, 1])
    Kp = rng.uniform(-0.3, 2.2) * (T + L / 2) / (K * L)
    Ki = abs(Kp) * np.sign(K) / ((T + L) * 10 ** rng.uniform(-1, 1.3))
    Kd = rng.uniform(0, 1.1) * T / K if delay == "pade" and rng.random() < 0.5 else 0.0
    if Kp * K < 0:
        Kd, Ki = 0.0, -Ki if rng.random() < 0.5 else Ki
    return K, T, L, Kp, Ki, Kd


def conditions(K, T, L, Kp, Ki, Kd, delay):
    """Judge by (3.4-19), (3.4-20) and (3.4-24) to (3.4-27), as corrected, for either sign of K."""
    k, i, d = K * Kp, K * Ki, K * Kd  # the products: the inequalities flip with the sign of K
    if delay == "taylor":
        return T - k * L > 0 and i > 0 and k - i * L + 1 > 0
    a0, a1, a2, a3 = T * L - d * L, L + 2 * T + 2 * d - k * L, 2 + 2 * k - i * L, 2 * i
    return a0 > 0 and a1 > 0 and a2 > 0 and a3 > 0 and a1 * a2 > a3 * a0


@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_the_conditions_agree_with_the_roots(delay):
    """The inequalities of the source, the roots and ours; 20 000 in the core's tests/routh.rs."""
    rng = np.random.default_rng(20_000 + len(delay))
    stable = 0
    for _ in range(1000):
        case = random_loop(rng, delay)
        K, T, L, Kp, Ki, Kd = case
        roots = np.roots(characteristic(*case, delay))
        if abs(roots.real).min() < 1e-9 * abs(roots).max():
            continue  # on the edge within rounding
        expected = roots.real.max() < 0
        model = pt.models.ProcessModel(K, T, L)
        if Ki * Kp < 0:  # a PID whose integral works against it is none of ours
            assert conditions(*case, delay) == expected
            continue
        pid = pt.models.PID(Kp, Ti=Kp / Ki, Td=Kd / Kp)
        ours = pt.tune.stability(model, pid, delay=delay).stable
        assert ours == expected == conditions(*case, delay), case
        stable += ours
    assert 200 < stable < 800


def moved(pid, name, value):
    """Return the controller with one setting moved, the others held as the bounds hold them."""
    Kp, Ki, Kd = pid.Kp, pid.Ki, pid.Kd
    if name == "Kp":
        return replace(pid, Kp=value)
    Ki, Kd = (value, Kd) if name == "Ki" else (Ki, value)
    return pt.models.PID(Kp, Ti=Kp / Ki, Td=Kd / Kp, Tf=pid.Tf, Ts=pid.Ts)


LOOPS = {
    "PI": (pt.models.ProcessModel(2.0, 5.0, 1.0), pt.models.PID(1.0, Ti=5.0)),
    "negative gain": (pt.models.ProcessModel(-5.939, 0.1491, 0.1), pt.models.PID(-0.13, Ti=0.15)),
    "filtered PID": (
        pt.models.ProcessModel(1.0, (4.0, 1.0), 2.0),
        pt.models.PID(1.2, Ti=5.0, Td=1.0, Tf=0.2),
    ),
    "integrating": (
        pt.models.ProcessModel(0.1, (), 2.0, integrating=True),
        pt.models.PID(2.0, Ti=20.0),
    ),
    "sampled": (pt.models.ProcessModel(2.0, 5.0, 1.3), pt.models.PID(1.0, Ti=5.0, Ts=0.5)),
    "polynomial": (
        pt.models.PolyModel(A=[1, -1.5, 0.7], B=[0.1, 0.05], nk=2, Ts=0.2),
        pt.models.PID(0.8, Ti=1.0, Ts=0.2),
    ),
}


@pytest.mark.parametrize("delay", ["exact", "pade", "taylor"])
@pytest.mark.parametrize("loop", LOOPS)
def test_at_the_bounds_stability_ends(loop, delay):
    model, pid = LOOPS[loop]
    if delay != "exact" and pid.Ts:
        pytest.skip("a sampled loop has no approximation")
    found = pt.tune.stability(model, pid, delay=delay)
    for name, (low, high) in found.bounds.items():
        if name == "Ti" or np.isnan(low):
            continue
        now = {"Kp": pid.Kp, "Ki": pid.Ki, "Kd": pid.Kd}[name]
        assert not found.stable or low <= now <= high  # an ideal D on (3.4-3) has no room at all
        for edge, inward in ((low, 1), (high, -1)):
            if np.isinf(edge) or (name == "Kd" and pid.Ki == 0):
                continue
            step = 1e-5 * (abs(edge) or abs(now) or abs(high))
            for where, expected in ((edge + inward * step, True), (edge - inward * step, False)):
                if where * pid.Kp <= 0 and name != "Kp":
                    continue  # no PID of ours: gains of one sign
                ours = pt.tune.stability(model, moved(pid, name, where), delay=delay).stable
                assert ours == expected, (name, where)


def test_bounds_are_those_of_the_source():
    """(3.4-21), (3.4-22) by Taylor, (3.4-28) to (3.4-30) by Padé, K < 0 as well."""
    for sign in (1, -1):
        K, T, L, Kp, Ti = sign * 2.0, 5.0, 1.0, sign * 1.0, 5.0
        model, pid = pt.models.ProcessModel(K, T, L), pt.models.PID(Kp, Ti)
        taylor = pt.tune.stability(model, pid, delay="taylor").bounds
        Ki = [0.0, (K * Kp + 1) / (K * L)]
        assert sorted(taylor["Kp"], key=abs) == approx([0.0, T / (K * L)])
        assert sorted(taylor["Ki"], key=abs) == approx(Ki)
        assert taylor["Ti"][0] == approx(K * Kp * L / (K * Kp + 1))
        pade = pt.tune.stability(model, pid, delay="pade").bounds
        # Necessary conditions: the bound of a1 a2 > a3 lies within them.
        assert 0 < abs(pade["Ki"][1 if sign > 0 else 0]) < abs(2 * (1 + K * Kp) / (K * L))
        assert sorted(pade["Kd"], key=abs)[1] == approx(T / K)
        proportional = pt.models.PID(Kp)
        alone = pt.tune.stability(model, proportional, delay="pade").bounds["Kp"]
        assert sorted(alone) == approx(sorted([-1 / K, (L + 2 * T) / (K * L)]))


def test_a_delayed_integrator_is_stable_up_to_a_quarter_turn():
    """k e^(-L s)/s up to k L = pi/2: IMC-PI's loop, (3.6-31)."""
    bounds = pt.tune.stability(*LOOPS["PI"]).bounds
    assert bounds["Kp"] == approx((0.0, np.pi / 2 * 5.0 / 2.0))


def test_an_unstable_loop_is_told_where_it_would_be_stable():
    model, _ = LOOPS["PI"]
    found = pt.tune.stability(model, pt.models.PID(9.0, Ti=5.0))
    assert not found.stable and not found
    assert found.bounds["Kp"] == approx((0.0, np.pi / 2 * 5.0 / 2.0))
    wrong_sign = pt.tune.stability(model, pt.models.PID(-1.0, Ti=5.0))
    assert not wrong_sign and wrong_sign.bounds["Kp"][0] == approx(0.0)


@pytest.mark.parametrize("seed", range(200))
def test_a_dead_time_is_judged_as_by_its_characteristic_roots(seed):
    """Rational plants times e^(-Ls), PI and filtered PID, and the room of Kp."""
    rng = np.random.default_rng(seed)
    kind = ("lags", "integrating", "inverse")[seed % 3]
    T = tuple(10 ** rng.uniform(-1, 1, rng.integers(1, 4)))
    L, K = 10 ** rng.uniform(-1.5, 1), rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1)
    Tz = -rng.uniform(0.1, 2) if kind == "inverse" and len(T) > 1 else 0.0
    model = pt.models.ProcessModel(K, T, L, Tz=Tz, integrating=kind == "integrating")
    Kp, Ti = rng.uniform(0.1, 3) / K, (sum(T) + L) * 10 ** rng.uniform(-0.7, 1)
    Td = rng.choice([0.0, 0.2]) * Ti
    pid = pt.models.PID(Kp, Ti, Td, Tf=0.1 * Td)
    G = model.transfer()
    loop = delayed.loop(G.num, G.den, Kp, Ti, Td, 0.1 * Td)
    ours = pt.tune.stability(model, pid)
    assert ours.stable == delayed.stable(*loop, L)
    if ours.stable:
        low, high = delayed.gain_interval(G.num, G.den, L, Kp, Ti, Td, 0.1 * Td)
        assert ours.bounds["Kp"] == approx((low, high), rel=1e-6, abs=1e-6 * abs(Kp))


@pytest.mark.parametrize("seed", range(40))
def test_the_exact_bound_is_where_the_simulation_begins_to_grow(seed):
    rng = np.random.default_rng(seed)
    T, L, K = *10 ** rng.uniform(-1, 1, 2), rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1)
    pid = pt.models.PID(0.1 / K, Ti=(T + L) * rng.uniform(0.5, 3))
    model = pt.models.ProcessModel(K, T, L)
    edge = max(pt.tune.stability(model, pid).bounds["Kp"], key=abs)
    for share, stable in ((0.93, True), (1.07, False)):
        loop = replace(pid, Kp=share * edge)
        y = pt.simulate.step(model, loop, t_end=150 * max(L, T / (1 + abs(share * edge * K)))).y
        swing = [np.ptp(part) for part in np.array_split(y, 6)]
        assert (swing[-1] < swing[-2]) == stable, (share, swing)
        assert bool(pt.tune.stability(model, loop)) == stable


def test_what_makes_no_sense_is_refused():
    model, pid = LOOPS["sampled"]
    for wrong in (
        lambda: pt.tune.stability(model, pid, delay="pade"),
        lambda: pt.tune.stability(model, pid, delay="smith"),
        lambda: pt.tune.loop_transfers(model, pid),
    ):
        with pytest.raises(pt.UsageError) as caught:
            wrong()
        assert caught.value.code == "U01"
