"""Several experiments in one fit, and rows that do not count in every estimator."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import experiment_design as oracle

P = (2.0, 10.0, 3.4)


def experiments(seed, n=4, N=120, noise=0.3, levels=True):
    rng = np.random.default_rng(seed)
    t = np.arange(N) * 1.0
    records = []
    for _ in range(n):
        u = np.repeat(rng.choice([-1.0, 1.0], size=N // 10), 10)
        O = 2 * rng.normal() if levels else 5.0
        y = oracle.response((*P, O), u, t, t) + noise * rng.normal(size=N)
        records.append(pt.Record(u=u, y=y, Ts=1.0))
    return records


ESTIMATORS = {
    "arx": lambda rec: pt.estimate.arx(rec, 1, 2, 4),
    "armax": lambda rec: pt.estimate.armax(rec, 1, 2, 1, 4),
    "oe": lambda rec: pt.estimate.oe(rec, 2, 1, 4),
    "bj": lambda rec: pt.estimate.bj(rec, 2, 1, 1, 1, 4),
    "iv4": lambda rec: pt.estimate.iv4(rec, 1, 2, 4),
    "process": lambda rec: pt.estimate.process(rec, "P1D", L=(0, 12)),
}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_fit_over_experiments_is_that_of_the_joined_record(name):
    """Joined, or one record with segment starts: the same numbers, bit for bit."""
    records = experiments(0, 3, levels=False)
    joined = pt.Record.join(records)
    whole = pt.Record(
        u=np.concatenate([rec.u for rec in records]),
        y=np.concatenate([rec.y for rec in records]),
        Ts=1.0,
        starts=[0, 120, 240],
    )
    a, b = ESTIMATORS[name](joined), ESTIMATORS[name](whole)
    assert np.array_equal(a.theta, b.theta)
    assert np.array_equal(a.P, b.P)


def test_each_experiment_has_its_own_offset_where_asked():
    records = experiments(1, 3, noise=0.0)
    fit = pt.estimate.process(pt.Record.join(records), "P1D", offset="each", L=(0, 12))
    assert fit.theta == approx(P, rel=1e-6)
    assert [step.row for step in fit.steps] == [120, 240]
    offsets = fit.offset[0] + np.cumsum([0, *(step.size for step in fit.steps)])
    alone = [pt.estimate.process(rec, "P1D", L=(0, 12)).offset[0] for rec in records]
    assert offsets == approx(alone, abs=1e-6)
    shared = pt.estimate.process(pt.Record.join(records), "P1D", L=(0, 12))
    assert shared.loss > 100 * fit.loss


def test_one_fit_over_three_beats_each_alone():
    """Root mean squared errors over records, and fits of fresh ones; per record it need not."""
    joint, alone, fresh_joint, fresh_alone = [], [], [], []
    for seed in range(16):
        *records, fresh = experiments(100 + seed)
        try:
            fits = [pt.estimate.process(rec, "P1D", L=(0, 12)) for rec in records]
            fit = pt.estimate.process(pt.Record.join(records), "P1D", offset="each", L=(0, 12))
            judged = [pt.validate.check(fresh, f, offset="estimate").fit for f in (fit, *fits)]
        except pt.NotIdentifiable:  # a draw whose input hardly moves
            continue
        size = np.array([P[0], P[1], P[1] + P[2]])
        joint.append((fit.theta - P) / size)
        alone.extend((f.theta - P) / size for f in fits)
        fresh_joint.append(judged[0])
        fresh_alone.append(np.mean(judged[1:]))
    assert len(joint) >= 12
    rms = [np.sqrt(np.mean(np.square(e), axis=0)) for e in (joint, alone)]
    assert np.all(rms[0] < 0.8 * rms[1])
    assert np.mean(fresh_joint) > np.mean(fresh_alone)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_rows_that_do_not_count_change_no_estimate(name):
    """Whatever stands there, a hole of 25 rows and single rows: the same fit, bit for bit."""
    rec = experiments(2, 1, N=600, noise=0.05)[0]
    valid = np.random.default_rng(2).random(600) > 0.05
    valid[200:225] = False
    fits = [
        ESTIMATORS[name](
            pt.Record(u=rec.u, y=np.where(valid, rec.y[:, 0], junk), Ts=1.0, valid=valid)
        )
        for junk in (0.0, 1e3)
    ]
    assert fits[1].theta == approx(fits[0].theta, rel=1e-6)
    full = ESTIMATORS[name](rec)
    assert fits[0].N < full.N
    if name in ("oe", "process"):  # its noise is white: others estimate colour that is not there
        assert np.all(abs(fits[0].theta - full.theta) < 2 * fits[0].sd)
