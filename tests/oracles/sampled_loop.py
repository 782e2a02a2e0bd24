"""A sampled PID on an exactly held plant, one sample after the other.

At t[k] = k Ts: y[k] is read, u[k] is computed and acts from t[k] to t[k+1].

    plant        x' = A x + B v(t - L), y = C x + D v(t - L) + O, v = actuator position + load;
                 any L >= 0, exact by exp of the augmented matrix (C. Van Loan, IEEE TAC 23, 1978)
    controller   e = r - y_f, P = Kp (b r - y_f), D on c r - y_f, I in units of u,
                 backward Euler: s -> (1 - q^-1)/Ts          (DESIGN 3, `PID`)
        "d1"     y_f = y, D (1 + Tf s) = Kp Td s (c r - y)
        "y2"     y_f (1 + Tf s + (Tf s)^2/2) = y, D = Kp Td s (c r - y_f)
    limits       low <= u <= high and |u[k] - u[k-1]| <= rate Ts, both at once
    anti-windup  candidate I' = I + Ki Ts e, v = P + I' + D, u = v within the limits;
        "clamp"  I' is kept if u == v, or if Ki e does not drive v further out; else I stays
                 and u = P + I + D within the limits
        "back"   I = I' + Ts/Tt (u - v)
        None     I = I'
    manual       u is the given value within the limits, and I = u - P - D
    new settings I takes the jump of P at the last sample, so that u would not have moved there
                 (with P alone: source 001, (3.7-25) as corrected, is the same thing); the
                 derivative's state is kept

Plants that vary go by source 001, (3.7-20) to (3.7-23) as corrected: `Varying`.
"""

from dataclasses import dataclass, replace
from itertools import product
from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm

from oracles.rational import state_space


@dataclass(frozen=True)
class Pid:
    """Settings of the standard form; Ki = Kp/Ti unless given (Kp = 0), Tf = 0 is no filter."""

    Kp: float
    Ti: float = np.inf
    Td: float = 0.0
    Tf: float = 0.0
    b: float = 1.0
    c: float = 0.0
    filter: str = "d1"
    integral: float | None = None

    @property
    def Ki(self):
        return self.Kp / self.Ti if self.integral is None else self.integral

    @property
    def Kd(self):
        return self.Kp * self.Td


# -- plants ------------------------------------------------------------------------------


class Plant:
    """A rational plant num/den e^(-Ls) + offset, sampled exactly; at rest at input `before`.

    L = (m + f) Ts: from t[k] to t[k] + f Ts the input of m + 1 samples ago acts, then the one
    of m samples ago.  y[k] is read just before a jump at t[k], which matters with D alone.
    The state counts time in samples, which keeps the matrices small.
    """

    def __init__(self, num, den, L, Ts, offset=0.0, before=0.0):
        num, den = (np.atleast_1d(p) / Ts ** np.arange(np.size(p))[::-1] for p in (num, den))
        self.A, self.B, self.C, self.D = state_space(num, den)
        self.n, self.Ts, self.L, self.offset = len(self.A), Ts, L, offset
        self.m = int(np.floor(L / Ts + 1e-9))
        self.f = max(0.0, L / Ts - self.m)
        self.f = 0.0 if self.f < 1e-9 else self.f
        self.past = [before] * (self.m + 2)  # past[j]: the input of j samples before the next
        self.x = np.zeros(self.n)
        if before and self.n:
            self.x = -np.linalg.solve(self.A, self.B[:, 0]) * before
        self.early, self.late = self._hold(self.f), self._hold(1 - self.f)

    def _hold(self, t):
        """Return exp(A t) and the integral of exp(A s) B over [0, t]."""
        M = np.zeros((self.n + 1, self.n + 1))
        M[: self.n, : self.n], M[: self.n, self.n] = self.A, self.B[:, 0]
        E = expm(M * t)
        return E[: self.n, : self.n], E[: self.n, self.n]

    def output(self):
        """Return y at the present sample, the newest input not yet known."""
        # y(t-) = C x + D v(t- - L): the input m + 1 samples before, when f = 0 too
        return float(self.C[0] @ self.x + self.D[0, 0] * self.past[self.m]) + self.offset

    def advance(self, v):
        """Apply v from now on and go to the next sample."""
        self.past = [v, *self.past[:-1]]
        for (F, G), old in ((self.early, self.past[self.m + 1]), (self.late, self.past[self.m])):
            self.x = F @ self.x + G * old

    def between(self, x, past, tau):
        """Return y at tau in (0, Ts] after a sample with state x; past[0] acts from there on."""
        tau = tau / self.Ts
        first = min(tau, self.f)
        for (F, G), old in (
            (self._hold(first), past[self.m + 1]),
            (self._hold(tau - first), past[self.m]),
        ):
            x = F @ x + G * old
        direct = past[self.m + 1] if tau <= self.f else past[self.m]
        return float(self.C[0] @ x + self.D[0, 0] * direct) + self.offset


