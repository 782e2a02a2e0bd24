"""Loops of 60 um for one cycle of 0 to 100 V, made by oracles."""

from types import SimpleNamespace

import numpy as np

from oracles import bouc_wen, play


def cosine(N, cycles=1):
    """Return x (cycles N + 1,) in V, from 0 on."""
    return 50 - 50 * np.cos(2 * np.pi * np.arange(cycles * N + 1) / N)


def sixty(y):
    y = y - y[0]
    return 60 * y / y.max()


def plays(n):
    def loop(N):
        x, r = cosine(N), np.linspace(0, 45, n)
        w = np.r_[0.42, np.linspace(0.06, 0.01, n - 1) * 9 / (n - 1)]
        return x, sixty(play.stack(x, r, w, play.plays(np.array([0.0, 100.0, 0.0]), r)[-1]))

    return loop


def asymmetric(N):
    x, y = plays(10)(N)
    return x, sixty(y + 0.0015 * np.maximum(y - 20, 0) ** 2)


def bouc_wen_loop(N):
    p = SimpleNamespace(alpha=0.25, beta=1.0, gamma=0.02, delta=0.015, nu=1.0)
    x = cosine(N)
    z0 = bouc_wen.exponentials(np.array([0.0, 100.0, 0.0]), p)[-1]
    return x, sixty(0.45 * x + bouc_wen.exponentials(x, p, z0))


LOOPS = {
    "10 plays": plays(10),
    "40 plays": plays(40),
    "asymmetric": asymmetric,
    "Bouc-Wen": bouc_wen_loop,
}
