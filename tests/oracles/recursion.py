"""Recursive estimators, each as its equations stand in the texts: full P, one sample at a time.

Least squares, y = phi' theta + e, q = phi' P phi, eps = y - phi' theta:

    exponential  L = P phi/(lam + q), theta += L eps, P = (P - L phi' P)/lam
    directional  L = P phi/(1 + q), g = lam - (1 - lam)/q, P^-1 += g phi phi'
    variable     L = P phi/(1 + q), P = (P - L phi' P)/lam, lam = 1 - (1 - phi' L) eps^2/(s^2 N0)
    random walk  L = P phi/(R2 + q), P = P - L phi' P + R1

    Ljung 1999, 11.2 and 11.6; Kulhavy, Kybernetika 23, 1987; Fortescue, Kershenbaum &
    Ydstie, Automatica 17, 1981; source 001, (3.7-7) to (3.7-11) as corrected in ERRATA 3.1.

Prediction errors of A y = B/F u + d + C/D e, theta = [a, b, c, d, f, offset] (order of `pem`):

    phi = [-y(t-1) ..., u(t-nk) ..., e(t-1) ..., -v(t-1) ..., -w(t-1) ..., 1]
    eps = y - phi' theta(t-1)
    psi = D/C phi for a and the offset, D/(C F) phi for b and f, 1/C phi for c and d   (RML)
    psi = phi                                                                          (ELS)
    w = B/F u, v = A y - w - d, e = y - phi' theta(t): with theta(t), the a-posteriori ones

    Ljung 1999, (4.33), (10.53), 11.4 and 11.5; METHODS 1.2 to 1.4.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

# -- what one row does to P --------------------------------------------------------------


def exponential(P, psi, lam=1.0):
    """Return the gain and the next P."""
    Ppsi = P @ psi
    s = lam + psi @ Ppsi
    return Ppsi / s, (P - outer(Ppsi) / s) / lam


def directional(P, psi, lam):
    """Return the gain and the next P, which forgets in the direction of psi alone."""
    Ppsi = P @ psi
    q = psi @ Ppsi
    if q == 0:
        return 0 * psi, P
    g = lam - (1 - lam) / q
    # by the matrix inversion lemma; 1 + g q = lam (1 + q) > 0
    return Ppsi / (1 + q), P - outer(Ppsi) * g / (1 + g * q)


def variable(P, psi, eps, sum0, lam_min=0.9):
    """Return the gain, the next P and lam, which keeps the weighted loss at sum0 = sigma^2 N0."""
    Ppsi = P @ psi
    q = psi @ Ppsi
    lam = min(max(1 - eps**2 / (1 + q) / sum0, lam_min), 1.0)  # 1 - psi' L = 1/(1 + q)
    return Ppsi / (1 + q), (P - outer(Ppsi) / (1 + q)) / lam, lam


def random_walk(P, psi, R1, R2=1.0):
    """Return the gain and the P of the next sample: theta(t+1) = theta(t) + w, Cov w = R1."""
    Ppsi = P @ psi
    s = R2 + psi @ Ppsi
    return Ppsi / s, P - outer(Ppsi) / s + R1


def outer(x):
    """Return x x', symmetric to the last bit: a difference in P would grow by 1/lam a sample."""
    return np.outer(x, x)


def growing(t, lam0=0.95, lam_inf=1.0, rho=0.99):
    """Return lam(t) = lam_inf - (lam_inf - lam0) rho^t, t = 0 at the first update; METHODS 1.2."""
    return lam_inf - (lam_inf - lam0) * rho**t


def least_squares(phi, y, P0, theta0=None, method="exponential", **settings):
    """Run the rows of phi (N, n); return theta (N, n), the last P, eps and lam (N)."""
    phi, y = np.asarray(phi), np.asarray(y)
    n = phi.shape[1]
    P = P0 * np.eye(n, dtype=phi.dtype) if np.ndim(P0) == 0 else np.array(P0)
    theta = np.zeros(n, phi.dtype) if theta0 is None else np.array(theta0, phi.dtype)
    path, errors, factors = np.zeros_like(phi), np.zeros_like(y), np.ones_like(y)
    for t, (row, target) in enumerate(zip(phi, y, strict=True)):
        eps = target - row @ theta
        if method == "variable":
            gain, P, factors[t] = variable(P, row, eps, **settings)
        else:
            gain, P = {
                "exponential": exponential,
                "directional": directional,
                "random walk": random_walk,
            }[method](P, row, **settings)
        theta = theta + gain * eps
        path[t], errors[t] = theta, eps
    return SimpleNamespace(theta=path, P=P, eps=errors, lam=factors)


# -- stability ---------------------------------------------------------------------------


