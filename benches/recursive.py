"""Recursive estimators: one stream, many loops side by side, tick by tick, called from Python.

First-order ARMAX with offset by RML, four parameters.  The yardstick is `plain.rs`: the same
recursion on the whole covariance matrix, one stream, compiled for the processor at hand.  numba
compiles the same, numpy does it lane by lane or for all lanes at once, and padasip knows RLS
only: its row is least squares on `[y(t-1), u(t-nk), 1]` and a column for e that is zero.
"""

import ctypes
import subprocess
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant

LOW, DELAYS = 1, 7
HIGH = LOW + DELAYS - 1
TRUE_NK = 4
SIGNS = [-1.0, 1.0, 1.0]  # of a1, b1, c1
LAM, LAM0, RHO, P0, C_MOST = 0.995, 0.95, 0.99, 1e6, 0.97


def records(N, loops):
    rng = np.random.default_rng(1)
    u, e = np.sign(rng.standard_normal((N, loops))), 0.1 * rng.standard_normal((N, loops))
    y = np.zeros((N, loops))
    for t in range(TRUE_NK, N):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - TRUE_NK] + e[t] - 0.4 * e[t - 1]
    return u, y + 100.0


# plantune --------------------------------------------------------------------------------------


def bank(N, loops, low=LOW, delays=DELAYS, **options):
    u, y = records(N, loops)
    nk = (low, low + delays - 1)

    def job():
        bank = pt.recursive.Bank(loops, nk, **options)
        bank.run(u, y)
        return right(bank.theta, low)

    return job


def right(theta, low=LOW):
    """a, b, c at the right delay, which all methods agree on."""
    return abc(theta[:, TRUE_NK - low])


def abc(theta):
    """Of a, b, d, c."""
    return theta[..., [0, 1, 3]]


def tick(loops, **options):
    u, y = records(20, loops)
    bank = pt.recursive.Bank(loops, (LOW, HIGH), **options)
    bank.run(u, y)
    rows = list(zip(u, y, strict=True)) * 10_000
    return lambda: bank.step(*rows.pop())


def armax(N):
    u, y = records(N, 1)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    return lambda: pt.recursive.ARMAX(1, 1, 1, TRUE_NK).run(rec, every=N).theta[-1] * SIGNS


def armax_steps(N):
    u, y = (x[:, 0].tolist() for x in records(N, 1))

    def job():
        armax = pt.recursive.ARMAX(1, 1, 1, TRUE_NK)
        for k in range(N):
            armax.step(u[k], y[k])
        return armax.theta * SIGNS

    return job


def bank_steps(N, low, delays):
    rows = list(zip(*records(N, 1), strict=True))

    def job():
        bank = pt.recursive.Bank(1, (low, low + delays - 1), errors=False)
        for row in rows:
            bank.step(*row)
        return right(bank.theta, low)

    return job


# The yardstick -----------------------------------------------------------------------------------


def yardstick(*options):
    source = Path(__file__).with_name("plain.rs")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "plain.so"
        args = ["rustc", "-O", *options, "-A", "non_snake_case", "--crate-type", "cdylib"]
        subprocess.run([*args, "-o", library, source], check=True)
        return ctypes.CDLL(str(library)).plain


def plain(N, loops, low=LOW, delays=DELAYS, options=("-C", "target-cpu=native")):
    (u, y), call = records(N, loops), yardstick(*options)
    theta = np.zeros((loops, delays, 4))
    pointers = [x.ctypes.data_as(ctypes.c_void_p) for x in (u, y, theta)]
    sizes = [ctypes.c_size_t(n) for n in (N, loops, low, delays)]

    def job():
        call(*sizes, *pointers)
        return right(theta, low)

    return job


# numba ---------------------------------------------------------------------------------------