class Varying:
    """First order with K, T, L (whole samples), O of each sample; (3.7-20) to (3.7-23).

    a1 = e^(-Ts/T(k)), yD(k) = a1 yD(k-1) + K(k)(1 - a1) u(k - 1 - L(k)), y = yD + O(k):
    ERRATA 3.1 puts in the -1.  Numbers or arrays over k; u before the start is `before`.
    """

    def __init__(self, K, T, L, O, Ts, N, before=0.0):
        self.K, self.T, self.L, self.O = (np.broadcast_to(v, N) for v in (K, T, L, O))
        self.Ts, self.u, self.before, self.k = Ts, [], before, 0
        self.yD = float(self.K[0]) * before

    def output(self):
        return self.yD + float(self.O[self.k])

    def advance(self, v):
        self.u.append(v)
        self.k += 1
        k = min(self.k, len(self.K) - 1)
        a1 = np.exp(-self.Ts / self.T[k])
        i = self.k - 1 - int(self.L[k])
        self.yD = a1 * self.yD + self.K[k] * (1 - a1) * (self.u[i] if i >= 0 else self.before)


# -- gain schedules ----------------------------------------------------------------------


def lookup(axes, table, point):
    """Return the table's value at `point` by multilinear interpolation, held beyond the edges.

    `axes`: one ascending array per signal (one to three), `table` of that shape; 001, 3.7.6.
    """
    corners = []
    for axis, x in zip(axes, np.atleast_1d(point), strict=True):
        axis = np.asarray(axis, float)
        x = min(max(x, axis[0]), axis[-1])
        i = min(max(int(np.searchsorted(axis, x, side="right")) - 1, 0), max(len(axis) - 2, 0))
        if len(axis) == 1:
            corners.append([(0, 1.0)])
            continue
        share = (x - axis[i]) / (axis[i + 1] - axis[i])
        corners.append([(i, 1 - share), (i + 1, share)])
    total = 0.0
    for corner in product(*corners):
        index = tuple(i for i, _ in corner)
        total += float(np.prod([share for _, share in corner])) * float(np.asarray(table)[index])
    return total


def scheduled(pid, axes, tables, signals):
    """Return the settings of every sample: `tables` maps fields of Pid to tables.

    `signals` (N, number of axes) are the operating-point signals.
    """
    return [
        replace(pid, **{name: lookup(axes, table, point) for name, table in tables.items()})
        for point in np.asarray(signals, float)
    ]


# -- the loop ----------------------------------------------------------------------------


