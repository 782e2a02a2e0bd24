"""Loops of any plant, continuous and sampled, with what a real loop has: scipy and closed forms."""

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from pytest import approx
from scipy.integrate import solve_ivp

import plantune as pt
from plantune.models import PID, PolyModel, ProcessModel, TransferFunction
from plantune.simulate import Actuator, Schedule, Table, VaryingPlant, closed_loop, load_step, step

PLANT = ProcessModel(K=2.0, T=1.0, L=0.3)
GENERAL = {
    "three lags": ProcessModel(K=1.0, T=(1.0, 1.0, 1.0), L=0.37),
    "stiff": ProcessModel(K=2.0, T=(1.0, 1e-3), L=0.2),
    "inverse": ProcessModel(K=-1.5, T=(2.0, 0.5), L=0.11, Tz=-0.6),
    "rings": ProcessModel(K=1.0, T=0.5, L=0.1, zeta=0.15),
    "tank": ProcessModel(K=0.4, T=2.0, L=0.25, integrating=True),
    "at once": TransferFunction([0.5, 1.0], [1.0, 1.0], L=0.2),
    "delay alone": ProcessModel(K=2.0, T=(), L=0.7),
}
GAINS = {  # Kp, Ti that suit them
    "three lags": (0.8, 3.0),
    "stiff": (0.9, 1.0),
    "inverse": (-0.4, 2.5),
    "rings": (0.1, 0.3),
    "tank": (0.6, 12.0),
    "at once": (0.3, 0.8),
    "delay alone": (0.1, 0.3),
}


def panels(model, u, Ts, fine):
    """Return y at begin, middle and end of panels of two fine steps; jumps lie between panels.

    The plant is simulated on steps of which the delay is a multiple; what it lets through at once
    is constant within a panel.
    """
    held = np.repeat(u, round(Ts / fine))
    G = model if isinstance(model, TransferFunction) else model.transfer()
    D = G.num[0] / G.den[0] if len(G.num) == len(G.den) else 0.0
    rest = np.polysub(G.num, D * G.den)
    late = round(G.L / fine)
    smooth = np.zeros(len(held) + 1)
    if np.any(rest):
        smooth = TransferFunction(rest, G.den, G.L).simulate([*held, 0.0], fine)
    through = D * np.concatenate([np.zeros(late), held])[: len(held)]
    return smooth[:-1:2] + through[::2], smooth[1::2] + through[1::2], smooth[2::2] + through[1::2]


# -- between the samples ---------------------------------------------------------------


@pytest.mark.parametrize("Ts", [0.05, 0.6])
@pytest.mark.parametrize("name", GENERAL)
def test_sampled_loops_have_true_integrals(name, Ts):
    """Simpson's rule on steps of 1 ms, 50 us for a lag of 1 ms: 1e-6, as the simulator says."""
    model, (Kp, Ti) = GENERAL[name], GAINS[name]
    if Ts > 0.5:
        Kp, Ti = Kp / 2, 2 * Ti
    run = closed_loop(model, PID(Kp, Ti, Ts=Ts), np.ones(round(12 / Ts)))
    fine = 5e-5 if name == "stiff" else 1e-3
    e = [1 - y for y in panels(model, run.u[:-1], Ts, fine)]
    t = [2 * fine * np.arange(len(e[0])) + j * fine for j in range(3)]

    def integral(f):
        return np.sum(f(t[0], e[0]) + 4 * f(t[1], e[1]) + f(t[2], e[2])) * fine / 3

    assert run.indices.ise == approx(integral(lambda _, e: e**2), rel=1e-6)
    # A panel in which e changes its sign costs 1e-6.
    assert run.indices.iae == approx(integral(lambda _, e: abs(e)), rel=2e-6)
    assert run.indices.itae == approx(integral(lambda t, e: t * abs(e)), rel=2e-6)
    assert run.indices.overshoot / 100 == approx(max(0.0, *(-x.min() for x in e)), abs=1e-6)


def test_a_sampled_first_order_is_exact_however_coarse():
    """Five time constants a sample: the closed form of every piece."""
    model, pid = ProcessModel(K=1.0, T=0.2), PID(0.0, pure_Ki=0.3, Ts=1.0)
    run = closed_loop(model, pid, np.ones(30))
    ise = iae = 0.0
    for y, u in zip(run.y[:30], run.u[:30], strict=True):
        E, A, a = 1 - u, u - y, np.exp(-1.0 / 0.2)
        ise += E**2 + 2 * E * A * 0.2 * (1 - a) + A**2 * 0.1 * (1 - a**2)
        iae += E + A * 0.2 * (1 - a)
    assert run.indices.ise == approx(ise, rel=1e-13)
    assert run.indices.iae == approx(iae, rel=1e-13)


