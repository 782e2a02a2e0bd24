"""Process models P0 to P3 with any real delay: exact samples, output-error fit.

    y = O + sum_i G_i u_i + free response + e,
    G = K (Tz s + 1) e^(-L s) / (s^i prod (T_k s + 1)),   U: (T^2 s^2 + 2 zeta T s + 1) (T3 s + 1)

    P<n> [D] [Z] [I] [U]: n lags; D dead time L; Z zero Tz; I integrator; U complex pair T, zeta

u is held.  With X(t) = int_0^t e^(A tau) b dtau (a matrix exponential), m = floor(L/Ts) and
f = (m+1) Ts - L the state after one pulse of u is 0 up to the sample m, then

    X(f),  Phi X(f) + X(Ts) - X(f),  and Phi times its predecessor,  Phi = e^(A Ts),

exact for every L >= 0 (METHODS 1.5).  Times a(q), whose roots are e^(p Ts), it ends after
n + 2 terms, which makes a filter.  Where y jumps with u (P0, P1Z) it counts right of the jump.

K, K Tz, O (integrating: the drift d t) and the free modes at the first row that counts are
linear; T, zeta and L are not: variable projection, Golub & Pereyra 1973; METHODS 2.2.  Rows of
which the delayed input is not known are history only (METHODS 8.2).  Derivatives are complex
steps, exact to rounding; at whole L/Ts that by L is the one towards larger L.
"""

from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.signal import lfilter

STEP = 1e-30


@dataclass(frozen=True)
class Code:
    """What the letters of a code say; p holds its nonlinear parameters in samples."""

    lags: int
    D: bool
    Z: bool
    I: bool
    U: bool

    @property
    def nonlinear(self):
        """Return the names of p: time constants, damping, dead time."""
        if self.U:
            names = ["T", "zeta"] + ["T3"] * (self.lags == 3)
        else:
            names = ["T"] if self.lags == 1 else [f"T{k + 1}" for k in range(self.lags)]
        return names + ["L"] * self.D

    @property
    def names(self):
        return ["K", *self.nonlinear, *["Tz"] * self.Z]

    def denominators(self, p):
        """Return q(s), highest power first, and a(q) = prod (1 - e^(pole) q^-1)."""
        q, a, times = np.ones(1), np.ones(1), list(p[: self.lags])
        if self.U:
            T, zeta = times[:2]
            w = np.sqrt(1 - zeta * zeta + 0j) / T
            r = np.exp(-zeta / T)
            c = np.cos(w) if np.iscomplexobj(p) else np.cos(w).real
            q, a = np.array([T * T, 2 * zeta * T, 1]), np.array([1, -2 * r * c, r * r])
            times = times[2:]
        for T in times:
            q, a = np.convolve(q, [T, 1]), np.convolve(a, [1, -np.exp(-1 / T)])
        return (np.convolve(q, [1, 0]), np.convolve(a, [1, -1])) if self.I else (q, a)


def code(text):
    """Read a code: P2DU, P1DI ..."""
    assert text[0] == "P" and set(text[2:]) <= set("DZIU")
    return Code(int(text[1]), *[letter in text[2:] for letter in "DZIU"])


def sampled(model, p):
    """Return (b, a, m): numerators (n+2, 2) of 1/q and s/q after m samples; unit of time Ts."""
    L = p[-1] if model.D else 0.0
    m = int(np.floor(np.real(L) + 1e-12))
    f = m + 1 - L
    whole = np.real(f) > 1 - 1e-9  # the pulse arrives at the sample m itself
    q, a = model.denominators(np.asarray(p))
    n = len(q) - 1
    arrival = np.eye(n + 2)[:, 0 if whole else 1]
    if n == 0:
        return np.column_stack([arrival, 0 * arrival]), a, m
    M = np.zeros((n + 1, n + 1), np.result_type(q, f))  # d/dt [x; 1], x = [z^(n-1) ... z' z]
    M[0, :n], M[0, n] = -q[1:] / q[0], 1 / q[0]
    M[1:n, : n - 1] = np.eye(n - 1)
    short, full = expm(M * f), expm(M)
    x = np.zeros((n + 2, n), M.dtype)
    x[1] = short[:n, n]
    x[2] = full[:n, :n] @ x[1] + full[:n, n] - x[1]
    for k in range(3, n + 2):
        x[k] = full[:n, :n] @ x[k - 1]
    z = x[:, -1]
    slope = x[:, -2] if n > 1 else M[0, 0] * z + M[0, 1] * arrival
    return np.column_stack([np.convolve(a, g)[: n + 2] for g in (z, slope)]), a, m


