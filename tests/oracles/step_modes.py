"""Time constants of a step response as a sum of exponentials, with what the data support.

    y(t) = K + sum_j c_j phi_j(t) + e(t),   t from any instant after the last change of the input.

The phi_j span all solutions of (d/dt - p_1) ... (d/dt - p_k) phi = 0.  Sections in a row hold the
poles, s + w, or s^2 + 2 zeta w s + w^2, and the phi_j are the outputs of the row from each of its
states, e_1' e^(At) with A block bidiagonal: smooth in ln w and ln zeta through repeated roots
(zeta = 1) and from real to complex ones, where the e^(p_i t) themselves become parallel.
Initial state, zeros and a delay already over only change the c_j.  Several steps share K, the
poles and the level at rest O, y = O + K u + ..., and have c_j each.

c, K and O by QR inside the search over (ln w, ln zeta): variable projection, Golub & Pereyra,
SIAM J. Num. Anal. 10, 1973.  Cov = s^2 (J'J)^-1 of all parameters, the Cramer-Rao bound for white
e; delta rule for the time constants.  Order by BIC = N ln max(RSS/N, floor) + n ln N, floor =
1e-12 var(y).  With e of lag-1 correlation r, N counts as N (1 - r)/(1 + r).  METHODS 5, 2.4.
"""

from types import SimpleNamespace

import numpy as np
from scipy.linalg import block_diag, expm
from scipy.optimize import least_squares

from oracles.step_starts import blocks, integrals, ordered, pencil

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
        else:  # states scaled by w, so that no entry grows faster than w
            A[i : i + 2, i : i + 2] = [[0, w], [-w, -2 * np.exp(q[at + 1]) * w]]
        if i:
            A[i - 1, i] = w
        i, at = i + int(kind), at + int(kind)
    return A


def roots(pattern, q):
    """Return the poles in closed form: as eigenvalues of A a repeated root would split."""
    poles, at = [], 0
    for kind in pattern:
        w = np.exp(q[at])
        if kind == "1":
            poles.append(-w)
        else:
            zeta = np.exp(q[at + 1])
            fast = -w * (zeta + np.sqrt(complex(zeta**2 - 1)))
            # the product, not the difference: no digits lost
            poles += [fast, w**2 / fast if zeta >= 1 else fast.conjugate()]
        at += int(kind)
    return ordered(np.array(poles, complex))


def basis(pattern, q, t):
    """Return the columns phi_1(t), ..., phi_k(t); on a uniform grid by doubling."""
    if not pattern:
        return np.zeros((len(t), 0))
    A = matrix(pattern, q)
    h = np.diff(t)
    if np.any(np.abs(h - h[0]) > 1e-9 * h[0]):
        return expm(t[:, None, None] * A)[:, 0]
    step, rows = expm(A * h[0]), expm(A * t[0])[:1]
    while len(rows) < len(t):
        rows, step = np.vstack([rows, rows @ step]), step @ step
    return rows[: len(t)]


def columns(pattern, q, x, u):
    """Return [1, u, phi of each step]; u only where it takes two values or more."""
    level = np.concatenate([np.full(len(t), v) for t, v in zip(x, u, strict=True)])
    common = [np.ones(len(level))] + ([level] if len(set(u)) > 1 else [])
    return np.column_stack([*common, block_diag(*(basis(pattern, q, t) for t in x))])


# -- variable projection ---------------------------------------------------------------------


def fit(t, y, poles, u=(1.0,)):
    """Return the least-squares sum of exponentials from one start.

    t and y are arrays, or lists of them with the levels u, one for each step.  `poles` distinct
    or not, real or complex.

    Only partners of a pair turn complex.  Where two others have met, the search stands on a
    seam; paired anew it goes on.
    """
    x, y = parts(t, y)
    found = search(x, y, u, poles)
    for _ in range(5):
        q = sections(found.poles)[1]
        if np.allclose(q, found.q, rtol=0, atol=1e-3):
            break
        again = search(x, y, u, found.poles)
        if again.rss >= found.rss * (1 - 1e-6):
            break
        found = again
    return found


def parts(t, y):
    """Return the times of each step from its first row, and all y in one."""
    if np.ndim(t[0]) == 0:
        t, y = [t], [y]
    return [np.asarray(ti, float) - ti[0] for ti in t], np.concatenate(y)