# -- continuous loops of any plant -----------------------------------------------------


@pytest.mark.parametrize(
    "pid",
    [
        PID(0.9, 2.0),
        PID(1.2, 2.5, Td=0.5, Tf=0.1, b=0.6, c=0.3),
        PID(1.2, 2.5, Td=0.5, Tf=0.1, b=0.6, filter="y2"),
        PID(0.9, 2.0, Tf=0.2, filter="y2"),
        PID.integral(0.3),
        PID(0.8),
    ],
    ids=str,
)
@pytest.mark.parametrize("name", ["three lags", "inverse", "at once"])
def test_a_continuous_loop_without_delay_is_its_transfer_function(name, pid):
    """T(s) by polynomial algebra, its step by matrix exponentials."""
    model = replace(GENERAL[name], L=0.0)
    if name == "inverse":
        pid = replace(pid, Kp=-0.3 * pid.Kp, pure_Ki=pid.pure_Ki and -0.3 * pid.pure_Ki)
    G = model.transfer() if isinstance(model, ProcessModel) else model
    run = closed_loop(model, pid, np.ones(300), Ts=0.05)
    P, D = pid.Kp, np.poly1d([pid.Kd, 0.0])
    s, one = np.poly1d([1.0, 0.0]), np.poly1d([1.0])
    Tf = pid.Tf
    if pid.filter == "y2":
        below, F = one, np.poly1d([Tf**2 / 2, Tf, 1.0])
    else:
        below, F = np.poly1d([Tf, 1.0]), one
    # u s below F = (b P s + Ki) below F r + c D s r - ((P s + Ki) below + D s) y, over the filters
    num_r = ((P * pid.b * s + pid.Ki) * below + pid.c * D * s) * F
    num_y = (P * s + pid.Ki) * below + D * s
    A, B = np.poly1d(G.den), np.poly1d(G.num)
    T = TransferFunction((B * num_r).coef, (A * s * below * F + B * num_y).coef)
    expected = T.step(run.t) if T.den[-1] else reduced(T).step(run.t)
    assert run.y[1:] == approx(expected[1:], abs=3e-6)


def reduced(T):
    """Cancel the s of a controller without integral action."""
    return TransferFunction(T.num[:-1], T.den[:-1])


