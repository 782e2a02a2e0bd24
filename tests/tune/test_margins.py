"""Margins with the exact delay, against root finding on a dense grid and closed forms."""

from math import asin, degrees, pi, radians

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from oracles import loop

OP1 = {"K": 5.939, "T": 0.1491, "L": 0.1}
FIELDS = ("gain", "gain_db", "w_gain", "phase_deg", "w_phase", "delay")


def margins(K, T, L, **pid):
    """Ask plantune."""
    return pt.tune.margins(pt.models.ProcessModel(K=K, T=T, L=L), pt.models.PID(**pid))


def assert_same(found, ref):
    """Compare crossings to 1e-9 (both bracket a root), peaks to 1e-6 (both search a maximum)."""
    for name in FIELDS:
        assert getattr(found, name) == approx(getattr(ref, name), rel=1e-9), name
    assert (found.Ms, found.Mt) == approx((ref.Ms, ref.Mt), rel=1e-6)


@pytest.mark.parametrize(
    "K, T, L, Kp, Ti, printed",
    [
        # Source 001, table 3.6-5 (its own grid: 5e-4) and ERRATA 3.2, operating point 5
        (5.939, 0.1491, 0.1, 0.9 * 0.1491 / 0.5939, 0.3, (6.20957, 17.485, 66.341, 7.27992)),
        (8.137, 0.4145, 0.1, 0.9 * 0.4145 / 0.8137, 0.3, (4.409, 15.120, 31.77, 9.257)),
        (8.137, 0.4145, 0.1, 0.0938, 0.1684, (16.525, 13.304, 47.49, 3.129)),
    ],
)
def test_printed_tables_are_reproduced(K, T, L, Kp, Ti, printed):
    m = margins(K, T, L, Kp=Kp, Ti=Ti)
    assert (m.gain_db, m.w_gain, m.phase_deg, m.w_phase) == approx(printed, rel=5e-4)
    assert_same(m, loop.margins(K, T, L, Kp, Ti))


@settings(max_examples=30)
@given(
    T=st.floats(0.02, 50.0),
    ratio=st.floats(0.05, 5.0),
    part=st.floats(0.1, 0.7),
    reset=st.floats(0.3, 3.0),
    sign=st.sampled_from([-1.0, 1.0]),
)
def test_pi_margins_equal_root_finding(T, ratio, part, reset, sign):
    L, Ti = ratio * T, reset * T
    unit = loop.margins(1.0, T, L, 1.0, Ti)
    Kp = part * unit.gain  # inside the stable range
    ref = loop.margins(2.0, T, L, Kp / 2.0, Ti)
    assert_same(margins(sign * 2.0, T, L, Kp=sign * Kp / 2.0, Ti=Ti), ref)


@settings(max_examples=20)
@given(
    T=st.floats(0.1, 10.0),
    ratio=st.floats(0.1, 2.0),
    part=st.floats(0.1, 0.6),
    lead=st.floats(0.02, 0.25),
    lag=st.floats(0.1, 0.5),
)
def test_pid_margins_equal_root_finding(T, ratio, part, lead, lag):
    """Derivative with its filter, Td s / (Tf s + 1)."""
    L, Td = ratio * T, lead * T
    Tf = lag * Td
    unit = loop.margins(1.0, T, L, 1.0, T, Td, Tf)
    Kp = part * unit.gain
    ref = loop.margins(1.0, T, L, Kp, T, Td, Tf)
    assert_same(margins(1.0, T, L, Kp=Kp, Ti=T, Td=Td, Tf=Tf), ref)


@pytest.mark.parametrize("ratio, gain, phase", [(1.433589, 3.0, None), (0.637557, None, 60.0)])
def test_imc_pid_has_the_margins_of_its_closed_form(ratio, gain, phase):
    """ERRATA 3.3: w L = 2.458714; six printed digits of tau_c/L give six of the margin."""
    K, T, L = OP1.values()
    Kp, Ti, Td = loop.imc_pid(K, T, L, ratio * L)
    m = margins(K, T, L, Kp=Kp, Ti=Ti, Td=Td, Tf=0.0)
    assert m.w_gain * L == approx(2.458714, abs=5e-7)
    if gain:
        assert m.gain == approx(gain, rel=1e-6)
    if phase:
        assert m.phase_deg == approx(phase, rel=1e-6)


def test_half_the_gain_is_twice_the_margin():
    one, half = (margins(s * 5.939, 0.1491, 0.1, Kp=0.1315, Ti=0.1491) for s in (1, 0.5))
    assert half.gain == approx(2 * one.gain, rel=1e-9)
    assert half.gain_db - one.gain_db == approx(6.020599913, abs=1e-7)
    assert half.w_gain == approx(one.w_gain, rel=1e-9)


def test_more_delay_takes_its_share_of_the_phase():
    one, more = (margins(5.939, 0.1491, L, Kp=0.1315, Ti=0.1491) for L in (0.1, 0.13))
    assert more.w_phase == approx(one.w_phase, rel=1e-9)  # a delay has gain 1
    assert radians(one.phase_deg - more.phase_deg) == approx(0.03 * one.w_phase, rel=1e-8)
    assert one.delay - more.delay == approx(0.03, rel=1e-8)


def test_the_delay_margin_is_the_edge_of_stability():
    m = margins(5.939, 0.1491, 0.1, Kp=0.1315, Ti=0.1491)
    edge = margins(5.939, 0.1491, 0.1 + 0.9999 * m.delay, Kp=0.1315, Ti=0.1491)
    assert 0 < edge.phase_deg < 0.02 and 1 < edge.gain < 1.001


def test_peaks_bound_the_margins():
    """|1 + CG| >= 1/Ms, so gain >= Ms/(Ms - 1) and phase >= 2 asin(1/(2 Ms))."""
    m = margins(5.939, 0.1491, 0.1, Kp=0.1315, Ti=0.1491)
    assert m.gain >= m.Ms / (m.Ms - 1) and m.phase_deg >= degrees(2 * asin(1 / (2 * m.Ms)))
    assert m.Ms == approx(1.63, abs=0.005)  # METHODS 3.1
    assert m.Mt >= 1 - 1e-9  # integral action


def test_a_tuning_reports_the_margins_of_its_controller():
    model = pt.models.ProcessModel(**OP1)
    tuning = pt.tune.imc_pi(model, gain_margin=3)
    again = pt.tune.margins(model, tuning.controller)
    for name in (*FIELDS, "Ms", "Mt"):
        assert getattr(again, name) == getattr(tuning.margins, name)
    assert again.w_gain == approx(pi / 0.2, rel=1e-9)
