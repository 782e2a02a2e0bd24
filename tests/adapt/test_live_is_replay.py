"""Claim: `step` over the samples equals `replay`, bit for bit, whatever happens on the way."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

import plantune as pt
from adapt.loops import asked
from oracles import scenarios
from plantune.adapt import AutoTuner, Sample

KINDS = ["missing", "offset", "stuck", "frozen", "change", "saturated", "gap", "quiet"]


def eventful(rows, every, seed=7):
    """Return the record of a loop to which something else happens every so many rows."""
    events, Ts = [], 0.02
    for i, first in enumerate(range(every, rows, every)):
        t, kind = first * Ts, KINDS[i % len(KINDS)]
        if kind == "offset":
            events.append(scenarios.offset_step(t, by=(-1) ** i * 60.0))
        if kind == "stuck":
            events.append(scenarios.stuck_sensor(t, until=t + 3.0))
        if kind == "frozen":
            events.append(scenarios.frozen_input(t, until=t + 3.0))
        if kind == "change":
            gain = 2.0 if (i // len(KINDS)) % 2 == 0 else 0.5
            events.append(scenarios.plant_change(t, gain=gain, delay=3 if gain > 1 else -3))
    s = scenarios.engine(seed, seconds=rows * Ts, sd=1.2, events=events)
    loop, found = scenarios.Loop(s), []
    while not loop.done:
        found.append(loop.step())
    t, r, u, y = np.array(found).T
    rng = np.random.default_rng(seed)
    keep = np.ones(rows, bool)
    for i, first in enumerate(range(every, rows, every)):
        kind, part = KINDS[i % len(KINDS)], slice(first, first + every // 2)
        if kind == "missing":
            y[part][rng.random(len(y[part])) < 0.02] = np.nan
        if kind == "saturated":
            u[part] = np.clip(u[part], 28.0, 33.0)
        if kind == "gap":
            keep[first : first + 37] = False
        if kind == "quiet":
            r[part], u[part], y[part] = r[first], u[first], y[first]
    return s, *(x[keep] for x in (t, r, u, y))


def same(a, b):
    return np.array_equal(np.asarray(a, float), np.asarray(b, float), equal_nan=True)


@pytest.mark.parametrize(
    ("rows", "every"), [(4500, 500), pytest.param(180_000, 1500, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("bank", [None, pt.adapt.BankSettings()])
def test_step_by_step_equals_the_record(rows, every, bank):
    scenario, t, r, u, y = eventful(rows, every)
    settings = replace(asked(scenario, bank=bank), u_limits=(0.0, 100.0))
    starts = np.flatnonzero(np.diff(t, prepend=t[0] - 0.02) > 0.03)
    rec = pt.Record(
        u=u, y=np.nan_to_num(y), r=r, Ts=0.02, t=t, valid=~np.isnan(y), starts=[0, *starts]
    )
    log = pt.adapt.replay(rec, settings)
    tuner = AutoTuner(settings)
    decisions = [
        tuner.step(Sample(t[k], r[k], u[k], None if np.isnan(y[k]) else y[k]))
        for k in range(len(t))
    ]

    nan = (np.nan,) * 3
    model = [nan if d.model is None else (d.model.K, d.model.T, d.model.L) for d in decisions]
    merged = [nan if d.merged is None else (d.merged.K, d.merged.T, d.merged.L) for d in decisions]
    assert same(model, np.stack([log.K, log.T, log.L], axis=1))
    assert same(merged, log.merged)
    assert same([d.sd for d in decisions], log.sd)
    assert same([d.offset for d in decisions], log.offset)
    assert same([list(d.delay_posterior.values()) for d in decisions], log.delays)
    assert same([d.controller.Kp for d in decisions], log.Kp)
    assert same([d.time_to_target for d in decisions], log.time_to_target)
    for name in ("accepted", "fitted", "retuned", "new_point", "alarm", "changed"):
        assert same([getattr(d, name) for d in decisions], getattr(log, name)), name
    said = [(k, d.reasons) for k, d in enumerate(decisions) if d.reasons]
    assert said == log.reasons
    assert log.accepted.any() and log.alarm.any()


@pytest.mark.parametrize("bank", [None, pt.adapt.BankSettings()])
@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy])
def test_a_copy_goes_on_by_itself(bank, way):
    rec = pt.datasets.engine_loop(noise_var=1.5, t_end=6.0)
    pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    tuner = AutoTuner(pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid, bank=bank))
    rows = zip(rec.time, rec.r[:, 0], rec.u[:, 0], rec.y[:, 0], strict=True)
    samples = [Sample(*row) for row in rows]
    for sample in samples[:150]:
        tuner.step(sample)
    other = way(tuner)
    theirs = [other.step(sample) for sample in samples[150:]]
    ours = [tuner.step(sample) for sample in samples[150:]]
    assert any(d.accepted for d in ours)
    for name in ("t", "offset", "accepted", "controller", "reasons", "time_to_target"):
        one, two = ([getattr(d, name) for d in ds] for ds in (ours, theirs))
        assert one == two, name


def test_a_pickle_is_refused_with_what_to_keep_instead():
    settings = pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pt.models.PID(Kp=0.1, Ti=1.0))
    with pytest.raises(TypeError, match="samples that it has seen"):
        pickle.dumps(AutoTuner(settings))
    assert pickle.loads(pickle.dumps(settings)).nk == (3, 11)
