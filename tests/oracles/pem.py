"""Prediction errors of the polynomial family, minimised by MINPACK's Levenberg-Marquardt.

    A y = sum_i w_i + d + C/D e,   F_i w_i = B_i u_i(t - nk_i)
    eps = D/C (A y - sum_i w_i - d)

Each segment is filtered from row h on, where all lags of u and y exist.  What the filters
1/F_i and D/C hold at that row are parameters of the segment: the states of the transposed
direct form, which act like impulses on the first rows.  Ljung 1999, 3.2, 7.2 and 10.3;
Söderström & Stoica, 7.2 and C7.7.
"""

from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from oracles import lsq

TOLERANCE = 1e-15  # of the iteration: it ends where rounding ends it


@dataclass(frozen=True)
class Orders:
    """Numbers of coefficients, and delays; nb, nf and nk hold one number per input."""

    nb: tuple[int, ...]
    nk: tuple[int, ...]
    nf: tuple[int, ...]
    na: int
    nc: int
    nd: int

    @property
    def history(self):
        """Return h, the first row at which all lags of u and y exist; DESIGN 3."""
        return max([self.na, *(k + b - 1 for k, b in zip(self.nk, self.nb, strict=True))])

    @property
    def sizes(self):
        """Return the numbers of coefficients in theta = [a, b_1 ..., c, d, f_1 ...]."""
        return [self.na, *self.nb, self.nc, self.nd, *self.nf]

    @property
    def states(self):
        """Return the numbers of states of each 1/F_i and of D/C."""
        return [*self.nf, max(self.nc, self.nd)]

    def polynomials(self, theta):
        """Return A, [B_i], C, D, [F_i], the monic ones with their 1."""
        nu = len(self.nb)
        a, *rest = np.split(np.asarray(theta, float), np.cumsum(self.sizes)[:-1])
        b, (c, d), f = rest[:nu], rest[nu : nu + 2], rest[nu + 2 :]
        return np.r_[1, a], b, np.r_[1, c], np.r_[1, d], [np.r_[1, p] for p in f]


def orders(nu=1, *, na=0, nb=1, nc=0, nd=0, nf=0, nk=1):
    """Return `Orders`; nb, nf and nk as one number or one per input."""
    nb, nk, nf = (tuple(int(k) for k in np.broadcast_to(n, nu)) for n in (nb, nk, nf))
    return Orders(nb, nk, nf, na, nc, nd)


def simulate(model, theta, u, e=0.0, offset=0.0):
    """Return y from rest plus an offset; Ljung 1999, (4.33)."""
    u = np.asarray(u, float).reshape(len(u), -1)
    A, B, C, D, F = model.polynomials(theta)
    y = lfilter(C, np.convolve(A, D), np.broadcast_to(e, len(u)))
    for i, (b, f, nk) in enumerate(zip(B, F, model.nk, strict=True)):
        y = y + lfilter(np.r_[np.zeros(nk), b], np.convolve(A, f), u[:, i])
    return y + offset


def run(numerator, denominator, X):
    """Filter each column of X from rest."""
    return lfilter(numerator, denominator, X, axis=0) if X.shape[1] else X


def delays(x, n):
    """Return x(t-1) ... x(t-n) as columns, zero before the first row."""
    table = np.zeros((len(x), n))
    for k in range(n):
        table[k + 1 :, k] = x[: len(x) - k - 1]
    return table


def segment_errors(model, theta, d, states, u, y):
    """Return eps on the rows from h on, and its derivatives by [theta, d, states].

    d eps/d c_k = -1/C eps(t-k) and d w/d f_k = -1/F w(t-k), both from rest: what comes before
    row h belongs to the states, which do not move with c and f; Ljung 1999, (10.53).
    """
    A, B, C, D, F = model.polynomials(theta)
    h, rows = model.history, len(y) - model.history

    def lags(x, first, n):  # x(t - first) ... x(t - first - n + 1), all measured
        return (
            np.array([x[h - k : h - k + rows] for k in range(first, first + n)]).reshape(n, rows).T
        )

    def impulses(n):
        return np.eye(rows, n)

    *input_states, noise_state = np.split(states, np.cumsum(model.nf))
    past_y = lags(y, 1, model.na)
    v = y[h:] + past_y @ A[1:] - d
    by_b, by_f, by_state = [], [], []
    for i, (b, f, nk, state) in enumerate(zip(B, F, model.nk, input_states, strict=True)):
        past_u = lags(u[:, i], nk, len(b))
        w = lfilter([1.0], f, past_u @ b, zi=state)[0]
        v = v - w
        by_b.append(-run(D, C, run([1.0], f, past_u)))
        by_f.append(run(D, C, run([1.0], f, delays(w, len(state)))))
        by_state.append(-run(D, C, run([1.0], f, impulses(len(state)))))
    eps = lfilter(D, C, v, zi=noise_state)[0]
    by_a = run(D, C, past_y)
    by_c = -run([1.0], C, delays(eps, model.nc))
    by_d = run([1.0], C, delays(v, model.nd))
    by_offset = -run(D, C, np.ones((rows, 1)))
    by_state.append(run([1.0], C, impulses(len(noise_state))))
    return eps, np.hstack([by_a, *by_b, by_c, by_d, *by_f, by_offset, *by_state])


