"""The loop of K e^(-Ls)/(Ts + 1) whose dead time is replaced by a rational function.

    Taylor: e^(-Ls) = 1 - Ls              source 001, (3.4-3), (3.4-4)
    Pade:   e^(-Ls) = (1 - Ls/2)/(1 + Ls/2)            (3.4-5), (3.4-6)
    C(s) = Kp + Ki/s + Kd s                            (3.4-7), (3.4-8)

Polynomials are numpy arrays, highest power first.  The corrected equations are those of
ERRATA 3.1; `printed` holds them as the text writes them, everything else multiplies
polynomials.  Ki = 0 leaves the controller without the factor 1/s.
"""

from itertools import pairwise

import mpmath
import numpy as np


def plant(K, T, L, delay):
    """Return numerator and denominator of the approximate plant; (3.4-4), (3.4-6)."""
    lag = [T, 1.0]
    if L == 0:
        return np.array([K]), np.array(lag)
    if delay == "taylor":
        return K * np.array([-L, 1.0]), np.array(lag)
    if delay == "pade":
        return K * np.array([-L / 2, 1.0]), np.polymul(lag, [L / 2, 1.0])
    raise ValueError(f"`delay` is {delay!r}, must be 'taylor' or 'pade'")


def controller(Kp, Ki, Kd=0.0):
    """Return numerator and denominator of Kp + Ki/s + Kd s; (3.4-7), (3.4-8)."""
    if Ki == 0:
        return _trim([Kd, Kp]), np.array([1.0])
    return _trim([Kd, Kp, Ki]), np.array([1.0, 0.0])


def closed_loop(K, T, L, Kp, Ki, Kd=0.0, *, delay):
    """Return {"Y/R": (num, den), ...} of the loop with unit feedback; (3.4-9) to (3.4-17).

    R set point, P added to the plant's input, D added to its output, U the plant's input,
    E = R - Y.  U/R of a PID on the Pade plant has a numerator one degree higher than its
    denominator: the step response starts with an impulse.
    """
    (nG, dG), (nC, dC) = plant(K, T, L, delay), controller(Kp, Ki, Kd)
    den = characteristic(K, T, L, Kp, Ki, Kd, delay=delay)
    through = {
        "Y/R": np.polymul(nC, nG),
        "U/R": np.polymul(nC, dG),
        "E/R": np.polymul(dC, dG),
        "Y/P": np.polymul(nG, dC),
        "U/P": np.polymul(dC, dG),
        "E/P": -np.polymul(nG, dC),
        "Y/D": np.polymul(dC, dG),
        "U/D": -np.polymul(nC, dG),
        "E/D": -np.polymul(dC, dG),
    }
    return {name: (num, den) for name, num in through.items()}


def characteristic(K, T, L, Kp, Ki, Kd=0.0, *, delay):
    """Return dC dG + nC nG, untrimmed: a leading 0 says that the loop is not well posed."""
    (nG, dG), (nC, dC) = plant(K, T, L, delay), controller(Kp, Ki, Kd)
    return np.polyadd(np.polymul(dC, dG), np.polymul(nC, nG))


def printed(K, T, L, Kp, Ki, Kd=0.0, *, delay):
    """Return {"Y/R", "U/R", "E/R"} as the text prints them, after ERRATA 3.1; (3.4-12) to (3.4-17).

    Taylor with PI, Pade with PID; first forms, denominators monic.
    """
    if delay == "taylor":
        lead = T - K * Kp * L
        den = [1.0, (K * (Kp - Ki * L) + 1) / lead, K * Ki / lead]
        y = [-Kp * L, Kp - Ki * L, Ki]
        u = np.polymul([Kp, Ki], [T, 1.0])
        e = [T, 1.0, 0.0]
    else:
        lead = T * L - K * Kd * L
        den = [
            1.0,
            (L + 2 * T + 2 * K * Kd - K * Kp * L) / lead,
            (2 + 2 * K * Kp - K * Ki * L) / lead,
            2 * K * Ki / lead,
        ]
        y = [-Kd * L, 2 * Kd - Kp * L, 2 * Kp - Ki * L, 2 * Ki]
        u = [
            Kd * T * L,
            Kd * (2 * T + L) + Kp * T * L,
            2 * Kd + Kp * (2 * T + L) + Ki * T * L,
            2 * Kp + Ki * (2 * T + L),
            2 * Ki,
        ]
        e = [T * L, 2 * T + L, 2.0, 0.0]
    return {
        "Y/R": (K * np.array(y) / lead, np.array(den)),
        "U/R": (np.array(u) / lead, np.array(den)),
        "E/R": (np.array(e) / lead, np.array(den)),
    }


