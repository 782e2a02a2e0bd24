"""What stands behind the numbers: delta rule, sandwich, block bootstrap, sign-perturbed sums.

delta      Cov g(theta) = G P G',  G by central differences
sandwich   (J'J)^-1 J' S J (J'J)^-1, J' S J = sum over lags |k| <= m of Bartlett's weight
           1 - |k|/(m+1) times sum_t psi(t) e(t) e(t-k) psi(t-k)'      Newey & West 1987
bootstrap  residuals in blocks that may start anywhere                 Künsch 1989
SPS        S_0 = |R^-1/2 sum phi r|^2 / N, S_i the same with random signs on r = y - phi'theta;
           theta is inside unless S_0 is among the q largest of m: confidence 1 - q/m,
           exact for independent symmetric noise       Csáji, Campi & Weyer 2015; METHODS 2.4
"""

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import lfilter


def delta(g, theta, P, h=1e-6):
    """Return g(theta), its covariance and the derivatives G; g returns a real vector."""
    theta = np.asarray(theta, float)
    sd = np.sqrt(np.diag(P))
    step = np.where(sd > 0, h * np.maximum(sd, 1e-3 * np.abs(theta)), h)
    # Steps of a share of sd: what the rule is linear over.
    G = np.column_stack(
        [
            (np.atleast_1d(g(theta + d)) - np.atleast_1d(g(theta - d))) / (2 * step[i])
            for i, d in enumerate(np.diag(step))
        ]
    )
    return np.atleast_1d(g(theta)), G @ P @ G.T, G


def fopdt(theta, Ts):
    """Return K and T of theta = [a1, b1], A = 1 + a1 q^-1; METHODS 2.4."""
    a, b = theta
    return np.array([b / (1 + a), -Ts / np.log(-a)])


def fopdt_slopes(theta, Ts):
    """Return the same derivatives in closed form; METHODS 2.4 with a of the other sign."""
    a, b = theta
    return np.array([[-b / (1 + a) ** 2, 1 / (1 + a)], [Ts / (a * np.log(-a) ** 2), 0.0]])


def roots(p):
    """Return [real, imaginary parts] of the roots of 1 + p_1 q^-1 + ..., in a fixed order."""
    r = np.roots(np.r_[1, p])
    r = r[np.lexsort((r.imag, r.real))]
    return np.r_[r.real, r.imag]


def gain(b, f):
    """Return B(1)/F(1)."""
    return np.sum(b) / (1 + np.sum(f))


def bode(b, f, nk, w, Ts):
    """Return [ln |G|, arg G in rad] at w; phases not wound."""
    z = np.exp(-1j * np.asarray(w) * Ts)
    B = sum(c * z ** (nk + k) for k, c in enumerate(b))
    F = 1 + sum(c * z ** (k + 1) for k, c in enumerate(f))
    return np.r_[np.log(np.abs(B / F)), np.angle(B / F)]


def step(b, f, nk, N):
    """Return the unit step response y(0) .. y(N-1)."""
    return lfilter(np.r_[np.zeros(nk), b], np.r_[1, f], np.ones(N))


def sandwich(eps, J, lags=None, starts=(0,)):
    """Return the covariance of the least-squares estimate for residuals that are not white."""
    N, n = J.shape
    lags = int(4 * (N / 100) ** (2 / 9)) if lags is None else lags
    size = np.linalg.norm(J, axis=0)
    X = J / size
    bread = np.linalg.inv(X.T @ X)
    score = X * eps[:, None]
    meat = score.T @ score
    segment = np.searchsorted(np.asarray(starts), np.arange(N), side="right")
    for k in range(1, lags + 1):
        same = segment[k:] == segment[:-k]
        cross = score[k:][same].T @ score[:-k][same]
        meat += (1 - k / (lags + 1)) * (cross + cross.T)
    return N / (N - n) * bread @ meat @ bread / np.outer(size, size)


def autocovariance(eps, highest=20, n=400):
    """Return r(0) .. r(n/2 - 1) of the AR model of eps whose order (1 .. highest) BIC takes."""
    X = np.column_stack([eps[highest - k : len(eps) - k] for k in range(1, highest + 1)])
    y, best = eps[highest:], None
    for p in range(1, highest + 1):
        c = np.linalg.lstsq(X[:, :p], y, rcond=None)[0]
        v = np.mean((y - X[:, :p] @ c) ** 2)
        bic = len(y) * np.log(v) + p * np.log(len(y))
        if best is None or bic < best[0]:
            best = bic, c, v
    h = lfilter([1.0], np.r_[1, -best[1]], np.eye(1, n).ravel())
    return best[2] * np.array([h[: n - k] @ h[k:] for k in range(n // 2)])


def sandwich_ar(eps, J, highest=20):
    """Return the covariance of the least-squares estimate for residuals that are an AR process."""
    N, n = J.shape
    r = np.zeros(N)
    found = autocovariance(eps, highest)
    r[: len(found)] = found[:N]
    size = np.linalg.norm(J, axis=0)
    X = J / size
    bread = np.linalg.pinv(X.T @ X)
    return N / (N - n) * bread @ (X.T @ toeplitz(r) @ X) @ bread / np.outer(size, size)


def blocks(eps, length, rng):
    """Return a record of as many rows, made of blocks of eps that start anywhere."""
    N = len(eps)
    first = rng.integers(0, N - length + 1, -(-N // length))
    return np.concatenate([eps[k : k + length] for k in first])[:N]


def bootstrap(fit, simulated, eps, length, runs, seed=0):
    """Return the estimates fit(simulated + resampled eps) (runs, n)."""
    rng = np.random.default_rng(seed)
    centred = eps - eps.mean()
    return np.array([fit(simulated + blocks(centred, length, rng)) for _ in range(runs)])


def signs(N, m, seed=0):
    """Return m - 1 rows of random signs, and an order that breaks ties."""
    rng = np.random.default_rng(seed)
    return rng.choice([-1.0, 1.0], (m - 1, N)), rng.permutation(m)


def inside(phi, y, theta, m=100, q=5, seed=0, perturbed=None):
    """Return whether theta belongs to the region of confidence 1 - q/m.

    `perturbed(theta, r)` builds phi of each sign-perturbed record for regressors that hold past
    y (ARX): y is simulated with theta and the residuals alpha_i r.  Without it phi is of u alone.
    """
    alpha, order = signs(len(y), m, seed)
    r = y - phi @ theta
    S = [norm(phi, r)]
    for a in alpha:
        S.append(norm(phi if perturbed is None else perturbed(theta, a * r), a * r))
    S = np.array(S)
    larger = np.sum((S > S[0]) | ((S == S[0]) & (order > order[0])))
    return bool(larger >= q)


def norm(phi, r):
    """Return r' phi (phi' phi)^-1 phi' r: the squared norm of the weighted sum."""
    Q = np.linalg.qr(phi)[0]
    return float(np.sum((Q.T @ r) ** 2))


def perturbed_arx(u, y, na, nb, nk, offset=True):
    """Return `perturbed` for an ARX model whose first rows are history; Csáji et al. 2015, V."""
    first = max(na, nk + nb - 1)

    def phi_of(theta, e):
        z = np.asarray(y, float).copy()
        out = []
        for t in range(first, len(z)):
            row = [-z[t - k] for k in range(1, na + 1)] + [u[t - nk - k] for k in range(nb)]
            row += [1.0] * offset
            z[t] = np.dot(row, theta) + e[t - first]
            out.append(row)
        return np.array(out)

    return phi_of
