"""Play and stop operators, stacks of them, their inverses and their fits; one sample at a time.

play          z(t) = max(x(t) - r, min(x(t) + r, z(t-1))), virgin z(-1) = 0
stop          x - z
Maxwell slip  F_i = k_i (x - x_bi), |F_i| < f_i; else F_i = f_i sgn(dx), x_bi = x - F_i/k_i:
              k_i times the stop of r_i = f_i/k_i; source 002, (7a), (7b)
stack         y = sum w_i z_i, 0 = r_0 < r_1 < ..., w_0 > 0 (Prandtl-Ishlinskii)
inverse       r'_i = sum_(j<=i) w_j (r_i - r_j), w'_0 = 1/w_0,
              w'_i = -w_i/[(w_0 + ... + w_i)(w_0 + ... + w_(i-1))],
              z'_i = sum_(j<=i) w_j z_i + sum_(j>i) w_j z_j
              Krejci & Kuhnen, IEE Proc. Control Theory Appl. 148, 2001
modified      y = S(H[x]), S monotone, sum of one-sided dead zones:
              S(h) = v_0 h + sum v_k max(h - d_k, 0) + sum v_l min(h - d_l, 0), d_k > 0 > d_l
              inverse H'[S'(y)]; Kuhnen, European J. Control 9, 2003; METHODS 4
fit           w >= 0 by NNLS; modified: H w - sum_(k != c) s_k seg_k(y) = seg_c(y) with
              seg_k(y) = clip(y, kappa_k, kappa_k+1) - clip(0, kappa_k, kappa_k+1)
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import nnls

# -- one operator ------------------------------------------------------------------------


def play(x, r, z0=0.0):
    """Return z of one play operator of half width r, started in z0."""
    z, out = z0, []
    for xt in x:
        z = max(xt - r, min(xt + r, z))
        out.append(z)
    return np.array(out)


def stop(x, r):
    """Return x - z of one operator, from the virgin state."""
    return np.asarray(x, float) - play(x, r)


def maxwell(x, k, f):
    """Return F as printed in (7a) and (7b): springs k and Coulomb forces f, blocks at 0."""
    x_b, before, out = np.zeros(len(k)), 0.0, []
    for xt in x:
        F = np.zeros(len(k))
        for i in range(len(k)):
            F[i] = k[i] * (xt - x_b[i])
            if abs(F[i]) >= f[i]:
                F[i] = f[i] * np.sign(xt - before)
                x_b[i] = xt - F[i] / k[i]
        before = xt
        out.append(F.sum())
    return np.array(out)


# -- stacks ------------------------------------------------------------------------------


def plays(x, r, z0=None):
    """Return the (N, n) outputs of plays of half widths r."""
    z0 = np.zeros(len(r)) if z0 is None else z0
    return np.column_stack([play(x, ri, zi) for ri, zi in zip(r, z0, strict=True)])


def stack(x, r, w, z0=None):
    """Return y = sum w_i z_i."""
    return plays(x, r, z0) @ w


def virgin_curve(x, r, w):
    """Return y after a monotone rise from 0 to x >= 0: sum w_i max(x - r_i, 0)."""
    return sum(wi * max(x - ri, 0.0) for ri, wi in zip(r, w, strict=True))


def branch(a, x, r, w):
    """Return |y - y_a| on a branch that leaves a reversal a: the virgin curve at twice the size."""
    return 2 * virgin_curve(abs(x - a) / 2, r, w)


def inverse(r, w):
    """Return r' and w' of the exact inverse."""
    r, w = np.asarray(r, float), np.asarray(w, float)
    below = np.cumsum(w)  # w_0 + ... + w_i
    r_inv = np.array([np.sum(w[: i + 1] * (r[i] - r[: i + 1])) for i in range(len(r))])
    w_inv = np.append(1 / w[0], -w[1:] / (below[1:] * below[:-1]))
    return r_inv, w_inv


def inverse_state(w, z):
    """Return z' of the inverse when the stack stands in z."""
    return np.array([np.sum(w[: i + 1]) * z[i] + w[i + 1 :] @ z[i + 1 :] for i in range(len(w))])


# -- modified stacks ---------------------------------------------------------------------


def dead_zones(h, d, v):
    """Return S(h) = v_0 h + sum v_k g_k: max(h - d_k, 0) for d_k > 0, min(h - d_k, 0) below."""
    h = np.asarray(h, float)
    S = v[0] * h
    for dk, vk in zip(d[1:], v[1:], strict=True):
        S = S + vk * (np.maximum(h - dk, 0) if dk > 0 else np.minimum(h - dk, 0))
    return S


def inverse_dead_zones(d, v):
    """Return d' and v' of the inverse of S: each side by itself, by the rule of the stack."""
    d, v = np.asarray(d, float), np.asarray(v, float)
    d_inv, v_inv = np.zeros(len(d)), np.full(len(v), 1 / v[0])
    for side in (1, -1):
        own = [
            0,
            *sorted((k for k in range(1, len(d)) if side * d[k] > 0), key=lambda k: abs(d[k])),
        ]
        dk, vk = inverse(abs(d[own]), v[own])
        d_inv[own], v_inv[own] = side * dk, vk
    return d_inv, v_inv