def unit(model, p, u):
    """Return the outputs of 1/q and, with Z, s/q from rest, and a; unit of time Ts."""
    b, a, m = sampled(model, p)
    v = np.r_[np.zeros(m), u][: len(u)]
    return [lfilter(b[:, j], a, v) for j in range(1 + model.Z)], a


def to_samples(model, p, Ts):
    return np.array(
        [x / (1 if name == "zeta" else Ts) for name, x in zip(model.nonlinear, p, strict=True)]
    )


def simulate(text, theta, u, Ts, offset=0.0):
    """Return y from rest; theta in the order of `code(text).names`, in seconds."""
    model = code(text)
    K, Tz = theta[0], theta[-1] if model.Z else 0.0
    n = len(model.nonlinear)
    parts, _ = unit(model, to_samples(model, theta[1 : n + 1], Ts), np.asarray(u, float))
    y = parts[0] + (Tz / Ts * parts[1] if model.Z else 0.0)
    return offset + K * (Ts if model.I else 1.0) * y


def columns(models, p, u, starts, skip, offset=True):
    """Return the rows that count and the columns [K_1, K_1 Tz_1, K_2 ..., O or d, free ...]."""
    edges = list(pairwise([*starts, len(u)]))
    rows = np.concatenate([np.arange(a + skip, b) for a, b in edges])
    ends = np.cumsum([len(model.nonlinear) for model in models])[:-1]
    split = np.split(np.asarray(p), ends)
    forced, free = [], []
    for i, (model, own) in enumerate(zip(models, split, strict=True)):
        parts = [unit(model, own, u[a:b, i]) for a, b in edges]
        for j in range(1 + model.Z):
            forced.append(np.concatenate([part[0][j][skip:] for part in parts]))
        a = parts[0][1]
        for first, end in edges:
            inside = (rows >= first) & (rows < end)
            for k in range(len(a) - 1):
                impulse = np.eye(inside.sum(), len(a) - 1)[:, k]
                free.append(np.zeros(len(rows), a.dtype))
                free[-1][inside] = lfilter([1.0], a, impulse)
    drift = [rows / 100.0 if any(m.I for m in models) else np.ones(len(rows))] * offset
    return rows, np.column_stack([*forced, *drift, *free])


