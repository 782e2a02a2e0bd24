"""Test signals: PRBS, GBN, multisine, chirp, staircase, and what they excite.

PRBS        shift register of n bits, x_k = x_(k-n) xor x_(k-n+tap), period M = 2^n - 1;
            periodic autocorrelation 1 at 0 and -1/M elsewhere (levels +-1)
            held for h samples: line spectrum ~ sinc^2(w h/2), first zero at 2 pi/(h Ts)
GBN         level changes at each sample with probability p; r(l) = (1 - 2 p)^|l|; Tulleken 1990
multisine   u = sum A_k cos(2 pi k t/N + phi_k); Schroeder phi_k = -pi k (k - 1)/F,
            or drawn: crest max|u|/rms about 1.7, or 3 to 4
chirp       u = A sin(2 pi (f0 t + (f1 - f0) t^2/(2 T)))
order of persistent excitation: the rank of the covariance of [u(t-1) ... u(t-n)], centred;
            a sum of F sines has 2 F (a line at pi counts 1)                Ljung 1999, 13.2
clock of a PRBS for K, T, L: 0.8 to 1.6 (T + L)                         METHODS 8, pitfall 8
"""

import numpy as np

TAPS = {2: 1, 3: 1, 4: 1, 5: 2, 6: 1, 7: 1, 9: 4, 10: 3, 11: 2, 15: 1, 17: 3, 18: 7}


def prbs(n, hold=1, periods=1, state=None):
    """Return +-1 by the register x^n + x^tap + 1, each bit held; n one of TAPS."""
    bits = list(np.ones(n, int) if state is None else state)
    out = []
    for _ in range(2**n - 1):
        out.append(bits[-1])
        bits = [bits[-1] ^ bits[TAPS[n] - 1], *bits[:-1]]
    return np.repeat(np.tile(2.0 * np.array(out) - 1, periods), hold)


def gbn(N, p, rng, least=1):
    """Return +-1 that changes with probability p after each `least` samples."""
    turns = rng.random(-(-N // least)) < p
    return np.repeat(np.where(np.cumsum(turns) % 2 == 0, 1.0, -1.0), least)[:N]


def multisine(N, lines, amplitudes=None, rng=None):
    """Return one period of N samples with the lines k of 2 pi/N; Schroeder phases without rng."""
    lines = np.asarray(lines)
    A = np.ones(len(lines)) if amplitudes is None else np.asarray(amplitudes)
    i = np.arange(1, len(lines) + 1)
    if rng is not None:
        phases = rng.uniform(0, 2 * np.pi, len(lines))
    else:
        p = A**2 / np.sum(A**2)  # Schroeder 1970: phi_n = phi_1 - 2 pi sum_(l<n) (n - l) p_l
        phases = np.array([-2 * np.pi * np.sum((n - i[: n - 1]) * p[: n - 1]) for n in i])
    t = np.arange(N)
    return sum(
        a * np.cos(2 * np.pi * k * t / N + f) for a, k, f in zip(A, lines, phases, strict=True)
    )


def chirp(N, Ts, f0, f1):
    """Return a sine whose frequency runs from f0 to f1 hertz in N samples."""
    t = np.arange(N) * Ts
    return np.sin(2 * np.pi * (f0 * t + (f1 - f0) * t**2 / (2 * N * Ts)))


def staircase(levels, hold):
    """Return each level held for `hold` samples."""
    return np.repeat(np.asarray(levels, float), hold)


def crest(u):
    return np.max(np.abs(u)) / np.sqrt(np.mean(u**2))


def periodic_correlation(u):
    """Return r(l) = sum u(t) u(t-l mod N)/N by adding up."""
    return np.array([u @ np.roll(u, l) for l in range(len(u))]) / len(u)


def held_spectrum(base, hold):
    """Return the line powers |U_k|^2/N of a periodic sequence after it is held, in closed form."""
    N = len(base) * hold
    w = 2 * np.pi * np.arange(N) / N
    X = np.fft.fft(base)[np.arange(N) % len(base)]
    sinc = np.where(
        np.isclose(np.sin(w / 2), 0),
        hold,
        np.sin(hold * w / 2) / np.where(w == 0, 1, np.sin(w / 2)),
    )
    return np.abs(X) ** 2 * sinc**2 / N


def order(u, n_max, tolerance=1e-5):
    """Return the largest n <= n_max for which the centred, scaled Hankel has full rank (X02)."""
    u = u - u.mean()
    if not np.any(u):
        return 0
    for n in range(n_max, 0, -1):
        H = np.column_stack([u[n - 1 - i : len(u) - i] for i in range(n)])
        H = H - H.mean(axis=0)
        s = np.linalg.svd(H / np.linalg.norm(H, axis=0), compute_uv=False)
        if s[-1] > tolerance * s[0]:
            return n
    return 0
