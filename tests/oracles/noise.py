"""Noise of a record: moments, histogram, autocorrelation, resolution, stationarity.

mean, rms, var = rms^2 - mean^2, SNR = 10 log10(rms^2/var)     source 001, (3.5-3) to (3.5-6)
R(l) = sum_(n>=l) x(n) x(n-l) / sum x(n)^2, x = y - mean        (3.5-7) to (3.5-9)
white:  |R(l)| < z/sqrt(N) for 95 % of the lags
bins    Freedman & Diaconis 1981: 2 IQR/N^(1/3) wide
resolution  the largest q of which every difference of neighbours is a multiple
stationarity between two parts: their means with the long-run variance s2 (1 + 2 sum R(l)),
        their variances by log(var1/var2), whose variance is 2/Ne1 + 2/Ne2 with
        Ne = N/(1 + 2 sum R(l)^2)
"""

import numpy as np
from scipy.stats import norm


def moments(y):
    """Return mean, rms, var, snr in dB; var by N, not N - 1; source 001, (3.5-3) to (3.5-6)."""
    mean = np.sum(y) / len(y)
    power = np.sum(np.asarray(y) ** 2) / len(y)
    var = np.sum((y - mean) ** 2) / len(y)
    return mean, np.sqrt(power), var, 10 * np.log10(power / var)


def autocorrelation(y, l_max):
    """Return R(0 ... l_max) of the centred signal; source 001, (3.5-8)."""
    x = y - np.mean(y)
    return np.array([np.sum(x[l:] * x[: len(x) - l]) for l in range(l_max + 1)]) / np.sum(x**2)


def bins(y):
    """Return the number of bins of the rule of Freedman and Diaconis."""
    low, high = np.percentile(y, [25, 75])
    width = 2 * (high - low) / len(y) ** (1 / 3)
    return int(np.ceil((np.max(y) - np.min(y)) / width)) if width > 0 else 1


def resolution(y, share=0.98, off_limit=0.05):
    """Return the step of a quantised signal, or None.

    Candidates are the least distance of two values met and its half and third; the first one of
    which `share` of all distances between neighbouring values are multiples, to 1/20 of a step,
    is taken. Chance gives 1/10. Held values are met once; more than half as many distinct values
    as changes, and hardly a repeat, means: not quantised.
    """
    y = np.asarray(y, float)
    changes = np.concatenate([y[:1], y[1:][np.diff(y) != 0]])
    values = np.unique(changes)
    repeats = 1 - len(changes) / len(y)
    if len(values) < 3 or (len(values) > len(changes) / 2 and repeats < 0.05):
        return None
    size = np.max(np.abs(values))
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-12 * size]
    for part in (1, 2, 3):
        q = np.min(gaps) / part
        if q < 1e-3 * np.median(np.abs(np.diff(changes))):
            return None
        for _ in range(5):  # the mean of many multiples is sharper than one gap
            q = np.sum(gaps) / np.sum(np.maximum(np.round(gaps / q), 1))
        off = np.abs(gaps / q - np.round(gaps / q))
        if np.mean(off < off_limit) >= share:
            return float(q)
    return None


def effective(y, power):
    """Return N/(1 + 2 sum R(l)^power), summed until R first falls inside its band."""
    N = len(y)
    R = autocorrelation(y, N // 4)
    inside = np.flatnonzero(np.abs(R) < 2 / np.sqrt(N))
    R = R[1 : (inside[0] if len(inside) else len(R))]
    return N / max(1.0, 1 + 2 * np.sum(R**power))


def stationary(y1, y2):
    """Return the two-sided p-values of equal means and of equal variances of two parts."""
    v = [np.var(y) / effective(y, 1) for y in (y1, y2)]
    z_mean = (np.mean(y1) - np.mean(y2)) / np.sqrt(sum(v))
    k = [kurtosis_factor(y) / effective(y, 2) for y in (y1, y2)]
    z_var = np.log(np.var(y1) / np.var(y2)) / np.sqrt(sum(k))
    return 2 * norm.sf(abs(z_mean)), 2 * norm.sf(abs(z_var))


def kurtosis_factor(y):
    """Return E x^4/var^2 - 1: 2 for Gauss; the variance of N log var of white noise."""
    x = y - np.mean(y)
    return max(0.1, np.mean(x**4) / np.mean(x**2) ** 2 - 1)
