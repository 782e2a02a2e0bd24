"""Delay four ways: each beside its oracle, and the one to trust counted."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import delay_ways


def held(N, hold, rng):
    return np.repeat(rng.choice([-1.0, 1.0], size=-(-N // hold)), hold)[:N]


def slow_clock(seed, N=600, nk=4, T=10.0, noise=0.05, lags=1, ar=0.0):
    """Simulate one or two lags behind a binary input held for about T + L."""
    rng = np.random.default_rng(seed)
    u = held(N, round(1.2 * (T + nk)), rng)
    a = np.exp(-1 / T)
    y = np.concatenate([np.zeros(nk), u[: N - nk]])
    for _ in range(lags):
        y = lfilter([1 - a], [1, -a], y)
    v = lfilter([np.sqrt(1 - ar**2)], [1, -ar], rng.normal(size=N + 200))[200:]
    return pt.Record(u=u, y=y + noise * v, Ts=1.0)


def test_hair_dryer_has_three_samples():
    """DESIGN 4; the softly rising response alone would say 2."""
    found = pt.analyze.delay_evidence(pt.datasets.hair_dryer())
    assert (found.nk, found.trusted, found.likely) == (3, "oe", (3,))
    assert found.weight > 0.99
    assert found.arx.nk == pt.analyze.delay(pt.datasets.hair_dryer()).nk == 3


def test_correlations_are_those_of_the_text():
    """Source 001, (3.5-35), and pre-whitening by an autoregression with the least AIC."""
    rec = slow_clock(0)
    found = pt.analyze.xcorr(rec, 20)
    assert found.raw[20:] == approx(delay_ways.raw(rec.u[:, 0], rec.y[:, 0], 20), abs=1e-12)
    assert found.A == approx(delay_ways.ar_by_aic(rec.u[:, 0], 30), abs=1e-9)
    r, first = delay_ways.pre_whitened(rec.u[:, 0], rec.y[:, 0], 20)
    assert found.prewhitened[20:] == approx(r, abs=1e-9)
    assert found.band == approx(3 / np.sqrt(rec.N - len(found.A) + 1))
    assert found.first == first == 4
    assert found.lags.tolist() == list(range(-20, 21))


def test_the_raw_peak_is_late_on_a_slow_clock():
    """ERRATA; METHODS 8.8."""
    found = pt.analyze.delay_evidence(slow_clock(1), (1, 12))
    assert found.nk == 4 and found.weight > 0.9
    assert found.correlation.peak > 8
    raw = found.ways[-1]
    assert raw.name == "raw correlation" and "late" in raw.remark


def test_bands_of_no_relation_hold():
    """Two signals that have nothing to do with each other, both slow: 3 sd at 41 lags."""
    outside = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        u = held(800, 8, rng)
        y = lfilter([1], [1, -0.9], rng.normal(size=800))
        found = pt.analyze.xcorr(pt.Record(u=u, y=y, Ts=1.0), 20)
        outside.append(
            [
                (np.abs(found.raw) > found.raw_band).mean(),
                (np.abs(found.prewhitened) > found.band).mean(),
            ]
        )
    assert np.mean(outside, axis=0) == approx([0.003, 0.003], abs=0.006)


@pytest.mark.parametrize("case", [{}, {"noise": 0.2}, {"lags": 2, "noise": 0.02}, {"ar": 0.9}])
def test_a_sure_weight_is_right(case):
    for seed in range(3):
        found = pt.analyze.delay_evidence(slow_clock(seed, **case), (1, 12))
        assert found.nk == 4 or (found.weight < 0.9 and 4 in found.likely)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "right"),
    [
        ({}, 0.99),
        ({"noise": 0.2}, 0.9),
        ({"lags": 2}, 0.25),
        ({"lags": 2, "ar": 0.95}, 0.2),
        ({"ar": 0.9}, 0.95),
    ],
)
def test_the_trusted_way_counted(case, right):
    """A sure weight is right; of two lags none is sure, and the truth is among the likely."""
    found = [pt.analyze.delay_evidence(slow_clock(s, **case), (1, 12)) for s in range(30)]
    sure = [f.nk == 4 for f in found if f.weight > 0.9]
    assert np.mean([f.nk == 4 for f in found]) >= right
    assert sum(sure) >= len(sure) - 1
    assert np.mean([4 in f.likely for f in found]) >= 0.9


def test_feedback_is_said():
    """In a PI loop u answers e, and nk = 0 would explain y best."""
    rng = np.random.default_rng(1)
    r, e = held(2000, 40, rng), 0.3 * lfilter([1], [1, -0.7], rng.normal(size=2000))
    u, y, x, total = np.zeros(2000), np.zeros(2000), 0.0, 0.0
    for t in range(2000):
        x = 0.9 * x + 0.1 * (u[t - 4] if t >= 4 else 0.0)
        y[t] = x + e[t]
        total += 0.05 * (r[t] - y[t])
        u[t] = 0.8 * (r[t] - y[t]) + total
    found = pt.analyze.delay_evidence(pt.Record(u=u, y=y, Ts=1.0), (0, 12))
    assert found.feedback and 4 in found.likely and 0 not in found.likely
    assert "X09" in [note.code for note in found.notes]
    assert not [note for note in pt.analyze.xcorr(slow_clock(0)).notes if note.code == "X09"]


def test_what_is_not_told_apart_is_listed():
    found = pt.analyze.delay_evidence(slow_clock(2, N=200, lags=2, noise=0.3), (1, 12))
    assert found.weight < 0.9 and len(found.likely) > 1
    (note,) = [note for note in found.notes if note.code == "X06"]
    assert all(str(nk) in note.text for nk in found.likely)


def test_another_input_is_taken_away():
    rng = np.random.default_rng(7)
    u = np.column_stack([held(800, 9, rng), held(800, 13, rng)])
    y = lfilter([0, 0, 0, 0.2], [1, -0.8], u[:, 0]) + lfilter([0] * 6 + [0.5], [1, -0.7], u[:, 1])
    rec = pt.Record(u=u, y=y + 0.05 * rng.normal(size=800), Ts=1.0)
    assert [pt.analyze.delay_evidence(rec, (1, 12), input=i).nk for i in (0, 1)] == [3, 6]


def test_shift_and_units():
    rec = slow_clock(3)
    later = pt.Record(u=1e-3 * rec.u[2:] + 5, y=1e3 * rec.y[:-2] - 9, Ts=1.0)
    assert pt.analyze.delay_evidence(rec, (1, 12)).nk == 4
    assert pt.analyze.delay_evidence(later, (1, 12)).nk == 6


def test_the_value_prints_every_way():
    text = str(pt.analyze.delay_evidence(slow_clock(4), (1, 12)))
    for name in ("OE scan", "impulse response", "ARX scan", "pre-whitened", "raw correlation"):
        assert name in text


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda rec: pt.analyze.delay_evidence(rec, (0, 300)), "X05"),
        (lambda rec: pt.analyze.delay_evidence(rec, (5, 1)), "U01"),
        (lambda rec: pt.analyze.delay_evidence(rec, input=2), "U01"),
        (lambda rec: pt.analyze.xcorr(rec, 0), "U01"),
        (lambda rec: pt.analyze.xcorr(rec, 300), "X03"),
        (lambda rec: pt.analyze.xcorr(rec, input=3), "U01"),
    ],
)
def test_refusals(call, code):
    with pytest.raises(pt.PlantuneError) as error:
        call(slow_clock(0))
    assert error.value.code == code


def test_an_input_that_stands_still_is_refused():
    rec = slow_clock(0)
    still = pt.Record(u=np.ones(rec.N), y=rec.y, Ts=1.0)
    for call in (pt.analyze.delay_evidence, pt.analyze.xcorr):
        with pytest.raises(pt.errors.NotIdentifiable, match="not exciting"):
            call(still)
