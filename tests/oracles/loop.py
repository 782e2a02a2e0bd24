"""The loop of K e^(-Ls) / (Ts + 1) with a PI or PID, delay exact.

    C(s) = Kp (1 + 1/(Ti s) + Td s / (Tf s + 1))

Margins by root finding on a dense frequency grid.  The continuous loop goes from one
delay to the next (method of steps): on each piece u is known from one delay before,
so y, the integral and u have Taylor series whose coefficients follow one another.
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from oracles.fopdt import response


def open_loop(w, K, T, L, Kp, Ti, Td=0.0, Tf=0.0):
    """Return C(jw) G(jw); source 001, (3.6-26)."""
    s = 1j * np.asarray(w, float)
    return Kp * (1 + 1 / (Ti * s) + Td * s / (Tf * s + 1)) * K * np.exp(-L * s) / (T * s + 1)


def phase(w, T, L, Ti, Td=0.0, Tf=0.0):
    """Return the continuous phase of C G for K Kp > 0; source 001, (3.6-27)."""
    w = np.asarray(w, float)
    # C = [(1 + Ti s)(1 + Tf s) + Ti Td s^2] / (Ti s (1 + Tf s));
    # the numerator's phase runs from 0 to at most pi.
    numerator = np.arctan2(w * (Ti + Tf), 1 - w**2 * Ti * (Tf + Td))
    return numerator - np.pi / 2 - np.arctan(w * Tf) - np.arctan(w * T) - w * L


def _crossings(f, w):
    v = f(w)
    k = np.flatnonzero(np.signbit(v[:-1]) != np.signbit(v[1:]))
    return np.array([brentq(f, w[i], w[i + 1], xtol=1e-14, rtol=1e-15) for i in k])


def _peak(f, w):
    best = -np.inf
    v = f(w)
    for i in np.argsort(v)[-3:]:
        lo, hi = w[max(i - 1, 0)], w[min(i + 1, len(w) - 1)]
        best = max(
            best,
            -minimize_scalar(
                lambda x: -float(f(x)), bounds=(lo, hi), method="bounded", options={"xatol": 1e-12}
            ).fun,
            v[i],
        )
    return float(best)


def margins(K, T, L, Kp, Ti, Td=0.0, Tf=0.0):
    """Return gain, phase and delay margin, Ms and Mt of a stable loop with K Kp > 0 and L > 0.

    Gain: least 1/|C G| where the phase is an odd multiple of -pi; phase and delay: least
    over all gain crossings.  Source 001, (3.6-27) to (3.6-30); Ms, Mt = max |S|, max |T|.
    """
    w = np.concatenate(
        [np.geomspace(1e-4 / (L + T), 0.05 / L, 4000), np.linspace(0.05 / L, 60 / L, 60000)[1:]]
    )
    C = dict(Td=Td, Tf=Tf)

    def G(x):
        return open_loop(x, K, T, L, Kp, Ti, **C)

    # Phase crossings: sin of half the distance to -pi changes sign at each of them only.
    at_pi = _crossings(lambda x: np.sin((phase(x, T, L, Ti, **C) + np.pi) / 2), w)
    at_one = _crossings(lambda x: np.log(np.abs(G(x))), w)
    gains = 1 / np.abs(G(at_pi))
    i = int(np.argmin(gains))
    left = np.mod(np.pi + phase(at_one, T, L, Ti, **C), 2 * np.pi)
    left = np.where(left > np.pi, left - 2 * np.pi, left)
    j = int(np.argmin(np.abs(left)))
    delays = np.mod(left, 2 * np.pi) / at_one
    return SimpleNamespace(
        gain=float(gains[i]),
        gain_db=float(20 * np.log10(gains[i])),
        w_gain=float(at_pi[i]),
        phase_deg=float(np.degrees(left[j])),
        w_phase=float(at_one[j]),
        delay=float(delays.min()),
        Ms=_peak(lambda x: np.abs(1 / (1 + G(x))), w),
        Mt=_peak(lambda x: np.abs(G(x) / (1 + G(x))), w),
    )


class Continuous:
    """Unit set-point and/or load step on a continuous PI loop, by the method of steps.

    T y' = -y + K (u(t - L) + d(t - L)),   u = Kp (r - y) + Kp/Ti int (r - y);  zero before t = 0.
    Each delay is cut into m pieces no longer than a quarter of min(T, Ti); ORDER terms a piece.
    """

    ORDER = 26

    def __init__(self, K, T, L, Kp, Ti, t_end, r=1.0, d=0.0):
        m = int(np.ceil(L / (0.25 * min(T, Ti))))
        self.h, self.t_end, self.r = L / m, float(t_end), r
        n = int(np.ceil(t_end / self.h - 1e-12))
        M = self.ORDER
        self.Y, self.U, self.I = (np.zeros((n, M)) for _ in range(3))
        powers = self.h ** np.arange(M)
        y0 = i0 = 0.0
        for p in range(n):
            drive = self.U[p - m].copy() if p >= m else np.zeros(M)
            if p >= m:
                drive[0] += d
            y, i = self.Y[p], self.I[p]
            y[0], i[0] = y0, i0
            for k in range(M - 1):
                y[k + 1] = (K * drive[k] - y[k]) / (T * (k + 1))
                i[k + 1] = ((r if k == 0 else 0.0) - y[k]) / (k + 1)
            self.U[p] = -Kp * y + Kp / Ti * i
            self.U[p, 0] += Kp * r
            y0, i0 = float(y @ powers), float(i @ powers)

    def _at(self, coef, t):
        t = np.asarray(t, float)
        p = np.clip((t / self.h).astype(int), 0, len(coef) - 1)
        x, out = t - p * self.h, np.zeros_like(t)
        for k in range(coef.shape[1] - 1, -1, -1):
            out = out * x + coef[p, k]
        return out

    def y(self, t):
        """Return the output at the times t; the pieces' Taylor series."""
        return self._at(self.Y, t)

    def u(self, t):
        """Return the controller output at the times t; the pieces' Taylor series."""
        return self._at(self.U, t)

    def _cuts(self, f, per_piece=8):
        t = np.unique(np.append(np.arange(0, self.t_end, self.h / per_piece), self.t_end))
        v = f(t)
        k = np.flatnonzero((np.signbit(v[:-1]) != np.signbit(v[1:])) & (v[:-1] != 0))
        return np.array(
            [brentq(lambda x: float(f(np.array(x))), t[i], t[i + 1], xtol=1e-15) for i in k]
        )

    def integral(self, f, cuts=()):
        """Return the integral of f over [0, t_end], piece by piece; Gauss-Legendre."""
        x, w = np.polynomial.legendre.leggauss(20)
        edges = np.unique(
            np.concatenate([np.arange(0, self.t_end, self.h), [self.t_end], np.asarray(cuts)])
        )
        a, b = edges[:-1, None], edges[1:, None]
        t = (a + b) / 2 + (b - a) / 2 * x
        return float(np.sum((b - a) / 2 * w * f(t)))

    def _max(self, f):
        t = np.linspace(0, self.t_end, 40 * len(self.Y) + 1)
        v = f(t)
        i = int(np.argmax(v))
        lo, hi = t[max(i - 1, 0)], t[min(i + 1, len(t) - 1)]
        peak = minimize_scalar(
            lambda x: -float(f(np.array(x))),
            bounds=(lo, hi),
            method="bounded",
            options={"xatol": 1e-13},
        )
        return max(float(v[i]), -float(peak.fun))

    def indices(self, final_u, band=0.02):
        """Return the step indices of source 001, table 3.6-2, as true integrals over [0, t_end]."""
        r = self.r
        zero = self._cuts(lambda t: r - self.y(t))
        edge = self._cuts(lambda t: np.abs(r - self.y(t)) - band * abs(r))

        def first(level):
            return self._cuts(lambda t: self.y(t) / r - level)[0]

        return SimpleNamespace(
            overshoot=max(0.0, 100 * (self._max(lambda t: self.y(t) / r) - 1)),
            settling=float(edge[-1]),
            rise=float(first(0.9) - first(0.1)),
            ise=self.integral(lambda t: (r - self.y(t)) ** 2),
            iae=self.integral(lambda t: np.abs(r - self.y(t)), zero),
            itae=self.integral(lambda t: t * np.abs(r - self.y(t)), zero),
            control_overshoot=max(0.0, 100 * (self._max(lambda t: self.u(t) / final_u) - 1)),
            control_energy=self.integral(lambda t: self.u(t) ** 2),
        )


