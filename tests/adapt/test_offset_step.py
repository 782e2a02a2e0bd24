"""Claim: the level steps by -60 during the run; the plant stays known, and there is one alarm."""

import numpy as np
import pytest

from adapt.loops import live
from oracles import scenarios
from plantune.adapt import Settings
from plantune.models import PID

FIRST = PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=0.02)
COUNTS = [6, pytest.param(40, marks=pytest.mark.slow)]


def runs(count, at, sd, seconds=15.0):
    settings = Settings(Ts=0.02, nk=(3, 11), controller=FIRST, u_limits=(0, 100))
    events = [] if at is None else [scenarios.offset_step(at)]
    return [
        live(scenarios.engine(seed, wait=50, seconds=seconds, sd=sd, events=events), settings)
        for seed in range(count)
    ]


def alarms(run):
    """Times of alarms, those within a second of the one before left out."""
    kept = []
    for t in run.t[run.rows("alarm")]:
        if not kept or t - kept[-1] > 1.0:
            kept.append(t)
    return kept


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize(("at", "sd"), [(8.0, 1.5**0.5), (5.0, 1.5**0.5), (8.0, 0.0)])
def test_a_step_of_the_level_leaves_the_plant_known(count, at, sd):
    largest = []
    for run in runs(count, at, sd):
        errors = np.abs(run.models / run.true - 1)[run.t >= at]
        largest.append(errors[:, :2].max(axis=0))
        (alarm,) = alarms(run)
        assert at <= alarm < at + 0.1
    K, T = np.median(largest, axis=0)
    assert K < 0.03  # 0.4 %
    assert T < 0.05  # 1.3 %


@pytest.mark.parametrize("count", COUNTS)
def test_without_a_step_there_is_no_alarm(count):
    assert [alarms(run) for run in runs(count, None, 1.5**0.5)] == [[]] * count