def printed_ti(K, T, L, Kp, Ti, Td=0.0, *, delay):
    """Return the second forms, in Ti and Td, after ERRATA 3.1; (3.4-12) to (3.4-17)."""
    if delay == "taylor":
        lead = T * Ti - K * Kp * Ti * L
        den = [1.0, (K * Kp * (Ti - L) + Ti) / lead, K * Kp / lead]
        y = [-Ti * L, Ti - L, 1.0]
        u = np.polymul([Ti, 1.0], [T, 1.0])
        e = np.array([T * Ti, Ti, 0.0])
    else:
        lead = T * Ti * L - K * Kp * Ti * Td * L
        den = [
            1.0,
            (Ti * L + 2 * T * Ti + 2 * K * Kp * Ti * Td - K * Kp * Ti * L) / lead,
            (2 * Ti + 2 * K * Kp * Ti - K * Kp * L) / lead,
            2 * K * Kp / lead,
        ]
        y = [-Ti * Td * L, 2 * Ti * Td - Ti * L, 2 * Ti - L, 2.0]
        u = [
            T * Ti * Td * L,
            Ti * (T * L + Td * (2 * T + L)),
            T * L + Ti * (2 * T + 2 * Td + L),
            2 * Ti + 2 * T + L,
            2.0,
        ]
        e = Ti * np.array([T * L, 2 * T + L, 2.0, 0.0])
    return {
        "Y/R": (K * Kp * np.array(y) / lead, np.array(den)),
        "U/R": (Kp * np.array(u) / lead, np.array(den)),
        "E/R": (e / lead, np.array(den)),
    }


# -- stability -------------------------------------------------------------------------


def stable(den):
    """Tell whether all roots of the untrimmed characteristic polynomial lie left of the axis.

    A leading coefficient of 0 (a loop that is not well posed, a root at infinity) counts
    as unstable.
    """
    den = np.asarray(den, float)
    if den[0] == 0:
        return False
    return bool(len(den) == 1 or np.roots(den).real.max() < 0)


def abscissa(den):
    """Return the largest real part of the roots: the distance to the border, signed."""
    return float(np.roots(den).real.max())


def hurwitz(den):
    """Tell stability by Hurwitz' determinants: all leading minors positive, any degree."""
    a = np.asarray(den, float) / den[0]
    n = len(a) - 1
    H = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            k = 2 * (j + 1) - (i + 1)
            H[i, j] = a[k] if 0 <= k <= n else 0.0
    return all(np.linalg.det(H[:m, :m]) > 0 for m in range(1, n + 1))


def routh(K, T, L, Kp, Ki, Kd=0.0, *, delay):
    """Return {equation: value}, stable when all are positive; (3.4-19) to (3.4-27), ERRATA 3.1.

    Taylor with PI, Pade with PID.  (3.4-27) is multiplied with the leading coefficient,
    as a1 a2 > a3 asks.
    """
    p, i, d = K * Kp, K * Ki, K * Kd
    if delay == "taylor":
        lead = T - p * L
        return {"3.4-19": i / lead, "3.4-20": (p - i * L + 1) / lead}
    lead = T * L - d * L
    second, first = L + 2 * T + 2 * d - p * L, 2 + 2 * p - i * L
    return {
        "3.4-24": 2 * i / lead,
        "3.4-25": first / lead,
        "3.4-26": second / lead,
        "3.4-27": second * first - 2 * i * lead,
    }


def routh_implied(K, T, L, Kp, Ki, Kd=0.0, *, delay):
    """Return {equation: value}, all positive in every stable loop; (3.4-21) to (3.4-30).

    Necessary, not sufficient.  After ERRATA 3.1, in the products K Kp, K Ki, K Kd, so for
    either sign of K.
    """
    p, i, d = K * Kp, K * Ki, K * Kd
    if delay == "taylor":
        return {"3.4-21": T / L - p, "3.4-22": (p + 1) / L - i}
    return {
        "3.4-28": T - d,
        "3.4-29": 2 * (1 + p) / L - i,
        "3.4-30": (L + 2 * T + 2 * d) / L - p,
    }


