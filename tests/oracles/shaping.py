"""Controllers from a point of the frequency response, and rules for further plants.

    C(j w_c) G(j w_c) = e^(j(-pi + phi_m)) =: X G(j w_c)
    PI:  Kp - j Ki/w_c = X;   PID: Kp (1 + j (w_c Td - 1/(w_c Ti))) = X, Td/Ti given

Astrom & Hagglund, Advanced PID Control, 2006, 6.4 (moving a point of the Nyquist curve).
The rules return the standard form Kp, Ti, Td with the sign of the plant's gain.
"""

import numpy as np
from scipy.optimize import brentq

# -- loop shaping --------------------------------------------------------------------------


def needed(G, w_c, phase_margin):
    """Return X = C(j w_c) for |CG| = 1 and the phase margin (rad); `G` is a function of s."""
    return np.exp(1j * (phase_margin - np.pi)) / G(1j * w_c)


def pi(G, w_c, phase_margin):
    """Return Kp, Ki of the PI with this crossover and phase margin (rad), None if there is none.

    A PI turns by 0 to -90 degrees: Kp and Ki must come out of one sign, that of the plant.
    """
    X = needed(G, w_c, phase_margin)
    Kp, Ki = X.real, -w_c * X.imag
    return (float(Kp), float(Ki)) if Kp * Ki > 0 else None


def pi_phase_margin_limit(G, w_c, sign=1.0):
    """Return the phase margin (rad) that a PI can only come near to at w_c: pi + arg(sign G)."""
    return float(np.pi + np.angle(sign * G(1j * w_c)))


def pid(G, w_c, phase_margin, ratio=0.25, filter=None):
    """Return Kp, Ti, Td = ratio Ti for crossover and phase margin (rad), None if there is none.

    `filter` is a function of s in series with C (a filter on y of known Tf), its phase and gain
    taken into account.  q = tan(arg X) = w Td - 1/(w Ti).
    """
    X = needed(G, w_c, phase_margin) / (1 if filter is None else filter(1j * w_c))
    if abs(X.real) <= 1e-12 * abs(X) or X.real * np.real(G(0)) < 0:
        return None
    q = X.imag / X.real
    x = 2 / (np.sqrt(q**2 + 4 * ratio) - q)  # w Ti > 0 of ratio (w Ti)^2 - q w Ti - 1 = 0
    return float(X.real), float(x / w_c), float(ratio * x / w_c)


def pid_by_search(G, w_c, phase_margin, ratio=0.25, filter=None):
    """Return the same as `pid` by root finding on the phase of CG alone."""
    H = (lambda s: 1.0) if filter is None else filter
    s = 1j * w_c

    def C(Ti):
        return (1 + 1 / (Ti * s) + ratio * Ti * s) * H(s)

    def miss(lnTi):
        return np.angle(C(np.exp(lnTi)) * G(s) * np.exp(1j * (np.pi - phase_margin)))

    Ti = np.exp(brentq(miss, np.log(1e-6 / w_c), np.log(1e6 / w_c), xtol=1e-15))
    return float(1 / abs(C(Ti) * G(s))), float(Ti), float(ratio * Ti)


# -- integrating plants K e^(-Ls)/s --------------------------------------------------------


def simc_integrating(K, L, tau_c):
    """Return Kp, Ti; Skogestad, J. Process Control 13 (2003) 291-309, table 1."""
    return 1 / (K * (tau_c + L)), 4 * (tau_c + L)


def amigo_pi_integrating(K, L):
    """Return Kp, Ti; Astrom & Hagglund 2006, ch. 7: 0.35/(K L), 13.4 L.

    T -> inf in the FOPDT rule gives 13.35 L.
    """
    return 0.35 / (K * L), 13.4 * L


def amigo_pid_integrating(K, L):
    """Return Kp, Ti, Td; Astrom & Hagglund 2006, ch. 7: 0.45/(K L), 8 L, L/2."""
    return 0.45 / (K * L), 8 * L, 0.5 * L