def search(x, y, u, poles):
    """Return the minimum that MINPACK reaches over [ln w, ln zeta] from these poles."""
    pattern, q0 = sections(poles)
    low, high = limits(pattern, x)

    def project(q):
        X = columns(pattern, np.clip(q, low, high), x, u)
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
    return assess(x, y, u, pattern, q, X, c)


def reach(x):
    """Return the fastest and slowest rate looked for: T from dt/3 to ten records."""
    return 3 / min(np.min(np.diff(t)) for t in x), 0.1 / max(t[-1] for t in x)


def limits(pattern, x):
    """Return the box of q."""
    fast, slow = np.log(reach(x))
    low, high = [], []
    for kind in pattern:
        low += [slow] + [np.log(1e-3)] * (kind == "2")
        high += [fast] + [np.log(1e2)] * (kind == "2")
    return np.array(low), np.array(high)


def assess(x, y, u, pattern, q, X, c):
    """Return the fit with the covariance P of [q, O and K or O + K, c] for white e.

    `K` is the last level, with several steps the gain; `sd_lnT` is of ln T.
    """
    e = y - X @ c
    k, N, h = len(q), len(y), 1e-5
    slopes = [
        (columns(pattern, q + h * d, x, u) @ c - columns(pattern, q - h * d, x, u) @ c) / (2 * h)
        for d in np.eye(k)
    ]
    J = np.column_stack([*slopes, X])
    rss, n = float(e @ e), J.shape[1]
    out = SimpleNamespace(order=k, pattern=pattern, q=q, poles=roots(pattern, q), N=N, n=n)
    out.rss, out.eps, out.c = rss, e, c
    out.s2 = rss / (N - n)
    out.P = out.s2 * covariance(J)
    out.r = float(e[1:] @ e[:-1]) / rss if rss > FLOOR * N * np.var(y) else 0.0
    out.floor = FLOOR * np.var(y)
    out.level = 1 if len(set(u)) > 1 else 0
    out.K, out.sd_K = float(c[out.level]), float(np.sqrt(out.P[k + out.level, k + out.level]))
    out.T, out.sd_lnT = time_constants(pattern, q, out.P[:k, :k])
    return out


def covariance(J):
    """Return (J'J)^-1 by QR of the scaled columns; infinite where it has no inverse."""
    size = np.linalg.norm(J, axis=0)
    if np.all(size > 0):
        R = np.linalg.qr(J / size, mode="r")
        singular = np.linalg.svd(R, compute_uv=False)
        if singular[-1] > 1e-12 * singular[0]:
            Ri = np.linalg.inv(R)
            return (Ri @ Ri.T) / np.outer(size, size)
    return np.full((len(size),) * 2, np.inf)


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


def numerator(f):
    """Return N(s)/K, highest power first, N(0) = K, and the deviations of its coefficients.

    N(s)/D(s) = s Y(s), y of one step from rest with t[0] the time of the step and no delay:
    N = K D(s) + s [det(sI - A + c e_1') - det(sI - A)]; (11) of source 003, any multiplicity.
    """
    k = f.order

    def coefficients(p):
        A, K, c = matrix(f.pattern, p[:k]), p[k], p[k + 1 :]
        D = np.poly(A)
        N = K * D + np.append((np.poly(A - np.outer(c, np.eye(k)[0])) - D)[1:], 0.0)
        return N / N[-1]

    p = np.concatenate([f.q, f.c])
    steps = np.diag(1e-6 * (1 + np.abs(p)))
    G = np.array([(coefficients(p + h) - coefficients(p - h)) / (2 * h.max()) for h in steps])
    return coefficients(p), np.sqrt(np.maximum(np.einsum("ij,ik,kj->j", G, f.P, G), 0))


# -- the search over starts and orders ---------------------------------------------------------