def stable_intervals(A, B):
    """Return the intervals (low, high) of x in which A(s) + x B(s) is stable, in ascending order.

    Brute force on roots: a root can pass to the right only through 0, jw or infinity.  All x
    with such a root are listed (real x with A(jw) + x B(jw) = 0), and the roots are looked at
    once between two neighbours.
    """
    n = max(len(A), len(B))
    A, B = _pad(A, n), _pad(B, n)
    Aw, Bw = _at_jw(A), _at_jw(B)
    # Im(A(jw) conj B(jw)) = 0, an odd polynomial in w: its even half in w^2
    odd = np.polysub(np.polymul(Aw[1], Bw[0]), np.polymul(Aw[0], Bw[1]))
    w = np.roots(_trim(odd)) if np.any(odd) else np.array([])
    w = np.concatenate([w[(np.abs(w.imag) < 1e-7 * np.abs(w)) & (w.real > 0)].real, [0.0]])
    s = 1j * w
    a, b = np.polyval(A, s), np.polyval(B, s)
    at = list((-a[b != 0] / b[b != 0]).real)
    if B[0] != 0:
        at.append(-A[0] / B[0])
    at = np.unique(at)
    edges = np.concatenate([[-np.inf], at, [np.inf]])
    found = []
    for low, high in pairwise(edges):
        if high - low <= 1e-12 * max(abs(low), abs(high), 1e-300) or not stable(
            A + _inside(low, high) * B
        ):
            continue
        if found and found[-1][1] == low and stable(A + low * B):
            low = found.pop()[0]  # no root on the axis after all
        found.append((float(low), float(high)))
    return found


def interval(which, K, T, L, Kp, Ki, Kd=0.0, *, delay):
    """Return (low, high) around the given setting that keeps the loop stable, None if it is not.

    "Kp": Ti = Kp/Ki and Td = Kd/Kp stay; "Ki", "Kd": the other two parallel gains stay.
    """
    nG, dG = plant(K, T, L, delay)
    if which == "Kp":
        nC, dC = controller(1.0, Ki / Kp, Kd / Kp)
        A, B, x = np.polymul(dC, dG), np.polymul(nC, nG), Kp
    else:
        s = np.array([1.0, 0.0])
        fixed = {"Ki": [Kd, Kp, 0.0], "Kd": [Kp, Ki]}[which]
        A = np.polyadd(np.polymul(s, dG), np.polymul(fixed, nG))
        B, x = (nG, Ki) if which == "Ki" else (np.polymul([1.0, 0.0, 0.0], nG), Kd)
        if which == "Kd" and Ki == 0:  # the factor s is in neither controller nor loop
            A, B = np.polyadd(dG, Kp * nG), np.polymul(s, nG)
    for low, high in stable_intervals(_trim(A), _trim(B)):
        if low < x < high:
            return low, high
    return None


# -- step responses --------------------------------------------------------------------


def step(num, den, t, dps=40):
    """Return the response at t > 0 to a unit step, right limit at 0; (3.4-31) to (3.4-45).

    Partial fractions in mpmath.  Poles that coincide come out apart by some 10^(-dps/2) and
    cost as many digits, which is why `dps` is what it is.  An impulse at t = 0 is left out.
    """
    with mpmath.workdps(dps):
        num, den = exact(_trim(num)), exact(_trim(den))
        poles = _apart([mpmath.mpc(0), *roots(den)])
        residues = []
        for i, p in enumerate(poles):
            others = mpmath.fprod(p - q for j, q in enumerate(poles) if j != i)
            residues.append(horner(num, p) / (den[0] * others))

        def at(x):
            terms = (c * mpmath.exp(p * x) for c, p in zip(residues, poles, strict=True))
            return float(mpmath.re(mpmath.fsum(terms)))

        return np.array([at(float(x)) for x in np.atleast_1d(t)])


def step_impulse(num, den):
    """Return the weight of the impulse at t = 0 in the unit step response."""
    num, den = _trim(num), np.append(_trim(den), 0.0)
    return float(num[0] / den[0]) if len(num) == len(den) else 0.0


