"""A record of steps as a process model from rest, at any time stamps, and as a free sum of modes.

    y(t) = O + K [u_0 + sum_j (u_j - u_(j-1)) S(t - t_j - L)] + e,
    S(tau) = 1 - e^(-tau/T), or 1 - (T1 e^(-tau/T1) - T2 e^(-tau/T2))/(T1 - T2); 0 for tau <= 0.

The same rows without rest, delay or O: `step_modes` from the row where y has left its band at
rest, by then the delay is over.  Both with deviations for a residual of lag-1 correlation r,
sqrt((1 + r)/(1 - r)) times the white ones, they agree where the model class holds.
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares

# -- from rest ---------------------------------------------------------------------------------


def step_response(tau, T):
    """Return S(tau) of one or two time constants."""
    tau = np.maximum(tau, 0.0)
    if len(T) == 1:
        return -np.expm1(-tau / T[0])
    a, b = T
    if abs(a - b) < 1e-5 * a:
        return 1 - (1 + tau / a) * np.exp(-tau / a)
    return 1 - (a * np.exp(-tau / a) - b * np.exp(-tau / b)) / (a - b)


def process(t, u, y, n, delays=(0.0, 10.0, 30.0)):
    """Fit n = 1 or 2 time constants, L, O, K from several starts; `sd` of [ln T, L, O, K]."""
    rows = np.flatnonzero(np.diff(u)) + 1
    span = t[-1] - t[0]

    def columns(p):
        held = u[0] + sum(
            (u[j] - u[j - 1]) * step_response(t - t[j] - p[-1], np.exp(p[:n])) for j in rows
        )
        return np.column_stack([np.ones(len(t)), held])

    def eps(p):
        X = columns(p)
        return y - X @ np.linalg.lstsq(X, y, rcond=None)[0]

    lag = [[1 / 4], [1 / 10]] if n == 1 else [[1 / 50, 1 / 5], [1 / 12, 1 / 6]]
    low, high = [np.log(1e-4 * span)] * n + [0.0], [np.log(10 * span)] * n + [span / 2]
    tries = [
        least_squares(eps, [*np.log(np.array(a) * span), L], bounds=(low, high), jac="3-point")
        for a in lag
        for L in delays
    ]
    p = min(tries, key=lambda r: r.cost).x
    X = columns(p)
    c = np.linalg.lstsq(X, y, rcond=None)[0]
    e = y - X @ c
    slopes = [(columns(p + d) @ c - columns(p - d) @ c) / 2e-4 for d in 1e-4 * np.eye(n + 1)]
    J = np.column_stack([*slopes, X])
    size = np.linalg.norm(J, axis=0)
    P = e @ e / (len(e) - n - 3) * np.linalg.inv((J / size).T @ (J / size)) / np.outer(size, size)
    r = float(e[1:] @ e[:-1] / (e @ e))
    wide = np.sqrt((1 + r) / (1 - r)) if r > 2 / np.sqrt(len(e)) else 1.0
    out = SimpleNamespace(T=np.exp(p[:n]), L=p[n], O=c[0], K=c[1], r=r, rms=np.std(e), eps=e)
    out.white = np.sqrt(np.diag(P))
    out.sd = out.white * wide
    return out


# -- where a step response begins -----------------------------------------------------------------


def rest(y, row):
    """Return mean, deviation of it, and half width of the band of y before the step at `row`.

    The band is four deviations or one and a half steps of resolution, whichever is wider.
    """
    before = y[:row]
    levels = np.unique(y)
    resolution = np.min(np.diff(levels)) if len(levels) > 1 else 0.0
    e = before - before.mean()
    r = float(e[1:] @ e[:-1] / (e @ e)) if e @ e > 0 else 0.0
    wide = np.sqrt((1 + r) / (1 - r)) if r > 0 else 1.0
    s = max(before.std(), resolution / np.sqrt(12))
    return before.mean(), s / np.sqrt(row) * wide, max(4 * before.std(), 1.5 * resolution)


def onset(y, row, run=3):
    """Return the first row after the step at `row` of `run` together outside the band at rest."""
    y0, _, band = rest(y, row)
    for sign in (1, -1):
        out = sign * (y - y0) > band
        for n in range(row + 1, len(y) - run):
            if out[n : n + run].all():
                return n
    return None


def gain(level, sd_level, y, row, du):
    """Return (level - y0)/du and its deviation."""
    y0, sd_y0, _ = rest(y, row)
    return (level - y0) / du, np.hypot(sd_level, sd_y0) / abs(du)


def delay(f, y0, back):
    """Return L of one mode: its curve y = K + c e^(-(t - t_first)/T) comes from y0 at t_step + L.

    `back` is t_first - t_step.
    """
    return back + f.T[0] * np.log(-f.c[-1] / (f.K - y0))
