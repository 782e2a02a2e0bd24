"""Hysteresis, sample by sample: what a stack of plays costs, and relays whatever their grid.

Plays: the peers are the same recursion, play after play in numba and all at once in numpy.

Preisach: the peers run the same Everett table and the same stack of remembered extremes, written
out plainly in numba and in Python; numpy also steps the relays one by one, all at once, as
textbooks have the model.  The grid changes the work of the relays alone.
"""

from functools import partial

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant

N, FEW = 200_000, 2_000


def walk(n):
    """A random walk, reflected at -1 and 1."""
    steps = np.random.default_rng(1).standard_normal(n) * 0.02
    return 1.0 - np.abs((np.cumsum(steps) + 1.0) % 4.0 - 2.0)


def sine(n):
    return np.sin(np.arange(n) / 50) * np.cos(np.arange(n) / 777)


def levels(grid):
    return np.linspace(-1.0, 1.0, grid + 1)


def mu(grid):
    return np.tri(grid) * (1 + np.add.outer(np.arange(grid), np.arange(grid))) / grid**3


# Preisach ----------------------------------------------------------------------------------------


def ours(grid, record, n=N):
    relays, x = (
        pt.hysteresis.Preisach(levels=levels(grid), mu=mu(grid), start="negative"),
        record(n),
    )
    stream = relays.stream()
    start = stream.state

    def job():
        stream.state = start
        return stream.run(x)[-100:]

    return job


def peers_model(grid):
    """Levels per unit, and E with its sign turned below the diagonal: a rise and a fall alike."""
    E = np.asarray(pt.hysteresis.Preisach(levels=levels(grid), mu=mu(grid)).everett)
    return E - E.T


def by_table(E, x, out, end, f_end):
    """The table and the stack, plainly: Python as it stands, or compiled by numba."""
    n = E.shape[0] - 1
    end[0], f_end[0], depth = -1.0, -E[n, 0], 1
    now, f, rising = -1.0, -E[n, 0], True
    for t in range(len(x)):
        xt = min(max(x[t], -1.0), 1.0)
        if xt != now:
            if (xt > now) != rising:
                end[depth], f_end[depth] = now, f
                depth, rising = depth + 1, not rising
            while depth > 2 and (xt >= end[depth - 2] if rising else xt <= end[depth - 2]):
                depth -= 2
            p, q = (xt + 1) * n / 2, (end[depth - 1] + 1) * n / 2
            i, j = min(int(p), n - 1), min(int(q), n - 1)
            p, q = p - i, q - j
            low = E[i, j] + p * (E[i + 1, j] - E[i, j])
            high = E[i, j + 1] + p * (E[i + 1, j + 1] - E[i, j + 1])
            now, f = xt, f_end[depth - 1] + 2 * (low + q * (high - low))
        out[t] = f
    return out


def numba_table(grid, record):
    from numba import njit

    run, E, x = njit(by_table), peers_model(grid), record(N)
    out, end, f_end = np.zeros(N), np.zeros(10_000), np.zeros(10_000)
    return lambda: run(E, x, out, end, f_end)[-100:]


def python_table(grid, record):
    E, x = peers_model(grid), record(FEW)
    out, end, f_end = np.zeros(FEW), np.zeros(10_000), np.zeros(10_000)
    return lambda: by_table(E, x, out, end, f_end)[-100:]


def numpy_relays(grid, record):
    """Relays in the middle of their cells, all at once."""
    middle = (levels(grid)[:-1] + levels(grid)[1:]) / 2
    i, j = np.tril_indices(grid)
    alpha, beta, weight, x = middle[i], middle[j], mu(grid)[i, j], record(FEW)

    def job():
        state, y = np.full(len(weight), -1.0), np.zeros(FEW)
        for t in range(FEW):
            state[x[t] >= alpha] = 1.0
            state[x[t] <= beta] = -1.0
            y[t] = weight @ state
        return y[-100:]

    return job


# Plays -------------------------------------------------------------------------------------------


def widths(n):
    return np.arange(n) / n