def compiled():
    """One update of one estimator; its 20 numbers: theta, upper P, psi, ebar, gap."""
    from numba import njit

    @njit(fastmath=False)
    def update(s, y_before, u, y):
        phi = (y_before, u, 1.0, s[18])
        lam = LAM - s[19]
        s[19] *= RHO
        for i in range(4):
            s[14 + i] = phi[i] - s[3] * s[14 + i]
        p0, p1, p2, p3 = s[14], s[15], s[16], s[17]
        g0 = s[4] * p0 + s[5] * p1 + s[6] * p2 + s[7] * p3
        g1 = s[5] * p0 + s[8] * p1 + s[9] * p2 + s[10] * p3
        g2 = s[6] * p0 + s[9] * p1 + s[11] * p2 + s[12] * p3
        g3 = s[7] * p0 + s[10] * p1 + s[12] * p2 + s[13] * p3
        g = (g0, g1, g2, g3)
        scale, inverse = 1.0 / (lam + g0 * p0 + g1 * p1 + g2 * p2 + g3 * p3), 1.0 / lam
        eps = y - phi[0] * s[0] - phi[1] * s[1] - s[2] - phi[3] * s[3]
        k = 4
        for i in range(4):
            s[i] += g[i] * eps * scale
            for j in range(i, 4):
                s[k] = (s[k] - g[i] * g[j] * scale) * inverse
                k += 1
        s[3] = min(max(s[3], -C_MOST), C_MOST)
        s[18] = y - phi[0] * s[0] - phi[1] * s[1] - s[2] - phi[3] * s[3]
        return eps

    @njit
    def fresh(loops, delays):
        s = np.zeros((loops, delays, 20))
        for i in (4, 8, 11, 13):
            s[:, :, i] = P0
        s[:, :, 19] = LAM - LAM0
        return s

    @njit
    def run(u, y, low, delays):
        s = fresh(u.shape[1], delays)
        for k in range(u.shape[1]):
            for c in range(delays):
                for t in range(low + delays - 1, len(u)):
                    v = u[t - low - c, k] - u[0, k]
                    update(s[k, c], y[t - 1, k] - y[0, k], v, y[t, k] - y[0, k])
        return s

    @njit
    def tick(s, y_before, u, y):
        for k in range(s.shape[0]):
            for c in range(s.shape[1]):
                update(s[k, c], y_before[k], u[c, k], y[k])

    return fresh, update, run, tick


def numba(N, loops, low=LOW, delays=DELAYS):
    (u, y), (_, _, run, _) = records(N, loops), compiled()
    return lambda: right(run(u, y, low, delays), low)


def numba_tick(loops):
    (u, y), (fresh, _, _, tick) = records(20, loops), compiled()
    s, u, y = fresh(loops, DELAYS), u - u[0], y - y[0]
    samples = [(y[t - 1], np.array(u[t - HIGH : t][::-1]), y[t]) for t in range(HIGH, 20)] * 10_000
    return lambda: tick(s, *samples.pop())


def numba_steps(N):
    (u, y), (fresh, update, _, _) = records(N, 1), compiled()
    u, y = (u[:, 0] - u[0, 0]).tolist(), (y[:, 0] - y[0, 0]).tolist()

    def job():
        s = fresh(1, 1)[0, 0]
        for t in range(TRUE_NK, N):
            update(s, y[t - 1], u[t - TRUE_NK], y[t])
        return abc(s)

    return job


# numpy ---------------------------------------------------------------------------------------


def numpy_steps(N):
    """The formulas as they stand in the book."""
    u, y = (x[:, 0] - x[0, 0] for x in records(N, 1))

    def job():
        theta, P, psi, ebar, gap = np.zeros(4), P0 * np.eye(4), np.zeros(4), 0.0, LAM - LAM0
        for t in range(TRUE_NK, N):
            lam, gap = LAM - gap, gap * RHO
            phi = np.array([y[t - 1], u[t - TRUE_NK], 1.0, ebar])
            psi = phi - theta[3] * psi
            gain = P @ psi / (lam + psi @ P @ psi)
            theta = theta + gain * (y[t] - phi @ theta)
            P = (P - np.outer(gain, psi @ P)) / lam
            theta[3] = min(max(theta[3], -C_MOST), C_MOST)
            ebar = y[t] - phi @ theta
        return abc(theta)

    return job


class Lanes:
    """All estimators at once; time is the only loop."""

    def __init__(self, loops):
        shape = (loops, DELAYS)
        self.theta, self.psi, self.ebar = (
            np.zeros((*shape, 4)),
            np.zeros((*shape, 4)),
            np.zeros(shape),
        )
        self.P, self.gap = np.tile(P0 * np.eye(4), (*shape, 1, 1)), LAM - LAM0

    def step(self, y_before, u, y):
        lam, self.gap = LAM - self.gap, self.gap * RHO
        y_before = np.broadcast_to(y_before[:, None], u.shape)
        phi = np.stack([y_before, u, np.ones_like(u), self.ebar], axis=-1)
        psi = self.psi = phi - self.theta[..., 3:] * self.psi
        gain = (self.P @ psi[..., None])[..., 0]
        scaled = gain / (lam + (gain * psi).sum(axis=-1))[..., None]
        self.theta += scaled * (y[:, None] - (phi * self.theta).sum(axis=-1))[..., None]
        self.P = (self.P - scaled[..., :, None] * gain[..., None, :]) / lam
        np.clip(self.theta[..., 3], -C_MOST, C_MOST, out=self.theta[..., 3])
        self.ebar = y[:, None] - (phi * self.theta).sum(axis=-1)


def delayed(u, t):
    return np.ascontiguousarray(u[t - HIGH : t - LOW + 1][::-1].T)


