"""ARX against numpy's `lstsq` on the built regressor: time, memory, accuracy.

`A(q) y(t) = B(q) u(t-1) + e(t)`, na = nb = n.  Accuracy is measured against the exact solution
of the least-squares problem that the given float64 numbers pose, worked out in fractions.
"""

from fractions import Fraction
from functools import partial

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant, Report

OFFSET = 100.0


def plant(n):
    """A with n stable poles, B without zeros on the unit circle."""
    pairs = [0.9 * np.exp(1j * w) for w in np.linspace(0.3, 2.8, n // 2)]
    A = np.real(np.poly([*pairs, *np.conj(pairs)]))
    return A, 0.5 ** np.arange(1, n + 1)


def simulated(N, n):
    """u and y with equation noise and an offset in y."""
    rng = np.random.default_rng(n)
    u, e = rng.standard_normal(N), 0.1 * rng.standard_normal(N)
    A, B = plant(n)
    model = pt.models.PolyModel(A=A, B=[B, [1.0]], nk=[1, 0], Ts=1.0)
    return u, model.simulate(np.column_stack([u, e])) + OFFSET


def regressor(u, y, n, offset):
    """`[-y(t-1) … -y(t-n), u(t-1) … u(t-n), 1]` and y(t)."""
    lags = [s[n - k : len(s) - k] for s in (-y, u) for k in range(1, n + 1)]
    return np.column_stack([*lags, *[np.ones(len(y) - n)] * offset]), y[n:]


def ours(N, n, offset):
    u, y = simulated(N, n)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    return lambda: pt.estimate.arx(rec, n, n, offset=offset).theta


def ours_with_record(N, n, offset):
    u, y = simulated(N, n)
    return lambda: pt.estimate.arx(pt.Record(u=u, y=y, Ts=1.0), n, n, offset=offset).theta


def lstsq(N, n, offset):
    phi, y = regressor(*simulated(N, n), n, offset)
    return lambda: np.linalg.lstsq(phi, y, rcond=None)[0][: 2 * n]


def build_and_lstsq(N, n, offset):
    u, y = simulated(N, n)
    return lambda: np.linalg.lstsq(*regressor(u, y, n, offset), rcond=None)[0][: 2 * n]


ROWS = {
    "plantune.estimate.arx": ours,
    "Record made + arx": ours_with_record,
    "numpy lstsq, regressor built before": lstsq,
    "numpy regressor built + lstsq": build_and_lstsq,
}


def bench(N, n, offset):
    def regressor_size(_):
        return f"regressor: {8e-6 * N * (2 * n + offset):.1f} MB"

    return Bench(
        f"ARX na = nb = {n}, N = {N:.0e}, {'with an' if offset else 'without'} offset",
        [Contestant(name, partial(setup, N, n, offset)) for name, setup in ROWS.items()],
        remark=regressor_size,
    )


# Accuracy -------------------------------------------------------------------------------------

# Samples per time constant at which the scaled regressor reaches the condition number.
PLAIN = [(False, samples) for samples in (1.3, 28.0, 256.0, 750.0)]
FAST = [*PLAIN, *((True, samples) for samples in (1.2, 25.0, 92.0))]


def fast_sampled(samples, offset):
    """A fourth-order plant sampled `samples` times per time constant, with its offset if any."""
    rng = np.random.default_rng(1)
    u = np.sign(rng.standard_normal(2000)) + OFFSET * offset
    poles = np.exp(-np.array([1.0, 1.5, 2.0, 3.0]) / samples)
    gain = np.prod(1 - poles)
    model = pt.models.PolyModel(A=np.poly(poles), B=[gain * 0.5 ** np.arange(4)], nk=[1], Ts=1.0)
    y = model.simulate(u) + OFFSET * offset
    return u, y + 1e-3 * gain * rng.standard_normal(len(y))


def exact(phi, y):
    """Solve the normal equations of the given numbers in fractions: no rounding at all."""
    whole = np.vectorize(lambda x: int(Fraction(x) * 2**200), otypes=[object])
    X = whole(np.column_stack([phi, y]))
    rows = [[Fraction(x) for x in line] for line in (X.T @ X)[:-1]]
    for i, pivot in enumerate(rows):
        rows[i] = pivot = [x / pivot[i] for x in pivot]
        for k, line in enumerate(rows):
            if k != i:
                rows[k] = [x - line[i] * p for x, p in zip(line, pivot, strict=True)]
    return np.array([float(line[-1]) for line in rows])


def lstsq_scaled(phi, y):
    lengths = np.linalg.norm(phi, axis=0)
    return np.linalg.lstsq(phi / lengths, y, rcond=None)[0] / lengths


def accuracy():
    lines = [f"{'':<8}{'condition':>10}{'plantune':>10}{'lstsq':>10}{'lstsq, columns scaled':>24}"]
    for offset, samples in FAST:
        u, y = fast_sampled(samples, offset)
        phi, rhs = regressor(u, y, 4, offset)
        theta = exact(phi, rhs)[:8]

        def error(x, theta=theta):
            return f"{np.linalg.norm(x[:8] - theta) / np.linalg.norm(theta):.0e}"

        condition = np.linalg.cond(phi / np.linalg.norm(phi, axis=0))
        ours = pt.estimate.arx(pt.Record(u=u, y=y, Ts=1.0), 4, 4, offset=offset).theta
        theirs = np.linalg.lstsq(phi, rhs, rcond=None)[0]
        scaled = lstsq_scaled(phi, rhs)
        name = "offset" if offset else "plain"
        errors = f"{error(ours):>10}{error(theirs):>10}{error(scaled):>24}"
        lines.append(f"{name:<8}{condition:>10.0e}{errors}")
    return lines


BENCHES = [
    Report(
        "ARX na = nb = 4, N = 2000: relative error of theta by condition of the scaled regressor",
        accuracy,
    ),
    bench(10**5, 4, False),
    bench(10**6, 4, False),
    bench(10**6, 4, True),
    bench(10**5, 10, False),
]