def projected(c, before, limit=0.98, c2=0.95, radius=0.97):
    """Return c with the roots of 1 + c1 q^-1 + ... inside the circle; METHODS 1.2.

    One coefficient is cut to |c1| <= limit, two to |c2| <= 0.95 and |c1| <= limit (1 + c2);
    more go back towards `before` by halving the step until no root is beyond `radius`.
    """
    c = np.array(c)
    if len(c) == 1:
        return np.clip(c, -limit, limit)
    if len(c) == 2:
        c[1] = np.clip(c[1], -c2, c2)
        c[0] = np.clip(c[0], -limit * (1 + c[1]), limit * (1 + c[1]))
        return c
    step = c - before
    for _ in range(60):
        if len(c) == 0 or np.max(np.abs(np.roots(np.r_[1, c].astype(float)))) <= radius:
            return c
        step = step / 2
        c = before + step
    return np.array(before)


# -- scale, clipping, alarms -------------------------------------------------------------


@dataclass
class Guard:
    """Scale, clipping and two-sided CUSUM of innovations; METHODS 1.4.

    z = eps/(s sqrt(1 + q)) cut to +-clip; g+- = max(0, g+- +- z - drift), alarm when one
    exceeds the threshold, both then 0; s^2 <- s^2 + rate (min(eps^2/(1 + q), 9 s^2) - s^2),
    not at an alarm.
    """

    s2: float
    rate: float = 0.01
    clip: float = 6.0
    drift: float = 0.75
    threshold: float = 8.0
    up: float = 0.0
    down: float = 0.0

    def look(self, eps, q):
        """Return whether this innovation raises the alarm."""
        z = self.cut(eps, q) / np.sqrt(self.s2 * (1 + q))
        self.up = max(0.0, self.up + z - self.drift)
        self.down = max(0.0, self.down - z - self.drift)
        alarm = max(self.up, self.down) > self.threshold
        if alarm:
            self.up = self.down = 0.0
        else:
            self.s2 += self.rate * (min(eps**2 / (1 + q), 9 * self.s2) - self.s2)
        return bool(alarm)

    def cut(self, eps, q):
        """Return eps within +-clip standard deviations."""
        bound = self.clip * np.sqrt(self.s2 * (1 + q))
        return min(max(eps, -bound), bound)


# -- the family --------------------------------------------------------------------------