def partial_fractions(num, den):
    """Return q0 and lists p, q of y(t) = q0 + sum q_i e^(-p_i t), as printed; (3.4-32) to (3.4-45).

    Roots of the second-order case by the corrected (3.4-33), (3.4-34).  Simple poles only.
    """
    b = np.asarray(num, complex) / den[0]
    a = np.asarray(den, complex) / den[0]
    n = len(a) - 1
    b = _pad(b, n + 1)
    if n == 2:
        root = np.sqrt(a[1] ** 2 - 4 * a[2])
        p = np.array([(a[1] - root) / 2, (a[1] + root) / 2])
    else:
        p = -np.roots(a)
    q = []
    for i in range(n):
        others = np.prod([p[j] - p[i] for j in range(n) if j != i])
        q.append(np.polyval(b, -p[i]) / (-p[i] * others))
    return float((b[-1] / a[-1]).real), p, np.array(q)


def state_space(num, den):
    """Return A, B, C, D of num/den in controllable canonical form."""
    num, den = _trim(num), _trim(den)
    n = len(den) - 1
    a, b = den / den[0], _pad(num / den[0], n + 1)
    A = np.vstack([-a[1:], np.eye(n)[:-1]]) if n else np.zeros((0, 0))
    return A, np.eye(n, 1), (b[1:] - b[0] * a[1:])[None, :], b[:1][None, :]


# -- polynomials in mpmath -------------------------------------------------------------


def exact(p):
    """Return the coefficients as mpmath numbers: a float is taken for the binary number it is."""
    return [v if isinstance(v, mpmath.mpf) else mpmath.mpf(float(v)) for v in p]


def horner(p, x):
    """Return p(x), highest power first."""
    y = mpmath.mpf(0)
    for c in p:
        y = y * x + c
    return y


def roots(p, steps=200):
    """Return all roots of a polynomial to the present working precision.

    Aberth's iteration from numpy's roots: Newton's step on p divided by the other roots.
    """
    while p and p[0] == 0:
        p = p[1:]
    zeros = 0
    while p and p[-1] == 0:
        p, zeros = p[:-1], zeros + 1
    n = len(p) - 1
    if n < 1:
        return [mpmath.mpc(0)] * zeros
    slope = [c * (n - k) for k, c in enumerate(p[:-1])]
    with mpmath.extradps(20):
        scale = max(abs(c) for c in p)
        start = np.roots([float(c / scale) for c in p]) if n > 1 else [-p[1] / p[0]]
        if len(start) < n:  # a coefficient too small for float: spread over a circle
            start = [mpmath.expjpi(2 * (k + 0.3) / n) for k in range(n)]
        # a start apart from its neighbours and off the real axis
        z = [mpmath.mpc(v) * (1 + mpmath.mpc(k + 1, 2 * k + 1) * 1e-9) for k, v in enumerate(start)]
        size = max(abs(v) for v in z)
        for _ in range(steps):
            moved = mpmath.mpf(0)
            for i in range(n):
                d = horner(slope, z[i])
                if d == 0:
                    continue
                newton = horner(p, z[i]) / d
                pull = mpmath.fsum(1 / (z[i] - z[j]) for j in range(n) if z[j] != z[i])
                step = newton / (1 - newton * pull)
                z[i] -= step
                moved = max(moved, abs(step) / (abs(z[i]) + size * mpmath.eps))
            if moved < mpmath.mpf(10) ** (10 - mpmath.mp.dps):
                break
    return [+v for v in z] + [mpmath.mpc(0)] * zeros


# -- helpers ---------------------------------------------------------------------------


def _trim(p):
    p = np.trim_zeros(np.atleast_1d(np.asarray(p, float)), "f")
    return p if len(p) else np.zeros(1)


def _pad(p, n):
    return np.concatenate([np.zeros(n - len(p)), np.asarray(p)])


def _at_jw(p):
    """Return real and imaginary part of p(jw) as polynomials in w, highest power first."""
    k = np.arange(len(p))[::-1]
    turned = np.asarray(p) * 1j**k
    return turned.real, turned.imag


def _inside(low, high):
    if np.isinf(low) and np.isinf(high):
        return 0.0
    if np.isinf(low):
        return high - max(1.0, abs(high))
    if np.isinf(high):
        return low + max(1.0, abs(low))
    return (low + high) / 2


def _apart(poles):
    """Move equal poles apart by 10^(-dps/2) of the largest."""
    eps = mpmath.mpf(10) ** (-mpmath.mp.dps // 2) * (max(abs(p) for p in poles) or 1)
    out = []
    for p in poles:
        while any(abs(p - q) < eps for q in out):
            p += 2 * eps
        out.append(p)
    return out
