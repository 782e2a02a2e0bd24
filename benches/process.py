"""First order plus dead time on the simulated engine loop, against the same fit by scipy.

`y = K e^(-L s) / (T s + 1) u + O`, initial state estimated, on the same rows.  scipy gets a start
near the truth; ours takes none and searches the delay over its whole range.
"""

from functools import partial

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant

START = dict(K=-5.0, T=0.2, L=0.08, offset=580.0, x0=0.0)


def record():
    return pt.datasets.engine_loop(noise_var=1.5, seed=1)


def ours():
    rec = record()

    def job():
        fit = pt.estimate.process(rec, "P1D")
        return [*fit.theta, *fit.offset]

    return job


def residuals(p, u, y, Ts, skip):
    """Exact recursion of the held input with a delay of d samples and a fraction."""
    from scipy.signal import lfilter

    K, T, L, offset, x0 = p
    d = int(L // Ts)
    a, b = np.exp(-Ts / T), np.exp(-((d + 1) * Ts - L) / T)
    A, B = [1.0, -a], [*[0.0] * (d + 1), K * (1.0 - b), K * (b - a)]
    forced = lfilter(B, A, u - u[0]) + K * u[0]
    free = x0 * a ** np.arange(len(u) - skip)
    return forced[skip:] + free + offset - y[skip:]


def scipy(jac):
    from scipy.optimize import least_squares

    rec = record()
    skip = rec.N - pt.estimate.process(rec, "P1D").N
    data = rec.u[:, 0], rec.y[:, 0], rec.Ts, skip
    low, high = [-np.inf, 1e-3, 0.0, -np.inf, -np.inf], [np.inf, 10.0, 1.0, np.inf, np.inf]

    def job():
        fit = least_squares(
            residuals, [*START.values()], jac, (low, high), x_scale="jac", args=data, xtol=1e-10
        )
        return fit.x[:4]

    return job


BENCHES = [
    Bench(
        "P1D on the engine loop, 3000 rows: K, T, L and offset",
        [
            Contestant("plantune.estimate.process", ours),
            Contestant("scipy least_squares, lfilter", partial(scipy, "2-point"), ("scipy",)),
            Contestant("the same, central differences", partial(scipy, "3-point"), ("scipy",)),
        ],
        difference=lambda ours, theirs: float(np.max(np.abs(theirs / ours - 1.0))),
    )
]