def modified(x, r, w, d, v):
    """Return y = S(H[x])."""
    return dead_zones(stack(x, r, w), d, v)


def modified_inverse(y, r, w, d, v):
    """Return x = H'[S'(y)]."""
    return stack(dead_zones(y, *inverse_dead_zones(d, v)), *inverse(r, w))


def segments(y, kappa):
    """Return seg_k(y), column by column: what y has run through of [kappa_k, kappa_k+1], from 0."""
    y = np.asarray(y, float)[:, None]
    low, high = np.asarray(kappa[:-1]), np.asarray(kappa[1:])
    return np.clip(y, low, high) - np.clip(0.0, low, high)


def warp(y, kappa, s):
    """Return sum s_k seg_k(y), the outer segments carried on beyond the ends."""
    open_ended = np.array([-np.inf, *kappa[1:-1], np.inf])
    return segments(y, open_ended) @ s


def unwarp(h, kappa, s):
    """Return y with warp(y) = h; every s_k > 0."""
    h = np.asarray(h, float)
    knots = np.asarray(kappa, float)
    at = warp(knots, kappa, s)
    y = np.interp(h, at, knots)
    y = np.where(h < at[0], knots[0] + (h - at[0]) / s[0], y)
    return np.where(h > at[-1], knots[-1] + (h - at[-1]) / s[-1], y)


# -- fits --------------------------------------------------------------------------------


def thresholds(x, n):
    """Return n half widths, r_i = i max|x|/n, i = 0 ... n - 1: the virgin state reaches all."""
    return np.arange(n) * np.max(np.abs(x)) / n


def fit(x, y, r, offset=False):
    """Return w >= 0 of least squares, and an offset of either sign."""
    z = plays(x, r)
    ones = np.ones((len(x), 1)) * offset
    found, _ = nnls(np.hstack([z, ones, -ones]), y, maxiter=10_000)
    w, O = found[: len(r)], found[-2] - found[-1]
    return SimpleNamespace(w=w, offset=O, y=z @ w + O)


def fit_stops(x, y, r):
    """Return k >= 0 of y = k_0 x + sum k_i (x - z_i), i >= 1: loops that turn clockwise."""
    A = np.column_stack([x, x[:, None] - plays(x, r)[:, 1:]])
    k, _ = nnls(A, y, maxiter=10_000)
    return SimpleNamespace(w=k, y=A @ k)


def fit_even(x, y, r, r_even):
    """Return w on x, v on |x| and an offset, of any sign: butterflies have no inverse anyway."""
    A = np.hstack([plays(x, r), plays(np.abs(x), r_even), np.ones((len(x), 1))])
    found = np.linalg.lstsq(A, y, rcond=None)[0]
    n = len(r)
    return SimpleNamespace(w=found[:n], v=found[n:-1], offset=found[-1], y=A @ found)


def select_even(x, y, r, n):
    """Return n half widths for x and n for |x| out of r, one by one: each time the best next."""
    sides = np.hstack([plays(x, r), plays(np.abs(x), r)])
    ones, chosen = np.ones((len(x), 1)), []

    def loss(columns):
        A = np.hstack([ones, sides[:, columns]])
        return np.sum((A @ np.linalg.lstsq(A, y, rcond=None)[0] - y) ** 2)

    for _ in range(2 * n):
        full = [sum((c < len(r)) == side for c in chosen) >= n for side in (False, True)]
        free = [c for c in range(2 * len(r)) if c not in chosen and not full[c < len(r)]]
        chosen.append(min(free, key=lambda c: loss([*chosen, c])))
    odd, even = (sorted(c % len(r) for c in chosen if (c < len(r)) == s) for s in (True, False))
    return r[odd], r[even]


def fit_modified(x, y, r, kappa, middle):
    """Return w >= 0 and s >= 0 with H w = sum s_k seg_k(y), s[middle] = 1; METHODS 4."""
    seg = segments(y, np.array([-np.inf, *kappa[1:-1], np.inf]))
    others = [k for k in range(len(kappa) - 1) if k != middle]
    z = plays(x, r)
    found, _ = nnls(np.hstack([z, -seg[:, others]]), seg[:, middle], maxiter=10_000)
    s = np.insert(found[len(r) :], middle, 1.0)
    return SimpleNamespace(w=found[: len(r)], s=s, y=unwarp(z @ found[: len(r)], kappa, s))


def fit_forgetting(x, y, r, lam, ridge):
    """Return w(t) >= 0 at every t that minimises sum lam^(t-s) e(s)^2 + ridge lam^(t+1) |w|^2."""
    z = plays(x, r)
    n = len(r)
    out = []
    for t in range(len(x)):
        scale = np.sqrt(lam ** np.arange(t, -1, -1.0))
        A = np.vstack([z[: t + 1] * scale[:, None], np.sqrt(ridge * lam ** (t + 1)) * np.eye(n)])
        out.append(nnls(A, np.append(y[: t + 1] * scale, np.zeros(n)))[0])
    return np.array(out)
