"""Forms of a PID: each evaluated by its own formula, there and back, and what is refused."""

import pickle
from dataclasses import replace
from math import inf

import control
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.models import PID

W = np.logspace(-5, 5, 41)

# One controller in every form: the printed vector of the issue, to its digits.
VECTOR = {
    "series": {"Kp": 2.0, "Ti": 10.0, "Td": 2.0},
    "ideal": {"Kp": 2.4, "Ti": 12.0, "Td": 5 / 3},
    "parallel": {"Kp": 2.4, "Ki": 0.2, "Kd": 4.0},
    "pb": {"PB": 125 / 3, "Ti": 12.0, "Td": 5 / 3},
}


def plane(Ts, w):
    """Give s, or what stands for it in a sampled controller."""
    return 1j * w if Ts is None else -np.expm1(-1j * w * Ts) / Ts


def response(form, w=W):
    """Evaluate a form by its own formula, in units of u/y and seconds."""
    seconds = 60.0 if form.time_unit == "min" else 1.0
    gain = form.op_span / form.pv_span if form.pv_span else 1.0
    s = plane(form.Ts, w)
    on_y = form.filter == "y2"
    Tf = 0.0 if form.form == "velocity" else form.Tf * seconds
    lag, behind = (1.0, 1 + s * Tf + (s * Tf) ** 2 / 2) if on_y else (s * Tf + 1, 1.0)
    if form.form == "velocity":
        q = np.exp(-1j * w * form.Ts)
        C = (form.q0 + form.q1 * q + form.q2 * q**2) / (s * form.Ts * (1 - form.d * q))
    elif form.form == "parallel":
        C = form.Kp + form.Ki / seconds / s + form.Kd * seconds * s / lag
    else:
        Kp = 100 / form.PB if form.form == "pb" else form.Kp
        over_Ti = 0.0 if form.Ti == inf else 1 / (s * form.Ti * seconds)
        sTd = s * form.Td * seconds
        if form.form == "series":
            C = Kp * (1 + over_Ti) * (sTd + 1) / lag
        else:
            C = Kp * (1 + over_Ti + sTd / lag)
    return gain * C / behind


def of_pid(pid, w=W):
    """Evaluate the standard form with the plainest arithmetic there is."""
    s = plane(pid.Ts, w)
    lag, behind = (1.0, 1 + s * pid.Tf + (s * pid.Tf) ** 2 / 2)
    if pid.filter == "d1":
        lag, behind = s * pid.Tf + 1, 1.0
    return (pid.Kp + pid.Ki / s + pid.Kp * pid.Td * s / lag) / behind


def same(C, expected, rel=1e-9):
    assert np.max(np.abs(C / expected - 1)) < rel


times = st.floats(-3, 3).map(lambda x: 10.0**x)
maybe = st.one_of(st.just(0.0), times)
controllers = st.builds(
    PID,
    Kp=st.tuples(times, st.sampled_from([-1.0, 1.0])).map(lambda x: x[0] * x[1]),
    Ti=st.one_of(times, st.just(inf)),
    Td=maybe,
    Tf=maybe,
    b=st.floats(0, 1),
    filter=st.sampled_from(["d1", "y2"]),
)
units = st.fixed_dictionaries(
    {"time_unit": st.sampled_from(["s", "min"])},
    optional={"spans": st.tuples(times, times)},
)


def keywords(units):
    units = dict(units)
    pv, op = units.pop("spans", (None, None))
    return {**units, "pv_span": pv, "op_span": op}


@pytest.mark.parametrize("start", VECTOR)
def test_the_printed_vector_in_every_form(start):
    pid = PID.from_form(start, **VECTOR[start])
    for form, settings in VECTOR.items():
        found = pid.to(form)
        assert found.settings == approx({**settings, "Tf": 0.0}, rel=1e-14)
        if form != "series":
            assert found.repeats_per_minute == approx(5.0)
    assert round(pid.to("ideal").Td, 4) == 1.6667 and round(pid.to("pb").PB, 3) == 41.667
    assert pid.to("pb", time_unit="min").repeats_per_minute == approx(5.0)


@given(controllers, st.sampled_from(["ideal", "parallel", "series", "pb"]), units)
def test_each_form_has_the_response_of_the_controller_and_leads_back(pid, form, units):
    if form == "series" and np.isfinite(pid.Ti):
        Tf = pid.Tf if pid.filter == "d1" else 0.0
        assume((pid.Ti - Tf) ** 2 >= 4 * pid.Ti * pid.Td)
    found = pid.to(form, **keywords(units))
    same(response(found), of_pid(pid))
    back = found.pid()
    same(of_pid(back), of_pid(pid))
    assert (back.b, back.c, back.filter, back.Ts) == (pid.b, pid.c, pid.filter, pid.Ts)


