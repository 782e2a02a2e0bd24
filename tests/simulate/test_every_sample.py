"""The sampled loop against an independent one, every sample, over random plants and features."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import sampled_loop as oracle

SIGNALS = ("y", "u")


def plants(rng):
    """Return our plant and the oracle's num, den, L: self-regulating or integrating."""
    T = tuple(10 ** rng.uniform(-0.5, 0.7, rng.integers(1, 4)))
    Tz = rng.choice([0.0, -0.3, 0.5]) if len(T) > 1 else 0.0
    K, L = rng.choice([-1, 1]) * rng.uniform(0.5, 3), rng.choice([0.0, 0.2, 0.37, 1.13])
    model = pt.models.ProcessModel(K, T, L, Tz=Tz)
    return model, model.transfer()


def controllers(rng, model, Ts):
    """Return our controller and the oracle's, of gains that keep the loop."""
    Kp, Ti = 0.6 / model.K, rng.uniform(1.0, 4.0)
    Td = rng.choice([0.0, 0.3])
    more = {
        "Td": Td,
        "Tf": rng.choice([0.05, 0.2]),
        "b": rng.choice([1.0, 0.4]),
        "filter": rng.choice(["d1", "y2"]),
    }
    c = rng.choice([0.0, 1.0]) if more["filter"] == "d1" else 0.0
    theirs = oracle.Pid(Kp, Ti, c=c, **more)
    return pt.models.PID(Kp, Ti, c=c, Ts=Ts, **more), theirs


@pytest.mark.parametrize("seed", range(60))
def test_every_sample_is_that_of_the_written_law(seed):
    rng = np.random.default_rng(seed)
    Ts, N = 0.1, 150
    model, G = plants(rng)
    pid, theirs = controllers(rng, model, Ts)
    sign = np.sign(model.K)
    r = np.repeat(rng.normal(0, 1, N // 30), 30)
    d, noise = np.repeat(rng.normal(0, 0.2, N // 50), 50), rng.normal(0, 0.02, N)
    limits = rng.random() < 0.7
    low, high = (-0.5, 0.6) if limits else (-np.inf, np.inf)
    rate = 1.5 if rng.random() < 0.4 else np.inf
    band, step, y_step = (rng.choice([0.0, x]) for x in (0.04, 0.03, 0.02))
    anti = rng.choice(["clamping", "back_calculation", "none"])
    manual = np.full(N, np.nan)
    if rng.random() < 0.5:
        manual[40:70] = 0.3 * sign
    own_Tt = np.sqrt(pid.Ti * pid.Td) if pid.Td else pid.Ti
    known = oracle.run(
        oracle.Plant(G.num, G.den, G.L, Ts), theirs, Ts, r, d=d, noise=noise, low=low, high=high,
        rate=rate, antiwindup={"clamping": "clamp", "back_calculation": "back", "none": None}[anti],
        Tt=own_Tt, manual=manual, dead_band=band, quantum_u=step, quantum_y=y_step,
    )  # fmt: skip
    ours = pt.simulate.closed_loop(
        model, pid, r, d=d, noise=noise, manual=manual, y_step=y_step,
        anti_windup=None if anti == "none" else anti,
        actuator=pt.simulate.Actuator(low, high, rate, band, step),
    )  # fmt: skip
    # Steps of the sensor and valve amplify the last bits only where a value lies on an edge.
    assert ours.y[:N] == approx(known.y, abs=1e-9)
    assert ours.u[:N] in (approx(known.u, abs=1e-9), approx(known.position, abs=1e-9))


def test_new_settings_do_not_move_the_output():
    model = pt.models.ProcessModel(K=2.0, T=1.0, L=0.3)
    first, second = (pt.models.PID(Kp, Ti, Ts=0.1) for Kp, Ti in ((0.5, 1.0), (0.2, 0.6)))
    r = np.concatenate([np.zeros(10), np.ones(90)])
    ours = pt.simulate.closed_loop(model, first, r, settings=[(3.0, second)])
    theirs = [oracle.Pid(0.5, 1.0)] * 30 + [oracle.Pid(0.2, 0.6)] * 70
    known = oracle.run(oracle.Plant([2.0], [1.0, 1.0], 0.3, 0.1), theirs, 0.1, r)
    assert ours.u[:100] == approx(known.u, abs=1e-12)
    assert abs(ours.u[30] - ours.u[29]) < 0.1 * np.ptp(ours.u)


def test_a_gain_schedule_is_read_from_its_table():
    """Source 001, 3.7.6: three signals, multilinear, held at the edges."""
    rng = np.random.default_rng(1)
    axes = [np.array([0.0, 1.0, 3.0]), np.array([10.0, 20.0]), np.array([-1.0, 0.0, 5.0])]
    table = rng.uniform(0.1, 0.5, (3, 2, 3))
    signals = rng.uniform(-2, 25, (120, 3))
    ours = pt.simulate.Table(axes, table).at(*signals.T)
    known = [oracle.lookup(axes, table, point) for point in signals]
    assert ours == approx(known, rel=1e-13)
    pid, plant = oracle.Pid(0.3, 1.0), oracle.Plant([2.0], [1.0, 1.0], 0.3, 0.1)
    settings = oracle.scheduled(pid, axes, {"Kp": table}, signals)
    theirs = oracle.run(plant, settings, 0.1, np.ones(120))
    run = pt.simulate.closed_loop(
        pt.models.ProcessModel(2.0, 1.0, 0.3),
        pt.models.PID(0.3, 1.0, Ts=0.1),
        np.ones(120),
        schedule=pt.simulate.Schedule(Kp=ours),
    )
    assert run.u[:120] == approx(theirs.u, abs=1e-12)


def test_a_plant_that_varies_follows_the_corrected_equations():
    """Source 001, (3.7-20) to (3.7-25): gain, lag, delay and offset change from row to row."""
    N, Ts = 200, 0.02
    rng = np.random.default_rng(2)
    K, T = -6 + 0.5 * np.sin(np.arange(N) / 30), 0.15 + 0.03 * rng.random(N)
    lag, O = np.repeat([5, 4, 6, 5], 50), np.repeat([583.0, 590.0], 100)
    r = np.repeat([400.0, 420.0], 100)
    start = (400.0 - 583.0) / K[0]
    plant = oracle.Varying(K, T, lag, O, Ts, N, before=start)
    known = oracle.run(plant, oracle.Pid(-0.018, 0.0532), Ts, r, r_before=400.0, u_before=start)
    ours = pt.simulate.closed_loop(
        pt.simulate.VaryingPlant(K, T, lag * Ts, O),
        pt.models.PID(-0.018, 0.0532, Ts=Ts),
        r,
        u0=start,
    )
    assert ours.y[:N] == approx(known.y, abs=1e-8)
    assert ours.u[:N] == approx(known.u, abs=1e-9)


def test_pre_control_takes_the_work_from_the_integral():
    """(3.4-46) to (3.4-51): p = r / K, and the controller's own share ends at 0."""
    model, pid = pt.models.ProcessModel(K=2.0, T=1.0, L=0.3), pt.models.PID(0.5, 1.0, Ts=0.1)
    r = np.ones(300)
    with_p = pt.simulate.closed_loop(model, pid, r, p=r / 2.0)
    without = pt.simulate.closed_loop(model, pid, r)
    assert with_p.y[-1] == approx(1.0) and with_p.u[-1] == approx(0.5)
    assert with_p.indices.rise < without.indices.rise
