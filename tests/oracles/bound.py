"""Cramer-Rao bound of K, T, L and O identified in a closed loop; source 001, 3.7.6.

    plant        yD(k) = a yD(k-1) + K (1 - a) u(k - 1 - L/Ts), a = e^(-Ts/T), at rest before
    controller   u(k) = u(k-1) + (Kp + Ki Ts) e(k) - Kp e(k-1), e = r - y     ERRATA 3.1, (3.7-25)
    "output"     y = yD + O + e                                   white noise on the output
    "equation"   A y = B u + (1 - a) O + C e, C = 1 + c q^-1      ARMAX noise

u depends on past y and r alone, so the likelihood of y is that of the one-step prediction
errors with u as measured, and the information matrix is

    J(t) = sum psi psi'/var e, psi = -d eps/d theta;   Cov >= J(t)^-1         Ljung 1999, 7.4

of the record in hand, whose r is given; averages are taken over records.  The slope by L,

    dy/dL = -K/T sum_j (u_j - u_(j-1)) e^(-(t - t_j - L)/T) over t > t_j + L,

has two sides where a move arrives at a sample (L/Ts whole): this one is towards larger L,
`side="left"` counts t >= t_j + L and is towards smaller L.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter


@dataclass(frozen=True)
class Engine:
    """The engine loop of source 001, 3.7.6c, with a delay of whole samples."""

    K: float = -5.939
    T: float = 0.1491
    L: float = 0.1
    O: float = 583.451
    Ts: float = 0.02
    Kp: float = -0.018
    Ki: float = -0.3385
    level: float = 400.0

    @property
    def a(self):
        return np.exp(-self.Ts / self.T)

    @property
    def nk(self):
        return round(self.L / self.Ts) + 1

    @property
    def u_rest(self):
        return (self.level - self.O) / self.K


def set_points(N, runs, hold, seed=0, wait=0, level=400.0, amplitude=50.0):
    """Return r (N, runs): `level` for `wait` samples, then level +- amplitude.

    Each value is held for `hold` samples; a pair (low, high) draws the length of each hold.
    """
    rng = np.random.default_rng(seed)
    r = np.full((N, runs), level)
    for j in range(runs):
        k = wait
        while k < N:
            n = hold if np.ndim(hold) == 0 else rng.integers(hold[0], hold[1] + 1)
            r[k : k + n, j] = level + amplitude * rng.choice([-1.0, 1.0])
            k += n
    return r


def simulate(engine, r, e, noise="output", c=0.0):
    """Return u and y (N, runs) of the loop that was at rest at `engine.level`."""
    p, N = engine, len(r)
    u, y = np.zeros_like(r), np.zeros_like(r)
    x = np.full(r.shape[1], p.level)
    u_old, error_old, e_old = np.full(r.shape[1], p.u_rest), 0.0, 0.0
    for k in range(N):
        acting = u[k - p.nk] if k >= p.nk else p.u_rest
        if k:
            x = p.a * x + (1 - p.a) * (p.K * acting + p.O)
        if noise == "equation":
            x = x + e[k] + c * e_old
            e_old = e[k]
            y[k] = x
        else:
            y[k] = x + e[k]
        error = r[k] - y[k]
        u[k] = u_old + (p.Kp + p.Ki * p.Ts) * error - p.Kp * error_old
        u_old, error_old = u[k], error
    return u, y


def sensitivities(engine, u, y=None, e=None, c=0.0, side="right"):
    """Return psi (4 or 5, N, runs) for K, T, L, O and, with y and e given, c.

    Without y the noise is white on the output; with it the errors are those of ARMAX.
    """
    p = engine
    a, nk = p.a, p.nk
    da = a * p.Ts / p.T**2
    v = np.concatenate([np.full((nk, u.shape[1]), p.u_rest), u])  # v[k + nk] = u[k]
    acting, before = v[: len(u)], np.concatenate([v[:1], v[: len(u) - 1]])
    # what a move of L does to b1 u(k - nk) + b2 u(k - nk - 1); METHODS 1.5
    by_L = -p.K / p.T * a * (acting - before)
    if side == "left":
        by_L = -p.K / p.T * (v[1 : len(u) + 1] - acting)

    if y is None:
        x = lfilter([1 - a], [1, -a], acting, axis=0, zi=np.full((1, u.shape[1]), a * p.u_rest))[0]
        x_old = np.concatenate([np.full((1, u.shape[1]), p.u_rest), x[:-1]])

        def through(drive):
            return lfilter([1.0], [1, -a], drive, axis=0)

        by_T = through(da * p.K * (x_old - acting))
        return np.array([x, by_T, through(by_L), np.ones_like(u)])

    y_old = np.concatenate([np.full((1, u.shape[1]), p.level), y[:-1]])
    e_old = np.concatenate([np.zeros((1, u.shape[1])), e[:-1]])
    drives = [
        (1 - a) * acting,
        da * (y_old - p.K * acting - p.O),
        by_L,
        np.full_like(u, 1 - a),
        e_old,
    ]
    return np.array([lfilter([1.0], [1, c], drive, axis=0) for drive in drives])


def covariance(psi, variance=1.5):
    """Return J^-1 (runs, n, n) of each record; psi (n, N, runs)."""
    J = np.einsum("ikr,jkr->rij", psi, psi) / variance
    s = np.sqrt(np.einsum("rii->ri", J))
    ss = s[:, :, None] * s[:, None, :]
    return np.linalg.inv(J / ss) / ss


def bound(
    times=(2.0, 5.0, 10.0),
    *,
    engine=None,
    hold=10,
    wait=0,
    variance=1.5,
    noise="output",
    c=0.0,
    parameters="KTO",
    runs=200,
    seed=0,
    side="right",
    average="rms",
):
    """Return standard deviations (times, parameters): K, T, L relative, O and c absolute.

    Counted are the samples from the start of the record to t + wait Ts: t seconds after the
    first move of the set point.  Each record has its own bound; over the records is taken
    "rms" (what the root mean square of errors is to be compared with), "mean" or "median";
    "information" inverts the mean of J, which is less, since records differ.
    """
    p = engine or Engine()
    ends = [wait + round(t / p.Ts) for t in times]
    r = set_points(max(ends), runs, hold, seed, wait, p.level)
    e = np.sqrt(variance) * np.random.default_rng(seed + 1).normal(size=r.shape)
    u, y = simulate(p, r, e, noise, c)
    if noise == "output":
        psi, names = sensitivities(p, u, side=side), "KTLO"
    else:
        psi, names = sensitivities(p, u, y, e, c, side), "KTLOc"
    psi = psi[[names.index(name) for name in parameters]]
    unit = np.array([dict(K=abs(p.K), T=p.T, L=p.L).get(name, 1.0) for name in parameters])
    return np.array([averaged(psi[:, :end], variance, average) for end in ends]) / unit


def averaged(psi, variance, how):
    if how == "information":  # one long record of all runs, and the share of one of them
        together = psi.reshape(len(psi), -1, 1)
        return np.sqrt(np.diag(covariance(together, variance)[0]) * psi.shape[2])
    var = np.einsum("rii->ri", covariance(psi, variance))
    if how == "rms":
        return np.sqrt(var.mean(axis=0))
    return {"mean": np.mean, "median": np.median}[how](np.sqrt(var), axis=0)