def by_scipy(limits, anti_windup, Tt, t):
    """Return y of 2/(s+1)^2 under PI, u limited, by an integrator of adaptive steps."""
    Kp, Ki = 2.0, 1.5

    def slopes(_, x):
        e, (y, dy, integral) = 1 - x[0], x
        v = Kp * e + integral
        u = min(max(v, limits[0]), limits[1])
        more = Ki * e
        if anti_windup == "back_calculation":
            more += (u - v) / Tt
        elif anti_windup == "clamping" and u != v and more * (v - u) > 0:
            more = 0.0
        return [dy, 2 * u - 2 * dy - y, more]

    return solve_ivp(
        slopes, (0, t[-1]), [0, 0, 0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=2e-3
    ).y[0]


@pytest.mark.parametrize("anti_windup", ["clamping", "back_calculation", None])
def test_a_limited_continuous_loop_follows_an_adaptive_integrator(anti_windup):
    model, pid = ProcessModel(K=2.0, T=(1.0, 1.0)), PID(2.0, Ti=2.0 / 1.5)
    Tt = 0.4 if anti_windup == "back_calculation" else None
    how = {"actuator": Actuator(-0.2, 0.8), "anti_windup": anti_windup, "Tt": Tt}
    run = closed_loop(model, pid, np.ones(400), Ts=0.02, **how)
    assert run.y == approx(by_scipy((-0.2, 0.8), anti_windup, Tt, run.t), abs=2e-5)
    assert run.u.max() == 0.8


ROW = 0.02  # s
T_ROWS = ROW * np.arange(800)
FEATURES = {
    "limits and rate": {"actuator": Actuator(-0.1, 0.7, rate=0.5)},
    "back-calculation": {"actuator": Actuator(0.0, 0.6), "anti_windup": "back_calculation"},
    "loads": {"d": 0.3 * (T_ROWS >= 5), "dy": -0.2 * (T_ROWS >= 9), "p": 0.4 * (T_ROWS >= 3)},
    "manual": {"manual": np.where((T_ROWS >= 8) & (T_ROWS < 10), 0.7, nan)},
    "settings": {"settings": [(6.0, PID(0.2, 0.8)), (11.0, PID(0.6, 2.0))]},
    "schedule": {"schedule": Schedule(Kp=0.4 + 0.2 * np.sin(T_ROWS), Ti=1.0 + 0.02 * T_ROWS)},
    "operating point": {"offset": 20.0, "u0": 0.3},
}


def on_rows_of(Ts, more):
    """Return the same signals on rows of `Ts`, and settings for that sample time."""
    times = round(ROW / Ts)
    finer = {k: np.repeat(x, times) if isinstance(x, np.ndarray) else x for k, x in more.items()}
    if "schedule" in more:
        schedule = more["schedule"]
        finer["schedule"] = Schedule(*(np.repeat(x, times) for x in (schedule.Kp, schedule.Ti)))
    if "settings" in more:
        finer["settings"] = [(t, replace(pid, Ts=Ts)) for t, pid in more["settings"]]
    return finer


@pytest.mark.parametrize("name", FEATURES)
@pytest.mark.parametrize("model", [PLANT, GENERAL["three lags"]], ids=["first order", "third"])
def test_a_continuous_loop_is_the_limit_of_sampled_ones(model, name):
    """Backward Euler is of first order: from 4 ms to 2 ms its gap to the continuous loop halves."""
    r = np.where(T_ROWS < 12, 1.0, 0.4) + (19.6 + 1.0 if name == "operating point" else 0.0)
    smooth = closed_loop(model, PID(0.5, 1.0), r, Ts=ROW, **FEATURES[name])
    gaps = []
    for Ts in (0.004, 0.002):
        more = on_rows_of(Ts, {"r": r, **FEATURES[name]})
        run = closed_loop(model, PID(0.5, 1.0, Ts=Ts), **more)
        gaps.append(np.abs(run.y[:: round(ROW / Ts)] - smooth.y).max())
        assert run.indices.iae == approx(smooth.indices.iae, rel=3 * Ts)
    assert gaps[1] == approx(gaps[0] / 2, rel=0.2) and gaps[1] < 2e-3


# -- what must hold --------------------------------------------------------------------


@pytest.mark.parametrize("Ts", [None, 0.1])
def test_disturbances_add_up_as_in_the_block_diagram(Ts):
    """Source 001, (3.4-9) and (3.4-46): p acts as d does, dy as an opposite set point on y - dy."""
    rng = np.random.default_rng(3)
    x = np.repeat(rng.normal(size=20), 10)
    pid = PID(0.5, 1.0, Ts=Ts)
    zero = np.zeros(200)
    by_p, by_d = (closed_loop(PLANT, pid, zero, Ts=0.1, **{n: x}) for n in ("p", "d"))
    assert by_p.y == approx(by_d.y, abs=1e-12)
    assert by_p.u[:-1] == approx(by_d.u[:-1] + x, abs=1e-12)
    by_dy, by_r = closed_loop(PLANT, pid, zero, Ts=0.1, dy=x), closed_loop(PLANT, pid, -x, Ts=0.1)
    assert by_dy.y[:-1] - x == approx(by_r.y[:-1], abs=1e-10)
    assert by_dy.indices.iae == approx(by_r.indices.iae, rel=1e-9)


@pytest.mark.parametrize("Ts", [None, 0.05])
def test_limits_and_rate_are_kept_and_anti_windup_pays(Ts):
    pid, N = PID(2.0, 0.6, Ts=Ts), 400
    r = np.repeat([1.4, 0.2], N // 2)
    valve = Actuator(-0.1, 0.75, rate=3.0)
    runs = {
        how: closed_loop(PLANT, replace(pid, Kp=0.8), r, Ts=0.05, actuator=valve, anti_windup=how)
        for how in ("clamping", "back_calculation", None)
    }
    for run in runs.values():
        assert run.u.min() >= -0.1 and run.u.max() <= 0.75
        assert np.abs(np.diff(run.u)).max() <= 3.0 * 0.05 + 1e-12
    assert runs["clamping"].indices.iae < runs[None].indices.iae
    assert runs["back_calculation"].indices.iae < runs[None].indices.iae


@pytest.mark.parametrize("Ts", [None, 0.1])
def test_automatic_goes_on_from_manual_without_a_bump(Ts):
    manual = np.full(300, nan)
    manual[100:150] = 0.3
    pid = PID(0.5, 1.0, Td=0.2, Tf=0.05, Ts=Ts)
    run = closed_loop(PLANT, pid, np.ones(300), Ts=0.1, manual=manual)
    assert run.u[100:150] == approx(0.3)
    # Before y moves, u goes on by what the integral adds.
    assert run.u[150] - 0.3 == approx(0.5 * 0.1 * (1 - run.y[150]) if Ts else 0.0, abs=0.02)
    assert run.y[-1] == approx(1.0, abs=1e-3)


def test_a_sticking_valve_leaves_a_limit_cycle():
    pid = PID(0.5, 1.0, Ts=0.1)
    free, stuck = (
        closed_loop(PLANT, pid, np.ones(2000), actuator=Actuator(dead_band=band))
        for band in (0.0, 0.05)
    )
    assert np.ptp(free.y[-300:]) < 1e-9 < 0.03 < np.ptp(stuck.y[-300:])


def test_a_polynomial_model_loops_as_the_plant_that_it_samples():
    for model in (PLANT, GENERAL["three lags"], GENERAL["tank"]):
        pid, r = PID(0.3, 3.0, Ts=0.1), np.ones(400)
        smooth = closed_loop(model, pid, r, offset=3.0)
        sampled = closed_loop(pt.models.c2d(model, 0.1), pid, r, offset=3.0)
        assert sampled.y == approx(smooth.y, abs=1e-8)
        # Straight from sample to sample: h^2.
        assert sampled.indices.iae == approx(smooth.indices.iae, rel=1e-3)


def test_an_integrating_plant_rests_at_any_input():
    """What flows off balances u0; a load is answered from there, the same for every u0."""
    pid, r, d = PID(0.6, 12.0), np.full(500, 7.0), np.full(500, 0.2)
    runs = [
        closed_loop(GENERAL["tank"], pid, r, Ts=0.1, d=d, offset=7.0, u0=u0) for u0 in (0.0, 0.4)
    ]
    assert runs[0].y == approx(runs[1].y, abs=1e-12)
    assert runs[0].u + 0.4 == approx(runs[1].u, abs=1e-12)
    assert runs[0].y.min() > 6.9 and runs[0].u[-1] == approx(-0.2, abs=1e-2)


@pytest.mark.parametrize("name", GENERAL)
@pytest.mark.parametrize("Ts", [None, 0.05])
def test_every_plant_settles_within_the_horizon(name, Ts):
    pid = PID(*GAINS[name], Ts=Ts)
    run, load = step(GENERAL[name], pid), load_step(GENERAL[name], pid)
    assert np.abs(run.y[-len(run.y) // 10 :] - 1).max() < 0.02
    assert abs(load.y[-1]) < 0.02 * np.abs(load.y).max()
    assert run.notes == () and len(run.y) < 20_000


def test_a_step_of_a_polynomial_model_needs_its_sampled_controller():
    model = PolyModel(A=[1, -0.9], B=[0.1], nk=2, Ts=0.5)
    assert step(model, PID(0.5, 5.0, Ts=0.5)).y[-1] == approx(1.0, abs=1e-3)
    with pytest.raises(pt.UsageError, match="PolyModel"):
        step(model, PID(0.5, 5.0), t_end=10.0)


@pytest.mark.parametrize("Ts", [None, 0.1])
def test_a_loop_that_runs_away_ends_and_says_so(Ts):
    run = step(PLANT, PID(5.0, 1.0, Ts=Ts), t_end=500.0)
    assert np.isfinite(run.y).all() and np.isfinite(run.u).all()
    assert len(run.t) == len(run.y) < 5001
    assert run.notes[0].code == "M02" and "unstable" in run.notes[0].text


def test_a_varying_plant_is_read_from_tables():
    """Source 001, 3.7.6: constant tables are the plant itself; a gain that falls is followed."""
    speed = np.linspace(1000, 3000, 300)
    constant = VaryingPlant(K=Table([1000.0, 3000.0], [2.0, 2.0]).at(speed), T=1.0, L=0.3)
    pid, r = PID(0.5, 1.0, Ts=0.1), np.ones(300)
    known, ours = closed_loop(PLANT, pid, r), closed_loop(constant, pid, r)
    assert ours.y == approx(known.y, abs=1e-12)
    assert ours.indices.iae == approx(known.indices.iae, rel=1e-12)
    falling = VaryingPlant(K=Table([1000.0, 2000.0], [2.0, 1.0]).at(speed), T=1.0, L=0.3)
    assert closed_loop(falling, pid, r).u[[149, -1]] == approx([1.0, 1.0], abs=0.1)
    assert closed_loop(falling, pid, r).u[-1] == approx(1.0, abs=1e-3)


# -- refusals --------------------------------------------------------------------------

SAMPLED = PID(0.5, 1.0, Ts=0.1)


@pytest.mark.parametrize(
    "says, wrong",
    [
        ("`dy` is 9 long", {"dy": np.zeros(9)}),
        ("`p` is not finite", {"p": np.full(10, inf)}),
        ("`u0` is 2, must be within", {"u0": 2.0, "actuator": Actuator(0.0, 1.0)}),
        ("`low` is 1, must be less", {"actuator": Actuator(1.0, 0.0)}),
        ("`rate` is 0", {"actuator": Actuator(rate=0.0)}),
        ("`dead_band` is -1", {"actuator": Actuator(dead_band=-1.0)}),
        ("`y_step` is -1", {"y_step": -1.0}),
        ("`Tt` is 0.01", {"anti_windup": "back_calculation", "Tt": 0.01}),
        ("`Tt` is 1", {"Tt": 1.0}),
        ("`anti_windup` is", {"anti_windup": "windup"}),
        ("`Ts` is", {"settings": [(0.5, PID(1.0, 1.0))]}),
        ("`Kp` is 9 long", {"schedule": Schedule(Kp=np.ones(9))}),
        ("`Ti` is 0 in row 0", {"schedule": Schedule(Ti=np.zeros(10))}),
        ("`Ti, Ki`", {"schedule": Schedule(Ti=np.ones(10), Ki=np.ones(10))}),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_what_does_not_go_together_is_refused(says, wrong):
    with pytest.raises(pt.UsageError) as refusal:
        closed_loop(PLANT, SAMPLED, np.ones(10), **wrong)
    assert refusal.value.text.startswith(says) and refusal.value.remedy


def test_a_continuous_controller_has_no_sample_at_which_to_jump():
    for wrong in (
        {"actuator": Actuator(dead_band=0.1)},
        {"actuator": Actuator(step=0.1)},
        {"y_step": 0.1},
        {"noise": np.ones(10)},
    ):
        with pytest.raises(pt.UsageError, match="give pid a Ts"):
            closed_loop(PLANT, PID(0.5, 1.0), np.ones(10), Ts=0.1, **wrong)
    with pytest.raises(pt.UsageError, match="Ts"):
        closed_loop(VaryingPlant(K=1.0, T=1.0), PID(0.5, 1.0), np.ones(10), Ts=0.1)


def test_what_is_no_table_or_plant_is_refused():
    for axes, values in (
        ([1.0, 1.0], [1.0, 2.0]),
        ([2.0, 1.0], [1.0, 2.0]),
        ([1.0, 2.0], [1.0]),
        ([[1.0]] * 4, [[[[1.0]]]]),
        ([1.0, 2.0], [1.0, nan]),
        ([], []),
    ):
        with pytest.raises(pt.UsageError):
            Table(axes, values)
    with pytest.raises(pt.UsageError, match="one per axis"):
        Table([1.0, 2.0], [1.0, 2.0]).at([1.0], [2.0])
    with pytest.raises(pt.NotIdentifiable) as refusal:
        VaryingPlant(K=1.0, T=[1.0, -1.0]).simulate([0.0, 0.0], Ts=0.1)
    assert refusal.value.code == "M12"
    with pytest.raises(pt.UsageError, match="twice"):
        closed_loop(VaryingPlant(K=1.0, T=1.0), SAMPLED, np.ones(10), offset=1.0)
    now = PolyModel(A=[1, -0.5], B=[1.0], nk=0, Ts=0.1)
    with pytest.raises(pt.UsageError, match="nk"):
        closed_loop(now, SAMPLED, np.ones(10))
