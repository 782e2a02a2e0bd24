"""Source 001, 3.4.2 to 3.4.7: the loop with a rational dead time, against the printed forms."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import rational

CASES = [(K, T, L, Kp, Ti) for K in (2.0, -5.939) for T, L in ((5.0, 1.0), (0.15, 0.1), (1.0, 3.0))
         for Kp, Ti in ((0.4, 4.0), (0.9, 1.0))]  # fmt: skip


def loop_of(case, delay):
    """Return gains as the text has them, and our model and controller: D acts on the error."""
    K, T, L, part, shape = case
    Kp, Ti = part * (T + L) / (K * L), shape * (T + L)
    Td = 0.1 * (T + L) if delay == "pade" else 0.0
    gains = (K, T, L, Kp, Kp / Ti, Kp * Td)
    return gains, pt.models.ProcessModel(K, T, L), pt.models.PID(Kp, Ti, Td, b=1.0, c=1.0)


def same(ours, num, den):
    """Compare two transfer functions whatever their common factor."""
    scale = ours.den[0] / den[0]
    assert ours.den == approx(scale * den, rel=1e-12, abs=1e-14 * abs(scale * den).max())
    theirs = scale * np.trim_zeros(np.atleast_1d(num), "f")
    assert np.trim_zeros(ours.num, "f") == approx(theirs, rel=1e-10, abs=1e-13 * abs(theirs).max())


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_closed_loops_are_the_printed_ones(case, delay):
    """(3.4-9) to (3.4-17) as corrected, both forms."""
    gains, model, pid = loop_of(case, delay)
    ours = pt.tune.loop_transfers(model, pid, delay=delay)
    every = rational.closed_loop(*gains, delay=delay)
    first = rational.printed(*gains, delay=delay)
    second = rational.printed_ti(*gains[:4], pid.Ti, pid.Td, delay=delay)
    for name, G in (("Y/R", ours.y_r), ("U/R", ours.u_r), ("E/R", ours.e_r)):
        for num, den in (first[name], second[name], every[name]):
            same(G, num, den)
    for name, G in (("Y/P", ours.y_p), ("Y/D", ours.y_d), ("U/D", ours.u_d)):
        same(G, *every[name])


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_step_responses_are_the_partial_fractions(case, delay):
    """(3.4-31) to (3.4-45), the poles as corrected."""
    gains, model, pid = loop_of(case, delay)
    if not pt.tune.stability(model, pid, delay=delay):
        pytest.skip("an unstable response compares nothing")
    ours = pt.tune.loop_transfers(model, pid, delay=delay).y_r
    t = np.linspace(0.01, 12.0, 40) * (model.T + model.L)
    num, den = rational.printed(*gains, delay=delay)["Y/R"]
    q0, p, q = rational.partial_fractions(num, den)
    printed = q0 + np.sum(q * np.exp(-p * t[:, None]), axis=1).real
    assert q0 == approx(1.0)  # (3.4-35), (3.4-41)
    assert ours.step(t) == approx(printed, abs=1e-8)


def test_models_with_a_rational_dead_time_are_the_printed_ones():
    """(3.4-4) and (3.4-6), by the sensitivities of a loop of gain one."""
    model, w = pt.models.ProcessModel(2.0, 5.0, 1.0), np.array([0.1, 1.0, 4.0])
    for delay in ("taylor", "pade"):
        num, den = rational.plant(2.0, 5.0, 1.0, delay)
        ours = pt.tune.sensitivities(model, pt.models.PID(1.0), w, delay=delay).L
        assert ours == approx(np.polyval(num, 1j * w) / np.polyval(den, 1j * w), rel=1e-12)


@pytest.mark.parametrize("delay", ["taylor", "pade"])
def test_bounds_are_those_of_a_search_on_the_roots(delay):
    """The Routh-Hurwitz room of Kp, Ki and Kd, for either sign of K."""
    for case in CASES:
        gains, model, pid = loop_of(case, delay)
        found = pt.tune.stability(model, pid, delay=delay)
        known = rational.routh(*gains, delay=delay)
        assert found.stable == all(value > 0 for value in known.values())
        for name in ("Kp", "Ki", "Kd") if delay == "pade" else ("Kp", "Ki"):
            theirs = rational.interval(name, *gains, delay=delay)
            if not found.stable:
                assert theirs is None
                continue
            assert found.bounds[name] == approx(theirs, rel=1e-8, abs=1e-9 * abs(pid.Kp)), name