def amigo_pi(K, T, L):
    """Return Kp, Ti for FOPDT; METHODS 3.1."""
    return (
        0.15 / K + (0.35 - L * T / (L + T) ** 2) * T / (K * L),
        0.35 * L + 13 * L * T**2 / (T**2 + 12 * L * T + 7 * L**2),
    )


def amigo_pid(K, T, L):
    """Return Kp, Ti, Td for FOPDT; METHODS 3.1."""
    return (
        (0.2 + 0.45 * T / L) / K,
        L * (0.4 * L + 0.8 * T) / (L + 0.1 * T),
        0.5 * L * T / (0.3 * L + T),
    )


def lambda_pi_integrating(K, L, lam):
    """Return Kp, Ti; Chien & Fruehauf, Chem. Eng. Progress 86 (1990) 33-41.

    Direct synthesis with e^(-Ls) = 1 - Ls of Y/R = ((2 lam + L) s + 1) e^(-Ls)/(lam s + 1)^2.
    """
    return (2 * lam + L) / (K * (lam + L) ** 2), 2 * lam + L


def ultimate_integrating(K, L):
    """Return Ku and Pu of an integrator with delay: Ku = pi/(2 K L), Pu = 4 L."""
    return np.pi / (2 * K * L), 4 * L


def tyreus_luyben(Ku, Pu):
    """Return Kp, Ti of the PI: Ku/3.22, 2.2 Pu; Tyreus & Luyben, IEC Research 31 (1992) 2625.

    On an integrator 0.487/(K L) and 8.8 L.  Later tables print Ku/3.2.
    """
    return Ku / 3.22, 2.2 * Pu


def tyreus_luyben_pid(Ku, Pu):
    """Return Kp, Ti, Td of the PID: Ku/2.2, 2.2 Pu, Pu/6.3; Luyben & Luyben 1997."""
    return Ku / 2.2, 2.2 * Pu, Pu / 6.3


# -- second order and beyond ---------------------------------------------------------------


def series_to_standard(Kp, Ti, Td):
    """Return Kp, Ti, Td of the standard form from the series form Kp (1 + 1/(Ti s))(1 + Td s)."""
    f = 1 + Td / Ti
    return Kp * f, Ti * f, Td / f


def simc_second(K, T1, T2, L, tau_c):
    """Return Kp, Ti, Td in standard form for K e^(-Ls)/((T1 s + 1)(T2 s + 1)), T1 >= T2.

    Series form T1/(K (tau_c + L)), min(T1, 4 (tau_c + L)), T2; Skogestad 2003, (23) to (25).
    """
    T1, T2 = max(T1, T2), min(T1, T2)
    return series_to_standard(T1 / (K * (tau_c + L)), min(T1, 4 * (tau_c + L)), T2)


def simc_integrating_lag(K, T2, L, tau_c):
    """Return Kp, Ti, Td in standard form for K e^(-Ls)/(s (T2 s + 1)); Skogestad 2003, table 1."""
    return series_to_standard(1 / (K * (tau_c + L)), 4 * (tau_c + L), T2)


def half_rule(T, L=0.0, Tz_inverse=(), order=1, Ts=0.0):
    """Return the kept time constants (tuple) and the effective delay; Skogestad 2003, (10), (11).

    T all time constants; Tz_inverse those of (1 - Tz s) in the numerator.  The largest
    neglected lag goes half to the smallest kept one, half to the delay; the others, the
    inverse numerator times and Ts/2 go to the delay.
    """
    T = sorted(T, reverse=True)
    kept, rest = [*T[:order], *[0.0] * (order - len(T))], T[order:]
    L = L + sum(Tz_inverse) + Ts / 2
    if rest:
        kept[-1] += rest[0] / 2
        L += rest[0] / 2 + sum(rest[1:])
    return tuple(kept), L
