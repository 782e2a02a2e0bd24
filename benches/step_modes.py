"""Three time constants of a step response, against scipy's variable projection and against Prony.

`y = K + sum_j c_j e^(-t/T_j)`, source 003, (16), N = 401.  Ours chooses the order from 0 to 4 and
takes no start; scipy searches `ln T` of order 3 from one good start, QR inside, slopes by
differences; Prony is one linear regression on lagged differences with a lag of 2 s.
"""

from functools import partial

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant

T = np.array([1.25, 3.25, 5.5])
DT = 0.1
START = [1.0, 3.0, 6.0]


def response(noise):
    plant = pt.models.TransferFunction([1.0], np.poly(-1 / T))
    y = plant.step(DT * np.arange(401)) / plant.dc_gain()
    return y + noise * np.random.default_rng(0).normal(size=401)


def ours(noise, order="auto"):
    rec = pt.Record(u=np.ones(401), y=response(noise), Ts=DT)
    return lambda: np.pad(T := pt.estimate.idt(rec, order=order).T, (0, 3 - len(T)))


def scipy(noise):
    from scipy.optimize import least_squares

    t, y = DT * np.arange(401), response(noise)

    def residuals(q):
        X = np.column_stack([np.ones(401), np.exp(-np.outer(t, np.exp(-q)))])
        return y - X @ np.linalg.lstsq(X, y, rcond=None)[0]

    def job():
        found = least_squares(residuals, np.log(START), method="lm", xtol=1e-10, ftol=1e-12)
        return np.sort(np.exp(found.x))

    return job


def prony(noise, lag=20):
    y = response(noise)

    def job():
        rows = range(3 * lag, 401)
        Y = np.array([[y[n - j * lag] for j in range(4)] for n in rows])
        Y -= Y.mean(axis=0)
        a = np.linalg.lstsq(Y[:, 1:], -Y[:, 0], rcond=None)[0]
        z = np.roots([1.0, *a]).astype(complex)
        return np.sort(np.abs(lag * DT / np.log(z)))

    return job


def bench(noise, title):
    return Bench(
        f"three time constants, {title}",
        [
            Contestant("plantune.estimate.idt, order chosen", partial(ours, noise)),
            Contestant("the same, order=3", partial(ours, noise, 3)),
            Contestant("scipy least_squares, QR inside", partial(scipy, noise), ("scipy",)),
            Contestant("Prony, numpy", partial(prony, noise)),
        ],
        difference=lambda ours, theirs: float(np.max(np.abs(theirs / ours - 1.0))),
        memory=False,
    )


BENCHES = [bench(0.0, "without noise"), bench(1e-3, "0.1 % noise")]
