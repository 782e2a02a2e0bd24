"""Refined instrumental variables for continuous time, with a search of the dead time.

    x = B(s)/A(s) e^(-L s) u,  y = x + O + white noise,   A = a_n s^n + ... + a_1 s + 1

With A and L of the last round, all of y, u(t - L) and 1 is filtered by s^k / A(s):

    y_f = -a_1 y_f' - ... - a_n y_f^(n) + b_0 u_f + b_1 u_f' + O,

regressed with the same derivatives of the simulated x as instruments (Young & Jakeman 1980;
Young 2011; METHODS 2.2).  u is held: exact filtering by matrix exponential, L included
(`process_models.sampled`).  y is taken as linear between samples (first-order hold), an
error of order Ts^2 in y's regressors, not in the instruments.  L by a grid of Ts/2 on the
simulation error, then by bounded search (Chen, Garnier & Gilson 2015).  Biased where u
depends on the noise (closed loop): instruments must then come from r.
"""

from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter


def companion(a):
    """Return M, b of 1/A with x = [z^(n-1) ... z]; a = [a_n ... a_1], A = a_n s^n + ... + 1."""
    q = np.r_[a, 1.0]
    n = len(a)
    M = np.zeros((n, n))
    M[0], M[1:, :-1] = -q[1:] / q[0], np.eye(n - 1)
    return M, np.eye(n)[0] / q[0]


def states(a, Ts, u, L=0.0, linear=False):
    """Return z^(n) ... z (N, n+1) of z = 1/A v from rest; v held and late by L, or linear."""
    M, b = companion(a)
    n = len(a)
    big = np.zeros((n + 2, n + 2))  # [x; v; dv/dt]
    big[:n, :n], big[:n, n], big[n, n + 1] = M, b, 1.0
    whole = expm(big * Ts)
    if linear:
        drive = np.outer(u[:-1], whole[:n, n]) + np.outer(np.diff(u) / Ts, whole[:n, n + 1])
        v = u
    else:
        m = int(np.floor(L / Ts + 1e-12))
        f = (m + 1) * Ts - L  # the newer value acts for the last f of a sample
        new = expm(big * f)[:n, n]
        old = whole[:n, n] - new
        pad = np.r_[np.full(m + 1, u[0]), u]
        late, later = pad[1 : len(u) + 1], pad[: len(u)]  # u(k - m), u(k - m - 1)
        drive = (np.outer(late, new) + np.outer(later, old))[:-1]
        v = late if f > Ts * (1 - 1e-9) else later
    x = np.zeros((len(u), n))
    # Each state through the scalar recursions of the eigenvectors of Phi, real part taken.
    lam, V = np.linalg.eig(whole[:n, :n])
    modes = np.linalg.solve(V, drive.T.astype(complex))
    for k in range(n):
        modes[k] = lfilter([1.0], [1.0, -lam[k]], modes[k])
    x[1:] = (V @ modes).T.real
    top = (v - x @ np.r_[a[1:], 1.0]) / a[0]  # a_n z^(n) = v - a_(n-1) z^(n-1) - ... - z
    return np.column_stack([top, x])


def at_delay(u, y, Ts, n, nb, L, a, rounds=30):
    """Return a, b, O and the simulation error at one dead time; nb numerator coefficients."""
    u0, y0 = u[0], y[0]
    v, z = u - u0, y - y0
    skip = int(np.ceil(L / Ts)) + 1
    one = np.ones(len(y))
    b = O = None
    for _ in range(rounds):
        zy, zu = states(a, Ts, z, linear=True), states(a, Ts, v, L)
        ones = states(a, Ts, one)[:, -1]
        free = free_modes(a, Ts, len(y))
        phi = np.column_stack([-zy[:, :n], zu[:, ::-1][:, :nb], ones, free])
        if b is None:
            zeta = phi
        else:
            x = states(a, Ts, v, L)[:, ::-1][:, :nb] @ b
            zx = states(a, Ts, x, linear=True)
            zeta = np.column_stack([-zx[:, :n], zu[:, ::-1][:, :nb], ones, free])
        Z, X, target = zeta[skip:], phi[skip:], zy[skip:, n]
        size = np.linalg.norm(Z, axis=0)
        theta = np.linalg.solve((Z / size).T @ X, (Z / size).T @ target)
        new, b, O = theta[:n], theta[n : n + nb], theta[n + nb]
        new = stable(new)
        moved, a = np.max(np.abs(new - a) / np.abs(a)), new
        if moved < 1e-9:
            break
    X = np.column_stack([states(a, Ts, v, L)[:, ::-1][:, :nb], one, free_modes(a, Ts, len(y))])
    lin = np.linalg.lstsq(X[skip:], z[skip:], rcond=None)[0]
    e = z[skip:] - X[skip:] @ lin
    return SimpleNamespace(
        a=a, b=b, L=L, offset=O + y0 - b[0] * u0, loss=float(e @ e) / len(e), moved=moved
    )


def free_modes(a, Ts, N):
    """Return the free response of z from each state (N, n)."""
    lam, V = np.linalg.eig(expm(companion(a)[0] * Ts))
    return ((V[-1] * lam ** np.arange(N)[:, None]) @ np.linalg.inv(V)).real


def stable(a):
    """Return A with roots in the right half plane reflected."""
    roots = np.roots(np.r_[a, 1.0])
    q = np.real(np.poly(np.where(roots.real > 0, -np.conj(roots), roots)))
    return (q / q[-1])[:-1]


def fit(u, y, Ts, n=1, nb=1, L_range=(0.0, 1.0), T0=None):
    """Return a, b, L, offset; L by a grid of Ts/2, polished between the best's neighbours."""
    u, y = np.asarray(u, float).ravel(), np.asarray(y, float).ravel()
    T0 = T0 or 10 * Ts
    start = np.poly(-np.array([1.0, 1.7, 2.9])[:n] / T0)  # apart: the filters run by eigenvectors
    start = (start / start[-1])[:-1]
    grid = np.arange(L_range[0], L_range[1] + Ts / 4, Ts / 2)
    found = [at_delay(u, y, Ts, n, nb, L, start, 12) for L in grid]
    best = min(found, key=lambda r: r.loss)
    low, high = max(best.L - Ts / 2, 0.0), best.L + Ts / 2
    fine = minimize_scalar(
        lambda L: at_delay(u, y, Ts, n, nb, L, best.a, 8).loss,
        bounds=(low, high),
        method="bounded",
        options=dict(xatol=1e-4 * Ts),
    )
    return at_delay(u, y, Ts, n, nb, fine.x, best.a)
