"""Time constants of a step response at once, without a search: starts and quick answers.

    y(t) = K + sum_i d_i e^(p_i t), any K, any state at t = 0; exact without noise:

    pencil     roots of Y1 - z Y0, Y of rank k + 1; Hua & Sarkar, IEEE ASSP 38, 1990
    prony      sum_j d_j (y[n - j] - K) = 0 by least squares; source 003, (15)
    integrals  y = sum_j a_j I^j y + polynomial of degree k, I the integral from the first row

From areas, for a step from rest: one time constant and delay (Astrom & Hagglund 1995; Bi et
al. 1999), n equal ones (Strejc 1959).  METHODS 5.
"""

import numpy as np
from scipy.linalg import hankel


def ordered(poles):
    """Return poles by rising time constant, conjugates side by side."""
    return poles[np.lexsort((poles.imag, np.abs(poles.imag), poles.real))]


def blocks(y, dt, most=200):
    """Return block means of y and their spacing: e^(pt) stays e^(pt), white noise falls."""
    m = max(1, len(y) // most)
    n = len(y) // m
    return y[: n * m].reshape(n, m).mean(axis=1), m * dt


def pencil(y, dt, k, part=0.5):
    """Return k poles of y by the matrix pencil; the root nearest 1 is the constant."""
    N = len(y)
    L = int(part * N)
    H = hankel(y[: N - L], y[N - L - 1 :])
    V = np.linalg.svd(H, full_matrices=False)[2][: k + 1].T
    z = np.linalg.eigvals(np.linalg.lstsq(V[:-1], V[1:], rcond=None)[0]).astype(complex)
    z = np.delete(z, np.argmin(np.abs(z - 1)))
    with np.errstate(divide="ignore"):
        return ordered(np.log(z) / dt)


def prony(y, dt, k, lag=1):
    """Return k poles from sum_j d_j (y[n - j lag] - K) = 0; the constant drops out with the means.

    (15) of source 003 with K free, its rows scaled to d_0 = 1 instead of sum d = 1.
    """
    N = len(y)
    Y = np.column_stack([y[(k - j) * lag : N - j * lag] for j in range(k + 1)])
    Y = Y - Y.mean(axis=0)
    a = np.linalg.lstsq(Y[:, 1:], -Y[:, 0], rcond=None)[0]
    z = np.roots(np.append(1.0, a)).astype(complex)
    with np.errstate(divide="ignore"):
        return ordered(np.log(z) / (dt * lag))


def integrals(t, y, k):
    """Return k poles from y = a_1 Iy + ... + a_k I^k y + polynomial of degree k.

    The sum of exponentials obeys a differential equation of order k whose right side is
    constant; k integrals make it free of derivatives, and the polynomial holds the
    state and K.  Integrals by the cubic through each four neighbours, any spacing.
    """
    t = t - t[0]
    scale = t[-1]
    x, columns, z = t / scale, [], y
    for _ in range(k):
        z = integral(x, z)
        columns.append(z)
    columns += [np.ones(len(x))]
    columns += [np.polynomial.legendre.legval(2 * x - 1, np.eye(k + 1)[j]) for j in range(1, k + 1)]
    X = np.column_stack(columns)
    size = np.linalg.norm(X, axis=0)
    a = np.linalg.lstsq(X / size, y, rcond=None)[0] / size
    return ordered(np.roots(np.append(1.0, -a[:k])).astype(complex) / scale)


def integral(x, y):
    """Return the integral of y from x[0] to each x: cubic through four neighbours."""
    n = len(x)
    if n < 4:
        return np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2 * np.diff(x))])
    node = np.sqrt(1 / 3) * np.array([-1, 1])  # two Gauss points are exact for a cubic
    first = np.clip(np.arange(n - 1) - 1, 0, n - 4)
    pieces = np.zeros(n - 1)
    half = np.diff(x) / 2
    for g in node:
        at = x[:-1] + half * (1 + g)
        value = np.zeros(n - 1)
        for i in range(4):
            weight = np.ones(n - 1)
            for j in range(4):
                if j != i:
                    weight *= (at - x[first + j]) / (x[first + i] - x[first + j])
            value += weight * y[first + i]
        pieces += half * value
    return np.concatenate([[0.0], np.cumsum(pieces)])


# -- areas: one, two or n equal time constants at once ---------------------------------------


def area_fopdt(t, y, y0, y1):
    """Return T, L from two areas: A0 = int (y1 - y) = K(T + L), A1 = int_0^(T+L) (y - y0) = KT/e.

    The step at t[0] = 0 from rest at y0 to y1; Astrom & Hagglund, PID Controllers, 1995, 2.4.
    """
    K = y1 - y0
    total = integral(t, y1 - y)[-1] / K
    up_to = np.interp(total, t, integral(t, y - y0)) / K
    T = np.e * up_to
    return T, total - T


def equal_lags(t, y, y0, y1):
    """Return n, T of 1/(Ts + 1)^n with the mean and variance of the impulse response.

    mean = int (1 - s) dt = nT, mean of squares = 2 int t (1 - s) dt, s the unit step
    response; n is real, rounded by whoever needs a row of tanks (Strejc 1959).
    """
    rest = (y1 - y) / (y1 - y0)
    mean = integral(t, rest)[-1]
    variance = 2 * integral(t, t * rest)[-1] - mean**2
    return mean**2 / variance, variance / mean


def integral_fopdt(t, y, late):
    """Return K, T, L, y0 of a unit step at t = 0 from int y = -T y + (K + y0) t + T y0 - K L.

    Linear in what is unknown, the state before the step too; rows with t > late alone, past
    the delay.  y0 is the mean of the rows before t = 0.  Bi et al., Control Eng. Practice 7, 1999.
    """
    before = t < 0
    y0 = y[before].mean() if before.any() else y[0]
    at = np.append(0.0, t[t > 0])
    v = np.append(0.0, y[t > 0] - y0)
    area = integral(at, v)
    use = at > late
    X = np.column_stack([-v, at, -np.ones(len(at))])[use]
    # instruments without noise: area = -T v + K t - K L with v from the first pass
    T, K, KL = np.linalg.lstsq(X, area[use], rcond=None)[0]
    for _ in range(3):
        clean = K * -np.expm1(-np.maximum(at - KL / K, 0) / max(T, 1e-9))
        Z = np.column_stack([-clean, at, -np.ones(len(at))])[use]
        T, K, KL = np.linalg.solve(Z.T @ X, Z.T @ area[use])
    return K, T, KL / K, y0
