"""MIMO ARX with matrix polynomials, least squares output by output.

    Y(k) + sum_j A_j Y(k-j) = sum_j B_j U(k - nk - j) + d + E(k),    A_j (r, r), B_j (r, m)

Source 000, (2.1-7) to (2.1-9); B_0 is the direct term when nk = 0.  One regressor serves all
outputs, so least squares per output is the maximum likelihood estimate for any Cov E
(Zellner 1962), and Cov vec(Theta) = Sigma kron (Phi' Phi)^-1.
"""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np

from oracles import lsq


def rows(Y, U, na, nb, nk, starts=(0,), offset=True):
    """Return Phi (N, r na + m nb + 1), targets (N, r) and row numbers."""
    out, numbers = [], []
    for first, end in pairwise([*starts, len(Y)]):
        for t in range(first + max(na, nk + nb - 1), end):
            row = [-Y[t - j] for j in range(1, na + 1)] + [U[t - nk - j] for j in range(nb)]
            out.append(np.concatenate([*row, [1.0] * offset]))
            numbers.append(t)
    return np.array(out), Y[numbers], np.array(numbers)


def fit(Y, U, na, nb, nk, starts=(0,), offset=True):
    """Return A (na+1, r, r), B (nb, r, m), offset O, Sigma, sd and P of each output.

    Sigma = E'E/(N - columns); loss = det(E'E/N); O = A(1)^-1 d.
    """
    Y, U = (np.asarray(x, float).reshape(len(x), -1) for x in (Y, U))
    r, m = Y.shape[1], U.shape[1]
    shift = Y[0] if offset else np.zeros(r)
    Phi, target, numbers = rows(Y - shift, U, na, nb, nk, starts, offset)
    Theta, eps = np.empty((Phi.shape[1], r)), np.empty_like(target)
    for i in range(r):
        Theta[:, i], eps[:, i], inverse = lsq.solve(Phi, target[:, i])
    N, n = Phi.shape
    Sigma = eps.T @ eps / (N - n)
    A = np.concatenate([np.eye(r)[None], Theta[: r * na].reshape(na, r, r).transpose(0, 2, 1)])
    B = Theta[r * na : r * na + m * nb].reshape(nb, m, r).transpose(0, 2, 1)
    d = Theta[-1] if offset else np.zeros(r)
    sd = np.sqrt(np.outer(np.diag(inverse), np.diag(Sigma)))
    return SimpleNamespace(
        A=A,
        B=B,
        nk=nk,
        Theta=Theta,
        sd=sd,
        Sigma=Sigma,
        inverse=inverse,
        eps=eps,
        N=N,
        rows=numbers,
        loss=float(np.linalg.det(eps.T @ eps / N)),
        offset=shift + np.linalg.solve(A.sum(axis=0), d),
    )


def simulate(A, B, nk, U, E=None, offset=0.0):
    """Return Y from rest by source 000, (2.1-7), plus an offset."""
    U = np.asarray(U, float).reshape(len(U), -1)
    r = A.shape[1]
    Y = np.zeros((len(U), r))
    for k in range(len(U)):
        if E is not None:
            Y[k] += E[k]
        for j in range(1, min(len(A) - 1, k) + 1):
            Y[k] -= A[j] @ Y[k - j]
        for j in range(len(B)):
            if k >= nk + j:
                Y[k] += B[j] @ U[k - nk - j]
    return Y + offset


def transfer(A, B, nk, z):
    """Return G(z) = A(z)^-1 B(z) z^-nk; source 000, (2.1-9)."""
    left = sum(Aj * z**-j for j, Aj in enumerate(A))
    return np.linalg.solve(left, sum(Bj * z ** -(nk + j) for j, Bj in enumerate(B)))


def poles(A):
    """Return the eigenvalues of the block companion matrix of A."""
    r, na = A.shape[1], len(A) - 1
    M = np.zeros((r * na, r * na))
    M[:r] = -np.hstack(list(A[1:]))
    M[r:, :-r] = np.eye(r * (na - 1))
    return np.linalg.eigvals(M)
