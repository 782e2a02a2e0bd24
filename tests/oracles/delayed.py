"""Stability of a rational plant with an exact dead time under a PID: P(s) + Q(s) e^(-Ls) = 0.

    P = dG dC, Q = nG nC for the plant nG/dG e^(-Ls) and the controller nC/dC,
    "d1": C = Kp (1 + 1/(Ti s) + Td s/(Tf s + 1)),
    "y2": C = Kp (1 + 1/(Ti s) + Td s) / (1 + Tf s + (Tf s)^2/2).

Two ways that share nothing but P and Q: `unstable_roots` follows the roots from L = 0 over
all delays at which one crosses the axis (Walton & Marshall, IEE Proc. D 134, 1987, 101-107);
`rightmost` takes the eigenvalues of the delay line cut up at Chebyshev points (Breda, Maset &
Vermiglio, SIAM J. Sci. Comput. 27, 2005, 482-495) and polishes them by Newton on the equation.

With deg Q = deg P (ideal PID on a first-order plant) the loop is neutral: it has a chain of
roots at Re s = ln|q/p|/L, so it is stable only if the leading coefficients have |q| < |p|.
"""

import numpy as np

from oracles.rational import state_space


def controller(Kp, Ti=np.inf, Td=0.0, Tf=0.0, filter="d1"):
    """Return numerator and denominator of the controller, seen from -y to u; DESIGN 3, `PID`."""
    integral = np.isfinite(Ti)
    # Kp (1 + Td s [+ 1/(Ti s)]) with the derivative's lag multiplied through
    lag = [Tf, 1.0] if filter == "d1" else [1.0]
    num = np.polyadd(lag, [Td, 0.0])
    den = np.array(lag)
    if integral:
        num = np.polyadd(np.polymul(num, [Ti, 0.0]), lag)
        den = np.polymul(den, [Ti, 0.0])
    if filter == "y2":
        den = np.polymul(den, [Tf**2 / 2, Tf, 1.0])
    elif filter != "d1":
        raise ValueError(f"`filter` is {filter!r}, must be 'd1' or 'y2'")
    return Kp * _trim(num), _trim(den)


def loop(num, den, Kp, Ti=np.inf, Td=0.0, Tf=0.0, filter="d1"):
    """Return P and Q of the closed loop's characteristic equation P + Q e^(-Ls) = 0."""
    nC, dC = controller(Kp, Ti, Td, Tf, filter)
    return np.polymul(_trim(den), dC), np.polymul(_trim(num), nC)


def neutral_ratio(P, Q):
    """Return |q/p| of the leading coefficients: 0 if retarded, infinite if the loop gain is."""
    P, Q = _trim(P), _trim(Q)
    if len(Q) < len(P):
        return 0.0
    return abs(Q[0] / P[0]) if len(Q) == len(P) else np.inf


def crossings(P, Q):
    """Return w > 0 with |P(jw)| = |Q(jw)|, and the sign of d Re s/dL of a root at jw."""
    W = np.polysub(_squared(P), _squared(Q))  # in x = w^2
    x = np.roots(_trim(W))
    x = np.sort(x[(np.abs(x.imag) < 1e-8 * np.abs(x)) & (x.real > 0)].real)
    return np.sqrt(x), np.sign(np.polyval(np.polyder(W), x)).astype(int)


def unstable_roots(P, Q, L):
    """Return how many roots lie right of the axis, inf for a neutral loop with |q| >= |p|."""
    P, Q = _trim(P), _trim(Q)
    if L == 0:
        return int(np.sum(np.roots(np.polyadd(P, Q)).real > 0))
    if neutral_ratio(P, Q) >= 1:
        return np.inf
    count = int(np.sum(np.roots(np.polyadd(P, Q)).real > 0))
    for w, sign in zip(*crossings(P, Q), strict=True):
        first = np.mod(np.angle(-np.polyval(Q, 1j * w) / np.polyval(P, 1j * w)), 2 * np.pi) / w
        passed = max(0, int(np.ceil((L - first) * w / (2 * np.pi))))
        count += 2 * int(sign) * passed
    return count


def stable(P, Q, L):
    """Tell whether all roots of P + Q e^(-Ls) lie left of the axis, bounded away from it."""
    return unstable_roots(P, Q, L) == 0


def next_delay(P, Q, L):
    """Return the least delay above L at which roots cross to the right, inf if there is none."""
    out = np.inf
    for w, sign in zip(*crossings(P, Q), strict=True):
        if sign > 0:
            first = np.mod(np.angle(-np.polyval(Q, 1j * w) / np.polyval(P, 1j * w)), 2 * np.pi) / w
            turns = max(0, int(np.floor((L - first) * w / (2 * np.pi))) + 1)
            out = min(out, first + 2 * np.pi * turns / w)
    return out


