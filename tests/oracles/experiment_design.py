"""Standard deviations of K, T, L, O that an experiment will give, before it is run.

    y(t) = O + K sum_j du_j s(t - t_j - L) + v(t),  s(x) = 1 - e^(-x/T) for x > 0, u held between
    psi(t) = dy/d(K, T, L, O)    with x = t - t_j - L > 0 at each move du_j:
        dK = sum du_j s(x),  dT = -K/T^2 sum du_j x e^(-x/T),
        dL = -K/T sum du_j e^(-x/T),  dO = 1
    white v            Cov = s2 (psi' psi)^-1                           Ljung 1999, 7.4 and 9.4
    coloured v, fit that thinks it white (output error)
                       Cov = M (psi' R psi) M, M = (psi' psi)^-1, R the covariance of v
    coloured v, its colour in the model (Box-Jenkins)
                       Cov = (psi' R^-1 psi)^-1
    not at rest before the record: one more column, e^(-t/T)

At L/Ts whole a move that arrives just at a sample has two slopes by L (0 and -K/T du): the fit
sees both sides, so psi takes `side` "mean", and the sd is good to a tenth only when it is small
against Ts (METHODS 1.1, 2.4; `bound`).
"""

import numpy as np


def response(p, u, t, stamps):
    """Return y at `stamps` of p = (K, T, L, O), resting under u[0] before; u acts from t on."""
    K, T, L, O = p
    du = np.diff(u)
    x = stamps[:, None] - t[None, 1:] - L
    return O + K * (u[0] + np.sum(np.where(x > 0, du * -np.expm1(-x.clip(0) / T), 0.0), axis=1))


def sensitivities(p, u, t, stamps, side="mean", start=False):
    """Return psi (N, 4 or 5) for K, T, L, O and, with `start`, the state before the record."""
    K, T, L, _ = p
    du = np.diff(u)
    x = stamps[:, None] - t[None, 1:] - L
    on = np.where(np.abs(x) < 1e-9 * T, {"left": 1.0, "right": 0.0, "mean": 0.5}[side], x > 0)
    decay = np.where(on > 0, np.exp(-x.clip(0) / T), 0.0)
    columns = [
        u[0] + np.sum(du * np.where(x > 0, 1 - decay, 0.0), axis=1),
        -K / T**2 * np.sum(du * x * decay * on, axis=1),
        -K / T * np.sum(du * decay * on, axis=1),
        np.ones(len(stamps)),
    ]
    if start:
        columns.append(np.exp(-(stamps - stamps[0]) / T))
    return np.column_stack(columns)


def ar1(N, sd, phi):
    """Return the covariance (N, N) of v(t) = phi v(t-1) + e(t) with standard deviation sd."""
    k = np.arange(N)
    return sd**2 * phi ** np.abs(k[:, None] - k)


def predicted(psi, R, fit="white"):
    """Return the standard deviations of the parameters; R the covariance of v."""
    if fit == "white":
        M = np.linalg.inv(psi.T @ psi)
        return np.sqrt(np.diag(M @ psi.T @ R @ psi @ M))
    return np.sqrt(np.diag(np.linalg.inv(psi.T @ np.linalg.solve(R, psi))))


def estimate(y, u, t, stamps, p0, rounds=40, start=False, more=()):
    """Fit K, T, L, O by Levenberg-Marquardt from p0; K, O and `more` columns are solved for."""
    T, L = p0[1], p0[2]

    def solve(T, L):
        unit = response((1.0, T, L, 0.0), u, t, stamps)
        cols = [unit, np.ones(len(y))] + ([np.exp(-(stamps - stamps[0]) / T)] if start else [])
        cols += list(more)
        X = np.column_stack(cols)
        theta = np.linalg.lstsq(X, y, rcond=None)[0]
        return theta, y - X @ theta, X

    theta, eps, X = solve(T, L)
    mu = 1e-3
    for _ in range(rounds):
        psi = sensitivities((theta[0], T, L, theta[1]), u, t, stamps)[:, 1:3] * [T, 1.0]
        if start:
            psi[:, 0] += theta[2] * np.exp(-(stamps - stamps[0]) / T) * (stamps - stamps[0]) / T
        psi = psi - X @ np.linalg.lstsq(X, psi, rcond=None)[0]  # what K and O cannot do
        H, g = psi.T @ psi, psi.T @ eps
        step = np.linalg.lstsq(H + mu * np.diag(np.diag(H)), g, rcond=None)[0]
        T_new, L_new = T * np.exp(np.clip(step[0], -1, 1)), max(0.0, L + step[1])
        theta_new, eps_new, X_new = solve(T_new, L_new)
        if eps_new @ eps_new <= eps @ eps:
            done = abs(step[0]) < 1e-7 and abs(L_new - L) < 1e-7 * T
            T, L, theta, eps, X, mu = T_new, L_new, theta_new, eps_new, X_new, mu / 5
            if done:
                break
        else:
            mu *= 6
            if mu > 1e8:
                break
    return np.array([theta[0], T, L, theta[1]]), float(eps @ eps)
