"""Weighted null-space fitting of OE and BJ from a long ARX model.

    y = B/F u + d' + C/D e    and    A_n y = B_n u + d'' + e,   A_n = D/C, B_n = A_n B/F

    C A_n = D,    F B_n = B A_n                                  linear in theta

1. the long ARX eta, Cov eta = R^-1 s^2; 2. least squares on the two relations, coefficient by
coefficient; 3. the same, weighted by the inverse of T Cov(eta) T', T = [[C, 0], [-B, F]] as
Toeplitz matrices (what the relations make of an error of eta), repeated.  OE is C = D = 1,
whose relation A_n = 1 has no unknowns but takes part in the weighting.  Galrinho, Rojas &
Hjalmarsson, IEEE TAC 2019; METHODS 2.1.  One input; a start, to be finished by `pem`.
"""

from types import SimpleNamespace

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from oracles import lsq


def lower(p, n):
    """Return the n x n lower Toeplitz matrix of the coefficients p_0, p_1 ..."""
    first = np.zeros(n)
    first[: min(len(p), n)] = p[:n]
    return toeplitz(first, np.eye(n)[0] * first[0])


def long_arx(u, y, n, nk, starts=(0,)):
    """Return a_1 .. a_n, b_nk .. b_n and their covariance."""
    found = lsq.arx(u, y, n, n - nk + 1, nk, starts)
    k = 2 * n - nk + 1
    return found.theta, found.P[:k, :k]


def relations(eta, n, nb, nc, nd, nf, nk):
    """Return g and Q of g(eta) = Q(eta) theta, theta = [b, c, d, f] in the order of `pem`.

    a_k = d_k - sum_j c_j a_(k-j),  k = 1 .. n
    b_k = sum_j B_j a_(k-j) - sum_j f_j b_(k-j),  k = nk .. n
    """
    a = np.r_[1.0, eta[:n]]
    b = np.r_[np.zeros(nk), eta[n:]]
    A, Bn = lower(a, n + 1), lower(b, n + 1)
    Q = np.zeros((2 * (n + 1), nb + nc + nd + nf))
    top, bottom = slice(0, n + 1), slice(n + 1, None)
    Q[bottom, :nb] = A[:, nk : nk + nb]
    Q[top, nb : nb + nc] = -A[:, 1 : nc + 1]
    Q[top, nb + nc : nb + nc + nd] = np.eye(n + 1)[:, 1 : nd + 1]
    Q[bottom, nb + nc + nd :] = -Bn[:, 1 : nf + 1]
    use = np.r_[np.arange(1, n + 1), n + 1 + np.arange(nk, n + 1)]
    return np.r_[a, b][use], Q[use], use


def fit(u, y, nb, nc, nd, nf, nk, n=None, starts=(0,), rounds=20):
    """Return theta = [b, c, d, f] and its asymptotic covariance; SISO."""
    n = n or min(50, len(y) // 12)
    eta, P = long_arx(u, y, n, nk, starts)
    g, Q, use = relations(eta, n, nb, nc, nd, nf, nk)
    theta = np.linalg.lstsq(Q, g, rcond=None)[0]
    cov = None
    for _ in range(rounds):
        b, c, _, f = np.split(theta, np.cumsum([nb, nc, nd]))
        T = np.zeros((2 * (n + 1), 2 * (n + 1)))
        T[: n + 1, : n + 1] = lower(np.r_[1, c], n + 1)
        T[n + 1 :, : n + 1] = -lower(np.r_[np.zeros(nk), b], n + 1)
        T[n + 1 :, n + 1 :] = lower(np.r_[1, f], n + 1)
        T = T[np.ix_(use, use)]
        S = np.linalg.cholesky(T @ P @ T.T)
        Qw, gw = np.linalg.solve(S, Q), np.linalg.solve(S, g)
        new = np.linalg.lstsq(Qw, gw, rcond=None)[0]
        moved, theta = np.max(np.abs(new - theta)), new
        cov = np.linalg.inv(Qw.T @ Qw)
        if moved < 1e-10:
            break
    return SimpleNamespace(theta=theta, P=cov, sd=np.sqrt(np.diag(cov)), n=n)


def steiglitz_mcbride(u, y, nb, nf, nk, rounds=50, offset=True):
    """Return [b, f] of OE by ARX on y/F and u/F, repeated; Steiglitz & McBride 1965.

    Filtered from rest: F (y/F) = B (u/F) + O + 1/F impulses at the first nf rows, which stand
    for the unknown past and are columns like O.
    """
    y = y - y[0] * offset
    theta = lsq.arx(u, y, nf, nb, nk, offset=offset).theta
    a, b = theta[:nf], theta[nf:]
    for _ in range(rounds):
        F = np.r_[1, a]
        X, target, rows = lsq.arx_rows(
            lfilter([1.0], F, np.ravel(u)), lfilter([1.0], F, y), nf, nb, nk, offset=False
        )
        past = lfilter([1.0], F, np.eye(len(y), nf), axis=0)[rows]
        columns = np.column_stack([X, past, np.ones((len(rows), int(offset)))])
        size = np.linalg.norm(columns, axis=0)
        found = np.linalg.lstsq(columns / size, target, rcond=1e-13)[0] / size
        moved, a, b = np.max(np.abs(found[:nf] - a)), found[:nf], found[nf : nf + nb]
        if not np.isfinite(moved) or moved < 1e-10:
            break
    return np.r_[b, a]