def numpy_lanes(N, loops):
    u, y = (x - x[0] for x in records(N, loops))

    def job():
        lanes = Lanes(loops)
        for t in range(HIGH, N):
            lanes.step(y[t - 1], delayed(u, t), y[t])
        return right(lanes.theta)

    return job


def numpy_tick(loops):
    u, y = (x - x[0] for x in records(20, loops))
    lanes, samples = Lanes(loops), [(y[t - 1], delayed(u, t), y[t]) for t in range(HIGH, 20)]
    return lambda: lanes.step(*samples[0])


# padasip -------------------------------------------------------------------------------------


def padasip_steps(N):
    import padasip

    u, y = (x[:, 0] - x[0, 0] for x in records(N, 1))

    def job():
        rls = padasip.filters.FilterRLS(n=4, mu=LAM, eps=1e-6)
        for t in range(TRUE_NK, N):
            rls.adapt(y[t], np.array([y[t - 1], u[t - TRUE_NK], 1.0, 0.0]))
        return abc(rls.w)

    return job


# The tables ----------------------------------------------------------------------------------

N, FLEET, LIVE = 20_000, (500, 1000), 10_000
ONE = dict(low=TRUE_NK, delays=1)
THERE = hasattr(pt.recursive, "ARMAX")


def per(count, what):
    def remark(rows):
        rates = [f"{row['name']} {1e9 * np.median(row['cpu']) / count:.3g}" for row in rows]
        return f"ns per {what}: " + ", ".join(rates)

    return remark


BENCHES = [
    Bench(
        f"One loop, one delay, N = {N:.0e}",
        [
            Contestant("recursive.Bank.run", partial(bank, N, 1, **ONE, errors=False)),
            Contestant("with errors", partial(bank, N, 1, **ONE)),
            *[Contestant("recursive.ARMAX.run", partial(armax, N))] * THERE,
            Contestant("plain recursion, Rust", partial(plain, N, 1, **ONE)),
            Contestant("the same for any x86-64", partial(plain, N, 1, **ONE, options=())),
            Contestant("plain recursion, numba", partial(numba, N, 1, **ONE), ("numba",)),
            Contestant("plain recursion, numpy", partial(numpy_steps, N)),
            Contestant("least squares, padasip", partial(padasip_steps, N), ("padasip",)),
        ],
        memory=False,
        remark=per(N, "sample"),
    ),
    Bench(
        f"One loop, {DELAYS} delays, N = {N:.0e}",
        [
            Contestant("recursive.Bank.run", partial(bank, N, 1, errors=False)),
            Contestant("with errors", partial(bank, N, 1)),
            Contestant("plain recursion, Rust", partial(plain, N, 1)),
            Contestant("plain recursion, numba", partial(numba, N, 1), ("numba",)),
        ],
        memory=False,
        remark=per(N, "sample"),
    ),
    Bench(
        f"{FLEET[1]} loops x {DELAYS} delays, {FLEET[0]} samples",
        [
            Contestant("recursive.Bank.run", partial(bank, *FLEET, errors=False)),
            Contestant("with errors and clipping", partial(bank, *FLEET, clip=6.0)),
            Contestant("plain recursion, Rust", partial(plain, *FLEET)),
            Contestant("plain recursion, numba", partial(numba, *FLEET), ("numba",)),
            Contestant("plain recursion, numpy, all lanes at once", partial(numpy_lanes, *FLEET)),
        ],
        memory=False,
        remark=per(FLEET[0] * FLEET[1] * DELAYS, "update"),
    ),
    Bench(
        f"A live tick: {LIVE} loops x {DELAYS} delays",
        [
            Contestant("recursive.Bank.step", partial(tick, LIVE, errors=False)),
            Contestant("with errors", partial(tick, LIVE)),
            Contestant("plain recursion, numba", partial(numba_tick, LIVE), ("numba",)),
            Contestant("plain recursion, numpy, all lanes at once", partial(numpy_tick, LIVE)),
        ],
        difference=None,
        memory=False,
        remark=per(LIVE * DELAYS, "update"),
    ),
    Bench(
        f"Called from Python once a sample, {N:.0e} samples",
        [
            *[Contestant("recursive.ARMAX.step", partial(armax_steps, N))] * THERE,
            Contestant("recursive.Bank.step, one delay", partial(bank_steps, N, TRUE_NK, 1)),
            Contestant(
                f"recursive.Bank.step, {DELAYS} delays", partial(bank_steps, N, LOW, DELAYS)
            ),
            Contestant("plain recursion, numba", partial(numba_steps, N), ("numba",)),
            Contestant("plain recursion, numpy", partial(numpy_steps, N)),
            Contestant("least squares, padasip", partial(padasip_steps, N), ("padasip",)),
        ],
        memory=False,
        remark=per(N, "sample"),
    ),
]
