"""Least squares on a regressor that is written out row by row.

    A(q) y(t) = B(q) u(t - nk) + d + e(t),      A = 1 + a1 q^-1 + ...
    phi(t) = [-y(t-1) ... -y(t-na), u(t-nk) ... u(t-nk-nb+1), 1]

Source 000, (2.2-3) to (2.2-5); conventions of DESIGN 3 and 5.
"""

from itertools import pairwise
from types import SimpleNamespace

import mpmath
import numpy as np


def segments(N, starts=(0,)):
    """Yield (first, end) of each contiguous segment; DESIGN 3, `starts`."""
    edges = [*starts, N]
    return list(pairwise(edges))


def arx_rows(u, y, na, nb, nk, starts=(0,), offset=True, valid=None):
    """Write out phi, target and row numbers of an ARX model; source 000, (2.2-3)."""
    u = np.asarray(u, float).reshape(len(u), -1)
    y = np.asarray(y, float).ravel()
    nb = np.broadcast_to(nb, u.shape[1])
    nk = np.broadcast_to(nk, u.shape[1])
    valid = np.ones(len(y), bool) if valid is None else np.asarray(valid, bool).ravel()
    drop = max([na, *(nb + nk - 1)])
    phi, rows = [], []
    for first, end in segments(len(y), starts):
        for t in range(first + drop, end):
            if not valid[t - na : t + 1].all():
                continue
            row = [-y[t - i] for i in range(1, na + 1)]
            for j in range(u.shape[1]):
                row += [u[t - nk[j] - i, j] for i in range(nb[j])]
            phi.append(row + [1.0] * offset)
            rows.append(t)
    return np.array(phi), y[rows], np.array(rows)


def solve(X, y):
    """Solve min |y - X theta| by scaled QR, refined in long double; source 000, (2.2-5)."""
    scale = np.linalg.norm(X, axis=0)
    Q, R = np.linalg.qr(X / scale)
    theta = np.zeros(X.shape[1], np.longdouble)
    for _ in range(3):
        eps = y.astype(np.longdouble) - X.astype(np.longdouble) @ theta
        theta = theta + np.linalg.solve(R, Q.T @ eps.astype(float)) / scale
    eps = (y.astype(np.longdouble) - X.astype(np.longdouble) @ theta).astype(float)
    Rinv = np.linalg.inv(R) / scale[:, None]
    return theta.astype(float), eps, Rinv @ Rinv.T


def criteria(loss, N, d):
    """Return FPE, AIC and BIC of a scalar loss; DESIGN 3."""
    return (
        loss * (1 + d / N) / (1 - d / N),
        N * np.log(loss) + 2 * d,
        N * np.log(loss) + d * np.log(N),
    )


def arx(u, y, na, nb, nk, starts=(0,), offset=True, valid=None):
    """Fit an ARX model by least squares; METHODS 1.1 and 2.4.

    P = s^2 (X'X)^-1, its last row and column moved to O = d/A(1) by the delta rule;
    s^2 = RSS / (N - columns of X); loss = RSS / N.
    """
    X, target, rows = arx_rows(u, y, na, nb, nk, starts, offset, valid)
    full, eps, inv = solve(X, target)
    N, n_all = X.shape
    rss = float(eps @ eps)
    P = rss / (N - n_all) * inv
    n = n_all - offset
    theta = full[:n]
    O = 0.0
    if offset:
        A1 = 1 + theta[:na].sum()
        O = full[-1] / A1
        J = np.eye(n_all)
        J[-1, -1] = 1 / A1  # dO/dd
        J[-1, :na] = -O / A1  # dO/da_i = -d / A(1)^2
        P = J @ P @ J.T
    fpe, aic, bic = criteria(rss / N, N, n)
    return SimpleNamespace(
        theta=theta,
        P=P,
        sd=np.sqrt(np.diag(P))[:n],
        offset=O,
        N=N,
        rss=rss,
        loss=rss / N,
        fpe=fpe,
        aic=aic,
        bic=bic,
        eps=eps,
        rows=rows,
    )


def exact(phi, y, digits=120):
    """Solve the normal equations in `digits` decimal digits; source 000, (2.2-5)."""
    with mpmath.workdps(digits):
        X = mpmath.matrix(np.asarray(phi, float).tolist())
        b = mpmath.matrix([mpmath.mpf(float(v)) for v in y])
        return np.array([float(v) for v in mpmath.lu_solve(X.T * X, X.T * b)])


def digits(found, truth):
    """Return the log relative error per coefficient, at most 15; NIST StRD."""
    found, truth = np.asarray(found, float), np.asarray(truth, float)
    error = np.abs(found - truth) / np.where(truth == 0, 1.0, np.abs(truth))
    return np.minimum(15.0, -np.log10(np.maximum(error, 1e-16)))


def simulate_arx(theta, u, na, nb, nk, past_y=None):
    """Run A(q) y = B(q) u(t - nk) after past_y = [y(-1), y(-2), ...]; source 000, (2.1)."""
    a, b = theta[:na], theta[na : na + nb]
    y = np.zeros(len(u))
    past = np.zeros(na) if past_y is None else np.asarray(past_y, float)
    for t in range(len(u)):
        for i in range(1, na + 1):
            y[t] -= a[i - 1] * (y[t - i] if t >= i else past[i - t - 1])
        for i in range(nb):
            if t - nk - i >= 0:
                y[t] += b[i] * u[t - nk - i]
    return y
