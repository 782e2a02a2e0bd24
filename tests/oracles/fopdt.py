"""First order plus dead time, K e^(-Ls) / (Ts + 1), as a sum of step responses.

    y(t) = O + x0 e^(-t/T) + K sum_j (u_j - u_(j-1)) S(t - t_j - L),
    S(tau) = 1 - e^(-tau/T) for tau > 0, else 0.

Any real L >= 0 is exact; no recursion and no split of L into samples is used.
"""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares


def step_response(tau, T):
    """Return the unit-gain first-order step response, 0 before tau = 0; source 001, (3.4-1)."""
    return -np.expm1(-np.maximum(tau, 0.0) / T)


def response(u, T, L, Ts, t, before=0.0):
    """Return the unit-gain output at the times t for a held input; superposition of steps."""
    u = np.asarray(u, float).ravel()
    moves = np.diff(u, prepend=before)
    j = np.flatnonzero(moves)
    t = np.asarray(t, float)
    # L is taken off the sample instants in one subtraction, so that t - t_j - L
    # carries the rounding of t alone.
    tau = t[:, None] - (Ts * j + L)[None, :]
    return before + step_response(tau, T) @ moves[j]


def simulate(u, K, T, L, Ts, offset=0.0, x0=0.0, before=0.0):
    """Return y at the samples; x0 is the deviation of y at t = 0, `before` the input for t < 0."""
    t = Ts * np.arange(len(u))
    return offset + x0 * np.exp(-t / T) + K * response(u, T, L, Ts, t, before)


def columns(u, T, L, Ts, starts, skip):
    """Return rows used and the columns of K, O and one initial state per segment; METHODS 2.2."""
    u = np.asarray(u, float).ravel()
    edges = [*starts, len(u)]
    rows, unit, free = [], [], []
    for s, (first, end) in enumerate(pairwise(edges)):
        k = np.arange(skip, end - first)
        t = Ts * k
        rows.append(first + k)
        unit.append(response(u[first:end], T, L, Ts, t, before=u[first]))
        decay = np.zeros((len(k), len(starts)))
        decay[:, s] = np.exp(-(t - Ts * skip) / T)
        free.append(decay)
    rows = np.concatenate(rows)
    return rows, np.column_stack([np.concatenate(unit), np.ones(len(rows)), np.vstack(free)])


def brute_fit(u, y, Ts, skip, T_range, L_range, starts=(0,), valid=None, grid=(25, 41)):
    """Fit K, T, L, O, x0 from a dense grid of (T, L), polishing the best three; METHODS 2.2.

    Rows before `skip` in each segment are history only.  P is s^2 (J'J)^-1 of all
    parameters, s^2 = RSS / (N - all), cut down to [K, T, L, O]; METHODS 2.4.
    """
    u, y = np.asarray(u, float).ravel(), np.asarray(y, float).ravel()
    keep = np.ones(len(y), bool) if valid is None else np.asarray(valid, bool).ravel()
    y0, u0 = y[keep][0], u[0]
    v, z = u - u0, y - y0  # O absorbs both shifts

    def project(p):
        rows, X = columns(v, np.exp(p[0]), p[1], Ts, starts, skip)
        use = keep[rows]
        X, target = X[use], z[rows[use]]
        lin = np.linalg.lstsq(X, target, rcond=None)[0]
        return lin, target - X @ lin

    def eps(p):
        return project(p)[1]

    lnT = np.log(np.geomspace(*T_range, grid[0]))
    delays = np.linspace(*L_range, grid[1])
    scan = sorted((float(np.sum(eps((a, b)) ** 2)), a, b) for a in lnT for b in delays)
    bounds = ([lnT[0] - 1.0, L_range[0]], [lnT[-1] + 1.0, L_range[1]])
    starts_at = [
        np.clip([a, b], np.array(bounds[0]) + 1e-9, np.array(bounds[1]) - 1e-9)
        for _, a, b in scan[:3]
    ]
    tries = [
        least_squares(
            eps,
            p,
            jac="3-point",
            bounds=bounds,
            x_scale=[0.1, Ts],
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=50,
        )
        for p in starts_at
    ]
    best = min(tries, key=lambda r: r.cost)
    T, L = float(np.exp(best.x[0])), float(best.x[1])
    lin, e = project(best.x)
    K, O = lin[0], lin[1] + y0 - lin[0] * u0

    def output(p):
        rows, X = columns(u, p[1], p[2], Ts, starts, skip)
        return (X @ np.concatenate([[p[0], p[3]], p[4:]]))[keep[rows]]

    full = np.concatenate([[K, T, L, O], lin[2:]])
    h = np.concatenate([[1e-4 * abs(K), 1e-4 * T, 1e-3 * Ts], np.full(len(full) - 3, 1e-3)])
    J = np.column_stack(
        [
            (output(full + h * d) - output(full - h * d)) / (2 * h[i])
            for i, d in enumerate(np.eye(len(full)))
        ]
    )
    s = np.linalg.norm(J, axis=0)
    rss, N = float(e @ e), len(e)
    P = rss / (N - len(full)) * np.linalg.inv((J / s).T @ (J / s)) / np.outer(s, s)
    return SimpleNamespace(
        theta=np.array([K, T, L]),
        K=K,
        T=T,
        L=L,
        offset=O,
        x0=lin[2:],
        N=N,
        rss=rss,
        loss=rss / N,
        P=P[:4, :4],
        sd=np.sqrt(np.diag(P))[:3],
        eps=e,
    )


def hold_input(N, hold, seed, levels=(-1.0, 1.0)):
    """Return a seeded input that draws one of `levels` and keeps it for `hold` samples."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.choice(levels, size=-(-N // hold)), hold)[:N]
