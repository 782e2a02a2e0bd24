"""V16: the model's step response beside that of the record; false alarms and power counted."""

import numpy as np
import pytest
from scipy.signal import lfilter

import plantune as pt


def held(N, hold, rng):
    return np.repeat(rng.choice([-1.0, 1.0], size=-(-N // hold)), hold)[:N]


def simulated(seed, N=800, K=2.0, T=8.0, nk=4, noise=0.2, ar=0.0, lag=0.0, hold=12):
    rng = np.random.default_rng([seed, 11])
    u = held(N, hold, rng)
    a = np.exp(-1 / T)
    y = K * lfilter([0] * nk + [1 - a], [1, -a], u)
    if lag:
        y = lfilter([1 - np.exp(-1 / lag)], [1, -np.exp(-1 / lag)], y)
    v = lfilter([np.sqrt(1 - ar**2)], [1, -ar], rng.normal(size=N + 200))[200:]
    return pt.Record(u=u + 5, y=y + 3 + noise * v, Ts=1.0)


def truth(K=2.0, T=8.0, nk=4):
    a = np.exp(-1 / T)
    return pt.models.PolyModel(A=[1], B=[K * (1 - a)], F=[1, -a], nk=nk, Ts=1.0)


def alarm(verdict):
    return next((note for note in verdict.notes if note.code == "V16"), None)


def of_fit(seed, estimate, **kw):
    est, val = simulated(seed, **kw).split(0.5)
    return alarm(pt.validate.check(val, estimate(est)))


ESTIMATORS = [
    ("OE", lambda est: pt.estimate.oe(est, 1, 1, 4), {}),
    ("OE", lambda est: pt.estimate.oe(est, 1, 1, 4), {"ar": 0.9}),
    ("P1D", lambda est: pt.estimate.process(est, "P1D"), {}),
    ("BJ", lambda est: pt.estimate.bj(est, 1, 1, 1, 1, 4), {"ar": 0.8}),
]


@pytest.mark.parametrize(("name", "estimate", "case"), ESTIMATORS)
def test_a_true_structure_is_not_doubted(name, estimate, case):
    assert sum(of_fit(seed, estimate, **case) is not None for seed in range(15)) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("name", "estimate", "case"), ESTIMATORS)
def test_false_alarms_are_rare(name, estimate, case):
    """At most 1 % of 500 records."""
    assert sum(of_fit(seed, estimate, **case) is not None for seed in range(500)) <= 5


@pytest.mark.parametrize(
    ("model", "word"),
    [
        (truth(K=2.4), "gain 17 % smaller"),
        (truth(K=1.6), "larger"),
        (truth(nk=6), "earlier"),
        (truth(nk=3), "later"),
        (truth(T=11.0), "time constant"),
    ],
)
def test_what_is_off_is_named(model, word):
    """The note speaks of the record: beside a model of too much gain its own is smaller."""
    rec = simulated(1, N=1500)
    note = alarm(pt.validate.check(rec, model, offset="estimate"))
    assert note is not None and note.measured > note.limit
    assert word in note.text


def test_a_lag_that_the_model_lacks_is_a_matter_of_shape():
    found = [
        of_fit(seed, lambda est: pt.estimate.oe(est, 1, 1, 4), lag=6.0, noise=0.05, N=1600)
        for seed in range(5)
    ]
    assert all(note is not None for note in found)


def test_the_truth_itself_is_not_doubted():
    for seed in range(20):
        rec = simulated(seed, ar=0.8)
        assert alarm(pt.validate.check(rec, truth(), offset="estimate")) is None


def test_small_differences_are_not_said():
    """A gain off by 3 % is sure on many rows, and too small to matter: `limits.V16` is 5 %."""
    rec = simulated(2, N=20000, noise=0.02)
    assert alarm(pt.validate.check(rec, truth(K=2.06), offset="estimate")) is None
    tight = pt.Limits(V16=0.01)
    assert alarm(pt.validate.check(rec, truth(K=2.06), offset="estimate", limits=tight))


def test_the_input_that_is_off_is_named():
    rng = np.random.default_rng(3)
    u = np.column_stack([held(900, 9, rng), held(900, 13, rng)])
    y = lfilter([0, 0, 0.2], [1, -0.8], u[:, 0]) + lfilter([0, 0.3], [1, -0.7], u[:, 1])
    rec = pt.Record(u=u, y=y + 0.1 * rng.normal(size=900), Ts=1.0, u_names=["heat", "flow"])
    model = pt.models.PolyModel(
        A=[1], B=[[0.2], [0.4]], F=[[1, -0.8], [1, -0.7]], nk=[2, 1], Ts=1.0
    )
    notes = [n for n in pt.validate.check(rec, model, offset="estimate").notes if n.code == "V16"]
    assert [note.where.column for note in notes] == ["flow"]


def test_feedback_is_no_difference():
    """A true model in a PI loop with coloured noise."""
    for seed in range(10):
        rng = np.random.default_rng([seed, 5])
        r, e = held(1200, 40, rng), 0.3 * lfilter([1], [1, -0.8], rng.normal(size=1200))
        u, y, x, total = np.zeros(1200), np.zeros(1200), 0.0, 0.0
        a = np.exp(-1 / 8)
        for t in range(1200):
            x = a * x + 2 * (1 - a) * (u[t - 4] if t >= 4 else 0.0)
            y[t] = x + e[t]
            total += 0.03 * (r[t] - y[t])
            u[t] = 0.4 * (r[t] - y[t]) + total
        rec = pt.Record(u=u, y=y, Ts=1.0)
        assert alarm(pt.validate.check(rec, truth(), offset="estimate")) is None
