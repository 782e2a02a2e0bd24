"""Power spectral density: periodogram, Welch, Blackman-Tukey, all one-sided in y^2/(rad/s).

X(k)   = sum x(n) W^(k n), W = e^(-2 pi i/N)               source 001, (3.5-10), (3.5-11)
P(k w_s/N) = c |X(k)|^2/(w_s N), c = 2, at k = 0 and at N/2 c = 1        (3.5-13), (3.5-14)
sum P w_s/N = mean square                                   Parseval, (3.5-12)
Welch: mean over segments of n samples, overlap half, of the periodogram of window * x,
       |.|^2 divided by w_s sum window^2; variance ratio 1/Ne,
       1/Ne = sum over pairs of (w shifted . w)^2/(w . w)^2 / segments^2; 19/18 K for Hann
Blackman-Tukey: P(w) = 2/w_s sum_|l|<=M window(l) R(l) e^(-i w l Ts), R biased;
       variance ratio sum window^2/N; degrees of freedom 2 N/sum window^2
band: P Q(nu)/chi2, nu = 2/variance ratio
"""

import numpy as np
from scipy.stats import chi2


def periodogram(x, Ts):
    """Return w and P by a sum over every n and k; source 001, (3.5-10) to (3.5-14)."""
    x = np.asarray(x, float)
    N, ws = len(x), 2 * np.pi / Ts
    k = np.arange(N // 2 + 1)
    X = np.exp(-2j * np.pi * np.outer(k, np.arange(N)) / N) @ x
    c = np.where((k == 0) | (2 * k == N), 1.0, 2.0)
    return k * ws / N, c * np.abs(X) ** 2 / (ws * N)


def hann(n):
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)  # periodic


def welch(x, Ts, n, window=None):
    """Return w, P and the variance ratio 1/Ne of half-overlapping segments of n."""
    window = hann(n) if window is None else window
    first = range(0, len(x) - n + 1, n // 2)
    k, ws = np.arange(n // 2 + 1), 2 * np.pi / Ts
    E = np.exp(-2j * np.pi * np.outer(k, np.arange(n)) / n)
    c = np.where((k == 0) | (2 * k == n), 1.0, 2.0)
    P = np.mean([c * np.abs(E @ (window * x[f : f + n])) ** 2 for f in first], axis=0)
    K = len(first)
    shared = [window[: n - l] @ window[l:] / (window @ window) for l in range(0, n, n // 2)]
    ratio = sum(
        shared[abs(i - j)] ** 2 for i in range(K) for j in range(K) if abs(i - j) < len(shared)
    )
    return k * ws / n, P / (ws * window @ window), ratio / K**2


def lag_window(M):
    """Return the Hann lag window w(l), l = 0 ... M; Ljung 1999, table 6.1."""
    return 0.5 * (1 + np.cos(np.pi * np.arange(M + 1) / M))


def covariance(x, y, l):
    """Return sum x(n) y(n - l)/N, biased; l of either sign."""
    N = len(x)
    return (x[l:] @ y[: N - l] if l >= 0 else x[:l] @ y[-l:]) / N


def blackman_tukey(x, Ts, M, w):
    """Return P at w and the variance ratio of the Hann lag window of width M."""
    x = x - np.mean(x)
    h = lag_window(M)
    R = np.array([covariance(x, x, l) for l in range(M + 1)])
    P = np.array(
        [h[0] * R[0] + 2 * np.sum(h[1:] * R[1:] * np.cos(v * Ts * np.arange(1, M + 1))) for v in w]
    )
    return 2 * P * Ts / (2 * np.pi), (h[0] ** 2 + 2 * np.sum(h[1:] ** 2)) / len(x)


def band(P, ratio, level=0.95):
    """Return the interval of the true density, chi-square with 2/ratio degrees of freedom."""
    nu = 2 / ratio
    return nu * P / chi2.ppf((1 + level) / 2, nu), nu * P / chi2.ppf((1 - level) / 2, nu)
