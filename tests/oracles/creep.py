"""Creep operators, and the charge with its leak; source 002, 3.2, (5) and (6).

    s_k' = (x - s_k)/tau_k, y = sum c_k s_k; for x held between samples
    s_k(t+1) = e^(-Ts/tau_k) s_k(t) + (1 - e^(-Ts/tau_k)) x(t)
    after a step y = sum c_k (1 - e^(-t/tau_k))

    i_t = i_c + i_l, i_l = V/X, X = R/sqrt((a i)^2 + 1), R = 21 Gohm, a = 3.4e7 1/A, q' = i_c,
    V = q/C, displacement = G q

The i of X is read as the leak's own, i_l = V/sqrt(R^2 - (a V)^2), V < R/a = 617.6 V; with i_t
in its place (`by="total"`) both agree where the charge stands still, i_c = 0.
Kuhnen & Janocha, IMechE J. Systems Control Eng. 212, 1998; Ronkanen, Kallio & Koivo, IROS 2002.
"""

import numpy as np
from scipy.integrate import solve_ivp

R, A = 21e9, 3.4e7


def creep(x, Ts, c, tau, s0=0.0):
    """Return y at the samples, before x(t) has acted."""
    y = np.zeros(len(x))
    for ck, tk in zip(c, tau, strict=True):
        s = s0
        for t, xt in enumerate(x):
            y[t] += ck * s
            s += (1 - np.exp(-Ts / tk)) * (xt - s)
    return y


def spaced(fastest, slowest, n):
    """Return n time constants, equal steps of the logarithm."""
    return fastest * (slowest / fastest) ** (np.arange(n) / (n - 1))


def fit(x, y, Ts, tau):
    """Return c of y = c_0 x + sum c_k s_k by least squares, c_0 first."""
    s = [creep(x, Ts, [1.0], [tk]) for tk in tau]
    return np.linalg.lstsq(np.column_stack([x, *s]), y, rcond=None)[0]


def leak_resistance(i):
    """Return X of (5), in ohm; i in A."""
    return R / np.sqrt((A * i) ** 2 + 1)


def leak(V):
    """Return i_l with i_l X(i_l) = V."""
    return V / np.sqrt(R**2 - (A * V) ** 2)


def charge(i_t, Ts, C, q0=0.0, by="leak"):
    """Return q at the samples for a drive current held between them."""
    q, out = q0, []
    for it in i_t:
        out.append(q)

        def slope(_, s, it=it):
            V = s[0] / C
            return [it - (leak(V) if by == "leak" else V / leak_resistance(it))]

        q = solve_ivp(slope, (0, Ts), [q], "DOP853", rtol=1e-11, atol=1e-18).y[0, -1]
    return np.array(out)
