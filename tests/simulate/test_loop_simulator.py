"""The loop that is stepped from outside: against the loop that knows all signals beforehand."""

import pickle

import numpy as np
import pytest

import plantune as pt
from plantune._core import LoopSimulator

TS, N = 0.02, 300
PID = pt.models.PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=TS)
NEXT = pt.models.PID(Kp=-0.1315, Ti=0.1491, Ts=TS)


def engine(**more):
    """Return the engine loop at rest at 400."""
    u0 = (400.0 - 583.451) / -5.939
    return LoopSimulator(-5.939, 0.1491, 0.1, TS, PID, offset=583.451, u0=u0, **more)


def test_it_is_closed_loop_to_the_last_bit():
    rng = np.random.default_rng(4)
    r = 400.0 + 50.0 * rng.choice([-1, 1], N // 15).repeat(15)
    noise = rng.normal(0.0, 1.0, N)
    K, L = np.where(np.arange(N) < 100, -5.939, -9.0), np.where(np.arange(N) < 200, 0.1, 0.147)
    plant = pt.simulate.VaryingPlant(K=K, T=0.1491, L=L, offset=583.451)
    actuator = pt.simulate.Actuator(low=25.0, high=40.0, rate=200.0)
    known = pt.simulate.closed_loop(
        plant,
        PID,
        r=r,
        Ts=TS,
        noise=noise,
        u0=(400.0 - 583.451) / -5.939,
        actuator=actuator,
        settings=[(150 * TS, NEXT)],
    )
    loop = engine(actuator=actuator, longest=0.2)
    rows = []
    for k in range(N):
        loop.set_plant(K[k], 0.1491, L[k], 583.451)
        if k == 150:
            loop.set(NEXT)
        if k == 220:
            loop = pickle.loads(pickle.dumps(loop))
        rows.append(loop.step(r[k], noise[k]))
    u, y = np.array(rows).T
    np.testing.assert_array_equal(u, known.u[:N])
    np.testing.assert_array_equal(y, known.y[:N] + noise)
    assert loop.pid == NEXT and loop.plant == (-9.0, 0.1491, 0.147, 583.451)


def test_new_settings_and_manual_come_without_a_bump():
    loop = engine()
    for _ in range(50):
        u, _ = loop.step(400.0)
    loop.set(NEXT)
    assert loop.step(400.0)[0] == pytest.approx(u, abs=1e-9)
    assert loop.hold(400.0, 33.0)[0] == 33.0
    assert loop.step(400.0)[0] == pytest.approx(33.0, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda: engine(actuator=pt.simulate.Actuator(low=100.0)), "U01"),
        (lambda: engine(anti_windup="sometimes"), "U01"),
        (lambda: engine().step(float("nan")), "U01"),
        (lambda: engine().set(pt.models.PID(Kp=1.0, Ti=1.0, Ts=0.5)), "U01"),
        (lambda: engine().set_plant(-6.0, 0.15, 0.5, 0.0), "U01"),
        (lambda: engine().set_plant(-6.0, -0.15, 0.1, 0.0), "M12"),
    ],
)
def test_what_is_no_loop_is_refused(change, code):
    with pytest.raises(pt.PlantuneError) as refused:
        change()
    assert refused.value.code == code
