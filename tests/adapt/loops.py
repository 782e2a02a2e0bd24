"""The auto-tuner at work in a loop of `oracles.scenarios`, and what came of it sample by sample."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import plantune as pt
from oracles import scenarios
from plantune.adapt import AutoTuner, Sample, Settings
from plantune.models import PID


def asked(scenario, **changes):
    """Return the settings of a user who knows of the plant what a user knows.

    Delays within 4 samples of the true one, the first controller, and the limits of u.
    """
    nk = round(scenario.plant.L / scenario.Ts) + 1
    pid = PID(Kp=scenario.Kp, Ti=scenario.Kp / scenario.Ki, Ts=scenario.Ts)
    own = {"nk": (max(1, nk - 4), nk + 6), "u_limits": (scenario.low, scenario.high)}
    return Settings(Ts=scenario.Ts, controller=pid, **{**own, **changes})


@dataclass(eq=False)
class Run:
    """Decisions of all samples, and the true plant at each."""

    scenario: scenarios.Scenario
    decisions: list
    plants: list
    signals: np.ndarray  # (N, 4): t, r, u, y

    @cached_property
    def t(self):
        return self.signals[:, 0]

    @cached_property
    def first_move(self):
        """Time of the first move of the set point."""
        return self.t[np.flatnonzero(self.signals[:, 1] != self.scenario.level)[0]]

    @cached_property
    def models(self):
        """K, T, L as shown at each sample, nan before the first."""
        nan = (np.nan,) * 3
        return np.array(
            [nan if d.model is None else (d.model.K, d.model.T, d.model.L) for d in self.decisions]
        )

    @cached_property
    def true(self):
        """K, T, L as they are at each sample."""
        return np.array([(p.K, p.T, p.L) for p in self.plants])

    def rows(self, name):
        """Rows at which a flag of the decision is set."""
        return np.flatnonzero([getattr(d, name) for d in self.decisions])

    @cached_property
    def retunings(self):
        """Row, Ms on the true plant before, and after, of each change of the settings."""
        found = []
        for k in self.rows("retuned"):
            before = self.decisions[k - 1].controller
            after = self.decisions[k].controller
            at = [
                scenarios.Ms(self.plants[k], c.Kp, c.Ki, self.scenario.Ts) for c in (before, after)
            ]
            found.append((k, *at))
        return found

    def Ms_at(self, k):
        """Ms of the settings in use after sample k on the plant as it is at k."""
        c = self.decisions[k].controller
        return scenarios.Ms(self.plants[k], c.Kp, c.Ki, self.scenario.Ts)


def live(scenario, settings):
    """Run the loop with the settings that the tuner decides."""
    loop, tuner, pid = scenarios.Loop(scenario), AutoTuner(settings), settings.controller
    decisions, plants, signals = [], [], []
    while not loop.done:
        now = loop.step(pid)
        decision = tuner.step(Sample(*now))
        pid = decision.controller
        decisions.append(decision)
        plants.append(loop.plant)
        signals.append(now)
    return Run(scenario, decisions, plants, np.array(signals))


def replayed(scenario, settings):
    """Return the log over the loop as its first controller holds it."""
    loop, rows = scenarios.Loop(scenario), []
    while not loop.done:
        rows.append(loop.step())
    _, r, u, y = np.array(rows).T
    return pt.adapt.replay(pt.Record(u=u, y=y, r=r, Ts=scenario.Ts), settings)


def lasting(good):
    """Return the first row from which on all are good; the length if the last is not."""
    bad = np.flatnonzero(~np.asarray(good))
    return 0 if len(bad) == 0 else int(bad[-1]) + 1