def rightmost(P, Q, L, n=None):
    """Return the root of P + Q e^(-Ls) with the largest real part (imaginary part >= 0).

    x' = A x + B w, v = C x + D w, w(t) = -v(t - L) and the line v between the n + 1
    Chebyshev points of one delay.  n follows the highest frequency at which |P| = |Q|,
    above which no root can lie to the right.
    """
    P, Q = _trim(P), _trim(Q)
    if L == 0:
        s = np.roots(np.polyadd(P, Q))
    else:
        P, Q = (np.array(p) / L ** np.arange(len(p))[::-1] for p in (P, Q))  # time in delays
        w = crossings(P, Q)[0]
        n = n or int(max(30, 2.0 * (w.max() if len(w) else 0.0)))
        A, B, C, D = state_space(Q, P)
        k = len(A)
        line = _chebyshev(n)  # d/dtheta on [-1, 0], point 0 at theta = 0
        M = np.zeros((k + n, k + n))
        M[:k, :k] = A
        M[:k, -1] = -B[:, 0]
        M[k:, k:] = line[1:, 1:]
        M[k:, :k] = np.outer(line[1:, 0], C[0])
        M[k:, -1] += -line[1:, 0] * D[0, 0]
        s = np.linalg.eigvals(M)
        s = np.concatenate([s, np.roots(np.polyadd(P, Q))])
        s = _newton(P, Q, s[np.argsort(-s.real)][: k + n // 2]) / L
    best = s[np.argmax(s.real)]
    return complex(best.real, abs(best.imag))


def gain_interval(num, den, L, Kp, Ti=np.inf, Td=0.0, Tf=0.0, filter="d1", factor=1.05):
    """Return (low, high) of Kp around the given one with Ti, Td, Tf fixed; None if unstable.

    Steps outwards by `factor` until `stable` fails, then bisects.  A border below 1e-6 of
    the given Kp is 0; from there on, where C has no integrator, the search goes on with the
    other sign.  Above 1e6 times the given Kp the interval is called infinite.
    """

    def ok(gain):
        return stable(*loop(num, den, gain, Ti, Td, Tf, filter), L)

    def outwards(start, ratio, end):
        inner, x = start, start * ratio
        while ok(x):
            if abs(x / end) ** np.sign(np.log(ratio)) > 1:
                return None
            inner, x = x, x * ratio
        for _ in range(80):
            middle = (inner + x) / 2
            if middle in (inner, x):
                break
            inner, x = (middle, x) if ok(middle) else (inner, middle)
        return inner

    if not ok(Kp):
        return None
    far = outwards(Kp, factor, 1e6 * Kp)
    far = np.sign(Kp) * np.inf if far is None else far
    near = outwards(Kp, 1 / factor, 1e-6 * Kp)
    if near is None:
        near = 0.0
        if not np.isfinite(Ti) and ok(-1e-6 * Kp) and ok(0.0):
            near = outwards(-1e-6 * Kp, factor, -1e6 * Kp)
            near = -np.sign(Kp) * np.inf if near is None else near
    return (float(near), float(far)) if Kp > 0 else (float(far), float(near))


# -- helpers ---------------------------------------------------------------------------


def _trim(p):
    p = np.trim_zeros(np.atleast_1d(np.asarray(p, float)), "f")
    return p if len(p) else np.zeros(1)


def _squared(p):
    """Return |p(jw)|^2 as a polynomial in w^2."""
    turned = np.asarray(p) * (-1.0) ** np.arange(len(p))[::-1]
    both = np.polymul(p, turned)[::-1][::2]  # even powers of s, ascending
    return (both * (-1.0) ** np.arange(len(both)))[::-1]


def _chebyshev(n):
    """Return the differentiation matrix on the n + 1 Chebyshev points from 0 down to -1."""
    i = np.arange(n + 1)
    x = (np.cos(np.pi * i / n) - 1) / 2
    c = np.where((i == 0) | (i == n), 2.0, 1.0) * (-1.0) ** i
    gap = x[:, None] - x[None, :] + np.eye(n + 1)
    D = np.outer(c, 1 / c) / gap
    return D - np.diag(D.sum(axis=1))


def _newton(P, Q, s):
    """Return the roots of P + Q e^(-s) that Newton reaches from near by."""
    start, dP, dQ = s, np.polyder(P), np.polyder(Q)
    with np.errstate(all="ignore"):
        for _ in range(30):
            E = np.exp(-s)
            f = np.polyval(P, s) + np.polyval(Q, s) * E
            slope = np.polyval(dP, s) + (np.polyval(dQ, s) - np.polyval(Q, s)) * E
            step = f / slope
            s = s - step
        size = np.polyval(np.abs(P), np.abs(s)) + np.polyval(np.abs(Q), np.abs(s)) * np.abs(E)
        done = (np.abs(f) < 1e-10 * size) & (np.abs(s - start) < 1 + 0.1 * np.abs(start))
    return s[done]
