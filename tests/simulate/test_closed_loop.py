"""Closed loops with exact delay: continuous PI by series, sampled PI by superposition."""

from math import inf, nan, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx
from scipy.integrate import trapezoid

import plantune as pt
from oracles import fopdt, loop

K, T, L, TS = 5.939, 0.1491, 0.1, 0.02
KP, TI = loop.imc_pi(K, T, L, (6 / pi - 1) * L)
INDICES = (
    "rise", "settling", "overshoot", "ise", "iae", "itae", "control_overshoot", "control_energy",
)  # fmt: skip


def at(response, t):
    """Return y and u of a response at times that it holds."""
    grid = np.asarray(response.t, float)
    rows = np.abs(grid[:, None] - np.asarray(t)[None, :]).argmin(axis=0)
    assert grid[rows] == approx(t, abs=1e-9)
    return np.ravel(response.y)[rows], np.ravel(response.u)[rows]


def step(K=K, T=T, L=L, Kp=KP, Ti=TI, t_end=4.0, Ts=None):
    """Ask plantune for a unit set-point step."""
    model, pid = pt.models.ProcessModel(K=K, T=T, L=L), pt.models.PID(Kp=Kp, Ti=Ti, Ts=Ts)
    return pt.simulate.step(model, pid, t_end=t_end)


def sampled(r, d=None, noise=None, K=K, L=L, Kp=KP):
    """Ask plantune for a sampled PI loop."""
    more = {k: v for k, v in {"d": d, "noise": noise}.items() if v is not None}
    pid = pt.models.PID(Kp=Kp, Ti=TI, Ts=TS)
    return pt.simulate.closed_loop(pt.models.ProcessModel(K=K, T=T, L=L), pid, r=r, Ts=TS, **more)


# -- continuous PI ---------------------------------------------------------------------


def test_imc_pi_step_has_the_known_indices():
    """Issue 2, in its printed digits; ISE and more digits from 40-digit quadrature."""
    i = step().indices
    assert i.overshoot == approx(5.643415, abs=5e-5)
    assert i.settling == approx(0.603673, abs=5e-5)
    assert i.iae == approx(0.213785560, abs=5e-5)
    assert i.ise == approx(0.165398669, abs=5e-5)
    assert i.itae == approx(0.0285565379, abs=5e-6)


@pytest.mark.parametrize(
    "T, L, Kp, Ti",
    [
        (0.1491, 0.1, KP, TI),
        (0.1491, 0.107, KP, TI),
        (0.1491, 0.1, 0.2259, 0.3),  # ZN, source 001, table 3.6-4
        (0.1491, 0.1, 0.0787, 0.1118),  # RZN
        (1.0, 0.05, 0.5, 1.0),  # little delay
        (0.05, 0.4, 0.03, 0.1),  # delay dominates
    ],
)
def test_step_follows_the_series_solution(T, L, Kp, Ti):
    t_end = 20 * (T + L)
    ref = loop.Continuous(K, T, L, Kp, Ti, t_end)
    run = step(T=T, L=L, Kp=Kp, Ti=Ti, t_end=t_end)
    t = np.asarray(run.t, float)
    assert t[0] == 0 and t[-1] == approx(t_end, rel=1e-2)
    inside = t <= t_end
    assert np.ravel(run.y)[inside] == approx(ref.y(t[inside]), abs=1e-6)
    assert np.ravel(run.u)[inside] == approx(ref.u(t[inside]), abs=1e-6 * Kp)
    # four digits and more: what the texts print
    expected = ref.indices(final_u=1 / K)
    for name in INDICES:
        wanted = getattr(expected, name)
        assert getattr(run.indices, name) == approx(wanted, rel=1e-4, abs=1e-6), name


def test_negative_gains_give_the_same_output():
    plus, minus = step(), step(K=-K, Kp=-KP)
    assert np.ravel(minus.y) == approx(np.ravel(plus.y), abs=1e-12)
    assert np.ravel(minus.u) == approx(-np.ravel(plus.u), abs=1e-12)
    assert minus.indices.control_overshoot == approx(plus.indices.control_overshoot, rel=1e-9)


@settings(max_examples=15)
@given(scale=st.floats(1e-3, 1e3))
def test_units_of_time_scale_the_indices(scale):
    one = step().indices
    other = step(T=scale * T, L=scale * L, Ti=scale * TI, t_end=scale * 4.0).indices
    assert other.overshoot == approx(one.overshoot, rel=1e-6)
    assert (other.settling / scale, other.rise / scale) == approx(
        (one.settling, one.rise), rel=1e-6
    )
    assert other.iae / scale == approx(one.iae, rel=1e-6)
    assert other.itae / scale**2 == approx(one.itae, rel=1e-6)


