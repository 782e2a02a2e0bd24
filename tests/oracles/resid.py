"""Residual tests: correlations as plain sums of products, with 99 % bands.

Whiteness: |r_e(k)| < z / sqrt(N).  Independence of the input: |r_ue(k)| < z sqrt(p / N),
p = sum_k r_e(k) r_u(k).  Source 001, 3.5.10; Ljung, System Identification, 2nd ed., 16.6.
"""

from itertools import pairwise

import numpy as np
from scipy.stats import norm

Z99 = float(norm.ppf(0.995))


def _lagged(a, b, k, starts):
    """Sum a(t + k) b(t) inside the segments."""
    edges = [*starts, len(a)]
    total = 0.0
    for first, end in pairwise(edges):
        p, q = a[first:end], b[first:end]
        if abs(k) < len(p):
            total += float(p[k:] @ q[: len(q) - k]) if k >= 0 else float(p[: len(p) + k] @ q[-k:])
    return total


def autocorr(eps, lags, starts=(0,)):
    """Return sum e(t+k) e(t) / sum e(t)^2 at the lags; source 001, 3.5.10."""
    eps = np.asarray(eps, float)
    return np.array([_lagged(eps, eps, int(k), starts) for k in lags]) / float(eps @ eps)


def crosscorr(eps, u, lags, starts=(0,)):
    """Return sum e(t+k) u(t) / sqrt(sum e^2 sum u^2), k > 0: past input; source 001, 3.5.10."""
    eps, u = np.asarray(eps, float), np.asarray(u, float)
    scale = np.sqrt(float(eps @ eps) * float(u @ u))
    return np.array([_lagged(eps, u, int(k), starts) for k in lags]) / scale


def auto_band(N):
    """Return the 99 % band of the autocorrelation of N white residuals; normal approximation."""
    return Z99 / np.sqrt(N)


def cross_band(eps, u, lags, starts=(0,)):
    """Return the 99 % band of the cross-correlation of coloured signals; Ljung 16.6."""
    both = np.arange(-int(np.max(lags)), int(np.max(lags)) + 1)
    p = float(autocorr(eps, both, starts) @ autocorr(u, both, starts))
    return Z99 * np.sqrt(max(p, 0.0) / len(eps))
