"""Predictor-based subspace identification, for closed loops.

    1 VARX     y(t) = sum_(i=1..p) [C Abar^(i-1) Bbar, C Abar^(i-1) K] z(t-i) + D u(t) + O + e,
               z = [u; y], Abar = A - K C, Bbar = B - K D, by least squares
    2 states   rows j = 0 ... f-1 of Gamma Kz:  sum_(i>j) (coefficients of lag i) z(t - i + j) ...
               [C Abar^(j) K_p] Z with Abar^p = 0:  X = S^(1/2) V' of that product
    3 models   y on [x; u] -> C, D, e;  x(t+1) on [x; u; e] -> A, B, K
e(t) is white and independent of the past whether or not u is fed back, so nothing is biased by
the loop as long as p covers the memory of Abar, and D = 0 or the loop has a delay.
Chiuso, Automatica 43, 2007 (PBSIDopt); METHODS 2.3.
"""

import numpy as np
from numpy.linalg import lstsq, svd


def varx(u, y, p, direct=False):
    """Return the coefficients of z(t-1) ... z(t-p) as (p, ny, nu + ny), Z and the rows' y, u."""
    N = len(y)
    z = np.column_stack([u, y])
    past = np.column_stack([z[p - i : N - i] for i in range(1, p + 1)])
    more = [u[p:]] if direct else []
    X = np.column_stack([past, *more, np.ones(N - p)])
    theta = lstsq(X, y[p:], rcond=None)[0]
    k = z.shape[1]
    return theta[: p * k].reshape(p, k, -1).transpose(0, 2, 1), past, y[p:], u[p:]


def identify(u, y, n, p, f, direct=False):
    """Return A, B, C, D, K and the singular values; constant parts removed by regression on 1."""
    h, past, Y, U = varx(u, y, p, direct)
    nz = h.shape[2]
    rows = []
    for j in range(f):  # C Abar^j x(t) = sum over lags i >= 1 of coefficient (i + j) times z(t-i)
        block = np.zeros((h.shape[1], p * nz))
        for i in range(1, p - j + 1):
            block[:, (i - 1) * nz : i * nz] = h[i + j - 1]
        rows.append(block @ past.T)
    product = np.vstack(rows)
    product = product - product.mean(axis=1, keepdims=True)
    _, S, Vt = svd(product, full_matrices=False)
    X = np.sqrt(S[:n])[:, None] * Vt[:n]
    one = np.ones((1, X.shape[1]))
    Z = np.vstack([X, U.T, one]) if direct else np.vstack([X, one])
    CD = lstsq(Z.T, Y, rcond=None)[0].T
    e = Y.T - CD @ Z
    W = np.vstack([X, U.T, e, one])[:, :-1]
    ABK = lstsq(W.T, X[:, 1:].T, rcond=None)[0].T
    m = U.shape[1]
    D = CD[:, n : n + m] if direct else np.zeros((Y.shape[1], m))
    return ABK[:, :n], ABK[:, n : n + m], CD[:, :n], D, ABK[:, n + m : -1], S
