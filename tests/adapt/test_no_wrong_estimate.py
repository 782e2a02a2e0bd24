"""Claim: no accepted estimate is wrong by a quarter in K, and every refusal says why.

Random plants with delays between samples, offsets and noise: white on the output, on the
equation, coloured, a drifting level, too little excitation, rare moves of the set point, a level
that steps, a coarse sensor.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from adapt.loops import asked
from oracles import scenarios
from plantune.adapt import AutoTuner, Sample

KINDS = ["white", "equation", "coloured", "drift", "weak", "rare", "level", "coarse"]
COUNTS = [range(8), pytest.param(range(500), marks=pytest.mark.slow)]


class Disturbed(scenarios.Loop):
    """A loop with more than white noise on the output."""

    def __init__(self, scenario, kind):
        super().__init__(scenario)
        s, N, rng = scenario, self.N, np.random.default_rng([scenario.seed, 9])
        self.w, self.quantum = np.zeros(N), 0.0
        if kind == "equation":
            a = np.exp(-s.Ts / s.plant.T)
            self.w, self.noise = s.sd * np.sqrt(1 - a * a) * rng.normal(size=N), np.zeros(N)
        if kind == "coloured":
            p = rng.uniform(0.5, 0.98)
            self.noise = lfilter([np.sqrt(1 - p * p)], [1, -p], s.sd * rng.normal(size=N))
        if kind == "drift":  # by a fifth of the set point's moves within a window of 15 s
            slope = 0.2 * s.amplitude * rng.uniform(-1, 1) / 15
            self.noise = self.noise + slope * s.Ts * np.arange(N)
        if kind == "coarse":
            self.quantum = s.amplitude * 10 ** rng.uniform(-2.5, -1)

    def step(self, pid=None):
        k = self.k
        self.x += self.w[k]
        if self.quantum:
            y = self.x + self.plant.O + self.noise[k]
            self.noise[k] += round(y / self.quantum) * self.quantum - y
        return super().step(pid)


def scenario_of(seed):
    """Return a loop and what disturbs it."""
    kind, rng = KINDS[seed % len(KINDS)], np.random.default_rng([seed, 77])
    s = scenarios.random_plant(seed, seconds=20.0, wait=1 + seed % 60)
    s = replace(s, plant=replace(s.plant, L=s.plant.L + s.Ts * rng.uniform(-0.5, 0.5)))
    if kind == "weak":
        s = replace(s, amplitude=s.amplitude * 10 ** rng.uniform(-2, -1))
    if kind == "rare":
        s = replace(s, hold=(400, 900))
    if kind == "level":
        by = s.amplitude * rng.choice([-1.2, 0.6])
        s = replace(s, events=(scenarios.offset_step(rng.uniform(5, 15), by=by),))
    return s, kind


def unexplained(decision, worth):
    """Whether something was not done, and no reason is given."""
    if decision.fitted and not decision.accepted:
        return not decision.reasons
    if decision.accepted and not decision.retuned and not decision.reasons:
        now, wanted = decision.controller, decision.target
        return max(abs(wanted.Kp / now.Kp - 1), abs(wanted.Ki / now.Ki - 1)) >= worth
    return False


@pytest.mark.parametrize("seeds", COUNTS)
def test_accepted_gains_are_right_and_refusals_say_why(seeds):
    accepted, wrong = Counter(), []
    for seed in seeds:
        scenario, kind = scenario_of(seed)
        settings = asked(scenario)
        loop, tuner, pid = Disturbed(scenario, kind), AutoTuner(settings), settings.controller
        some = False
        while not loop.done:
            decision = tuner.step(Sample(*loop.step(pid)))
            pid = decision.controller
            assert not unexplained(decision, settings.worth), (seed, decision.t)
            some |= decision.accepted
            if decision.accepted and abs(decision.model.K / loop.plant.K - 1) > 0.25:
                wrong.append((seed, kind, decision.t))
        accepted[kind] += some
    assert wrong == []
    # it does not keep its word by silence
    often = len(seeds) / len(KINDS)
    assert all(accepted[kind] >= 0.7 * often for kind in KINDS if kind != "weak"), accepted


@pytest.mark.parametrize(
    ("seed", "beyond"), [(14, "above"), (34, "above"), (54, "below"), (94, "below")]
)
def test_a_delay_beyond_the_range_is_told(seed, beyond):
    """K looked sure to 4.6 % and was 30 % off, with the true delay two samples above the range."""
    scenario = scenarios.random_plant(seed, seconds=20.0, wait=1 + seed % 60)
    nk = round(scenario.plant.L / scenario.Ts) + 1
    settings = asked(scenario, nk=(nk + 2, nk + 7) if beyond == "above" else (1, max(1, nk - 3)))
    loop, tuner, codes = scenarios.Loop(scenario), AutoTuner(settings), Counter()
    while not loop.done:
        decision = tuner.step(Sample(*loop.step()))
        codes.update(note.code for note in decision.reasons)
        assert not (decision.accepted and abs(decision.model.K / loop.plant.K - 1) > 0.25)
    assert codes["A02"] > 20