def stack(n, record=walk, rows=N):
    stream = pt.hysteresis.PlayStack(r=widths(n), w=np.full(n, 1 / n)).stream()
    x, start = record(rows), np.zeros(n)

    def job():
        stream.state = start
        return stream.run(x)[-100:]

    return job


def stack_steps(n):
    """One sample at a time, from Python."""
    stream, x = (
        pt.hysteresis.PlayStack(r=widths(n), w=np.full(n, 1 / n)).stream(),
        walk(FEW).tolist(),
    )
    start = np.zeros(n)

    def job():
        stream.state = start
        return [stream.step(value) for value in x][-100:]

    return job


def by_plays(r, w, x, z, out):
    """One play after the other: Python as it stands, or compiled by numba."""
    z[:] = 0.0
    for t in range(len(x)):
        y = 0.0
        for i in range(len(r)):
            z[i] = max(x[t] - r[i], min(x[t] + r[i], z[i]))
            y += w[i] * z[i]
        out[t] = y
    return out


def numba_plays(n):
    from numba import njit

    run, x = njit(fastmath=True)(by_plays), walk(N)
    r, w, z, out = widths(n), np.full(n, 1 / n), np.zeros(n), np.zeros(N)
    return lambda: run(r, w, x, z, out)[-100:]


def numpy_plays(n):
    """All plays at once, one sample after the other."""
    r, w, x = widths(n), np.full(n, 1 / n), walk(FEW)

    def job():
        z, y = np.zeros(n), np.zeros(FEW)
        for t in range(FEW):
            z = np.maximum(x[t] - r, np.minimum(x[t] + r, z))
            y[t] = w @ z
        return y[-100:]

    return job


def plays(n):
    return Bench(
        f"{n} plays, N = {N:.0e}",
        [
            Contestant("Stream.run", partial(stack, n)),
            Contestant("play after play, numba", partial(numba_plays, n), ("numba",)),
        ],
        memory=False,
        patience=8,
        remark=per_sample([N, N]),
    )


def few_plays(n):
    return Bench(
        f"{n} plays, N = {FEW:.0e}",
        [
            Contestant("Stream.run", partial(stack, n, walk, FEW)),
            Contestant("Stream.step, from Python", partial(stack_steps, n)),
            Contestant("all plays at once, numpy", partial(numpy_plays, n)),
        ],
        memory=False,
        remark=per_sample([FEW] * 3),
    )


# The tables --------------------------------------------------------------------------------------


def per_sample(samples):
    """Nanoseconds per sample of each, and the worst process of the first over its median."""

    def remark(rows):
        rates = [
            f"{row['name']} {1e9 * np.median(row['cpu']) / n:.3g}"
            for row, n in zip(rows, samples, strict=False)
        ]
        spread = np.max(rows[0]["cpu"]) / np.median(rows[0]["cpu"])
        worst = f"; worst of {len(rows[0]['cpu'])} processes {spread:.2f} of the median"
        return "ns per sample: " + ", ".join(rates) + worst

    return remark


def preisach(grid, record):
    return Bench(
        f"Preisach, {grid} levels, {record.__name__}, N = {N:.0e}",
        [
            Contestant("Stream.run", partial(ours, grid, record)),
            Contestant("table and stack, numba", partial(numba_table, grid, record), ("numba",)),
        ],
        memory=False,
        patience=8,
        remark=per_sample([N, N]),
    )


def plain(grid, record):
    return Bench(
        f"Preisach, {grid} levels, {record.__name__}, N = {FEW:.0e}",
        [
            Contestant("Stream.run", partial(ours, grid, record, FEW)),
            Contestant("table and stack, Python", partial(python_table, grid, record)),
            Contestant("relays all at once, numpy", partial(numpy_relays, grid, record)),
        ],
        difference=None,  # relays in the middle of their cells leave a staircase
        memory=False,
        remark=per_sample([FEW] * 3),
    )


BENCHES = [
    plays(100),
    few_plays(100),
    *[preisach(grid, record) for grid in (20, 100, 400) for record in (walk, sine)],
    *[plain(grid, walk) for grid in (20, 100)],
]
