"""Frequency response from a record: ETFE, smoothed ETFE, Welch, Blackman-Tukey; bands.

ETFE        G(w_k) = Y(w_k)/U(w_k)                                   source 001, (3.5-38)
smoothed    G = sum_j W(j) Y U*/sum_j W(j) |U|^2 over neighbouring lines (Hann, 2 half + 1 wide)
spa         G = S_yu/S_u, S by a Hann lag window of width M; Ljung 1999, 6.4
Welch       the same with S averaged over half-overlapping Hann segments
coherence   g2 = |S_yu|^2/(S_u S_y); disturbance S_v = S_y (1 - g2)
band        var G = r (1 - g2)/(g2) |G|^2 / (1 - r), r the variance ratio of the averaging
            (1/segments in effect); |G| and its complex error: 2 real parts, each half
S_yu(w) = sum_l R_yu(l) h(l) e^(-i w l Ts), R_yu(l) = mean y(t + l) u(t)
"""

import numpy as np
from scipy.stats import f as f_law

from oracles import spectrum


def etfe(u, y, Ts):
    """Return w_k and Y/U at k = 1 ... N/2; source 001, (3.5-38)."""
    N = len(u)
    k = np.arange(1, N // 2 + 1)
    E = np.exp(-2j * np.pi * np.outer(k, np.arange(N)) / N)
    return 2 * np.pi * k / (N * Ts), (E @ y) / (E @ u)


def smoothed(u, y, Ts, half):
    """Return w, G and coherence of the ETFE averaged over lines with a Hann weight."""
    N = len(u)
    U, Y = np.fft.fft(u - u.mean()), np.fft.fft(y - y.mean())
    W = 0.5 * (1 + np.cos(np.pi * np.arange(-half, half + 1) / (half + 1)))
    k = np.arange(1, N // 2 + 1)

    def over(S):
        return np.array([np.sum(W * S[(i + np.arange(-half, half + 1)) % N]) for i in k])

    Syu, Su, Sy = over(Y * U.conj()), over(np.abs(U) ** 2), over(np.abs(Y) ** 2)
    ratio = np.sum(W**2) / np.sum(W) ** 2
    return 2 * np.pi * k / (N * Ts), Syu / Su, np.abs(Syu) ** 2 / (Su * Sy), ratio


def spa(u, y, Ts, M, w):
    """Return G, coherence and the variance ratio at w by Blackman and Tukey."""
    u, y = u - u.mean(), y - y.mean()
    h = spectrum.lag_window(M)
    l = np.arange(-M, M + 1)
    H = h[np.abs(l)]
    E = np.exp(-1j * np.outer(w, l) * Ts)
    Ryu = np.array([spectrum.covariance(y, u, i) for i in l])
    Ru = np.array([spectrum.covariance(u, u, i) for i in l])
    Ry = np.array([spectrum.covariance(y, y, i) for i in l])
    Syu, Su, Sy = E @ (H * Ryu), (E @ (H * Ru)).real, (E @ (H * Ry)).real
    return Syu / Su, np.abs(Syu) ** 2 / (Su * Sy), np.sum(H**2) / len(u)


def welch(u, y, Ts, n):
    """Return w, G, coherence and the variance ratio; segments of n, half overlapping, Hann."""
    u, y = u - u.mean(), y - y.mean()
    window = spectrum.hann(n)
    first = range(0, len(u) - n + 1, n // 2)
    U = np.array([np.fft.rfft(window * u[f : f + n]) for f in first])
    Y = np.array([np.fft.rfft(window * y[f : f + n]) for f in first])
    Syu, Su, Sy = (Y * U.conj()).mean(0), (np.abs(U) ** 2).mean(0), (np.abs(Y) ** 2).mean(0)
    ratio = spectrum.welch(u, Ts, n)[2]
    w = 2 * np.pi * np.arange(n // 2 + 1) / (n * Ts)
    return w[1:], (Syu / Su)[1:], (np.abs(Syu) ** 2 / (Su * Sy))[1:], ratio


def radius(G, coherence, ratio, level=0.95):
    """Return the radius of the disc in which G lies; Bendat & Piersol 2010, (9.94).

    |G^ - G|^2 <= 2/(nu - 2) F(2, nu - 2) (1 - g2) S_y/S_u, nu = 2/ratio.
    """
    nu = 2 / ratio
    quantile = f_law.ppf(level, 2, nu - 2)
    return np.sqrt(2 / (nu - 2) * quantile * (1 / np.minimum(coherence, 1.0) - 1)) * np.abs(G)
