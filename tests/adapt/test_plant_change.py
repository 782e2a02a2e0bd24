"""Claim: K times 2 and L plus 3 samples are followed, and no retuning makes the true loop bad.

Every fourth loop is the engine, whose level jumps with the gain; the others are random plants
whose gain changes about the operating point, so that u can still hold the set point.  Asked is
IMC-PI with a phase margin of 65 degrees: its Ms is 1.74 at most in these sampled loops, before
and after; a gain margin of 3 would give up to 2.0 at delays of 2 samples.

A retuning may raise Ms towards what is asked: from 1.3 of the sluggish first controllers to 1.7.
None leaves it above 1.8, and more than 5 % above what it was.
"""

from dataclasses import replace

import numpy as np
import pytest

from adapt.loops import asked, lasting, live
from oracles import scenarios

AT, ASKED = 20.0, 1.8
COUNTS = [8, pytest.param(200, marks=pytest.mark.slow)]


def changing(seed):
    change = scenarios.plant_change(AT)
    if seed % 4 == 0:
        return scenarios.engine(seed, wait=50, seconds=2 * AT, sd=1.5**0.5, events=[change])
    scenario = scenarios.random_plant(seed, wait=50, seconds=2 * AT)
    return replace(scenario, events=(replace(change, offset=scenario.plant.O - scenario.level),))


def true_Ms(run, first):
    """Ms of the settings in use after each sample from `first` on, on the plant as it is."""
    found, last = [], None
    for k in range(first, len(run.t)):
        now = run.decisions[k].controller, run.plants[k]
        if now != last:
            found.append(run.Ms_at(k))
            last = now
        else:
            found.append(found[-1])
    return np.array(found)


@pytest.mark.parametrize("count", COUNTS)
def test_a_change_of_the_plant_is_followed(count):
    for seed in range(count):
        run = live(changing(seed), asked(changing(seed), phase_margin=65.0))
        Ms = true_Ms(run, round(AT / 0.02))
        assert lasting(Ms <= ASKED) < len(Ms), seed  # within 20 s; median 3 s
        for _, before, after in run.retunings:
            assert after <= max(ASKED, 1.05 * before), seed


def sick(seed, event):
    scenario = changing(seed)
    return replace(scenario, events=(event(AT),), seconds=30.0)


@pytest.mark.parametrize("count", [4, pytest.param(40, marks=pytest.mark.slow)])
@pytest.mark.parametrize("event", [scenarios.frozen_input, scenarios.stuck_sensor])
def test_a_frozen_input_and_a_stuck_sensor_retune_nothing(count, event):
    """Not after the last samples before the event have been fitted once more."""
    for seed in range(count):
        scenario = sick(seed, event)
        run = live(scenario, asked(scenario, phase_margin=65.0))
        assert not np.any(run.t[run.rows("retuned")] > AT + 0.2), seed
