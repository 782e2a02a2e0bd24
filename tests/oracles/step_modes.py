"""Time constants of a step response as a sum of exponentials, with what the data support.

    y(t) = K + sum_j c_j phi_j(t) + e(t),   t from any instant after the last change of the input.

The phi_j span all solutions of (d/dt - p_1) ... (d/dt - p_k) phi = 0.  Sections in a row hold the
poles, s + w, or s^2 + 2 zeta w s + w^2, and the phi_j are the outputs of the row from each of its
states, e_1' e^(At) with A block bidiagonal: smooth in ln w and ln zeta through repeated roots
(zeta = 1) and from real to complex ones, where the e^(p_i t) themselves become parallel.
Initial state, zeros and a delay already over only change the c_j.

Starts, all without knowing K or the state, exact without noise:

    pencil     roots of Y1 - z Y0, Y of rank k + 1; Hua & Sarkar, IEEE ASSP 38, 1990
    prony      sum_j d_j (y[n - j] - K) = 0 by least squares; source 003, (15)
    integrals  y = sum_j a_j I^j y + polynomial of degree k, I the integral from the first row

Answer: variable projection, c and K by QR inside the search over (ln w, ln zeta); Golub & Pereyra,
SIAM J. Num. Anal. 10, 1973.  Cov = s^2 (J'J)^-1 of all parameters (the Cramer-Rao bound for
white e), delta rule for the time constants.  Order by BIC = N ln max(RSS/N, floor) + n ln N,
floor = 1e-12 var(y).  METHODS 5.
"""

from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm, hankel
from scipy.optimize import least_squares

FLOOR = 1e-12  # of var(y): below it a smaller residual is rounding, not evidence

# -- sections and the functions they span ------------------------------------------------------


def sections(poles):
    """Return the pattern of sections and [ln w, ln zeta, ...]: pairs first, then a single one.

    Complex poles go with their conjugates.  Of real ones the closest (in ln) are paired first,
    as only partners can meet and turn complex.
    """
    poles = np.asarray(poles, complex)
    upper = sorted(poles[poles.imag > 0], key=abs)
    pairs = [(p, p.conjugate()) for p in upper]
    real = sorted(-p.real for p in poles[poles.imag == 0])
    while len(real) > 1:
        i = int(np.argmin(np.diff(np.log(real))))
        pairs.append((-real.pop(i), -real.pop(i)))
    q = []
    for a, b in pairs:
        w = np.sqrt((a * b).real)
        q += [np.log(w), np.log(-(a + b).real / (2 * w))]
    return "2" * len(pairs) + "1" * len(real), np.array(q + [np.log(w) for w in real])


def matrix(pattern, q):
    """Return A of the row of sections: each section drives the one before it."""
    A = np.zeros((sum(map(int, pattern)),) * 2)
    i = at = 0
    for kind in pattern:
        w = np.exp(q[at])
        if kind == "1":
            A[i, i] = -w
        else:
            # states scaled by w, so that no entry grows faster than w
            A[i : i + 2, i : i + 2] = [[0, w], [-w, -2 * np.exp(q[at + 1]) * w]]
        if i:
            A[i - 1, i] = abs(A[i - 1, i - 1]) or w
        i, at = i + int(kind), at + int(kind)
    return A


def roots(pattern, q):
    """Return the poles, slowest last, in closed form: eigenvalues of a repeated root split."""
    poles, at = [], 0
    for kind in pattern:
        w = np.exp(q[at])
        if kind == "1":
            poles.append(-w)
        else:
            zeta = np.exp(q[at + 1])
            root = np.sqrt(complex(zeta**2 - 1))
            fast = -w * (zeta + root)
            poles += [fast, w**2 / fast]  # the product, not the difference: no digits lost
        at += int(kind)
    return ordered(np.array(poles, complex))


def ordered(poles):
    """Return poles by rising time constant, conjugates side by side."""
    return poles[np.lexsort((poles.imag, np.abs(poles.imag), poles.real))]