@given(Kp=times, Ti=times, Td=times, share=st.floats(0, 1), sign=st.sampled_from([-1, 1]))
def test_from_series_there_and_back(Kp, Ti, Td, share, sign):
    Tf = share * min(Ti, Td)
    pid = PID.from_form("series", Kp=sign * Kp, Ti=Ti, Td=Td, Tf=Tf)
    s = 1j * W
    same(of_pid(pid), sign * Kp * (1 + 1 / (s * Ti)) * (s * Td + 1) / (s * Tf + 1))
    # The two times have no order of their own: the greater one becomes Ti.
    found = pid.to("series")
    same(response(found), of_pid(pid))
    assert found.Ti >= found.Td * (1 - 1e-6)


@given(controllers.filter(lambda pid: pid.filter == "d1"), st.floats(-1, 1))
def test_sampled_controllers_convert_alike_and_to_increments(pid, x):
    # Three numbers of 16 digits say an integral by what they leave of each other.
    acting = [time for time in (pid.Ti, pid.Td, pid.Tf) if 0 < time < inf] or [1.0]
    assume(max(acting) < 1e3 * min(acting))
    sampled = replace(pid, Ts=min(acting) * 10 ** (x - 1))
    w = np.logspace(-3, 0, 31) * np.pi / sampled.Ts
    velocity = sampled.to("velocity")
    same(of_pid(velocity.pid(), w), of_pid(sampled, w), 1e-7)
    same(response(velocity, w), of_pid(sampled, w), 1e-7)
    same(response(sampled.to("parallel"), w), of_pid(sampled, w))


def test_increments_are_the_positional_algorithm():
    pid = PID(Kp=-2.0, Ti=3.0, Td=0.5, Tf=0.2, Ts=0.1)
    v = pid.to("velocity")
    e = np.random.default_rng(5).normal(size=200)
    positional, incremental = [], []
    total = D = e1 = 0.0
    for k, now in enumerate(e):
        total += pid.Ki * pid.Ts * now
        D = (pid.Tf * D + pid.Kd * (now - e1)) / (pid.Tf + pid.Ts)
        positional.append(pid.Kp * now + total + D)
        e1 = now
        past = [incremental[k - i] if k >= i else 0.0 for i in (1, 2)]
        errors = [e[k - i] if k >= i else 0.0 for i in (0, 1, 2)]
        rise = v.d * (past[0] - past[1]) + np.dot([v.q0, v.q1, v.q2], errors)
        incremental.append(past[0] + rise)
    assert incremental == approx(positional, rel=1e-10)


def test_series_agrees_with_python_control():
    s = control.tf("s")
    series = {"Kp": 2.0, "Ti": 10.0, "Td": 2.0, "Tf": 0.25}
    C = 2.0 * (1 + 1 / (10 * s)) * (2 * s + 1) / (0.25 * s + 1)
    same(of_pid(PID.from_form("series", **series)), C(1j * W))


@given(Ti=times, ratio=st.floats(0.26, 50), share=st.floats(0, 0.5))
def test_the_nearest_series_is_off_by_what_it_says_and_none_is_nearer(Ti, ratio, share):
    pid = PID(Kp=-3.0, Ti=Ti, Td=ratio * Ti, Tf=share * Ti)
    assume((pid.Ti - pid.Tf) ** 2 < 4 * pid.Ti * pid.Td)
    with pytest.raises(pt.UsageError) as refused:
        pid.to("series")
    nearest = refused.value.result
    assert refused.value.code == "U01" and refused.value.measured < refused.value.limit
    assert f"{100 * nearest.deviation:.1f} %" in refused.value.text
    off = np.abs(response(nearest.form) / of_pid(pid) - 1)
    assert off == approx(nearest.deviation, rel=1e-6, abs=1e-9)
    same(of_pid(nearest.form.pid()), response(nearest.form))
    # None around it comes nearer, with another gain, other zeros, or two that are apart.
    mid = 1 / np.sqrt(pid.Ti * (pid.Td + pid.Tf))
    s = 1j * mid * np.logspace(-3, 3, 61)
    C = pid.Kp * (1 + 1 / (s * pid.Ti) + s * pid.Td / (s * pid.Tf + 1))
    own = nearest.form
    for gain, wide, apart in ((1.05, 1, 1), (0.95, 1, 1), (1, 1.05, 1), (1, 0.95, 1), (1, 1, 1.3)):
        x, y = own.Ti * wide * apart, own.Td * wide / apart
        other = own.Kp / own.Ti * gain / s * (s * x + 1) * (s * y + 1) / (s * own.Tf + 1)
        assert np.max(np.abs(other / C - 1)) > nearest.deviation * (1 - 1e-9)


