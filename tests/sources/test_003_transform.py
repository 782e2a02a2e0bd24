"""Source 003: the numbers that it prints, and those of its misprints that can be counted."""

import re
from pathlib import Path

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import idt as oracle

PAGE = Path(__file__).resolve().parents[2] / "docs" / "sources" / "003.md"
T_16 = (1.25, 3.25, 5.5)
NUM_18, DEN_18 = [20.0], [0.01, 0.04, 1.0]


def left(y, poles, dt, gain=1.0):
    """Return the sum of squares of (15) under an operator, over every row with its history."""
    x = pt.recursive.InverseTransform(poles, dt, gain=gain).run(y)
    return float(np.sum((1 - x[len(poles) :]) ** 2))


def pair(beta, Omega):
    return [-beta + 1j * Omega, -beta - 1j * Omega]


def starting_on_its_step(num, den, dt, n):
    y = oracle.step_response(num, den, dt * np.arange(n))
    return pt.Record(u=np.ones(n), y=y, Ts=dt)


def test_first_and_second_order_are_written_out_as_5_and_6():
    dt, y = 0.1, np.random.default_rng(0).normal(size=50)
    e = np.exp(-dt / 2.0)
    x = pt.recursive.InverseTransform([-0.5], dt).run(y)
    assert x[1:] == approx((y[1:] - e * y[:-1]) / (1 - e), rel=1e-12, abs=1e-12)
    assert x[1:] == approx(oracle.first(y, 2.0, dt), rel=1e-12, abs=1e-12)
    x = pt.recursive.InverseTransform(pair(0.4, 3.0), dt).run(y)
    assert x[2:] == approx(oracle.second(y, 0.4, 3.0, dt), rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("poles", [[-0.8, -0.8], [-1.0] * 3, [-2.0, *pair(0.5, 2.0) * 2]])
def test_a_cascade_solves_the_equations_4_repeated_roots_included(poles):
    y = np.random.default_rng(1).normal(size=40)
    x = pt.recursive.InverseTransform(poles, 0.2).run(y)[len(poles) :]
    ours = oracle.by_equations(y, sorted(poles, key=lambda p: (p.real, abs(p.imag))), 0.2)
    assert x == approx(ours, abs=1e-9 * np.abs(ours).max())
    streamed = np.array(list(oracle.stream(y, poles, 0.2)))[len(poles) :]
    assert x == approx(streamed, abs=1e-9 * np.abs(x).max())


def test_wrong_roots_leave_what_9_says_as_corrected():
    T, T0, dt, b = (2.0, 5.0), (2.5, 4.0, 7.0), 0.1, np.array([0.7, -1.7])
    n = np.arange(100)
    y = 1 + np.exp(-np.outer(n, dt / np.array(T))) @ b
    x = pt.recursive.InverseTransform([-1 / Ti for Ti in T0], dt).run(y)
    assert x[3:] == approx(oracle.mismatch(b, T, T0, dt, n)[3:], abs=1e-8)


def test_example_i_to_both_tolerances():
    """What the printed (1.3, 3.5, 5.2) leaves hangs on dt, so its 5e-3 cannot be pinned."""
    for dt, S in ((0.1, 0.0205), (0.5, 0.00226)):
        rec = starting_on_its_step([1.0], oracle.polynomial(T_16), dt, round(40 / dt) + 1)
        rough = [-1 / T for T in (1.3, 3.5, 5.2)]
        assert left(rec.y[:, 0], rough, dt) == approx(S, rel=3e-3)
        found = pt.estimate.idt_criterion(rec, eps=1e-8)
        assert found.order == 3 and found.T == approx(T_16, rel=1e-8)
        assert left(rec.y[:, 0], found.poles, dt) < 1e-12


def test_example_ii_to_the_last_digits():
    """The text asks for 1e-15; time constants come to 1e-10, numerator to 1e-9."""
    den = oracle.polynomial((2, 5, 8))
    y = oracle.step_response(oracle.polynomial((1, 9)), den, 0.1 * np.arange(601))
    u = np.repeat([0.0, 1.0], [10, 601])
    found = pt.estimate.idt_criterion(pt.Record(u=u, y=np.r_[np.zeros(10), y], Ts=0.1))
    assert found.T == approx([2, 5, 8], rel=1e-10)
    assert found.numerator == approx([0, 9, 10, 1], abs=1e-9)
    # Another way: amplitudes by least squares, then (11) as corrected.
    t = 0.1 * np.arange(601)
    other = oracle.zeros(oracle.amplitudes(y, t, found.T), found.T, 2)
    assert found.numerator[1:] == approx(other, abs=1e-8)


def test_example_iii_belongs_to_the_other_tolerance_each():
    """ERRATA 5: S(2, 9.80) = 2.23e-6, S(2, 9.81) = 7.75e-5; the roots are -2 +- 9.798j."""
    y = oracle.step_response(NUM_18, DEN_18, 0.01 * np.arange(1001))
    assert left(y, pair(2, 9.80), 0.01, gain=20.0) == approx(2.23e-6, abs=0.005e-6)
    assert left(y, pair(2, 9.81), 0.01, gain=20.0) == approx(7.75e-5, abs=0.005e-5)
    found = pt.estimate.idt_criterion(pt.Record(u=np.ones(1001), y=y, Ts=0.01), gain=20.0)
    assert found.poles.real == approx([-2, -2], rel=1e-9)
    assert np.abs(found.poles.imag) == approx([np.sqrt(96)] * 2, rel=1e-9)


def test_14_vanishes_at_wrong_roots_where_15_does_not():
    """ERRATA 5: one equation, two unknowns; at dt = 0.02 zero at beta = 1, Omega = 5.7183."""
    delta, omega, dt = 2.0, np.sqrt(96.0), 0.02
    assert oracle.sum_of_second_order(delta, omega, 1.0, 5.7183, dt) == approx(0.0, abs=2e-3)
    y = oracle.step_response(NUM_18, DEN_18, dt * np.arange(1001))
    x = pt.recursive.InverseTransform(pair(1.0, 5.7183), dt, gain=20.0).run(y)[2:]
    assert np.sum(1 - x) == approx(
        oracle.sum_of_second_order(delta, omega, 1.0, 5.7183, dt), abs=1e-8
    )
    assert left(y, pair(1.0, 5.7183), dt, gain=20.0) > 1.0


def test_the_noise_that_the_text_calls_satisfactory_leaves_no_time_constant():
    """(15) with one time constant: the closed form has no root left at lag 1; refused."""
    t, T = 0.1 * np.arange(201), 2.0
    clean = np.exp(-t / T)
    a = 200 * 0.05**2 / np.sum(clean**2)
    assert oracle.biased_root(np.exp(-0.1 / T), a) < 0.02
    for seed in range(20):
        y = 1 - clean + 0.05 * np.random.default_rng(seed).normal(size=201)
        with pytest.raises(pt.PlantuneError) as refused:
            pt.estimate.idt_criterion(pt.Record(u=np.ones(201), y=y, Ts=0.1), order=1)
        assert refused.value.code in ("N04", "X02") and "idt" in refused.value.remedy


def test_the_page_shows_what_15_makes_of_noise():
    """The oracle's medians of 200 records: one time constant of 2 s, 20 s of it, 5 % of noise."""
    page = PAGE.read_text(encoding="utf-8")
    (row,) = re.findall(r"^\| \(15\), lag (\d.*\d) \| (.*\d) \|$", page, re.M)
    clean = 1 - np.exp(-0.1 * np.arange(201) / 2.0)
    noise = [0.05 * np.random.default_rng(seed).normal(size=201) for seed in range(200)]
    for lag, shown in zip(*(cells.split(", ") for cells in row), strict=True):
        found = [oracle.minimum(clean + e, 0.1, 1, int(lag), K=1.0).poles[0].real for e in noise]
        assert float(shown) == approx(np.median(-1 / np.array(found)), abs=0.006), lag
