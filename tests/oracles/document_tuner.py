"""The auto-tuner of source 001, 3.7, in its own simulated loop: what ours is compared with.

Figure 3.7-1, each sample:
    read r, u, y                   plant (3.7-20) to (3.7-23), PI (3.7-24), (3.7-25), as corrected
    filter u and y                 Butterworth band-pass of order 5, 1 to 20 rad/s; (3.7-6)
    identify                       one ARMAX(1, 1, 1) by RML for each delay, no offset parameter,
                                   forgetting 0.995; (3.7-7) to (3.7-13)
    choose the delay               figure 3.7-4, `DelayChoice`
    classify                       figure 3.7-5, `Classifier`
    merge                          (3.7-14) to (3.7-19)
    retune                         IMC-PI, Kp = T/(K (T_F + L)), Ki = Kp/T, T_F = (2 A_m/pi - 1) L

ERRATA 3.1, 3.3 and 3.4 correct the equations.  Left open by the text and set here:
    delays                         0.05 to 0.2 s in whole samples, the middle one to begin with
    counters                       up and down count samples at which the least accumulated and
                                   the least present error both lie beyond the delay in use, in
                                   a row; at 5 the delay goes one sample that way
    limits                         a third to three times |K| = 6, 0.05 to 0.6 s for T
    standard deviation             2 % of K and of T, a tenth of a sample for L
    rate of merging                C_AR = 0.5; no nominal model
    start of the recursion         theta = 0, P = 1e4 I, |c| <= 0.98

A filter that starts "steady" must see the loop at rest first: the sample at which the set point
first moves has moved u already, by (Kp + Ki Ts) times the step.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi


@dataclass(frozen=True)
class Settings:
    """All that can be set; times in seconds."""

    K: float = -5.939  # the plant
    T: float = 0.1491
    L: float = 0.1
    O: float = 0.0
    Kp: float = -0.018  # the controller to begin with
    Ki: float = -0.3385
    Ts: float = 0.02
    start: str = "zero"  # plant and controller at "zero", or at "rest" at `level`
    level: float = 400.0
    filter: str = "zero"  # state of the filter: "zero", "steady" at the first sample, "none"
    opens: float = 0.0  # when the bank begins to learn
    lam: float = 0.995
    forgets: bool = True  # False: (3.7-11) as printed, without 1/lam
    delays: tuple[float, float] = (0.05, 0.2)
    window: float = 1.0
    hysteresis: int = 5
    K_limits: tuple[float, float] = (-18.0, -2.0)
    T_limits: tuple[float, float] = (0.05, 0.6)
    sd_limits: tuple[float, float, float] = (0.02, 0.02, 0.1)  # of K, of T, of Ts
    C_AR: float = 0.5
    gain_margin: float = 3.0
    retune: bool = True


def run(r, settings=None, noise=0.0):
    """Run the loop over r; return t, r, u, y, K, T, L, Kp, Ki (N) and the rows `accepted`.

    K, T, L are the merged estimates, nan before the first; `chosen` (N, 3) those of the model
    of the delay in use; Kp and Ki those that made u.  `noise` is added to y.
    """
    s = settings or Settings()
    N = len(r)
    noise = np.broadcast_to(noise, N)
    loop = Loop(s)
    filters = [BandPass(s), BandPass(s)]
    bank = Bank(s)
    delay, classifier, merged = DelayChoice(s, len(bank.nk)), Classifier(s), None
    log = {name: np.full(N, np.nan) for name in ("u", "y", "K", "T", "L", "Kp", "Ki")}
    chosen, accepted = np.full((N, 3), np.nan), []

    for k in range(N):
        log["Kp"][k], log["Ki"][k] = loop.Kp, loop.Ki
        u, y = loop.step(r[k], noise[k])
        log["u"][k], log["y"][k] = u, y
        uf, yf = filters[0](u), filters[1](y)
        bank.remember(uf)
        if k >= round(s.opens / s.Ts):
            error = bank.learn(yf)
            chosen[k] = bank.model(delay.step(error**2))
            mean = classifier.step(chosen[k])
            if mean is not None:
                accepted.append(k)
                merged = mean if merged is None else merged * (1 - s.C_AR) + mean * s.C_AR
                if s.retune:
                    loop.Kp, loop.Ki = imc_pi(*merged, s.gain_margin)
        bank.y_old = yf
        if merged is not None:
            log["K"][k], log["T"][k], log["L"][k] = merged

    return SimpleNamespace(
        t=s.Ts * np.arange(N),
        r=np.asarray(r),
        chosen=chosen,
        accepted=np.array(accepted, int),
        **log,
    )


def imc_pi(K, T, L, gain_margin):
    """Return Kp and Ki; source 001, (3.6-18), (3.6-19) and (3.6-41)."""
    Kp = T / (K * 2 * gain_margin / np.pi * L)  # T_F + L = 2 A_m/pi L
    return Kp, Kp / T


class Loop:
    """The simulated plant and PI controller; the gains can be set between samples."""

    def __init__(self, s):
        self.s, self.Kp, self.Ki = s, s.Kp, s.Ki
        self.a, self.nk = np.exp(-s.Ts / s.T), round(s.L / s.Ts) + 1
        rest = (s.level - s.O) / s.K if s.start == "rest" else 0.0
        self.u, self.yD, self.e = [rest] * self.nk, s.K * rest, 0.0

    def step(self, r, noise=0.0):
        """Return u and y; u goes on from where it is, whatever the gains were."""
        y = self.yD + self.s.O + noise
        e = r - y
        u = self.u[0] + (self.Kp + self.Ki * self.s.Ts) * e - self.Kp * self.e
        self.e, self.u = e, [u, *self.u[:-1]]
        self.yD = self.a * self.yD + self.s.K * (1 - self.a) * self.u[-1]
        return u, y


class BandPass:
    """Second-order sections of the filter of (3.7-6), 1 to 20 rad/s."""

    def __init__(self, s):
        nyquist = np.pi / s.Ts
        self.sos = butter(5, [1 / nyquist, 20 / nyquist], "bandpass", output="sos")
        self.how, self.state = s.filter, None

    def __call__(self, x):
        if self.how == "none":
            return x
        if self.state is None:
            self.state = sosfilt_zi(self.sos) * (x if self.how == "steady" else 0.0)
        out, self.state = sosfilt(self.sos, [x], zi=self.state)
        return out[0]


class Bank:
    """RML of y = -a y(t-1) + b u(t-nk) + c e(t-1) + e for all nk at once; (3.7-7) to (3.7-11).

    The first axis of all arrays is the delay; theta = [a, b, c].
    """

    def __init__(self, s):
        first, last = (int(f(t / s.Ts)) for f, t in zip((np.ceil, np.floor), s.delays, strict=True))
        self.nk = np.arange(first, last + 1) + 1
        m = len(self.nk)
        self.lam, self.Ts, self.growth = s.lam, s.Ts, 1 / s.lam if s.forgets else 1.0
        self.theta, self.psi, self.e = np.zeros((m, 3)), np.zeros((m, 3)), np.zeros(m)
        self.P = np.tile(1e4 * np.eye(3), (m, 1, 1))
        self.u, self.y_old = np.zeros(self.nk[-1] + 1), 0.0

    def remember(self, u):
        """Take u(t); u[k] is u(t-k)."""
        self.u = np.r_[u, self.u[:-1]]

    def learn(self, y):
        """Return the prediction error of every delay."""
        phi = np.column_stack([np.full(len(self.nk), -self.y_old), self.u[self.nk], self.e])
        self.psi = phi - self.theta[:, 2:] * self.psi
        error = y - np.sum(phi * self.theta, axis=1)
        g = np.einsum("mij,mj->mi", self.P, self.psi)
        q = self.lam + np.sum(self.psi * g, axis=1)
        self.theta = self.theta + g * (error / q)[:, None]
        self.theta[:, 2] = np.clip(self.theta[:, 2], -0.98, 0.98)
        self.P = (self.P - g[:, :, None] * g[:, None, :] / q[:, None, None]) * self.growth
        self.e = y - np.sum(phi * self.theta, axis=1)
        return error

    def model(self, j):
        """Return K, T, L of one delay, nan where the pole is no decay; ERRATA 3.3."""
        a, b, _ = self.theta[j]
        T = -self.Ts / np.log(-a) if -1 < a < 0 else np.nan
        return np.array([b / (1 + a) if a != -1 else np.nan, T, (self.nk[j] - 1) * self.Ts])


class DelayChoice:
    """Figure 3.7-4: moving window, a pair of counters, hysteresis; a delay moves by one sample."""

    def __init__(self, s, m):
        self.errors = np.zeros((round(s.window / s.Ts), m))  # of the window, in a ring
        self.hysteresis, self.used, self.up, self.down, self.k = s.hysteresis, m // 2, 0, 0, 0

    def step(self, squared):
        """Take the squared prediction errors of all delays; return the index in use."""
        self.errors[self.k % len(self.errors)] = squared
        self.k += 1
        least = np.argmin(squared), np.argmin(self.errors.sum(axis=0))
        self.up = self.up + 1 if min(least) > self.used else 0
        self.down = self.down + 1 if max(least) < self.used else 0
        if self.up >= self.hysteresis:
            self.used, self.up = self.used + 1, 0
        elif self.down >= self.hysteresis:
            self.used, self.down = self.used - 1, 0
        return self.used


class Classifier:
    """Figure 3.7-5: limits, standard deviation over the moving window, mean."""

    def __init__(self, s):
        self.s, self.k = s, 0
        self.window = np.full((round(s.window / s.Ts), 3), np.nan)  # in a ring, nan: none within

    def step(self, model):
        """Take K, T, L; return their mean over the window if they are accepted, else None."""
        s, (K, T, _) = self.s, model
        within = s.K_limits[0] <= K <= s.K_limits[1] and s.T_limits[0] <= T <= s.T_limits[1]
        self.window[self.k % len(self.window)] = model if within else np.nan
        self.k += 1
        if np.isnan(self.window).any():
            return None
        mean, sd = self.window.mean(axis=0), self.window.std(axis=0)
        scale = np.array([abs(mean[0]), mean[1], s.Ts])
        return mean if np.all(sd <= s.sd_limits * scale) else None