def test_total_variation_is_at_least_the_way_travelled():
    run = step()
    u = np.ravel(run.u)
    assert run.indices.total_variation >= abs(u.max() - u[-1]) + abs(u.max() - u[0]) - 1e-6


# -- sampled PI ------------------------------------------------------------------------


@pytest.mark.parametrize("L", [0.1, 0.107, 0.013, 0.0])
def test_sampled_loop_follows_the_superposition(L):
    """L = 0 too: u[k] acts after t[k]."""
    Kp = KP / 2 if L < 0.02 else KP
    r = np.ones(150)
    ref = loop.sampled_pi(K, T, L, Kp, TI, TS, r)
    y, u = at(sampled(r, L=L, Kp=Kp), ref.t)
    assert y == approx(ref.y, abs=1e-9)
    assert u == approx(ref.u, abs=1e-9)


def test_sampled_loop_takes_set_point_load_and_noise():
    rng = np.random.default_rng(1)
    r = fopdt.hold_input(200, 25, 2)
    d, noise = 0.05 * fopdt.hold_input(200, 31, 3), 0.02 * rng.normal(size=200)
    ref = loop.sampled_pi(K, T, L, KP, TI, TS, r, d, noise)
    assert at(sampled(r, d, noise), ref.t)[1] == approx(ref.u, abs=1e-9)
    clean = loop.sampled_pi(K, T, L, KP, TI, TS, r, d)
    assert at(sampled(r, d), clean.t)[0] == approx(clean.y, abs=1e-9)


def test_sampled_step_has_true_integrals():
    """Quadrature of the output between the samples, 100 points a sample: 1e-4 or better."""
    ref = loop.sampled_pi(K, T, L, KP, TI, TS, np.ones(200))
    t = np.linspace(0, 3.9, 19_501)
    e = 1 - ref.at(t)
    i = step(t_end=3.9, Ts=TS).indices
    assert i.ise == approx(trapezoid(e**2, t), rel=1e-3)
    assert i.iae == approx(trapezoid(np.abs(e), t), rel=1e-3)
    assert i.itae == approx(trapezoid(t * np.abs(e), t), rel=1e-3)
    assert i.overshoot == approx(-100 * e.min(), abs=0.01)


@given(a=st.floats(-5, 5), b=st.floats(-5, 5))
def test_the_loop_is_linear(a, b):
    r1, r2 = fopdt.hold_input(80, 9, 4), fopdt.hold_input(80, 13, 5)
    y1, y2 = (np.ravel(sampled(r).y) for r in (r1, r2))
    both = np.ravel(sampled(a * r1 + b * r2).y)
    assert both == approx(a * y1 + b * y2, abs=1e-10)


def test_fast_sampling_tends_to_the_continuous_loop():
    smooth = loop.Continuous(K, T, L, KP, TI, t_end=1.0)
    gap = []
    for Ts in (0.004, 0.002):
        model, pid = pt.models.ProcessModel(K=K, T=T, L=L), pt.models.PID(Kp=KP, Ti=TI, Ts=Ts)
        run = pt.simulate.closed_loop(model, pid, r=np.ones(round(1 / Ts)), Ts=Ts)
        t = Ts * np.arange(round(1 / Ts))
        gap.append(np.abs(at(run, t)[0] - smooth.y(t)).max())
    assert gap[1] == approx(gap[0] / 2, rel=0.1)  # backward Euler: first order


def test_a_simulated_loop_is_identified_again():
    r = fopdt.hold_input(500, 25, 6)
    run = sampled(r, K=-K, Kp=-KP)
    y, u = at(run, TS * np.arange(500))
    fit = pt.estimate.process(pt.Record(u=u, y=y, r=r, Ts=TS), "P1D")
    assert fit.theta == approx([-K, T, L], rel=1e-6)


@pytest.mark.parametrize("run", [pt.simulate.step, pt.simulate.load_step])
def test_steps_of_no_plant_or_over_no_time_are_refused(run):
    pid = pt.models.PID(Kp=1.0, Ti=1.0)
    for t_end in (0.0, -1.0, inf, nan):
        with pytest.raises(pt.UsageError):
            run(pt.models.ProcessModel(K=1.0, T=1.0, L=0.1), pid, t_end)
    for wrong in ({"K": nan}, {"T": -1.0}, {"L": inf}):
        with pytest.raises(pt.NotIdentifiable) as refusal:
            run(pt.models.ProcessModel(**{"K": 1.0, "T": 1.0, "L": 0.1, **wrong}), pid)
        assert refusal.value.code == "M12"
