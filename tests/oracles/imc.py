"""Internal model control: controllers, margins and costs; source 001, 3.6.

    C_IMC = C_F / G_-,  C_F = 1/(T_F s + 1)^gamma,  G* = G_- G_+       (3.6-6) to (3.6-12)
    C = C_IMC / (1 - C_IMC G*) = C_F G_-^-1 / (1 - C_F G_+)            (3.6-14), (3.6-15)

Corrections of ERRATA 3.1: the plant of (3.6-16), (3.6-17), (3.6-20) has T s + 1; ITAE at
gain margin 3 is (1/2 - 6/pi + 36/pi^2) L^2; (3.6-64) to (3.6-66) hold with dead-time
compensation only, and `pi_delay_costs` gives what PI and the exact delay do.
"""

from itertools import pairwise
from types import SimpleNamespace

import mpmath
import numpy as np
from scipy.optimize import brentq

from oracles.rational import horner

# -- the structure, as numbers at one s --------------------------------------------------


def responses(C_imc, G, G_model):
    """Return E/R, U/R, Y/R at one s, the model G_model beside the plant G; (3.6-1) to (3.6-3)."""
    den = 1 + C_imc * (G - G_model)
    return {"E/R": (1 - C_imc * G_model) / den, "U/R": C_imc / den, "Y/R": C_imc * G / den}


def ideal(num, den):
    """Return num, den of C_IMC = 1/G, so that Y = R; (3.6-5).  Improper for a proper plant."""
    return np.asarray(den, float), np.asarray(num, float)


def filtered(num, den, T_F, gamma):
    """Return num, den of C_IMC = C_F/G; Y/R = 1/(T_F s + 1)^gamma; (3.6-6) to (3.6-10)."""
    return np.asarray(den, float), np.polymul(num, _filter(T_F, gamma))


def split(num, den, L=0.0, allpass=False):
    """Return (num_minus, den_minus), (num_plus, den_plus, L) of G* = G_- G_+; (3.6-11).

    G_+ holds the dead time and the zeros to the right, (1 - s/z) each, of gain 1 as in
    (3.6-16), (3.6-20).  `allpass` puts their mirror images below them, (1 - s/z)/(1 + s/z'):
    least ISE for steps (Morari & Zafiriou, Robust Process Control, 1989, 4.1).
    """
    num = np.trim_zeros(np.asarray(num, float), "f")
    zeros = np.roots(num)
    right = zeros[zeros.real > 0]
    plus = np.real(np.poly(right)) if len(right) else np.ones(1)
    plus = plus / plus[-1]
    minus = np.polydiv(num, plus)[0]
    mirror = plus * (-1.0) ** np.arange(len(plus))[::-1] if allpass else np.ones(1)
    return (np.polymul(minus, mirror), np.asarray(den, float)), (plus, mirror, L)


def controller(num, den, L=0.0, *, T_F, gamma=1, allpass=False):
    """Return C(s) as a function of s, dead time exact; (3.6-15)."""
    (nm, dm), (plus, mirror, L) = split(num, den, L, allpass)

    def C(s):
        F = 1 / np.polyval(_filter(T_F, gamma), s)
        G_plus = np.polyval(plus, s) / np.polyval(mirror, s) * np.exp(-L * s)
        return F * np.polyval(dm, s) / np.polyval(nm, s) / (1 - F * G_plus)

    return C


def controller_polynomials(num, den, T_F, gamma=1, allpass=False):
    """Return num, den of C(s) for a plant without dead time; (3.6-15), common s cancelled.

    den is 0 at s = 0: integral action, since C_F and G_+ have gain 1.
    """
    (nm, dm), (plus, mirror, _) = split(num, den, 0.0, allpass)
    rest = np.polysub(np.polymul(_filter(T_F, gamma), mirror), plus)
    rest[-1] = 0.0
    return np.polymul(dm, mirror), np.polymul(nm, rest)


def pi(K, T, L, T_F):
    """Return Kp, Ti, from G_+ = 1 - Ls; (3.6-17) to (3.6-19)."""
    return T / (K * (T_F + L)), T


def pid(K, T, L, T_F):
    """Return Kp, Ti, Td, from G_+ = 1 - Ls/2; (3.6-21) to (3.6-24)."""
    return (2 * T + L) / (K * (2 * T_F + L)), T + L / 2, T * L / (2 * T + L)


# -- margins of IMC-PI, closed form ------------------------------------------------------


def margins_pi(L, T_F):
    """Return gain margin, its w, phase margin in rad, its w; (3.6-33) to (3.6-38)."""
    w = 1 / (T_F + L)
    return np.pi * (T_F + L) / (2 * L), np.pi / (2 * L), np.pi / 2 - L * w, w


def T_F_pi(L, gain_margin=None, phase_margin=None):
    """Return T_F of IMC-PI for one margin, phase in rad; (3.6-41), (3.6-43)."""
    if gain_margin is not None:
        return (2 * gain_margin / np.pi - 1) * L
    return (1 / (np.pi / 2 - phase_margin) - 1) * L


# -- margins of IMC-PID, by root finding ---------------------------------------------------


def w_gain_pid():
    """Return w_AM L, the root of atan(2/x) + x = pi: the same for all plants; (3.6-48)."""
    return brentq(lambda x: np.arctan2(2, x) + x - np.pi, 1.0, 3.0, xtol=1e-15)


