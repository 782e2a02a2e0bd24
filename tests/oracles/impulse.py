"""Impulse response by least squares and with TC, DC, SS priors; hyper-parameters by likelihood.

    y(t) = O + sum_k g_k u(t - k) + e(t), k = 1 ... n
    prior     g ~ N(0, s2 c K), K zero for the dead taps k <= d, and beyond, with i = k - d,
              TC lam^max(i,j);  DC lam^((i+j)/2) rho^|i-j|;
              SS lam^(i+j+max(i,j))/2 - lam^(3 max(i,j))/6
    estimate  g = c K Phi' (Phi c K Phi' + I)^-1 (y - O)
    evidence  -2 ln p = N ln s2 + ln |I + c Phi K Phi'| + const,
              s2 = y' (I + c Phi K Phi')^-1 y / N    (the noise variance is the best one, O flat)

Everything is computed on the N x N covariance of y, the long way round: no thin QR.
Chen, Ohlsson & Ljung, Automatica 48, 2012; Chen & Ljung, Automatica 49, 2013; METHODS 2.3.
"""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize


def kernel(kind, n, lam, rho=0.0, dead=0):
    """Return K (n, n), its first `dead` rows and columns zero."""
    i = np.arange(1.0, n - dead + 1)
    I, J = np.meshgrid(i, i, indexing="ij")
    M = np.maximum(I, J)
    K = np.zeros((n, n))
    K[dead:, dead:] = {
        "tc": lambda: lam**M,
        "dc": lambda: lam ** ((I + J) / 2) * rho ** np.abs(I - J),
        "ss": lambda: lam ** (I + J + M) / 2 - lam ** (3 * M) / 6,
    }[kind]()
    return K


def rows(u, y, n, starts=(0,)):
    """Return Phi (N, n) and y at the rows whose n past inputs lie in their segment."""
    edges = [*starts, len(y)]
    keep = [t for a, b in pairwise(edges) for t in range(a + n, b)]
    return np.array([[u[t - k] for k in range(1, n + 1)] for t in keep]), np.asarray(y)[keep]


def least_squares(Phi, y):
    """Return g, its covariance and s2 = RSS/(N - n - 1)."""
    X = np.column_stack([Phi, np.ones(len(y))])
    theta = np.linalg.lstsq(X, y, rcond=None)[0]
    s2 = np.sum((y - X @ theta) ** 2) / (len(y) - X.shape[1])
    return theta[:-1], s2 * np.linalg.inv(X.T @ X)[:-1, :-1], s2


def without_level(Phi, y):
    """Return Phi and y seen by an orthonormal basis of what is not constant."""
    N = len(y)
    Q = np.linalg.qr(np.column_stack([np.ones(N), np.eye(N)[:, : N - 1]]))[0][:, 1:]
    return Q.T @ Phi, Q.T @ y


def evidence(Phi, y, K, level=True):
    """Return -2 ln p (without constants) and s2; K = c times the kernel."""
    if level:
        Phi, y = without_level(Phi, y)
    factor = cho_factor(np.eye(len(y)) + Phi @ K @ Phi.T, lower=True)
    s2 = y @ cho_solve(factor, y) / len(y)
    return len(y) * np.log(s2) + 2 * np.sum(np.log(np.diag(factor[0]))), s2


def posterior(Phi, y, K, s2):
    """Return the mean and the covariance of g."""
    Phi, y = without_level(Phi, y)
    gain = np.linalg.solve(np.eye(len(y)) + Phi @ K @ Phi.T, Phi @ K).T
    return gain @ y, s2 * (K - gain @ Phi @ K)


def fit(Phi, y, kind="tc", dead=0):
    """Fit the hyper-parameters by a simplex from several starts; return g, cov, s2 and them."""
    n = Phi.shape[1]
    size = np.var(y) / max(np.mean(np.var(Phi, axis=0)), 1e-300)

    def unpack(p):
        lam, c = 1 / (1 + np.exp(-p[0])), np.exp(p[1])
        return lam, c, np.tanh(p[2]) if kind == "dc" else 0.0

    P, v = without_level(Phi, y)

    def cost(p):
        lam, c, rho = unpack(p)
        return evidence(P, v, c * kernel(kind, n, lam, rho, dead), level=False)[0]

    best = None
    for lam in (0.6, 0.85, 0.96):
        start = [np.log(lam / (1 - lam)), np.log(size / np.var(y))]
        start += [np.arctanh(0.9)] if kind == "dc" else []
        found = minimize(
            cost,
            start,
            method="Nelder-Mead",
            options={"xatol": 1e-4, "fatol": 1e-8, "maxiter": 600},
        )
        if best is None or found.fun < best.fun:
            best = found
    lam, c, rho = unpack(best.x)
    K = c * kernel(kind, n, lam, rho, dead)
    s2 = evidence(Phi, y, K)[1]
    g, cov = posterior(Phi, y, K, s2)
    return SimpleNamespace(
        g=g, cov=cov, sd=np.sqrt(np.diag(cov).clip(0)), s2=s2, lam=lam, c=c, rho=rho, cost=best.fun
    )


def dead_taps(Phi, y, d_max, kind="tc"):
    """Return the weights of d = 0 ... d_max dead taps, exp(-cost/2) scaled to sum 1, and fits.

    nk = d + 1.
    """
    fits = [fit(Phi, y, kind, dead) for dead in range(d_max + 1)]
    cost = np.array([f.cost for f in fits])
    weight = np.exp(-(cost - cost.min()) / 2)
    return weight / weight.sum(), fits
