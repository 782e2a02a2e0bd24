"""Dead time in samples, four ways; nk = 1 when y follows u at once after its hold.

    raw           arg max |R_yu(l)|, R_yu(l) = sum y(n) u(n - l)              source 001, (3.5-35)
    pre-whitened  A(q) u = w by an AR model of u; both filtered by A; the first lag at which
                  |r(l)| leaves the band z/sqrt(N) of no relation              Box & Jenkins, 11
    ARX scan      least BIC over orders and nk                     source 001, 3.5.4 b (`delayest`)
    OE scan       the same with output-error models, by Gauss-Newton     source 001, 3.5.4 c
    impulse       the number of dead taps with the most evidence, `impulse.dead_taps`

Raw correlation is the plant's impulse response smeared by the autocorrelation of u: on a PRBS
that is held for h samples its peak lies late by about h - 1 or more (ERRATA; METHODS 8).
"""

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares
from scipy.signal import lfilter


def raw(u, y, l_max):
    """Return R_yu(0 ... l_max)/(N s_y s_u) of the centred signals; source 001, (3.5-35)."""
    u, y = u - u.mean(), y - y.mean()
    R = np.array([y[l:] @ u[: len(u) - l] for l in range(l_max + 1)])
    return R / (np.linalg.norm(u) * np.linalg.norm(y))


def ar_by_aic(x, p_max):
    """Return A = [1, a1 ...] of the Yule-Walker model with the least AIC."""
    x = x - x.mean()
    r = np.array([x[l:] @ x[: len(x) - l] for l in range(p_max + 1)]) / len(x)
    best, A = len(x) * np.log(r[0]), np.ones(1)
    for p in range(1, p_max + 1):
        a = solve_toeplitz(r[:p], r[1 : p + 1])
        s2 = r[0] - a @ r[1 : p + 1]
        if s2 <= 1e-9 * r[0]:
            break
        aic = len(x) * np.log(s2) + 2 * p
        if aic < best:
            best, A = aic, np.concatenate([[1.0], -a])
    return A


def pre_whitened(u, y, l_max, p_max=30, z=3.0):
    """Return the correlation of both signals filtered by A, and the first lag outside the band."""
    A = ar_by_aic(u, p_max)
    drop = len(A) - 1
    w = lfilter(A, [1.0], u - u.mean())[drop:]
    v = lfilter(A, [1.0], y - y.mean())[drop:]
    r = raw(w, v, l_max)
    out = np.flatnonzero(np.abs(r) > z / np.sqrt(len(w)))
    return r, int(out[0]) if len(out) else None


def regressor(u, y, na, nb, nk, first):
    """Return [-y(t-1) ..., u(t-nk) ..., 1] at t = first ... N-1."""
    N = len(y)
    past = [-y[first - i : N - i] for i in range(1, na + 1)]
    past += [u[first - nk - i : N - nk - i] for i in range(nb)]
    return np.column_stack([*past, np.ones(N - first)])


def arx_scan(u, y, nk_max, orders=(1, 2, 3, 4)):
    """Return {nk: least BIC over na = nb}, all on the same rows."""
    first = nk_max + max(orders)
    out = {}
    for nk in range(nk_max + 1):
        scores = []
        for n in orders:
            X = regressor(u, y, n, n, nk, first)
            rss = np.sum((y[first:] - X @ np.linalg.lstsq(X, y[first:], rcond=None)[0]) ** 2)
            scores.append(len(X) * np.log(rss / len(X)) + 2 * n * np.log(len(X)))
        out[nk] = min(scores)
    return out


def oe_cost(u, y, n, nk, first, f0):
    """Return the residuals' sum of squares of B/F u with B, level and start free, F searched.

    B, the offset and the free response (n modes of 1/F) are linear and solved for at each F.
    """
    N = len(y)
    shifted = np.concatenate([np.full(nk, u[0]), u[: N - nk]]) if nk else u

    def columns(f):
        F = np.concatenate([[1.0], f])
        pulse = np.zeros(N)
        pulse[0] = 1.0
        back = [
            lfilter([1.0], F, np.concatenate([np.zeros(i), shifted[: N - i]])) for i in range(n)
        ]
        free = [lfilter([1.0], F, np.concatenate([np.zeros(i), pulse[: N - i]])) for i in range(n)]
        return np.column_stack([*back, *free, np.ones(N)])[first:]

    def residuals(f):
        if np.any(np.abs(np.roots(np.concatenate([[1.0], f]))) > 0.9999):
            return 10 * (y[first:] - y[first:].mean())
        X = columns(f)
        size = np.linalg.norm(X, axis=0)
        size[size == 0] = 1.0
        return y[first:] - X @ (np.linalg.lstsq(X / size, y[first:], rcond=1e-12)[0] / size)

    found = least_squares(residuals, f0, x_scale="jac", max_nfev=30)
    return 2 * found.cost, found.x


def oe_scan(u, y, nk_max, orders=(1, 2)):
    """Return {nk: least BIC over nb = nf}; F starts at one and two lags of several speeds."""
    first = nk_max + max(orders)
    N = len(y) - first
    out = {}
    for nk in range(nk_max + 1):
        scores = []
        for n in orders:
            starts = [np.poly([p] * n)[1:] + 1e-3 * np.arange(n) for p in (0.7, 0.93)]
            rss = min(oe_cost(u, y, n, nk, first, f0)[0] for f0 in starts)
            scores.append(N * np.log(rss / N) + 2 * n * np.log(N))
        out[nk] = min(scores)
    return out


def least(scan):
    """Return the nk with the least score."""
    return min(scan, key=scan.get)


def weights(scan):
    """Return {nk: exp(-score/2)} scaled to sum 1: the posterior of nk under equal priors."""
    score = np.array(list(scan.values()))
    w = np.exp(-(score - score.min()) / 2)
    return dict(zip(scan, w / w.sum(), strict=True))