def sampled_pi(K, T, L, Kp, Ti, Ts, r, d=None, noise=None):
    """Run I += Ts e; u[k] = Kp (e + I/Ti), held from t[k] to t[k+1], on the exact plant.

    Backward Euler (DESIGN 3, `PID`; 001, (3.7-25) as corrected).  The loop is at rest before
    t = 0, d adds to u, noise to the measured y.  `at(t)` is the true output between samples.
    """
    N = len(r)
    r = np.asarray(r, float)
    d = np.zeros(N) if d is None else np.asarray(d, float)
    noise = np.zeros(N) if noise is None else np.asarray(noise, float)
    t, y, u = Ts * np.arange(N), np.zeros(N), np.zeros(N)
    total = 0.0
    for k in range(N):
        if k:
            y[k] = K * response(u[:k] + d[:k], T, L, Ts, t[k : k + 1])[0]
        e = r[k] - y[k] - noise[k]
        total += Ts * e
        u[k] = Kp * (e + total / Ti)
    return SimpleNamespace(
        t=t, y=y, u=u, at=lambda x: K * response(u + d, T, L, Ts, np.atleast_1d(x))
    )


def imc_pi(K, T, L, tau_c):
    """Return Kp and Ti of IMC-PI; source 001, (3.6-18) and (3.6-19)."""
    return T / (K * (tau_c + L)), T


def imc_pid(K, T, L, tau_c):
    """Return Kp, Ti, Td of IMC-PID; source 001, (3.6-22) to (3.6-24), (3.6-46)."""
    return (2 * T + L) / (K * (2 * tau_c + L)), T + L / 2, T * L / (2 * T + L)
