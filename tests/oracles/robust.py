"""Huber's estimates by reweighted least squares, for regressions and for output error.

    min sum rho(r_t / s),   weights w = min(1, c s/|r|),  c = 1.345,  s = 1.4826 MAD of r

s is taken anew in each round; a round of a regression solves the weighted least squares, one
of an output-error model runs Gauss-Newton on sqrt(w) eps.  Huber 1981, 7.8; METHODS 2.4.

    Cov = s^2 kappa^2 mean(psi^2)/mean(psi')^2 (J'J)^-1,  psi(x) = max(-c, min(c, x)), x = r/s
    kappa = 1 + (n/N) (1 - mean psi')/mean psi'                          Huber 1981, (6.5)
"""

from types import SimpleNamespace

import numpy as np

C = 1.345


def scale(r):
    """Return s; zero where more than half of r are equal."""
    return 1.4826 * float(np.median(np.abs(r - np.median(r))))


def weights(r, s, c=C):
    return np.minimum(1.0, c * s / np.maximum(np.abs(r), 1e-300))


def covariance(r, s, J, c=C):
    """Return the covariance of a Huber estimate with Jacobian J."""
    N, n = J.shape
    inside = np.mean(np.abs(r) <= c * s)
    square = np.sum(np.clip(r / s, -c, c) ** 2) / (N - n)
    kappa = 1 + n / N * (1 - inside) / inside
    size = np.linalg.norm(J, axis=0)
    inverse = np.linalg.inv((J / size).T @ (J / size)) / np.outer(size, size)
    return s**2 * kappa**2 * square / inside**2 * inverse


def regression(X, y, c=C, rounds=200, tolerance=1e-12):
    """Return theta, sd, weights of y = X theta + r."""
    size = np.linalg.norm(X, axis=0)
    theta = np.linalg.lstsq(X / size, y, rcond=None)[0] / size
    for _ in range(rounds):
        r = y - X @ theta
        s = scale(r)
        root = np.sqrt(weights(r, s, c))[:, None]
        new = np.linalg.lstsq(root * X / size, root[:, 0] * y, rcond=None)[0] / size
        moved = np.max(np.abs(new - theta) * size)
        theta = new
        if moved < tolerance * np.linalg.norm(y):
            break
    r = y - X @ theta
    s = scale(r)
    P = covariance(r, s, X, c)
    return SimpleNamespace(theta=theta, sd=np.sqrt(np.diag(P)), P=P, s=s, w=weights(r, s, c), eps=r)


def nonlinear(problem, x, c=C, rounds=100, tolerance=1e-10):
    """Return the Huber estimate of a `pem.Problem` from x (its full vector).

    Each round takes one Levenberg-Marquardt step on the loss of the weights in hand; the
    least-squares minimum, or a start made of outlier-free rows, should be x.
    """
    x, damping = np.asarray(x, float).copy(), 1e-3
    eps, J = problem(x)
    for _ in range(rounds):
        s = scale(eps)
        w = weights(eps, s, c)
        size = np.linalg.norm(np.sqrt(w)[:, None] * J, axis=0)
        while True:
            top = np.sqrt(w)[:, None] * J / size
            A = np.vstack([top, np.sqrt(damping) * np.eye(len(x))])
            step = -np.linalg.lstsq(A, np.r_[np.sqrt(w) * eps, np.zeros(len(x))], rcond=None)[0]
            new_eps, new_J = problem(x + step / size)
            if loss(new_eps, s, c) <= loss(eps, s, c) or damping > 1e8:
                break
            damping *= 10
        x, eps, J, damping = x + step / size, new_eps, new_J, max(damping / 10, 1e-12)
        if np.linalg.norm(step) < tolerance * np.linalg.norm(np.sqrt(w) * eps):
            break
    s = scale(eps)
    P = covariance(eps, s, J, c)
    return SimpleNamespace(x=x, sd=np.sqrt(np.diag(P)), P=P, s=s, w=weights(eps, s, c), eps=eps)


def loss(r, s, c=C):
    """Return sum rho(r/s), quadratic inside c and linear outside."""
    x = np.abs(r / s)
    return float(np.sum(np.where(x <= c, 0.5 * x * x, c * x - 0.5 * c * c)))