def basis(pattern, q, t):
    """Return the columns [1, phi_1(t), ..., phi_k(t)]; on a uniform grid by doubling."""
    A = matrix(pattern, q)
    if not pattern:
        return np.ones((len(t), 1))
    h = np.diff(t)
    if len(h) and np.all(np.abs(h - h[0]) < 1e-9 * h[0]):
        step, rows = expm(A * h[0]), expm(A * t[0])[:1]
        while len(rows) < len(t):
            rows, step = np.vstack([rows, rows @ step]), step @ step
        rows = rows[: len(t)]
    else:
        rows = expm(t[:, None, None] * A)[:, 0]
    return np.column_stack([np.ones(len(t)), rows])


# -- starts --------------------------------------------------------------------------------


def blocks(y, dt, most=200):
    """Return block means of y and their spacing: e^(pt) stays e^(pt), white noise falls."""
    m = max(1, len(y) // most)
    n = len(y) // m
    return y[: n * m].reshape(n, m).mean(axis=1), m * dt


def pencil(y, dt, k, part=0.5):
    """Return k poles of y by the matrix pencil; the root nearest 1 is the constant."""
    N = len(y)
    L = int(part * N)
    H = hankel(y[: N - L], y[N - L - 1 :])
    V = np.linalg.svd(H, full_matrices=False)[2][: k + 1].T
    z = np.linalg.eigvals(np.linalg.lstsq(V[:-1], V[1:], rcond=None)[0]).astype(complex)
    z = np.delete(z, np.argmin(np.abs(z - 1)))
    with np.errstate(divide="ignore"):
        return ordered(np.log(z) / dt)


def prony(y, dt, k, lag=1):
    """Return k poles from sum_j d_j (y[n - j lag] - K) = 0; the constant drops out with the means.

    (15) of source 003 with K free, its rows scaled to d_0 = 1 instead of sum d = 1.
    """
    N = len(y)
    Y = np.column_stack([y[(k - j) * lag : N - j * lag] for j in range(k + 1)])
    Y = Y - Y.mean(axis=0)
    a = np.linalg.lstsq(Y[:, 1:], -Y[:, 0], rcond=None)[0]
    z = np.roots(np.append(1.0, a)).astype(complex)
    with np.errstate(divide="ignore"):
        return ordered(np.log(z) / (dt * lag))


def integrals(t, y, k):
    """Return k poles from y = a_1 Iy + ... + a_k I^k y + polynomial of degree k.

    The sum of exponentials obeys a differential equation of order k whose right side is
    constant; k integrals make it free of derivatives, and the polynomial holds the
    state and K.  Integrals by the cubic through each four neighbours, any spacing.
    """
    t = t - t[0]
    scale = t[-1]
    x, columns, z = t / scale, [], y
    for _ in range(k):
        z = integral(x, z)
        columns.append(z)
    columns += [np.ones(len(x))]
    columns += [np.polynomial.legendre.legval(2 * x - 1, np.eye(k + 1)[j]) for j in range(1, k + 1)]
    X = np.column_stack(columns)
    size = np.linalg.norm(X, axis=0)
    a = np.linalg.lstsq(X / size, y, rcond=None)[0] / size
    return ordered(np.roots(np.append(1.0, -a[:k])).astype(complex) / scale)


def integral(x, y):
    """Return the integral of y from x[0] to each x: cubic through four neighbours."""
    n = len(x)
    if n < 4:
        return np.concatenate([[0.0], np.cumsum((y[1:] + y[:-1]) / 2 * np.diff(x))])
    node = np.sqrt(1 / 3) * np.array([-1, 1])  # two Gauss points are exact for a cubic
    first = np.clip(np.arange(n - 1) - 1, 0, n - 4)
    pieces = np.zeros(n - 1)
    half = np.diff(x) / 2
    for g in node:
        at = x[:-1] + half * (1 + g)
        value = np.zeros(n - 1)
        for i in range(4):
            weight = np.ones(n - 1)
            for j in range(4):
                if j != i:
                    weight *= (at - x[first + j]) / (x[first + i] - x[first + j])
            value += weight * y[first + i]
        pieces += half * value
    return np.concatenate([[0.0], np.cumsum(pieces)])


# -- areas: one, two or n equal time constants at once ---------------------------------------


def area_fopdt(t, y, y0, y1):
    """Return T, L from two areas: A0 = int (y1 - y) = K(T + L), A1 = int_0^(T+L) (y - y0) = KT/e.

    The step at t[0] = 0 from rest at y0 to y1; Astrom & Hagglund, PID Controllers, 1995, 2.4.
    """
    K = y1 - y0
    total = integral(t, y1 - y)[-1] / K
    up_to = np.interp(total, t, integral(t, y - y0)) / K
    T = np.e * up_to
    return T, total - T


def equal_lags(t, y, y0, y1):
    """Return n, T of 1/(Ts + 1)^n with the mean and variance of the impulse response.

    mean = int (1 - s) dt = nT, mean of squares = 2 int t (1 - s) dt, s the unit step
    response; n is real, rounded by whoever needs a row of tanks (Strejc 1959).
    """
    rest = (y1 - y) / (y1 - y0)
    mean = integral(t, rest)[-1]
    variance = 2 * integral(t, t * rest)[-1] - mean**2
    return mean**2 / variance, variance / mean


def integral_fopdt(t, y, late):
    """Return K, T, L, y0 of a unit step at t = 0 from int y = -T y + (K + y0) t + T y0 - K L.

    Linear in what is unknown, the state before the step too; rows with t > late alone, past
    the delay.  y0 is the mean of the rows before t = 0.  Bi et al., Control Eng. Practice 7, 1999.
    """
    before = t < 0
    y0 = y[before].mean() if before.any() else y[0]
    at = np.append(0.0, t[t > 0])
    v = np.append(0.0, y[t > 0] - y0)
    area = integral(at, v)
    use = at > late
    X = np.column_stack([-v, at, -np.ones(len(at))])[use]
    # instruments without noise: area = -T v + K t - K L with v from the first pass
    T, K, KL = np.linalg.lstsq(X, area[use], rcond=None)[0]
    for _ in range(3):
        clean = K * -np.expm1(-np.maximum(at - KL / K, 0) / max(T, 1e-9))
        Z = np.column_stack([-clean, at, -np.ones(len(at))])[use]
        T, K, KL = np.linalg.solve(Z.T @ X, Z.T @ area[use])
    return K, T, KL / K, y0


# -- variable projection ---------------------------------------------------------------------


def fit(t, y, poles, cov="white"):
    """Return the least-squares sum of exponentials from one start.

    `poles` distinct or not, real or complex.  `cov` "white" is s^2 (J'J)^-1; "ar1" multiplies
    by (1 + r)/(1 - r), r the lag-1 correlation of the residual.

    Only partners of a pair turn complex.  Where two others have met, the search stands on a
    seam; paired anew it goes on.
    """
    t, y = np.asarray(t, float), np.asarray(y, float)
    found = search(t - t[0], y, poles, cov)
    for _ in range(5):
        q = sections(found.poles)[1]
        if np.allclose(q, found.q, rtol=0, atol=1e-3):
            break
        again = search(t - t[0], y, found.poles, cov)
        if again.rss >= found.rss * (1 - 1e-6):
            break
        found = again
    return found


def search(x, y, poles, cov):
    """Return the minimum that MINPACK reaches over [ln w, ln zeta] from these poles."""
    pattern, q0 = sections(poles)
    low, high = limits(pattern, x)

    def project(q):
        X = basis(pattern, np.clip(q, low, high), x)
        size = np.linalg.norm(X, axis=0) + 1e-300
        c = np.linalg.lstsq(X / size, y, rcond=1e-14)[0] / size
        return X, c

    def eps(q):
        X, c = project(q)
        return np.append(y - X @ c, q - np.clip(q, low, high))

    q = q0
    if len(q):
        q = least_squares(eps, q0, method="lm", xtol=1e-10, ftol=1e-12, max_nfev=60 * len(q)).x
    q = np.clip(q, low, high)
    X, c = project(q)
    return assess(x, y, pattern, q, X, c, y - X @ c, cov)


def limits(pattern, x):
    """Return the box of q: time constants from a third of a sample to ten records."""
    fast, slow = np.log(3 / np.min(np.diff(x))), np.log(0.1 / x[-1])
    low, high = [], []
    for kind in pattern:
        low += [slow] + [np.log(1e-3)] * (kind == "2")
        high += [fast] + [np.log(1e2)] * (kind == "2")
    return np.array(low), np.array(high)


def assess(x, y, pattern, q, X, c, e, cov):
    """Return the fit with the covariance of [q, K, c] and of what q means."""
    k, N = len(q), len(y)
    rss = float(e @ e)
    h = 1e-5
    J = [
        (basis(pattern, q + h * d, x) @ c - basis(pattern, q - h * d, x) @ c) / (2 * h)
        for d in np.eye(k)
    ]
    J = np.column_stack([*J, X])
    size = np.linalg.norm(J, axis=0)
    R = np.linalg.qr(J / size, mode="r")
    singular = np.linalg.svd(R, compute_uv=False)
    s2 = rss / (N - J.shape[1])
    if cov == "ar1":
        r = max(0.0, float(e[1:] @ e[:-1]) / max(rss, 1e-300))
        s2 *= (1 + r) / (1 - r)
    P = np.full((len(size),) * 2, np.inf)
    if singular[-1] > 1e-12 * singular[0]:
        Ri = np.linalg.inv(R)
        P = s2 * (Ri @ Ri.T) / np.outer(size, size)
    out = SimpleNamespace(order=k, pattern=pattern, q=q, poles=roots(pattern, q), N=N, rss=rss, P=P)
    out.K, out.c, out.sd_K, out.s, out.eps = float(c[0]), c[1:], np.sqrt(P[k, k]), s2**0.5, e
    out.bic = N * np.log(max(rss / N, FLOOR * np.var(y))) + (2 * k + 2) * np.log(N)
    out.T, out.sd_lnT = time_constants(pattern, q, P[:k, :k])
    return out


def time_constants(pattern, q, P):
    """Return |1/p| by rising size and sd(ln of it), delta rule on [ln w, ln zeta].

    Real pair: T = (zeta +- root)/w, d ln T/d ln zeta = +- zeta/root, root = sqrt(zeta^2 - 1):
    infinite at the repeated root, where w and zeta are the answer.  Complex pair: 1/w twice.
    """
    T, sd, at = [], [], 0
    for kind in pattern:
        w = np.exp(q[at])
        if kind == "1":
            T.append(1 / w)
            sd.append(np.sqrt(P[at, at]))
        else:
            zeta = np.exp(q[at + 1])
            root = np.sqrt(max(zeta**2 - 1, 0.0))
            for sign in (1, -1):
                g = np.array([-1.0, sign * zeta / root if root else 0.0])
                T.append((zeta + root) ** sign / w)
                sd.append(deviation(g, P[at : at + 2, at : at + 2]))
        at += int(kind)
    i = np.argsort(T, kind="stable")
    return np.array(T)[i], np.array(sd)[i]


def deviation(g, P):
    """Return sqrt(g' P g), infinite where P is."""
    if not np.all(np.isfinite(P)):
        return np.inf
    return float(np.sqrt(max(g @ P @ g, 0.0)))


# -- the search over starts and orders ---------------------------------------------------------


def repair(poles, x):
    """Return poles inside the limits: reflected when unstable, time constants cut to the range."""
    fast, slow = 3 / np.min(np.diff(x)), 0.1 / x[-1]
    out = []
    for p in poles:
        if not np.isfinite(p):
            p = complex(-fast)
        p = complex(-abs(p.real) or -1e-3 * abs(p), p.imag)
        out.append(p * np.clip(abs(p), slow, fast) / abs(p))
    # one of a pair that lost its partner (a root below 0) is taken as real
    whole = [any(abs(p.conjugate() - o) < 1e-9 * abs(p) for o in out) for p in out]
    return np.array([p if w else complex(-abs(p)) for p, w in zip(out, whole, strict=True)])


def starts(t, y, k, lower=None):
    """Return {name: poles}: pencil of block means, integrals, one pole more than the order below.

    That one is faster than all by 4, between two neighbours, or slower than all by 3.
    """
    x = t - t[0]
    out = {}
    b, h = blocks(y, x[-1] / (len(x) - 1))
    if len(b) > 3 * k + 3:
        out["pencil"] = repair(pencil(b, h, k), x)
    out["integrals"] = repair(integrals(t, y, k), x)
    if lower is not None:
        T = np.sort(1 / np.abs(lower.poles)) if k > 1 else x[-1:] / 9
        new = [T[0] / 4, *np.sqrt(T[1:] * T[:-1]), T[-1] * 3]
        for i, Ti in enumerate(new):
            out[f"added {i}"] = repair([*lower.poles, complex(-1 / Ti)], x)
    return out


def best(t, y, k, lower=None, cov="white", only=None):
    """Return the fit of order k with the least residual of all starts (or of those in `only`)."""
    if k == 0:
        return search(t - t[0], y, [], cov)
    tries = starts(t, y, k, lower)
    fits = {n: fit(t, y, p, cov) for n, p in tries.items() if only is None or n in only}
    found = min(fits.values(), key=lambda f: f.rss)
    found.tried = {n: f.rss for n, f in fits.items()}
    return found


def orders(t, y, k_max=4, cov="white", only=None):
    """Return the best fits of order 0, 1, ..., k_max."""
    out = []
    for k in range(k_max + 1):
        out.append(best(t, y, k, out[-1] if out else None, cov, only))
    return out


# -- what the data support ------------------------------------------------------------------


def modes(fit, sure=1.96):
    """Return the modes of a fit: what each section says, and the deviation that judges it.

    kind "lag": T.  "oscillation": zeta < 1 by `sure` deviations.  "pair": zeta = 1 within
    `sure` deviations, two time constants that the data do not tell apart (or a repeated one):
    T = 1/w and zeta stand for both.  `sd` is the largest of the deviations of their logarithms.
    """
    out, at = [], 0
    k = fit.order
    for kind in fit.pattern:
        w, block = np.exp(fit.q[at]), fit.P[at : at + int(kind), at : at + int(kind)]
        sd = np.sqrt(np.diag(block))
        if kind == "1":
            out.append(SimpleNamespace(kind="lag", T=1 / w, sd=sd[0]))
        elif fit.q[at + 1] > sure * sd[1]:
            T, each = time_constants("2", fit.q[at : at + 2], block)
            out += [SimpleNamespace(kind="lag", T=T[i], sd=each[i]) for i in (0, 1)]
        else:
            name = "oscillation" if fit.q[at + 1] < -sure * sd[1] else "pair"
            zeta = np.exp(fit.q[at + 1])
            out.append(SimpleNamespace(kind=name, T=1 / w, zeta=zeta, sd=max(sd), sd_zeta=sd[1]))
        at += int(kind)
    assert at == k
    return sorted(out, key=lambda m: m.T)


def choose(fits, limit=0.5):
    """Return the fit that the data support, the order of least BIC, and why it was lowered.

    From the order of least BIC downwards to the first whose modes all have deviations (of
    ln T, ln w, ln zeta) below `limit`: 0.5 is a factor of 2.7 either way at 95 %.
    """
    top = int(np.argmin([f.bic for f in fits]))
    refused = []
    for k in range(top, 0, -1):
        worst = max(modes(fits[k]), key=lambda m: m.sd)
        if worst.sd < limit:
            return SimpleNamespace(fit=fits[k], order=k, bic_order=top, refused=refused)
        refused.append((k, worst))
    return SimpleNamespace(fit=fits[0], order=0, bic_order=top, refused=refused)
