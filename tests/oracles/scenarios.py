"""Seeded closed loops on which an auto-tuner is counted, and the true Ms of what it does.

plant       x(k+1) = a x + b1 u(k-m) + b2 u(k-m-1), y = x + O + noise, L = (m + f) Ts,
            a = e^(-Ts/T), b1 = K (1 - e^(-(Ts-f)/T)), b2 = K (1 - a) - b1     METHODS 1.5
controller  u(k) = u(k-1) + (Kp + Ki Ts) e(k) - Kp e(k-1) within low and high: the velocity
            form, so that new gains go on from where u is; ERRATA 3.1, (3.7-25)
Ms          max over the unit circle of |1/(1 + C H)|, C = Kp + Ki Ts/(1 - z^-1),
            H = z^-(m+1) (b1 + b2 z^-1)/(1 - a z^-1); infinite unless 1 + C H has all its
            roots inside

loop = Loop(random_plant(seed, events=[plant_change(30.0)]))
while not loop.done:
    t, r, u, y = loop.step((Kp, Ki))          # u acts from t on
    ...                                       # new Kp and Ki are in use from the next sample
    Ms(loop.plant, Kp, Ki, loop.scenario.Ts)  # of the plant as it is at t
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar


@dataclass(frozen=True)
class Plant:
    """K e^(-Ls)/(T s + 1) and its offset O."""

    K: float
    T: float
    L: float
    O: float = 0.0

    def held(self, Ts):
        """Return a, b1, b2, m for an input held over Ts."""
        m = int(np.floor(self.L / Ts + 1e-9))
        f = max(0.0, self.L - m * Ts)
        a = np.exp(-Ts / self.T)
        b1 = self.K * -np.expm1(-(Ts - f) / self.T)
        return a, b1, self.K * (1 - a) - b1, m


@dataclass(frozen=True)
class Event:
    """What happens from `t` (to `until`): "plant", "offset", "frozen" u or "stuck" y."""

    t: float
    kind: str
    gain: float = 1.0  # K times this
    delay: int = 0  # samples more
    offset: float = 0.0  # O plus this
    until: float = np.inf


def plant_change(t, gain=2.0, delay=3):
    """Return K times `gain` and L plus `delay` samples from t on; x goes on from where it is."""
    return Event(t, "plant", gain=gain, delay=delay)


def offset_step(t, by=-60.0):
    return Event(t, "offset", offset=by)


def frozen_input(t, until=np.inf):
    """Return a u that stays where it is; the sample tells the u that acts."""
    return Event(t, "frozen", until=until)


def stuck_sensor(t, until=np.inf):
    """Return a y that repeats its last value, noise included, while the plant goes on."""
    return Event(t, "stuck", until=until)


@dataclass(frozen=True)
class Scenario:
    """A loop at rest at `level`, its first PI, set-point PRBS after `wait` samples, and events."""

    plant: Plant
    Kp: float
    Ki: float
    Ts: float = 0.02
    seconds: float = 30.0
    level: float = 400.0
    amplitude: float = 50.0
    hold: tuple[int, int] = (10, 25)  # samples, drawn anew for each hold, both included
    wait: int = 1
    sd: float = 0.0  # of white noise on y
    low: float = -np.inf
    high: float = np.inf
    events: tuple[Event, ...] = ()
    seed: int = 0

    @property
    def rest(self):
        return (self.level - self.plant.O) / self.plant.K


def engine(seed=0, **changes):
    """Return source 001, 3.7.6c: the engine with offset and its first PI (Ms 1.30); u in %."""
    plant = Plant(-5.939, 0.1491, 0.1, 583.451)
    made = Scenario(plant, -0.018, -0.3385, low=0.0, high=100.0, seed=seed)
    return tuplified(made, changes)


def random_plant(seed, **changes):
    """Return a loop of either sign, offset and noise, as sluggish to begin with as the engine's.

    In units of Ts and of the set point's amplitude: T 4 to 25, L 2 to 10 whole samples, |K|
    0.2 to 20, O -20 to 20, noise 0 to 3 %, hold 0.8 to 1.6 (T + L), u within 6 A/|K| of rest.
    The first PI has 0.137 of Kp and 0.384 of Ki of IMC-PI with gain margin 3, as -0.018 and
    -0.3385 have for the engine: Ms 1.24 to 1.35.
    """
    rng = np.random.default_rng([seed, 5])
    Ts, A = 0.02, 50.0
    K = rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(np.log10(0.2), np.log10(20))
    T = Ts * 10 ** rng.uniform(np.log10(4), np.log10(25))
    L = Ts * int(rng.integers(2, 11))
    plant = Plant(K, T, L, A * rng.uniform(-20, 20))
    Kp = T / (K * 6 / np.pi * L)
    n = (T + L) / Ts
    made = Scenario(
        plant,
        0.137 * Kp,
        0.384 * Kp / T,
        Ts,
        amplitude=A,
        hold=(max(2, round(0.8 * n)), max(2, round(1.6 * n))),
        sd=A * 0.03 * rng.uniform(),
        seed=seed,
    )
    span = 6 * A / abs(K)
    return tuplified(replace(made, low=made.rest - span, high=made.rest + span), changes)


def tuplified(scenario, changes):
    """Return the scenario with changes; events may be any sequence."""
    if "events" in changes:
        changes = {**changes, "events": tuple(changes["events"])}
    return replace(scenario, **changes)


class Loop:
    """A scenario as it runs: `step` until `done`; `plant` is the true one at the last sample."""

    def __init__(self, scenario):
        s = self.scenario = scenario
        self.N = round(s.seconds / s.Ts)
        draws = [np.random.default_rng([s.seed, i]) for i in (1, 2)]
        self.r = self.prbs(draws[0])
        self.noise = s.sd * draws[1].normal(size=self.N)
        self.plant, self.k = s.plant, 0
        self.u = [s.rest] * 256  # u[j] is the input of j + 1 samples ago
        self.x = s.plant.K * s.rest
        self.e, self.y_told = 0.0, s.level

    def prbs(self, rng):
        s, r = self.scenario, np.full(self.N, self.scenario.level)
        k = s.wait
        while k < self.N:
            n = rng.integers(s.hold[0], s.hold[1] + 1)
            r[k : k + n] = s.level + s.amplitude * rng.choice([-1.0, 1.0])
            k += n
        return r

    @property
    def done(self):
        return self.k >= self.N

    def at(self, kind):
        """Return whether an event of that kind is on."""
        t = self.k * self.scenario.Ts + 1e-9
        return any(e.kind == kind and e.t <= t < e.until for e in self.scenario.events)

    def step(self, pid=None):
        """Return t, r, u, y of the next sample under pid = (Kp, Ki), or an object that has them."""
        s, k = self.scenario, self.k
        Kp, Ki = gains(s if pid is None else pid)
        for event in s.events:
            if k == int(np.ceil(event.t / s.Ts - 1e-9)):
                self.plant = after(self.plant, event, s.Ts)
        y = self.x + self.plant.O + self.noise[k]
        y = self.y_told = self.y_told if self.at("stuck") else y
        e = self.r[k] - y
        u = min(max(self.u[0] + (Kp + Ki * s.Ts) * e - Kp * self.e, s.low), s.high)
        u = self.u[0] if self.at("frozen") else u
        self.e, self.u = e, [u, *self.u[:-1]]
        a, b1, b2, m = self.plant.held(s.Ts)
        self.x = a * self.x + b1 * self.u[m] + b2 * self.u[m + 1]
        self.k += 1
        return k * s.Ts, float(self.r[k]), float(u), float(y)


def gains(pid):
    return (pid.Kp, pid.Ki) if hasattr(pid, "Kp") else pid


def after(plant, event, Ts):
    """Return the plant after an event."""
    return Plant(plant.K * event.gain, plant.T, plant.L + event.delay * Ts, plant.O + event.offset)


# -- the true loop -----------------------------------------------------------------------


def characteristic(plant, Kp, Ki, Ts):
    """Return the polynomial in z whose roots are those of 1 + C H = 0."""
    a, b1, b2, m = plant.held(Ts)
    den = np.polymul([1, -a], [1, -1])
    num = np.polymul([b1, b2], [Kp + Ki * Ts, -Kp])
    # in z^-1: den + z^-(m+1) num, of degree m + 3
    p = np.zeros(m + 4)
    p[:3] += den
    p[m + 1 :] += num
    return np.trim_zeros(p, "b")


def stable(plant, Kp, Ki, Ts):
    """Return whether all roots lie inside the unit circle: no integral action is no loop."""
    return bool(np.max(np.abs(np.roots(characteristic(plant, Kp, Ki, Ts)))) < 1 - 1e-12)


def sensitivity(plant, Kp, Ki, Ts, w):
    """Return |1/(1 + C H)| at the frequencies w (rad/s)."""
    a, b1, b2, m = plant.held(Ts)
    q = np.exp(-1j * np.asarray(w) * Ts)
    H = q ** (m + 1) * (b1 + b2 * q) / (1 - a * q)
    return np.abs(1 / (1 + (Kp + Ki * Ts / (1 - q)) * H))


def Ms(plant, Kp, Ki, Ts, points=2000):
    """Return the largest sensitivity of the sampled loop, infinite if it is not stable."""
    if not stable(plant, Kp, Ki, Ts):
        return np.inf
    w = np.linspace(0, np.pi / Ts, points + 1)[1:]
    # narrow peaks stand at roots close to the circle: look there as well
    roots = np.roots(characteristic(plant, Kp, Ki, Ts))
    w = np.unique(np.r_[w, np.abs(np.angle(roots[np.abs(roots) > 0.5])) / Ts, 1e-3 / Ts])
    w = w[w > 0]
    S = sensitivity(plant, Kp, Ki, Ts, w)
    i = int(np.argmax(S))
    around = w[max(i - 1, 0)], w[min(i + 1, len(w) - 1)]
    peak = minimize_scalar(
        lambda x: -sensitivity(plant, Kp, Ki, Ts, x),
        bounds=around,
        method="bounded",
        options={"xatol": 1e-10 * w[-1]},
    )
    return float(max(S[i], -peak.fun))