def run(
    plant,
    pid,
    Ts,
    r,
    *,
    d=0.0,
    noise=0.0,
    low=-np.inf,
    high=np.inf,
    rate=np.inf,
    antiwindup="clamp",
    Tt=None,
    manual=None,
    dead_band=0.0,
    quantum_u=0.0,
    quantum_y=0.0,
    r_before=0.0,
    u_before=0.0,
):
    """Run len(r) samples; return t, r, y, ym, u, v, position, P, I, D, and y between samples.

    `pid`: one Pid, or a list of one per sample (a schedule, new settings).  `d` load on the
    plant's input, `noise` on the measurement, `manual` (N,) with nan where automatic.  `v` is
    what the controller would like, `u` after the limits (and quantisation), `position` what
    reaches the plant before the load.  Before the start the loop is at rest at `r_before`,
    `u_before` and the plant's own output.  Numbers are taken for all samples.
    """
    N = len(r)
    r, d, noise = (np.broadcast_to(np.asarray(v, float), N) for v in (r, d, noise))
    manual = np.full(N, np.nan) if manual is None else np.asarray(manual, float)
    settings = [pid] * N if isinstance(pid, Pid) else list(pid)

    y0 = quantise(plant.output(), quantum_y)
    p = settings[0]
    yf = [y0, y0]  # filtered output of the last two samples
    r_old, D = r_before, 0.0
    I = u_before - p.Kp * (p.b * r_before - y0)
    u_old = position = u_before
    log = {name: np.zeros(N) for name in ("y", "ym", "u", "v", "position", "P", "I", "D")}
    states = []

    for k in range(N):
        y = plant.output()
        ym = quantise(y + noise[k], quantum_y)
        if settings[k] != p:  # bumpless: P + I as it was for the last r and y
            new = settings[k]
            I += p.Kp * (p.b * r_old - yf[0]) - new.Kp * (new.b * r_old - yf[0])
            p = new

        if p.filter == "y2":
            a = p.Tf / Ts
            now = (ym + (a + a**2) * yf[0] - a**2 / 2 * yf[1]) / (1 + a + a**2 / 2)
            D = p.Kd * ((p.c * r[k] - now) - (p.c * r_old - yf[0])) / Ts
        else:
            now = ym
            step = (p.c * r[k] - now) - (p.c * r_old - yf[0])
            D = (p.Tf * D + p.Kd * step) / (p.Tf + Ts)
        P = p.Kp * (p.b * r[k] - now)
        e = r[k] - now

        bottom, top = max(low, u_old - rate * Ts), min(high, u_old + rate * Ts)

        def within(value, bottom=bottom, top=top):
            return min(max(value, bottom), top)

        if np.isnan(manual[k]):
            candidate = I + p.Ki * Ts * e
            v = P + candidate + D
            u = within(v)
            if antiwindup == "clamp":
                drives = p.Ki * e
                if u == v or not ((v > top and drives > 0) or (v < bottom and drives < 0)):
                    I = candidate
                else:
                    u = within(P + I + D)
            elif antiwindup == "back":
                I = candidate + Ts / Tt * (u - v)
            else:
                I = candidate
        else:
            v = manual[k]
            u = within(v)
            I = u - P - D
        u_old = u
        u = quantise(u, quantum_u)
        if abs(u - position) > dead_band:
            position = u

        for name, value in zip(log, (y, ym, u, v, position, P, I, D), strict=True):
            log[name][k] = value
        states.append((getattr(plant, "x", None), [position + d[k], *getattr(plant, "past", [])]))
        plant.advance(position + d[k])
        yf, r_old = [now, yf[0]], r[k]

    def at(t):
        """Return the true output at the times t, between samples too (`Plant` only)."""
        out = []
        for time in np.atleast_1d(t):
            k = min(max(int(np.ceil(time / Ts - 1e-9)) - 1, 0), N - 1)
            tau = time - k * Ts
            out.append(log["y"][0] if tau <= 0 else plant.between(*states[k], tau))
        return np.array(out)

    return SimpleNamespace(t=Ts * np.arange(N), r=r, at=at, **log)


def quantise(x, quantum):
    """Return x rounded to whole quanta (ties to even), x itself for quantum 0."""
    return float(quantum * np.round(x / quantum)) if quantum else x
