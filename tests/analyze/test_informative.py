"""Stretches that say something of the plant: the tests of each window, the counts, the ranking."""

from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import check_refusal
from oracles import informative as oracle

TRUE = np.array([1.5, 8.0, 3.0])


def loop(seed, N=20_000):
    """Return a loop with drifting load, and its events: (kind, first row, row after the last).

    T 8, nk 4, PI; load AR(.98) of sd .3, set-point moves of sd 1, steps of .7 in manual.
    """
    rng = np.random.default_rng(seed)
    e, v = rng.normal(size=N) * np.sqrt(1 - 0.98**2), np.zeros(N)
    for t in range(1, N):
        v[t] = 0.98 * v[t - 1] + e[t]
    v = 0.3 * v + 0.03 * rng.normal(size=N)
    r, manual, events, k = np.zeros(N), np.zeros(N, bool), [], 1000
    while k < N - 800:
        first = k
        if rng.random() < 0.6:
            for _ in range(rng.integers(1, 4)):
                r[k:] = rng.choice([-1, 1]) * (0.5 + rng.random())
                k += int(rng.integers(30, 90))
            r[k:] = 0
            events.append(("set point", first, k + 60))
        else:
            k += int(rng.integers(160, 300))
            manual[first:k] = True
            events.append(("manual", first, k))
        k += int(rng.integers(900, 2500))
    u, y, x, integral, base, step = np.zeros(N), np.zeros(N), 0.0, 0.0, 0.0, 0.0
    a = np.exp(-1 / 8)
    for t in range(N):
        x = a * x + 1.5 * (1 - a) * (u[t - 4] if t >= 4 else 0.0)
        y[t] = x + v[t]
        error = r[t] - y[t]
        if manual[t]:
            base = base if manual[t - 1] else u[t - 1]
            step = rng.choice([-0.7, 0.7]) if t % 25 == 0 or not manual[t - 1] else step
            u[t] = base + step
            integral = u[t] - 0.7 * error
        else:
            integral += 0.08 * error
            u[t] = 0.7 * error + integral
    return pt.Record(u=u, y=y, Ts=1.0), events


def count(seeds):
    """Return found and all events of each kind, and the stretches where none was."""
    found, false = {"set point": [0, 0], "manual": [0, 0]}, 0
    for seed in seeds:
        rec, events = loop(seed)
        stretches = [s.rows for s in pt.analyze.informative(rec).stretches]
        for kind, first, stop in events:
            found[kind][0] += any(s.start < stop and s.stop > first for s in stretches)
            found[kind][1] += 1
        hit = [any(s.start < b and s.stop > a for _, a, b in events) for s in stretches]
        false += hit.count(False)
    return found, false


def test_each_window_is_tested_as_by_direct_regression():
    rec, _ = loop(0, 6000)
    found = pt.analyze.informative(rec)
    for k in range(0, len(found.firsts), 5):
        window = slice(found.firsts[k], found.stops[k])
        sd, condition, F, p = oracle.tests(rec.u[window, 0], rec.y[window, 0], skip=15)
        assert sd > 0
        assert (found.condition[k], found.F[k]) == approx((condition, F), rel=1e-6)
        assert found.p[k] == approx(p, rel=1e-5)


def test_events_are_found_and_none_invented():
    found, false = count(range(1))
    assert found["manual"][0] == found["manual"][1]
    assert found["set point"][0] >= found["set point"][1] - 1
    assert false <= 1


@pytest.mark.slow
def test_events_are_found_over_many_loops():
    found, false = count(range(6))
    assert found["manual"][0] == found["manual"][1]
    assert found["set point"][0] >= 0.85 * found["set point"][1]
    assert false <= 3


def test_what_can_be_identified_is():
    """The plant of the best stretch, with a noise model, is the true one to three deviations."""
    rec, _ = loop(1)
    found = pt.analyze.informative(rec)
    assert found.best.identifiable
    fit = pt.estimate.process(found.record(0), "P1D", noise="arma")
    assert np.all(abs(fit.theta - TRUE) < 3 * fit.sd + 0.02 * TRUE)
    joined = found.joined()
    assert len(joined.starts) == len(found.identifiable)
    assert joined.N == sum(s.rows.stop - s.rows.start for s in found.identifiable)
    scores = [s.score for s in found.stretches]
    assert scores == sorted(scores)


def test_scale_and_level_change_nothing_but_the_gain():
    rec, _ = loop(2, 8000)
    a = pt.analyze.informative(rec)
    b = pt.analyze.informative(replace(rec, u=100 + 2 * rec.u, y=7 + 10 * rec.y, source=""))
    assert [s.rows for s in a.stretches] == [s.rows for s in b.stretches]
    for s, other in zip(a.stretches, b.stretches, strict=True):
        assert other.score == approx(s.score, rel=1e-3)
        assert other.K == approx(5 * s.K, rel=1e-3)


def test_gaps_are_not_bridged():
    rec, _ = loop(3, 6000)
    parts = [rec.take(slice(0, 2500)), rec.take(slice(2600, 6000))]
    found = pt.analyze.informative(pt.Record.join(parts))
    assert not np.any((found.firsts < 2500) & (found.stops > 2500))


def test_a_loop_at_rest_says_nothing_and_says_so():
    rng = np.random.default_rng(4)
    found = pt.analyze.informative(pt.Record(u=np.ones(500), y=rng.normal(size=500), Ts=1.0))
    assert (found.stretches, found.plant, found.best) == ((), None, None)
    assert [note.code for note in found.notes] == ["X02"]
    with pytest.raises(pt.NotIdentifiable) as caught:
        found.joined()
    check_refusal(caught.value, "X02", ())


def test_refusals():
    rec, _ = loop(5, 2000)
    for bad in ({"window": 20}, {"input": 1}, {"output": -1}):
        with pytest.raises(pt.UsageError) as caught:
            pt.analyze.informative(rec, **bad)
        assert caught.value.code == "U01"
    with pytest.raises(pt.UsageError):
        pt.analyze.informative(rec).record(99)
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.analyze.informative(rec.take(slice(0, 40)))
    check_refusal(caught.value, "X03", ("count", "measured"))


def test_the_week_of_a_flow_loop(data):
    """METHODS 6: the last day can be identified (K 2.5 to 2.8, T 3 to 4 min); sampled coarsely."""
    rec = pt.read(
        data("plant_flow_loop") / "FIC-211_20241121-27.csv",
        u="FV_211",
        y="FT_211",
        time=("date", "time"),
        sort=True,
        missing="segments",
    )
    found = pt.analyze.informative(rec)
    assert 2.4 < found.best.K < 3.1
    assert found.best.start > 5 * 86_400
    assert 1 < len(found.identifiable) < len(found.stretches)
    assert {"M09", "X09"} <= {note.code for note in found.notes}
    assert 2.5 < found.plant.T / 60 < 5
    fit = pt.estimate.process(found.record(0), "P1D", noise="arma")
    assert fit.model.K == approx(found.best.K, rel=0.25)
