"""Periodic records: turning points, cycles, the repeatability of a loop; a stage to try them on.

turning point   an extreme of x from which x has come back by more than `least`
cycle           from one lowest turning point to the next
repeatability   max and rms over x and both branches of y of one cycle less y of another
stage           two cycles of 50 - 50 cos(w t) V; y = stack + drift + creep, rounded to
                122.07 nm (14 bit over 20 V, 100 um/V: ERRATA 4 on source 002, 2.4)
"""

import numpy as np

from oracles import creep, play

DIGIT = 20 / 2**14 * 100  # um


def turning_points(x, least):
    """Return the indices of the extremes of x, both ends among them."""
    points, way, best = [0], 0, 0
    for t in range(len(x)):
        if way == 0:
            if abs(x[t] - x[0]) > least:
                way, best = np.sign(x[t] - x[0]), t
        elif (x[t] - x[best]) * way >= 0:
            best = t
        elif (x[best] - x[t]) * way > least:
            points.append(best)
            way, best = -way, t
    return [*points, best]


def split(x, least):
    """Return (first, top, last) of each whole cycle that starts at its lowest point."""
    p = turning_points(x, least)
    return [
        (a, b, c) for a, b, c in zip(p, p[1:], p[2:], strict=False) if x[b] > x[a] and x[b] > x[c]
    ]


def branches(x, y, cycle, grid):
    """Return y of the rising and of the falling branch at the levels of a grid."""
    a, b, c = cycle
    up = np.interp(grid, np.maximum.accumulate(x[a : b + 1]), y[a : b + 1])
    down = np.interp(grid, np.maximum.accumulate(x[c : b - 1 : -1]), y[c : b - 1 : -1])
    return np.concatenate([up, down])


def repeatability(x, y, one, other, n=200):
    """Return the largest and the rms difference of two cycles over the x both have."""
    low = max(x[c].min() for c in map(inside, (one, other)))
    high = min(x[c].max() for c in map(inside, (one, other)))
    grid = np.linspace(low, high, n)
    d = branches(x, y, one, grid) - branches(x, y, other, grid)
    return abs(d).max(), np.sqrt(np.mean(d**2))


def inside(cycle):
    return slice(cycle[0], cycle[2] + 1)


def stage(N=2000, cycles=2, size=60.0, drift=0.3, slow=0.01, noise=0.0, digit=DIGIT, seed=0):
    """Return x (V) and y (um): an asymmetric loop of `size`, drift per cycle in um."""
    t = np.arange(cycles * N + 1) / N
    x = 50 - 50 * np.cos(2 * np.pi * t)
    r = np.linspace(0, 45, 10)
    w = np.array([0.42, 0.05, 0.04, 0.04, 0.03, 0.03, 0.02, 0.02, 0.01, 0.01])
    h = play.stack(x, r, w, play.plays(x, r)[-1])  # the first cycle runs on the loop already
    h -= h[0]
    y = h + 0.0015 * np.maximum(h - 20, 0) ** 2
    y *= size / y.max()
    y += drift * t + slow * creep.creep(y, 1 / N, [1.0], [0.5])
    y += noise * np.random.default_rng(seed).normal(size=len(t))
    return x, np.round(y / digit) * digit if digit else y
