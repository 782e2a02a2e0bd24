"""Process models at irregular stamps: from break to break by the exact transition.

    x' = F x + g u(t - L), y = h x + O;  u held from its stamp to the next
    over any interval d without a move of u(t - L):
        [x; u] -> exp([F g; 0 0] d) [x; u]                                  Van Loan 1978
    breaks are all stamps of y and all stamps of u shifted by L; a missing y is a stamp left out,
    a missing u is the last one held (and said so)                         METHODS 2.2
    P1D  F = -1/T, g = K/T, h = 1;  P2D  T1 x1' = K u - x1, T2 x2' = x1 - x2, y = x2

Decimation: a low-pass filter first, then every m-th sample; the filter has its own delay, the
same on u and y, so it leaves G alone.  Pole at 0.8/m of the Nyquist frequency.
"""

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, sosfilt, sosfilt_zi

from oracles import experiment_design


def p1d(K, T):
    return np.array([[-1 / T]]), np.array([K / T]), np.array([1.0])


def p2d(K, T1, T2):
    F = np.array([[-1 / T1, 0.0], [1 / T2, -1 / T2]])
    return F, np.array([K / T1, 0.0]), np.array([0.0, 1.0])


def response(system, L, u, t, stamps, O=0.0):
    """Return y at `stamps`, at rest under u[0] before; u acts from t on, L later on x."""
    F, g, h = system
    n = len(g)
    x = -np.linalg.solve(F, g) * u[0]
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n] = F, g
    events = sorted(
        [(v + L, 0, k) for k, v in enumerate(t)] + [(v, 1, k) for k, v in enumerate(stamps)]
    )
    y, now, held = np.empty(len(stamps)), events[0][0], u[0]
    for when, kind, k in events:
        state = expm(M * (when - now)) @ np.append(x, held)
        x, now = state[:n], when
        if kind == 0:
            held = u[k]
        else:
            y[k] = h @ x + O
    return y


def fit(y, u, t, stamps, p0):
    """Fit K, T, L, O to whatever stamps there are; missing y are not among them."""
    good = np.isfinite(y)
    return experiment_design.estimate(y[good], u, t, stamps[good], p0)


def decimate(x, m, order=8):
    """Return every m-th sample of x behind a Butterworth at 0.8/m of Nyquist, at rest at x[0]."""
    sos = butter(order, 0.8 / m, output="sos")
    return sosfilt(sos, x, zi=sosfilt_zi(sos) * x[0])[0][::m]
