"""Source 001, 3.7.6: the built-in simulators of plant and controller, (3.7-20) to (3.7-25).

The equations as corrected: the input acts N_L + 1 samples late in (3.7-22), and (3.7-25) has the
integral that it lacks in print.  Numbers of the text: operating point 1 with its offset, set point
400 +- 50, and the PI of the sponsor.
"""

from math import exp

import numpy as np
from pytest import approx

import plantune as pt

K, T, L, O, TS = -5.939, 0.1491, 0.1, 583.451, 0.02
KP, KI = -0.018, -0.3385
U0 = (400.0 - O) / K


def set_point(N):
    return 400.0 + 50.0 * np.sign(np.sin(np.arange(N) / 17.0) + 0.1)


def recursions(r, N_L):
    """Write plant and controller out, sample by sample."""
    a1 = exp(-TS / T)  # (3.7-20)
    b1 = K * (1 - a1)  # (3.7-21)
    yD, integral, u, y = K * U0, U0 / KI, [], []
    for k in range(len(r)):
        if k > 0:
            yD = a1 * yD + b1 * (u[k - 1 - N_L] if k - 1 - N_L >= 0 else U0)  # (3.7-22)
        y.append(yD + O)  # (3.7-23)
        e = r[k] - y[k]  # (3.7-24)
        integral += TS * e
        u.append(KP * e + KI * integral)  # (3.7-25)
    return np.array(y), np.array(u)


def test_both_simulators_are_the_loop_of_the_source():
    r = set_point(1500)
    y, u = recursions(r, N_L=5)
    pid = pt.models.PID(KP, KP / KI, Ts=TS)
    plants = {
        "its own": (pt.simulate.VaryingPlant(K=K, T=T, L=L, offset=O), {}),
        "fixed": (pt.models.ProcessModel(K, T, L), {"offset": O}),
    }
    for plant, offset in plants.values():
        run = pt.simulate.closed_loop(plant, pid, r, u0=U0, **offset)
        assert run.y[:-1] == approx(y, abs=1e-9)
        assert run.u[:-1] == approx(u, abs=1e-9)


def test_the_delay_as_printed_is_one_sample_short():
    """u(k - L) instead of u(k - 1 - N_L): a model of 0.08 s follows it."""
    r = set_point(400)
    y, _ = recursions(r, N_L=4)
    pid = pt.models.PID(KP, KP / KI, Ts=TS)
    run = pt.simulate.closed_loop(pt.models.ProcessModel(K, T, 0.08), pid, r, u0=U0, offset=O)
    assert run.y[:-1] == approx(y, abs=1e-9)


def test_the_controller_as_printed_leaves_most_of_the_error():
    """u = (K_P + K_I Ts) e is a P controller: the errata count 87 % of a step."""
    gain = KP + KI * TS
    run = pt.simulate.step(pt.models.ProcessModel(K, T, L), pt.models.PID(gain, Ts=TS), t_end=20.0)
    assert 1 - run.y[-1] == approx(1 / (1 + K * gain), rel=1e-9)
    assert 1 - run.y[-1] == approx(0.87, abs=5e-3)


def test_parameters_come_from_tables_of_three_signals():
    """Four arrays of three dimensions, interpolated; each table here is linear in its signals."""
    rng = np.random.default_rng(4)
    axes = [np.linspace(800, 3000, 4), np.linspace(0, 100, 3), np.linspace(-1, 1, 2)]
    grid = np.meshgrid(*axes, indexing="ij")
    weights = {
        "K": (-8.0, 1e-3, 0.01, 0.2),
        "T": (0.1, 2e-5, 1e-4, 0.01),
        "L": (0.06, 1e-5, 1e-4, 0.005),
        "offset": (500.0, 0.03, 0.1, 2.0),
    }
    signals = [rng.uniform(axis[0], axis[-1], 200) for axis in axes]

    def linear(w, x):
        return w[0] + sum(c * s for c, s in zip(w[1:], x, strict=True))

    read = {n: pt.simulate.Table(axes, linear(w, grid)).at(*signals) for n, w in weights.items()}
    for name, w in weights.items():
        assert read[name] == approx(linear(w, signals), rel=1e-12)
    u = rng.normal(30, 3, 200)
    y = pt.simulate.VaryingPlant(**read).simulate(u, TS, u0=30.0)
    yD, past = read["K"][0] * 30.0, np.concatenate([np.full(20, 30.0), u])
    for k in range(200):
        if k > 0:
            a1 = exp(-TS / read["T"][k])
            N_L, f = divmod(read["L"][k], TS)
            older, newer = past[20 + k - 2 - int(N_L)], past[20 + k - 1 - int(N_L)]
            aged = exp(-(TS - f) / read["T"][k])  # the share of the sample after the jump
            yD = a1 * yD + read["K"][k] * ((1 - aged) * newer + (aged - a1) * older)
        assert y[k] == approx(yD + read["offset"][k], rel=1e-12)
