"""Stretches of a long record that say something about the plant, ranked by what they say.

Bittencourt, Isaksson, Peretzki & Forsman, Processes 2015, 3:357 (METHODS 6), per window:
    1 variance     u moves: sd(u) over the window > limit
    2 regression   y(t) = sum_i -a_i y(t-i) + sum_k g_k L_k(q) u(t-1) + d + e(t),
                   L_1 = sqrt(1 - al^2)/(q - al), L_k = L_(k-1) (1 - al q)/(q - al): no delay needed
    3 condition    of the centred, column-scaled regressor < limit
    4 causality    all g_k = 0?  F = (RSS_0 - RSS)/n_g / (RSS/(N - n)) against F(n_g, N - n)
A loop in automatic whose set point rests passes 1; u is then a filter of past y, and 3 and 4
tell: the columns of u are nearly those of y (condition), and F stays small.

Information about K, T, L (a rough plant being known): J = psi'psi/s2 of the window, psi as in
`experiment_design`, O and the start free; score = the largest of sd K/K, sd T/T, sd L/(T + L).
"""

import numpy as np
from scipy.signal import lfilter
from scipy.stats import f as f_law

from oracles import experiment_design


def laguerre(u, n, al):
    """Return L_1 u ... L_n u as columns, each by its difference equation, at rest before u[0]."""
    x = lfilter([0.0, np.sqrt(1 - al**2)], [1.0, -al], u)
    out = [x]
    for _ in range(n - 1):
        x = lfilter([-al, 1.0], [1.0, -al], x)
        out.append(x)
    return np.column_stack(out)


def regression(u, y, na, n, al, skip):
    """Return Phi (first the na of y, then n of u) centred, and y centred, without `skip` rows."""
    past = np.column_stack([-np.roll(y, i) for i in range(1, na + 1)])
    Phi = np.column_stack([past, laguerre(u - u[0], n, al)])[max(skip, na) :]
    target = y[max(skip, na) :]
    return Phi - Phi.mean(axis=0), target - target.mean()


def tests(u, y, na=2, n=6, al=0.8, skip=None):
    """Return sd of u, condition number, F, its p-value."""
    skip = int(np.ceil(3 / (1 - al))) if skip is None else skip
    Phi, target = regression(u, y, na, n, al, skip)
    size = np.linalg.norm(Phi, axis=0)
    if np.std(u) == 0 or np.any(size == 0):
        return np.std(u), np.inf, 0.0, 1.0
    X = Phi / size
    s = np.linalg.svd(X, compute_uv=False)
    if s[-1] < 1e-13 * s[0]:
        return np.std(u), np.inf, 0.0, 1.0
    rss = np.sum((target - X @ np.linalg.lstsq(X, target, rcond=None)[0]) ** 2)
    A = X[:, :na]
    rss0 = np.sum((target - A @ np.linalg.lstsq(A, target, rcond=None)[0]) ** 2)
    free = len(target) - na - n - 1
    F = (rss0 - rss) / n / (rss / free)
    return np.std(u), s[0] / s[-1], F, f_law.sf(F, n, free)


def information(u, y, Ts, K, T, L, s2):
    """Return sd K/K, sd T/T and sd L/(T + L) of a window, O and the start free."""
    t = np.arange(len(u)) * Ts
    psi = experiment_design.sensitivities((K, T, L, 0.0), u, t, t, start=True)
    J = psi.T @ psi / s2
    size = np.sqrt(np.diag(J))
    if np.any(size == 0):
        return np.full(3, np.inf)
    scaled = J / np.outer(size, size)
    if np.linalg.cond(scaled) > 1e12:
        return np.full(3, np.inf)
    sd = np.sqrt(np.diag(np.linalg.inv(scaled))) / size
    return sd[:3] / [abs(K), T, T + L]
