"""Predictor-based subspace identification: the oracle, a tight loop, several outputs, refusals."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import pbsid, subspace


def loop(seed, N=2000, n4=False):
    """Two lags in a tight PI loop, noise through the equation, set-point moves."""
    rng = np.random.default_rng(seed)
    a, b = np.array([-1.5, 0.56]), np.array([0.3, 0.2])
    r = np.repeat(rng.choice([-1.0, 1.0], N // 10), 10)
    e = 0.3 * rng.normal(size=N)
    u, y, total = np.zeros(N), np.zeros(N), 0.0
    for t in range(N):
        past = lambda x, k, t=t: x[t - k] if t >= k else 0.0  # noqa: E731
        y[t] = -a[0] * past(y, 1) - a[1] * past(y, 2) + b[0] * past(u, 1) + b[1] * past(u, 2)
        y[t] += e[t]
        total += 0.15 * (r[t] - y[t])
        u[t] = 0.6 * (r[t] - y[t]) + total
    return pt.Record(u=u, y=y, Ts=1.0)


def test_pbsid_is_the_oracle():
    rec = loop(0)
    fit = pt.estimate.pbsid(rec, 3, past=15, future=8)
    A, B, C, D, K, _ = pbsid.identify(rec.u, rec.y, 3, 15, 8)
    ours = fit.model
    w = np.array([0.05, 0.3, 1.0])
    G = subspace.freqresp(A, B, C, D, np.exp(1j * w))
    assert ours.freqresp(w) == approx(G, rel=3e-3)  # the last column alone is used differently
    H = subspace.freqresp(A, K, C, np.eye(1), np.exp(1j * w))
    noise = pt.models.StateSpace(A=ours.A, B=ours.K, C=ours.C, D=[[1.0]], Ts=1.0)
    assert noise.freqresp(w) == approx(H, rel=3e-3)


def test_the_loop_bends_moesp_and_not_pbsid():
    w = np.array([0.05, 0.2, 0.6])
    true = pt.models.PolyModel(A=[1, -1.5, 0.56], B=[0.3, 0.2], nk=1, Ts=1.0).freqresp(w)
    errors = {"pbsid": [], "moesp": []}
    for seed in range(8):
        rec = loop(seed)
        errors["pbsid"].append(pt.estimate.pbsid(rec, 2, past=15, future=8).model.freqresp(w))
        errors["moesp"].append(pt.estimate.subspace(rec, 2).model.freqresp(w))
    bias = {k: abs(np.mean(v, axis=0)[:, 0, 0] / true - 1).max() for k, v in errors.items()}
    assert bias["pbsid"] < 0.06  # two deviations of a mean of eight
    assert bias["moesp"] > 0.3  # this loop is tighter than the engine's


def test_the_verdict_warns_of_feedback_all_but_pbsid():
    est, val = loop(3).split(0.5)
    for fit, codes in (
        (pt.estimate.subspace(est, 2), 1),
        (pt.estimate.pbsid(est, 2, past=15, future=8), 0),
    ):
        found = [note for note in pt.validate.check(val, fit).notes if note.code == "X09"]
        assert len(found) == codes
        assert all("pbsid" in note.text for note in found)


def test_levels_and_one_step_errors():
    rec = loop(1)
    moved = pt.Record(u=rec.u + 40.0, y=rec.y + 300.0, Ts=1.0)
    fit, plain = (pt.estimate.pbsid(r, 2, past=15, future=8) for r in (moved, rec))
    assert fit.model.freqresp([0.3]) == approx(plain.model.freqresp([0.3]), rel=1e-6)
    level = 300.0 - 40.0 * plain.model.dc_gain()[0, 0]
    assert fit.offset[0] - plain.offset[0] == approx(level, rel=1e-6)
    assert fit.loss == approx(0.09, rel=0.1)


def test_an_unstable_plant_keeps_its_pole():
    rng = np.random.default_rng(0)
    u, y = np.zeros(1000), np.zeros(1000)
    r = np.repeat(rng.choice([-1.0, 1.0], 100), 10)
    for t in range(1, 1000):
        y[t] = 1.05 * y[t - 1] + 0.5 * u[t - 1] + 0.1 * rng.normal()
        u[t] = 1.0 * (r[t] - y[t])
    fit = pt.estimate.pbsid(pt.Record(u=u, y=y, Ts=1.0), 1, past=10, future=5)
    assert fit.model.poles()[0].real == approx(1.05, abs=0.02)
    assert [note.code for note in fit.notes] == ["M02"]


@pytest.mark.parametrize(
    "options, message",
    [
        ({"n": 0}, "`n` is 0"),
        ({"n": 50}, "`n` is 50"),
        ({"future": 30}, "`future` is 30"),
    ],
)
def test_options_out_of_range_are_refused(options, message):
    with pytest.raises(pt.UsageError, match=message):
        pt.estimate.pbsid(loop(0, 400), **({"n": 2} | options))
    with pytest.raises(pt.NotIdentifiable) as refused:
        pt.estimate.pbsid(loop(0, 60), 2)
    assert refused.value.code == "X03"
