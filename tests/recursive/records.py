"""Records of known plants for the recursive estimators."""

import numpy as np
from scipy.signal import lfilter

import plantune as pt

ENGINE = (-5.939, 0.1491)  # K, T of the first operating point of source 001; Ts 0.02 s


def levels(N, hold, rng, level=3.0):
    """Return +-1 about a level, switching at random."""
    return rng.choice([-1.0, 1.0], -(-N // hold)).repeat(hold)[:N] + level


def plant(kind, seed, N=1500, sd=0.3):
    """Return a record of `y = 0.5 q^-2 / (1 - 0.8 q^-1) u + 7 + v` from rest; v by kind."""
    rng = np.random.default_rng(seed)
    u, e = levels(N, 5, rng), sd * rng.normal(size=N)
    noise = {"arx": ([1], [1, -0.8]), "armax": ([1, 0.5], [1, -0.8]), "oe": ([1], [1])}
    noise["bj"] = ([1, 0.4], [1, -0.6])
    y = lfilter([0, 0, 0.5], [1, -0.8], u) + lfilter(*noise[kind], e) + 7.0
    return pt.Record(u=u, y=y, Ts=1.0)


ESTIMATORS = {
    "arx": (lambda **k: pt.recursive.ARX(1, 1, 2, **k), [-0.8, 0.5]),
    "armax": (lambda **k: pt.recursive.ARMAX(1, 1, 1, 2, **k), [-0.8, 0.5, 0.5]),
    "oe": (lambda **k: pt.recursive.OE(1, 1, 2, **k), [0.5, -0.8]),
    "bj": (lambda **k: pt.recursive.BJ(1, 1, 1, 1, 2, **k), [0.5, 0.4, -0.6, -0.8]),
}


def engine_with_steps(seed, noise_var=1.5, steps=(), t_end=30.0):
    """Return the engine loop of source 001, 3.7.6c, its output offset stepping at (t, by).

    K e^(-0.1 s)/(T s + 1), Ts 0.02 s, offset 583.451, PI -0.018, -0.3385; the set point is
    400 +- 50 and held 0.2 s.
    """
    rng = np.random.default_rng(1000 + seed)
    N, (K, T) = round(t_end / 0.02), ENGINE
    r = levels(N, 10, rng, 0.0) * 50.0 + 400.0
    e = np.sqrt(noise_var) * rng.normal(size=N)
    a = np.exp(-0.02 / T)
    offset = 583.451 + sum(by * (0.02 * np.arange(N) >= t - 1e-9) for t, by in steps)
    offset = np.broadcast_to(offset, N)
    u, y = np.zeros(N), np.zeros(N)
    integral = u_first = (400.0 - 583.451) / K
    x = K * u_first
    for k in range(N):
        if k:
            x = a * x + K * (1 - a) * (u[k - 6] if k >= 6 else u_first)
        y[k] = x + offset[k] + e[k]
        integral -= 0.3385 * 0.02 * (r[k] - y[k])
        u[k] = -0.018 * (r[k] - y[k]) + integral
    return pt.Record(u=u, y=y, r=r, Ts=0.02)


def gain_and_lag(trace):
    """Return relative errors of K and T along a trace of ARMAX(1, 1, 1, 6) on the engine."""
    a, b = -trace.theta[:, 0], trace.theta[:, 1]
    inside = (a > 0) & (a < 1)
    T = np.where(inside, -0.02 / np.log(np.where(inside, a, 0.5)), np.inf)
    return b / (1 - a) / ENGINE[0] - 1, T / ENGINE[1] - 1
