"""The limit cycle of K e^(-Ls)/(Ts + 1) under an asymmetric relay; METHODS 3.4.

The relay works on y - y_ref turned by the sign of K: u = bias + d1 ("on") until
sign(K) (y - y_ref) rises to h, then u = bias - d2 until it falls to -h.  y_ref is the output
at rest under the bias.  With x = (y - y_ref)/K, h' = h/|K|, the cycle is

    x rises to h'; u switches; x rises for L more towards d1, then falls towards -d2; and so on

    t_on  = T ln[(h' - d2 + e^(L/T) (d1 + d2)) / (d1 - h')]
    t_off = T ln[(h' - d1 + e^(L/T) (d1 + d2)) / (d2 - h')]

Both are longer than L, so never is more than one switch under way.  A cycle needs h' < d1, d2.
Own derivation; Berner, Hagglund & Astrom, Control Eng. Practice 2016, treat the same experiment.
"""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq


def times(K, T, L, d1, d2, h=0.0):
    """Return t_on and t_off of the limit cycle; METHODS 3.4."""
    hk, grown = h / abs(K), np.exp(L / T) * (d1 + d2)
    return T * np.log((hk - d2 + grown) / (d1 - hk)), T * np.log((hk - d1 + grown) / (d2 - hk))


def gain(t_on, t_off, y_mean, d1, d2):
    """Return K from the means over one period: of y - y_ref, and of u - bias; METHODS 3.4."""
    return y_mean * (t_on + t_off) / (d1 * t_on - d2 * t_off)


def mean(K, T, L, d1, d2, h=0.0):
    """Return the mean of y - y_ref over one period: K times that of u - bias."""
    t_on, t_off = times(K, T, L, d1, d2, h)
    return K * (d1 * t_on - d2 * t_off) / (t_on + t_off)


def extremes(K, T, L, d1, d2, h=0.0):
    """Return the least and the largest y - y_ref of the limit cycle."""
    hk, a = h / abs(K), np.exp(-L / T)
    ends = K * (d1 + (hk - d1) * a), K * (-d2 + (d2 - hk) * a)
    return min(ends), max(ends)


def invert(t_on, t_off, K, d1, d2, h=0.0):
    """Return T and L from the times of a cycle and a known K; METHODS 3.4.

    The difference of the two equations, free of L, is (d1 - h') e^(t_on/T) - (d2 - h')
    e^(t_off/T) = d1 - d2, solved for T by root finding; L follows.  d1 = d2 gives no T.
    """
    if d1 == d2:
        raise ValueError("d1 = d2: every T fits the two times")
    hk = h / abs(K)
    p, q = d1 - hk, d2 - hk
    # In x = 1/T a root at 0 and one more, the last.

    def f(x):
        longest = max(t_on, t_off)
        return (
            p * np.exp((t_on - longest) * x)
            - q * np.exp((t_off - longest) * x)
            - (d1 - d2) * np.exp(-longest * x)
        )

    grid = np.geomspace(1e-5, 700, 4000) / max(t_on, t_off)
    v = f(grid)
    k = np.flatnonzero(np.sign(v[:-1]) != np.sign(v[1:]))
    if len(k) == 0:
        raise ValueError("the two times do not determine T")
    x = brentq(f, grid[k[-1]], grid[k[-1] + 1], xtol=1e-16, rtol=1e-14)
    T = 1 / x
    return T, T * np.log((p * np.exp(t_on * x) + d2 - hk) / (d1 + d2))


class Experiment:
    """A relay from rest under the bias, switched on at t = 0, event by event in closed form.

    `switches` are (time, new u - bias); `y(t)`, `u(t)` hold at any time up to t_end.
    """

    def __init__(self, K, T, L, d1, d2, h=0.0, *, t_end, bias=0.0, y_ref=0.0):
        self.K, self.T, self.L, self.bias, self.y_ref = K, T, L, bias, y_ref
        hk = h / abs(K)
        self.switches = [(0.0, d1)]
        t = 0.0
        while t < t_end:
            t_s, level = self.switches[-1]
            # from t_s + L on the plant goes from x0 towards `level`
            x0 = self._x(t_s + L)
            target = hk if level > 0 else -hk
            t = t_s + L + T * np.log((level - x0) / (level - target))
            self.switches.append((t, -d2 if level > 0 else d1))
        self.t_end = t_end

    def _x(self, t):
        """Return (y - y_ref)/K at one time, a sum of step responses of the switches so far."""
        x, old = 0.0, 0.0
        for t_s, level in self.switches:
            if t_s + self.L < t:
                x += (level - old) * -np.expm1(-(t - t_s - self.L) / self.T)
            old = level
        return x

    def y(self, t):
        """Return the output at the times t."""
        return np.array([self.y_ref + self.K * self._x(v) for v in np.atleast_1d(t)])

    def u(self, t):
        """Return the plant's input at the times t (the new one at a switch)."""
        times, levels = np.array(self.switches).T
        k = np.searchsorted(times, np.atleast_1d(t), side="right") - 1
        return self.bias + np.where(k >= 0, levels[k], 0.0)

    def cycles(self):
        """Return arrays t_on and t_off of the whole half periods, in order."""
        gaps = np.array([(b[0] - a[0], a[1]) for a, b in pairwise(self.switches)])
        return gaps[gaps[:, 1] > 0, 0], gaps[gaps[:, 1] < 0, 0]

    def record(self, Ts):
        """Return t, u, y at the samples.  Switches fall between samples: u is the one at t[k].

        `share[k]` is the mean of u over [t[k], t[k+1]), for integrals that should be exact.
        """
        t = Ts * np.arange(int(self.t_end / Ts + 1e-9) + 1)
        edges = np.append(t, t[-1] + Ts)
        total = np.array([self._integral(v) for v in edges])
        return SimpleNamespace(t=t, u=self.u(t), y=self.y(t), share=self.bias + np.diff(total) / Ts)

    def _integral(self, t):
        out = 0.0
        for (t_s, level), (t_next, _) in pairwise([*self.switches, (np.inf, 0.0)]):
            out += level * max(0.0, min(t, t_next) - t_s)
        return out


def sampled(K, T, L, d1, d2, h=0.0, *, Ts, N, bias=0.0, y_ref=0.0, noise=None):
    """Return t, u, y of a relay that looks at the samples and holds u: an exact ZOH record.

    As a controller's task would do it; switches are up to Ts later than in `Experiment`.
    The relay sees y + noise, and so does the record.
    """
    from oracles.sampled_loop import Plant

    plant = Plant([K], [T, 1.0], L, Ts)
    noise = np.zeros(N) if noise is None else np.asarray(noise, float)
    t, u, y = Ts * np.arange(N), np.zeros(N), np.zeros(N)
    level = d1
    for k in range(N):
        y[k] = plant.output() + noise[k]
        turned = np.sign(K) * y[k]
        if level > 0 and turned > h:
            level = -d2
        elif level < 0 and turned < -h:
            level = d1
        u[k] = bias + level
        plant.advance(level)
    return SimpleNamespace(t=t, u=u, y=y_ref + y)