class Problem:
    """eps(x) and its Jacobian; x = [theta, d, states of segment 1, states of segment 2 ...].

    `x0="zero"` puts h rows of zeros before each segment, takes every state as zero and counts
    from the segment's own row 0.  Rows with `valid=False` do not count: meant for models
    without a, c and d, where a measured y touches no row but its own.
    """

    def __init__(self, model, u, y, starts=(0,), offset=True, x0="estimate", valid=None):
        y = np.asarray(y, float).ravel()
        u = np.asarray(u, float).reshape(len(y), -1)
        valid = np.ones(len(y), bool) if valid is None else np.asarray(valid, bool).ravel()
        y = np.where(valid, y, 0.0)
        before = model.history if x0 == "zero" else 0
        edges = list(pairwise([*starts, len(y)]))
        self.model = model
        self.segments = [
            (np.pad(u[a:b], ((before, 0), (0, 0))), np.pad(y[a:b], (before, 0))) for a, b in edges
        ]
        first = model.history - before
        self.counts = np.concatenate([valid[a + first : b] for a, b in edges])
        self.n, self.offset = sum(model.sizes), offset
        self.states = 0 if x0 == "zero" else sum(model.states)
        self.size = self.n + offset + len(edges) * self.states

    def __call__(self, x):
        """Return eps (N,) and its Jacobian (N, size)."""
        shared = self.n + self.offset
        errors, common, own = [], [], []
        for s, (u, y) in enumerate(self.segments):
            columns = slice(s * self.states, (s + 1) * self.states)
            states = x[shared:][columns] if self.states else np.zeros(sum(self.model.states))
            d = x[self.n] if self.offset else 0.0
            eps, J = segment_errors(self.model, x[: self.n], d, states, u, y)
            errors.append(eps)
            common.append(J[:, :shared])
            own.append(np.zeros((len(eps), self.size - shared)))
            own[-1][:, columns] = J[:, self.n + 1 : self.n + 1 + self.states]
        J = np.hstack([np.vstack(common), np.vstack(own)])
        return np.concatenate(errors)[self.counts], J[self.counts]

    def start(self, theta):
        """Return x with theta, and the d and states that suit it: eps is linear in these."""
        x = np.r_[theta, np.zeros(self.size - self.n)]
        eps, J = self(x)
        x[self.n :] = np.linalg.lstsq(J[:, self.n :], -eps, rcond=None)[0]
        return x


def cosine(eps, J):
    """Return the largest cosine between eps and a column of J: MINPACK's `gtol`."""
    lengths = np.linalg.norm(J, axis=0) * np.linalg.norm(eps)
    return float(np.max(np.abs(J.T @ eps) / lengths))


def polish(problem, x, steps=30):
    """Take Gauss-Newton steps while they bring eps closer to right angles with J."""
    eps, J = problem(x)
    for _ in range(steps):
        lengths = np.linalg.norm(J, axis=0)
        further = x - np.linalg.lstsq(J / lengths, eps, rcond=None)[0] / lengths
        new_eps, new_J = problem(further)
        if not cosine(new_eps, new_J) < cosine(eps, J):
            break
        x, eps, J = further, new_eps, new_J
    return x, eps, J


def minimise(problem, theta):
    """Return x, eps and J at the minimum reached from theta."""
    done = least_squares(
        lambda x: problem(x)[0],
        problem.start(theta),
        lambda x: problem(x)[1],
        method="lm",
        x_scale="jac",
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=2000,
    )
    return polish(problem, done.x)


def fit(model, u, y, theta, starts=(0,), offset=True, x0="estimate", valid=None):
    """Minimise from theta; P is that of [theta, O], O = d/A(1) by the delta rule.

    s^2 = RSS / (N - all parameters), offset and states counted; loss = RSS / N.
    Söderström & Stoica, (7.49).
    """
    y = np.asarray(y, float).ravel()
    # An unknown start takes up any shift of y, which spares digits.
    shift = y[np.argmax(valid)] if valid is not None else y[0]
    shift = shift if offset and x0 == "estimate" else 0.0
    problem = Problem(model, u, y - shift, starts, offset, x0, valid)
    x, eps, J = minimise(problem, theta)
    n, N = problem.n, len(eps)
    rss = float(eps @ eps)
    lengths = np.linalg.norm(J, axis=0)
    Rinv = np.linalg.inv(np.linalg.qr(J / lengths, mode="r")) / lengths[:, None]
    P = (rss / (N - problem.size) * Rinv @ Rinv.T)[: n + offset, : n + offset]
    O = 0.0
    if offset:
        A1 = 1 + x[: model.na].sum()
        O = x[n] / A1
        by = np.eye(n + 1)
        by[-1, -1] = 1 / A1  # dO/dd
        by[-1, : model.na] = -O / A1  # dO/da_i = -d / A(1)^2
        P = by @ P @ by.T
        O += shift
    return SimpleNamespace(
        theta=x[:n],
        P=P,
        sd=np.sqrt(np.diag(P))[:n],
        offset=O,
        N=N,
        rss=rss,
        loss=rss / N,
        eps=eps,
        cosine=cosine(eps, J),
        model=model,
    )


def arx_start(model, u, y, starts=(0,), offset=True):
    """Return a start for one input that knows nothing of the plant: ARX, its A taken for F."""
    arx = lsq.arx(u, y, max(model.na, *model.nf), model.nb, model.nk, starts, offset).theta
    a, b = np.split(arx, [max(model.na, *model.nf)])
    return np.concatenate([a[: model.na], b, np.zeros(model.nc + model.nd), a[: model.nf[0]]])