def fit(texts, u, y, Ts, tries, L_max, starts=(0,), offset=True, valid=None, tight=True, hold=()):
    """Minimise sum e^2 from each p of `tries` (nonlinear parameters of all inputs, seconds).

    skip = ceil(L_max / Ts) rows of each segment are history; the parameters numbered in `hold`
    stay as they are.  P is s^2 (J'J)^-1 of all
    parameters, s^2 = RSS / (N - all), cut down to theta; METHODS 2.4.
    """
    models = [code(text) for text in np.atleast_1d(texts)]
    y = np.asarray(y, float).ravel()
    u = np.asarray(u, float).reshape(len(y), -1)
    keep = np.ones(len(y), bool) if valid is None else np.asarray(valid, bool).ravel()
    shift, skip = y[keep][0], int(np.ceil(L_max / Ts - 1e-9))
    names = [name for model in models for name in model.nonlinear]
    scale = np.array([1.0 if name == "zeta" else Ts for name in names])
    logs = np.array([name != "L" for name in names])

    def natural(x):
        return np.where(logs, np.exp(np.where(logs, x, 0.0)), x)

    def columns_at(p):
        rows, X = columns(models, p, u, starts, skip, offset)
        return X[keep[rows]]

    rows = columns(models, natural(np.zeros(len(names))), u, starts, skip, offset)[0]
    rows = rows[keep[rows]]
    target = y[rows] - shift

    def solve(p):
        X = columns_at(p)
        size = np.linalg.norm(X, axis=0)
        size[size == 0] = 1.0
        lin = np.linalg.lstsq(X / size, target, rcond=1e-12)[0] / size
        return lin, X, target - X @ lin

    def slopes(p, lin):
        """d(X lin)/dp in natural units, by the complex step."""
        J = np.empty((len(rows), len(p)))
        for k in range(len(p)):
            z = p.astype(complex)
            z[k] += 1j * STEP
            J[:, k] = columns_at(z).imag @ lin / STEP
        return J

    def jacobian(x):
        p = natural(x)
        lin, X, _ = solve(p)
        J = (slopes(p, lin) * np.where(logs, p, 1.0))[:, moving]
        Q = np.linalg.qr(X)[0]
        return -(J - Q @ (Q.T @ J))  # Kaufman's form

    low = np.where(logs, np.log(1e-3), 0.0)
    high = np.where(logs, np.log(1e5), max(L_max / Ts, 1e-9))
    moving = [k for k in range(len(names)) if k not in hold]
    done, tol = [], 1e-13 if tight else 1e-8
    for p in tries:
        p = np.asarray(p, float) / scale
        x = np.clip(np.where(logs, np.log(np.maximum(p, 1e-9)), p), low + 1e-9, high - 1e-9)

        def whole(z, x=x):
            return np.where(np.isin(np.arange(len(x)), moving), expand(z), x)

        def expand(z):
            return np.bincount(moving, z, len(names))

        if not moving:
            done.append(SimpleNamespace(x=x, cost=0.5 * float(np.sum(solve(natural(x))[2] ** 2))))
            continue
        end = least_squares(
            lambda z: solve(natural(whole(z)))[2],
            x[moving],
            lambda z: jacobian(whole(z)),
            bounds=(low[moving], high[moving]),
            x_scale=np.where(logs, 0.1, 0.5)[moving],
            xtol=tol,
            ftol=tol,
            gtol=1e-14,
            max_nfev=100,
        )
        done.append(SimpleNamespace(x=whole(end.x), cost=end.cost))
    best = min(done, key=lambda r: r.cost)
    p = natural(best.x)
    lin, X, eps = solve(p)
    J = np.column_stack([slopes(p, lin) / scale, X])
    return summary(models, names, p * scale, lin, J, eps, Ts, shift, offset, done, solve)


def summary(models, names, p, lin, J, eps, Ts, shift, offset, done, solve):
    """Collect theta = [K, T.., L, Tz] of each input, O and their covariance by the delta rule."""
    N, n = J.shape
    size = np.linalg.norm(J, axis=0)
    _, sv, V = np.linalg.svd(J / size, full_matrices=False)
    good = sv > 1e-10 * sv[0]  # equal modes of two inputs are one
    s2 = float(eps @ eps) / (N - good.sum())
    P = s2 * (V[good].T / sv[good] ** 2) @ V[good] / np.outer(size, size)
    theta, by, i, j = [], [], 0, 0
    for model in models:
        unit_of_K = Ts if model.I else 1.0
        row = np.eye(n)
        k = len(p) + j
        theta += [lin[j] / unit_of_K, *p[i : i + len(model.nonlinear)]]
        by += [row[k] / unit_of_K, *row[i : i + len(model.nonlinear)]]
        if model.Z:
            Tz = Ts * lin[j + 1] / lin[j]
            theta.append(Tz)
            by.append(Ts / lin[j] * row[k + 1] - Tz / lin[j] * row[k])
        i, j = i + len(model.nonlinear), j + 1 + model.Z
    integrating = any(m.I for m in models)
    unit_of_O = 100.0 * Ts if integrating else 1.0
    O = lin[j] / unit_of_O + (0.0 if integrating else shift) if offset else 0.0
    by.append(np.eye(n)[len(p) + j] / unit_of_O * offset)
    P = np.array(by) @ P @ np.array(by).T
    rss = float(eps @ eps)
    return SimpleNamespace(
        theta=np.array(theta),
        names=[x for m in models for x in m.names],
        offset=O,
        P=P,
        sd=np.sqrt(np.diag(P))[:-1],
        N=N,
        free=N - good.sum(),
        rss=rss,
        loss=rss / N,
        eps=eps,
        p=p,
        nonlinear=names,
        costs=np.array([2 * r.cost for r in done]),
        J=J,
        solve=solve,
    )