def test_a_border_case_is_no_refusal():
    assert PID(Kp=1.0, Ti=4.0, Td=1.0).to("series").settings == approx(
        {"Kp": 0.5, "Ti": 2.0, "Td": 2.0, "Tf": 0.0}
    )


def test_integral_controllers_have_the_parallel_form():
    pid = PID.integral(0.5)
    parallel = pid.to("parallel", time_unit="min")
    assert (parallel.Kp, parallel.Ki, parallel.repeats_per_minute) == (0.0, 30.0, inf)
    assert parallel.pid() == pid
    for form in ("ideal", "series", "pb"):
        with pytest.raises(pt.UsageError, match="integral controller"):
            pid.to(form)


def test_a_filter_without_derivative_does_nothing_in_series_either():
    pid = PID(Kp=1.0, Ti=2.0, Tf=5.0)
    same(response(pid.to("series")), of_pid(pid))
    on_y = replace(pid, filter="y2")
    assert on_y.to("series").Tf == 5.0
    same(response(on_y.to("series")), of_pid(on_y))


@pytest.mark.parametrize(
    ("form", "settings", "word"),
    [
        ("standard", {"Kp": 1.0}, "`form`"),
        ("ideal", {"Ti": 1.0}, "needs Kp"),
        ("ideal", {"Kp": 1.0, "Ki": 1.0}, "has no Ki"),
        ("ideal", {"Kp": 1.0, "Ti": 0.0}, "`Ti`"),
        ("ideal", {"Kp": float("nan"), "Ti": 1.0}, "`Kp`"),
        ("pb", {"PB": 0.0}, "`PB`"),
        ("parallel", {"Kp": 0.0, "Kd": 1.0}, "`Kp`"),
        ("parallel", {"Kp": 1.0, "Ki": -1.0}, "one sign"),
        ("series", {"Kp": 1.0, "Ti": 5.0, "Td": 1.0, "Tf": 2.0}, "make a lag"),
        ("series", {"Kp": 1.0, "Ti": 5.0, "Tf": 0.1}, "make a lag"),
        ("velocity", {"q0": 1.0, "q1": -1.0, "q2": 0.0}, "`Ts`"),
        ("ideal", {"Kp": 1.0, "time_unit": "h"}, "`time_unit`"),
        ("ideal", {"Kp": 1.0, "pv_span": 100.0}, "`op_span`"),
        ("ideal", {"Kp": 1.0, "pv_span": 100.0, "op_span": -1.0}, "`op_span`"),
    ],
)
def test_what_is_no_controller_is_refused(form, settings, word):
    with pytest.raises(pt.UsageError, match=word) as refused:
        PID.from_form(form, **settings)
    assert refused.value.code == "U01" and refused.value.remedy


def test_what_has_no_such_form_is_refused():
    for pid, form in (
        (PID(Kp=1.0, Ti=1.0), "velocity"),
        (PID(Kp=1.0, Ti=1.0, Ts=0.1, filter="y2"), "velocity"),
        (PID(Kp=0.0), "pb"),
        (PID(Kp=1.0), "isa"),
    ):
        with pytest.raises(pt.UsageError) as refused:
            pid.to(form)
        assert refused.value.code == "U01" and refused.value.result is None


def test_forms_print_with_units_and_travel():
    pid = PID(Kp=2.4, Ti=12.0, Td=5 / 3, Tf=0.1)
    spans = {"pv_span": 200.0, "op_span": 100.0}
    assert str(pid.to("parallel", **spans, time_unit="min")) == (
        "parallel: Kp = 4.8 %/%, Ki = 24 %/%/min, Kd = 0.133333 %/% min, Tf = 0.00166667 min"
    )
    assert str(PID(Kp=2.0, Tf=1.0).to("ideal")) == "ideal: Kp = 2"
    form = pid.to("pb", **spans)
    assert pickle.loads(pickle.dumps(form)) == form
