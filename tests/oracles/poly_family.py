"""The polynomial family by rows, its exact gradient, the information it holds, many starts.

    A y = sum_i w_i + d + C/D e,   F_i w_i = B_i u_i(t - nk_i)

    ARX      na nb nk          ARMAX    na nb nc nk       ARARX    na nb nd nk
    OE       nb nf nk          BJ       nb nc nd nf nk    ARARMAX  na nb nc nd nk

`pem` filters and estimates; here the same predictor is written row by row (from rest, complex
arguments allowed, so that its derivative by the complex step is exact), the information
matrix is the expected one, and a minimum is taken over many starts.

At the truth eps = e and psi = d eps/d theta is linear in (u, e), hence

    E sum_t psi psi' = sum_t psi_u psi_u' + s^2 sum_k (N - k) g(k) g(k)',

psi_u the response to u alone, g that to an impulse of e; Cov >= s^2 (E sum psi psi')^-1.
Ljung 1999, 4.2, 7.4 and 10.3; Söderström & Stoica, 6.2 and 7.5.
"""

import numpy as np
from scipy.signal import lfilter

from oracles import lsq, pem


def arx(nu=1, **n):
    """ARX, ARMAX, ARARX and ARARMAX are told by their orders: na nb nk with nc, nd."""
    return pem.orders(nu, **n)


armax = ararx = ararmax = arx


def oe(nu=1, *, nb, nf, nk):
    return pem.orders(nu, nb=nb, nf=nf, nk=nk)


def bj(nu=1, *, nb, nc, nd, nf, nk):
    return pem.orders(nu, nb=nb, nc=nc, nd=nd, nf=nf, nk=nk)


# -- the predictor, row by row ---------------------------------------------------------------


def past(p, x, t):
    """Return p_1 x(t-1) + p_2 x(t-2) + ..., x zero before row 0."""
    return sum(p[k] * x[t - k] for k in range(1, min(len(p) - 1, t) + 1))


def polynomials(model, theta):
    """Split theta = [a, b_1 ..., c, d, f_1 ...] into A, [B_i], C, D, [F_i]."""
    parts = np.split(np.asarray(theta), np.cumsum(model.sizes)[:-1])
    nu = len(model.nb)
    a, b, c, d, f = parts[0], parts[1 : nu + 1], parts[nu + 1], parts[nu + 2], parts[nu + 3 :]
    return np.r_[1, a], b, np.r_[1, c], np.r_[1, d], [np.r_[1, p] for p in f]


def errors(model, theta, u, y, d=0.0):
    """Return the one-step prediction errors from rest; Ljung 1999, (4.33) and (7.2)."""
    A, B, C, D, F = polynomials(model, theta)
    u = np.asarray(u, float).reshape(len(y), -1)
    kind = np.result_type(float, *[np.asarray(x).dtype for x in (theta, d)])
    w = np.zeros((len(B), len(y)), kind)
    v, eps = np.zeros(len(y), kind), np.zeros(len(y), kind)
    for t in range(len(y)):
        for i, (b, f, nk) in enumerate(zip(B, F, model.nk, strict=True)):
            driven = sum(b[k] * u[t - nk - k, i] for k in range(len(b)) if t >= nk + k)
            w[i, t] = driven - past(f, w[i], t)
        v[t] = y[t] + past(A, y, t) - w[:, t].sum() - d
        eps[t] = v[t] + past(D, v, t) - past(C, eps, t)
    return eps


def gradient_by_step(model, theta, u, y, d=0.0, h=1e-30):
    """Return d eps/d [theta, d] (N, n + 1) by the complex step, exact to rounding."""
    x = np.r_[theta, d].astype(complex)
    columns = []
    for k in range(len(x)):
        z = x.copy()
        z[k] += 1j * h
        columns.append(errors(model, z[:-1], u, y, z[-1]).imag / h)
    return np.column_stack(columns)


def gradient(model, theta, u, y, d=0.0):
    """Return the same in closed form; Ljung 1999, (10.53).

    d eps = D/C y(t-k) da - D/(C F) u(t-nk-k) db - 1/C eps(t-k) dc + 1/C v(t-k) dd
            + D/(C F) w(t-k) df - D/C 1 dd(offset)
    """
    A, B, C, D, F = polynomials(model, theta)
    u = np.asarray(u, float).reshape(len(y), -1)
    w = [
        lfilter(np.r_[np.zeros(nk), b], f, u[:, i])
        for i, (b, f, nk) in enumerate(zip(B, F, model.nk, strict=True))
    ]
    v = lfilter(A, [1.0], y) - sum(w) - d
    eps = lfilter(D, C, v)

    def lagged(x, first, n):
        return [np.r_[np.zeros(k), x[: len(x) - k]] for k in range(first, first + n)]

    by_y = lfilter(D, C, y)
    columns = lagged(by_y, 1, model.na)
    for i, (f, nk, nb) in enumerate(zip(F, model.nk, model.nb, strict=True)):
        columns += lagged(-lfilter(D, np.convolve(C, f), u[:, i]), nk, nb)
    columns += lagged(-lfilter([1.0], C, eps), 1, model.nc)
    columns += lagged(lfilter([1.0], C, v), 1, model.nd)
    for i, f in enumerate(F):
        columns += lagged(lfilter(D, np.convolve(C, f), w[i]), 1, model.nf[i])
    return np.column_stack([*columns, -lfilter(D, C, np.ones(len(y)))])