class PredictionError:
    """RML (`method="rml"`) or ELS (`"els"`) for the orders of `pem.orders`, one input.

    u and y are taken less their first values (`centred=False`: as they are), and learning
    begins at the sample at which all lags exist (`first=0`: at once, with zeros before).
    `lam` is a number or a function of the number of updates done; `R1` makes a random walk
    of theta, with lam in the place of R2.  `guard` cuts innovations, and adds `bump` to the
    variance of the offset at an alarm, before that sample is learnt; with `cut_residual=True`
    the residual in phi is cut to +-clip s too.
    Entries of psi of higher lag are filtered anew with theta(t-1), (3.7-10); with
    `shifted=True` they are those of the sample before, moved by one; Ljung & Soderstrom 1983.
    """

    def __init__(
        self,
        model,
        P0,
        theta0=None,
        *,
        lam=1.0,
        R1=None,
        method="rml",
        offset=True,
        centred=True,
        first=None,
        shifted=False,
        limits=(0.98, 0.999),
        guard=None,
        bump=1e3,
        cut_residual=False,
        dtype=float,
    ):
        (nb,), (self.nk,), (nf,) = model.nb, model.nk, model.nf
        self.sizes = [model.na, nb, model.nc, model.nd, nf, int(offset)]
        self.at = np.cumsum([0, *self.sizes])
        n = self.at[-1]
        self.theta = np.zeros(n, dtype) if theta0 is None else np.array(theta0, dtype)
        self.P = (P0 * np.eye(n) if np.ndim(P0) == 0 else np.array(P0)).astype(dtype)
        self.lam = lam if callable(lam) else (lambda t: lam)
        self.R1, self.method, self.shifted, self.limits = R1, method, shifted, limits
        self.guard, self.bump, self.cut_residual = guard, bump, cut_residual
        self.centred, self.first = centred, model.history if first is None else first
        self.dtype, self.origin, self.samples, self.updates = dtype, None, 0, 0
        # what lies 1, 2, ... samples back
        self.u, self.y, self.e, self.v, self.w = (
            np.zeros(k, dtype)
            for k in (self.nk + nb, model.na, model.nc, max(model.nd, 1), max(nf, 1))
        )
        back = max(model.nc, model.nd, nf, 1)
        self.phi, self.half, self.psi = (np.zeros((back, n), dtype) for _ in range(3))

    def part(self, i):
        """Return where a, b, c, d, f, offset (i = 0 ... 5) stand in theta."""
        return slice(self.at[i], self.at[i + 1])

    def step(self, u, y):
        """Take u(t) and y(t); return eps(t), nan while lags are missing, and the alarm."""
        if self.origin is None:
            self.origin = (u, y) if self.centred else (0.0, 0.0)
        u, y = self.dtype(u - self.origin[0]), self.dtype(y - self.origin[1])
        self.u = np.r_[u, self.u][: len(self.u)]  # u[0] is u(t)
        eps, alarm = np.nan, False
        if self.samples >= self.first:
            eps, alarm = self.learn(y)
        self.y = np.r_[y, self.y][: len(self.y)]
        self.samples += 1
        return eps, alarm

    def learn(self, y):
        phi = self.regressor()
        psi = phi if self.method == "els" else self.gradient(phi)
        eps = y - phi @ self.theta
        used, alarm = self.guarded(psi, eps)

        lam = self.lam(self.updates)
        if self.R1 is None:
            gain, self.P = exponential(self.P, psi, lam)
        else:
            gain, self.P = random_walk(self.P, psi, self.R1, lam)
        before = self.theta
        self.theta = before + gain * used
        for i, limit in ((2, self.limits[0]), (4, self.limits[1])):
            part = self.part(i)
            self.theta[part] = projected(self.theta[part], before[part], limit)

        self.remember(phi, y)
        self.updates += 1
        return eps, alarm

    def regressor(self):
        _, nb, _, nd, nf, offset = self.sizes
        past_u = self.u[self.nk : self.nk + nb]
        return np.r_[
            -self.y, past_u, self.e, -self.v[:nd], -self.w[:nf], np.ones(offset, self.dtype)
        ]

    def gradient(self, phi):
        """Filter phi by the polynomials of theta(t-1); (10.53)."""
        c, d, f = (self.theta[self.part(i)] for i in (2, 3, 4))
        dynamic = np.ones(len(phi), bool)
        dynamic[self.at[2] : self.at[4]] = False  # the parts of c and d know neither D nor F
        half = phi + np.where(dynamic, d @ self.phi[: len(d)], 0) - c @ self.half[: len(c)]
        with_F = np.zeros(len(phi), bool)
        with_F[self.part(1)] = with_F[self.part(4)] = True
        psi = half - np.where(with_F, f @ self.psi[: len(f)], 0)
        if self.shifted:
            for i in range(5):
                part = self.part(i)
                psi[part][1:] = self.psi[0][part][:-1]
                half[part][1:] = self.half[0][part][:-1]
        self.phi, self.half, self.psi = (
            np.vstack([new, old])[: len(old)]
            for new, old in ((phi, self.phi), (half, self.half), (psi, self.psi))
        )
        return psi

    def guarded(self, psi, eps):
        """Return the innovation to learn from, and the alarm."""
        if self.guard is None:
            return eps, False
        alarm = self.guard.look(eps, psi @ self.P @ psi)
        if alarm:
            self.P[-1, -1] += self.bump
        return self.guard.cut(eps, psi @ self.P @ psi), alarm

    def remember(self, phi, y):
        """Keep w, v and the residual of theta(t)."""
        a, b, _, _, f, offset = (self.part(i) for i in range(6))
        by = [part @ self.theta[at] for part, at in ((phi[a], a), (phi[b], b), (phi[f], f))]
        w = by[1] + by[2]
        v = y - by[0] - w - phi[offset] @ self.theta[offset]
        e = y - phi @ self.theta
        if self.cut_residual:
            e = self.guard.cut(e, 0.0)
        self.w, self.v = np.r_[w, self.w][: len(self.w)], np.r_[v, self.v][: len(self.v)]
        self.e = np.r_[e, self.e][: len(self.e)]

    def physical_offset(self):
        """Return O in y = B/(A F) u + O of the raw data; METHODS 1.1."""
        a, b, f = (self.theta[self.part(i)].sum() for i in (0, 1, 4))
        K = b / (1 + a) / (1 + f)
        u0, y0 = self.origin
        return y0 - K * u0 + self.theta[-1] / (1 + a)

    def first_order(self, Ts):
        """Return K, T, L of a first-order model with whole-sample delay; ERRATA 3.3."""
        pole = -(self.theta[self.part(0)].sum() + self.theta[self.part(4)].sum())
        b = self.theta[self.part(1)][0]
        T = -Ts / np.log(pole) if 0 < pole < 1 else np.nan
        return float(b / (1 - pole)), float(T), (self.nk - 1) * Ts


def run(estimator, u, y):
    """Step through a record; return theta (N, n), eps (N), alarms (rows)."""
    steps = []
    for pair in zip(u, y, strict=True):
        eps, alarm = estimator.step(*pair)
        steps.append((np.array(estimator.theta), eps, alarm))
    theta, eps, alarms = zip(*steps, strict=True)
    return SimpleNamespace(theta=np.array(theta), eps=np.array(eps), alarms=np.flatnonzero(alarms))