def margins_pid(L, T_F):
    """Return gain margin, its w, phase margin in rad, its w; (3.6-48) to (3.6-53).

    Without a gain crossing (T_F = 0, where |CG| stays above 1) the phase margin is nan.
    """
    x = w_gain_pid()
    gain = x * (2 * T_F / L + 1) / np.hypot(x, 2)
    root = np.sqrt(T_F**2 + T_F * L)
    if root == 0:
        return gain, x / L, np.nan, np.inf
    return gain, x / L, np.pi - np.arctan(2 * root / L) - L / root, 1 / root


def T_F_pid(L, gain_margin=None, phase_margin=None):
    """Return T_F of IMC-PID for one margin, phase in rad; (3.6-50) solved, (3.6-53) searched.

    The phase margin rises with T_F up to pi/2 (T_F -> inf).
    """
    if gain_margin is not None:
        x = w_gain_pid()
        return (gain_margin * np.hypot(x, 2) / x - 1) * L / 2
    return L * brentq(lambda r: margins_pid(1.0, r)[2] - phase_margin, 1e-3, 1e9, xtol=1e-15)


# -- costs -------------------------------------------------------------------------------


def costs(L, T_F):
    """Return ISE, IAE, ITAE of e = 1 until L, then e^(-(t - L)/T_F); (3.6-63) to (3.6-66)."""
    return L + T_F / 2, L + T_F, L**2 / 2 + L * T_F + T_F**2


def costs_gain_margin_3(L):
    """Return the same three for T_F = (6/pi - 1) L; (3.6-68) to (3.6-70), the last corrected."""
    p = np.pi
    return (3 / p + 1 / 2) * L, 6 / p * L, (1 / 2 - 6 / p + 36 / p**2) * L**2


def costs_sampled(e, Ts):
    """Return ISE, IAE, ITAE as sums of samples times Ts from t = 0 on; (3.6-58), ERRATA 3.3."""
    e = np.asarray(e, float)
    return Ts * np.sum(e**2), Ts * np.sum(np.abs(e)), Ts**2 * np.sum(np.arange(len(e)) * np.abs(e))


def pi_delay_error(k, t):
    """Return e(t) of 1/(s + k e^(-s)), IMC-PI with exact delay 1, to a unit set-point step.

    e = sum_n (-k)^n (t - n)^n / n! over 0 <= n <= t, a finite sum; k = L/(T_F + L).
    """
    t = mpmath.mpf(t)
    return mpmath.fsum(
        (-k) ** n * (t - n) ** n / mpmath.factorial(n) for n in range(int(mpmath.floor(t)) + 1)
    )


def pi_delay_costs(gain_margin=3.0, band=0.02, t_end=50, dps=50):
    """Return ISE, IAE, ITAE, overshoot (%), settling of IMC-PI with the exact delay L = 1.

    K and T cancel; times are in L, ISE and IAE in L, ITAE in L^2.  Integrals over [0, t_end]
    from zero to zero of e, which is a polynomial between two whole t.
    """
    with mpmath.workdps(dps):
        k = mpmath.pi / (2 * mpmath.mpf(gain_margin))
        ise = iae = itae = overshoot = settling = mpmath.mpf(0)
        for n in range(t_end):
            e = _piece(k, n)
            cuts = [mpmath.mpf(0), *_crossings(e, 0), mpmath.mpf(1)]
            ise += _integral(np.polymul(e, e), 0, 1)
            for a, b in pairwise(cuts):
                sign = mpmath.sign(horner(e, (a + b) / 2))
                iae += sign * _integral(e, a, b)
                itae += sign * _integral(np.polymul(e, [1, n]), a, b)
            turning = _crossings(np.polyder(np.array(e)), 0)
            overshoot = max([overshoot] + [-horner(e, x) for x in turning])
            passed = [*_crossings(e, band), *_crossings(e, -band)]
            settling = max([settling] + [n + x for x in passed])
    return SimpleNamespace(
        ise=float(ise),
        iae=float(iae),
        itae=float(itae),
        overshoot=float(100 * overshoot),
        settling=float(settling),
    )


def pi_delay_ise(gain_margin=3.0):
    """Return ISE/L of IMC-PI with the exact delay: cos k / (2 k (1 - sin k)), k = pi/(2 A_M).

    By Parseval on 1/(s + k e^(-s)); compare (3.6-64).
    """
    k = np.pi / (2 * gain_margin)
    return np.cos(k) / (2 * k * (1 - np.sin(k)))


# -- helpers -------------------------------------------------------------------------------


def _filter(T_F, gamma):
    out = np.ones(1)
    for _ in range(gamma):
        out = np.polymul(out, [T_F, 1.0])
    return out


def _piece(k, n):
    """Return e(n + x) of `pi_delay_error` as a polynomial in x, highest power first."""
    c = [mpmath.mpf(0)] * (n + 1)
    for m in range(n + 1):
        front = (-k) ** m / mpmath.factorial(m)
        for j in range(m + 1):
            c[n - j] += front * mpmath.binomial(m, j) * mpmath.mpf(n - m) ** (m - j)
    return np.array(c)


def _integral(p, a, b):
    whole = [c / (len(p) - k) for k, c in enumerate(p)] + [mpmath.mpf(0)]
    return horner(whole, b) - horner(whole, a)


def _crossings(p, level, pieces=8):
    """Return the x in (0, 1) where the polynomial passes the level, from a grid of `pieces`."""

    def f(x):
        return horner(p, x) - level

    x = [mpmath.mpf(i) / pieces for i in range(pieces + 1)]
    return [
        mpmath.findroot(f, ends, solver="anderson")
        for ends in pairwise(x)
        if f(ends[0]) * f(ends[1]) < 0
    ]