# -- what the record can tell ---------------------------------------------------------------


def information(model, theta, u, variance, offset=True):
    """Return E sum psi psi'/s^2 of [theta, d] or of theta, in open loop."""
    u = np.asarray(u, float).reshape(len(u), -1)
    N = len(u)
    by_u = gradient(model, theta, u, pem.simulate(model, theta, u))
    by_u[:, -1] = gradient(model, theta, 0 * u, np.zeros(N))[:, -1]
    impulse = np.eye(N, 1).ravel()
    g = gradient(model, theta, 0 * u, pem.simulate(model, theta, 0 * u, impulse))
    g[:, -1] = 0.0  # the column of d does not move with e
    n = by_u.shape[1] if offset else by_u.shape[1] - 1
    weights = np.arange(N, 0, -1)[:, None]
    return (by_u.T @ by_u / variance + (weights * g).T @ g)[:n, :n]


def bound(model, theta, u, variance, offset=True):
    """Return the Cramér-Rao bound on the covariance of [theta, d], or of theta."""
    J = information(model, theta, u, variance, offset)
    s = np.sqrt(np.diag(J))
    return np.linalg.inv(J / np.outer(s, s)) / np.outer(s, s)


# -- starts ---------------------------------------------------------------------------------


def inside(p, radius=0.98):
    """Return the polynomial with roots outside the circle reflected and all within `radius`."""
    roots = np.roots(p)
    roots = np.where(np.abs(roots) > 1, 1 / np.conj(roots), roots)
    size = np.maximum(np.abs(roots), 1e-300)
    return np.atleast_1d(np.real(np.poly(np.where(size > radius, roots * radius / size, roots))))


def two_stage(model, u, y, n=None):
    """Return a start by least squares on lagged errors of a long ARX (Hannan & Rissanen 1982).

    A y = B u + (C - 1) e: for ARMAX the model itself; for OE and BJ its A is taken for F and
    1/D is left at 1 where it does not fit.
    """
    u = np.asarray(u, float).reshape(len(y), -1)
    nu, na = u.shape[1], max(model.na, *model.nf)
    n = n or min(30, len(y) // 10)
    long = lsq.arx(u, y, n, n, np.array(model.nk), offset=True)
    e = np.zeros(len(y))
    e[long.rows] = long.eps
    nc = model.nc
    wide = np.column_stack([u, e])[long.rows[0] :] if nc else u
    nb = np.r_[model.nb, [nc] * bool(nc)].astype(int)
    nk = np.r_[model.nk, [1] * bool(nc)].astype(int)
    found = lsq.arx(wide, y[len(y) - len(wide) :], na, nb, nk).theta
    a, b, c = np.split(found, [na, na + sum(model.nb)])
    a, c = inside(np.r_[1, a])[1:], inside(np.r_[1, c])[1:]
    f = [a[:k] for k in model.nf]
    return np.concatenate([a[: model.na], b, c, np.zeros(model.nd), *f[:nu]])


def random_start(model, u, y, rng):
    """Return stable random denominators and C, with B by least squares under them."""

    def monic(n):
        p = np.ones(1)
        while len(p) <= n:
            if n + 1 - len(p) >= 2 and rng.random() < 0.5:
                r, w = rng.uniform(0.2, 0.98), rng.uniform(0, np.pi)
                p = np.convolve(p, [1, -2 * r * np.cos(w), r * r])
            else:
                p = np.convolve(p, [1, -rng.uniform(-0.5, 0.98)])
        return p[1:]

    u = np.asarray(u, float).reshape(len(y), -1)
    a, c, d = monic(model.na), monic(model.nc), monic(model.nd)
    f = [monic(k) for k in model.nf]
    theta = np.concatenate([a, np.zeros(sum(model.nb)), c, d, *f])
    J = gradient(model, theta, u, y)
    linear = np.r_[model.na + np.arange(sum(model.nb)), J.shape[1] - 1]
    b = np.linalg.lstsq(J[:, linear], -errors_fast(model, theta, u, y), rcond=None)[0]
    theta[model.na : model.na + sum(model.nb)] = b[:-1]
    return theta


def errors_fast(model, theta, u, y):
    """Return `errors` by filters, with B = 0 allowed."""
    A, B, C, D, F = polynomials(model, theta)
    v = lfilter(A, [1.0], y)
    for i, (b, f, nk) in enumerate(zip(B, F, model.nk, strict=True)):
        v = v - lfilter(np.r_[np.zeros(nk), b], f, u[:, i])
    return lfilter(D, C, v)


def best_of(model, u, y, starts, **options):
    """Fit by `pem.fit` from each start; return the best fit and the losses (inf: failed)."""
    fits = []
    for theta in starts:
        try:
            with np.errstate(all="ignore"):
                fits.append(pem.fit(model, u, y, theta, **options))
        except (ValueError, FloatingPointError, np.linalg.LinAlgError):
            fits.append(None)
    losses = np.array([np.inf if f is None or not np.isfinite(f.loss) else f.loss for f in fits])
    return fits[int(np.argmin(losses))], losses
