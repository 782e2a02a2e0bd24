"""Controllers, plants and seeded signals that both languages are tried on."""

import numpy as np

from plantune.models import PID, PolyModel, ProcessModel

CONTROLLERS = {
    "P": PID(Kp=1.5, Ts=0.1),
    "I": PID.integral(0.8, Ts=0.1),
    "PI": PID(Kp=-0.13, Ti=0.15, Ts=0.02),
    "PI weighted": PID(Kp=2.0, Ti=1.0, b=0.4, Ts=0.1),
    "PID": PID(Kp=2.0, Ti=3.0, Td=0.4, Tf=0.05, b=0.7, c=0.2, Ts=0.1),
    "PD unfiltered": PID(Kp=0.7, Td=0.3, c=1.0, Ts=0.1),
}
PLANTS = {
    "no delay": (ProcessModel(K=2.0, T=1.0, L=0.0), 0.1),
    "a fraction": (ProcessModel(K=-5.939, T=0.1491, L=0.107), 0.02),
    "whole samples": (ProcessModel(K=2.0, T=5.0, L=1.5), 0.5),
    "long": (ProcessModel(K=0.3, T=5.0, L=300.1), 0.5),
    "arx": (PolyModel(A=[1, -1.27, 0.39], B=[0.067, 0.044], nk=3, Ts=0.08), None),
    "oe": (PolyModel(B=[0.5, -0.2, 0.1], F=[1, -1.5, 0.7], nk=1, Ts=1.0), None),
    "A and F": (PolyModel(A=[1, -0.5], B=[1.0, 0.2], F=[1, 0.2, 0.1], nk=2, Ts=1.0), None),
    "direct": (PolyModel(A=[1, -0.5], B=[1.0, 0.2], nk=0, Ts=1.0), None),
    "gain alone": (PolyModel(B=[2.5], nk=0, Ts=1.0), None),
    "integrating": (PolyModel(A=[1, -1], B=[0.1], nk=5, Ts=1.0), None),
}


def readings(N=1000, seed=11, size=3.0):
    """Return r (N,), a staircase, and y (N,), a random walk with noise."""
    rng = np.random.default_rng(seed)
    r = size * np.repeat(rng.normal(size=N // 50 + 1), 50)[:N]
    return r, 0.3 * size * np.cumsum(rng.normal(size=N)) / np.sqrt(N) + 0.1 * rng.normal(size=N)


def staircase(N=1000, seed=12):
    """Return u (N,) of random levels, some of them long."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.normal(size=N), rng.integers(1, 9, N))[:N]


def near(expected):
    """Return how near every sample must be.

    The sums of a step are the core's in another order: some roundings of 1e-16 of the largest
    term a step, gathered by an integral over a thousand of them.
    """
    expected = np.asarray(expected)
    return {"rel": 1e-12, "abs": 1e-12 * max(1.0, np.abs(expected).max())}