def repair(poles, x):
    """Return poles inside the limits: reflected when unstable, time constants cut to the range."""
    fast, slow = reach(x)
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

    That one is faster than all by 4, between two neighbours, or slower than all by 3.  Of
    several steps the longest is taken.
    """
    x, _ = parts(t, y)
    if np.ndim(t[0]):
        longest = int(np.argmax([len(ti) for ti in t]))
        t, y = t[longest], y[longest]
    span, out = t[-1] - t[0], {}
    means, h = blocks(y, span / (len(t) - 1))
    if len(means) > 3 * k + 3:
        out["pencil"] = repair(pencil(means, h, k), x)
    out["integrals"] = repair(integrals(t, y, k), x)
    if lower is not None:
        T = np.sort(1 / np.abs(lower.poles)) if k > 1 else np.array([span / 9])
        for i, Ti in enumerate([T[0] / 4, *np.sqrt(T[1:] * T[:-1]), T[-1] * 3]):
            out[f"added {i}"] = repair([*lower.poles, complex(-1 / Ti)], x)
    return out


def best(t, y, k, lower=None, u=(1.0,), only=None):
    """Return the fit of order k with the least residual of all starts (or of those in `only`)."""
    if k == 0:
        return search(*parts(t, y), u, [])
    tries = starts(t, y, k, lower)
    fits = {n: fit(t, y, p, u) for n, p in tries.items() if only is None or n in only}
    found = min(fits.values(), key=lambda f: f.rss)
    found.tried = {n: f.rss for n, f in fits.items()}
    return found


def orders(t, y, k_max=4, u=(1.0,), only=None):
    """Return the best fits of order 0, 1, ..., k_max."""
    out = []
    for k in range(k_max + 1):
        out.append(best(t, y, k, out[-1] if out else None, u, only))
    return out


# -- what the data support ------------------------------------------------------------------


def colour(fits):
    """Return r, the lag-1 correlation of the least coloured residual; 0 within two deviations."""
    f = min(fits, key=lambda f: abs(f.r))
    return f.r if f.r > 2 / np.sqrt(f.N) else 0.0


def bic(f, r=0.0):
    """Return the BIC of a fit whose rows count as N (1 - r)/(1 + r); s^2 is a parameter too."""
    N = f.N * (1 - r) / (1 + r)
    return N * np.log(max(f.rss / f.N, f.floor)) + (f.n + 1) * np.log(N)


def modes(f, r=0.0, sure=1.96):
    """Return the modes of a fit: what each section says, and the deviation that judges it.

    kind "lag": T.  "complex": zeta < 1 by `sure` deviations.  "pair": zeta = 1 within
    `sure` deviations, two time constants that the data do not tell apart (or a repeated one):
    T = 1/w and zeta stand for both.  `sd` is the largest of the deviations of their logarithms.
    """
    out, at = [], 0
    P = f.P * (1 + r) / (1 - r)
    for kind in f.pattern:
        q, block = f.q[at : at + int(kind)], P[at : at + int(kind), at : at + int(kind)]
        sd = np.sqrt(np.diag(block))
        if kind == "1":
            out.append(SimpleNamespace(kind="lag", T=np.exp(-q[0]), sd=sd[0]))
        elif q[1] > sure * sd[1]:
            T, each = time_constants("2", q, block)
            out += [SimpleNamespace(kind="lag", T=T[i], sd=each[i]) for i in (0, 1)]
        else:
            name = "complex" if q[1] < -sure * sd[1] else "pair"
            out.append(SimpleNamespace(kind=name, T=np.exp(-q[0]), zeta=np.exp(q[1]), sd=max(sd)))
        at += int(kind)
    return sorted(out, key=lambda m: m.T)


def choose(fits, limit=0.5, margin=6.0):
    """Return the fit that the data support, the order that BIC favours, and why it was lowered.

    BIC first: the highest order that beats every lower one by `margin`, 6 being strong evidence
    (Kass & Raftery, J. Am. Stat. Ass. 90, 1995).  From it downwards to the first whose modes all
    have deviations (of ln T, ln w, ln zeta) below `limit`: 0.5 is a factor of 2.7 at 95 %.
    """
    r = colour(fits)
    value = np.array([bic(f, r) for f in fits])
    top = int(np.argmin(value))
    while top > 0 and value[top] > np.min(value[:top]) - margin:
        top -= 1
    refused = []
    for k in range(top, 0, -1):
        found = modes(fits[k], r)
        worst = max(found, key=lambda m: m.sd)
        if worst.sd < limit:
            break
        refused.append((k, worst))
    else:
        k, found = 0, []
    return SimpleNamespace(fit=fits[k], order=k, modes=found, bic_order=top, r=r, refused=refused)
