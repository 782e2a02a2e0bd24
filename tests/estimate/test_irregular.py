"""Process models at stamps that are not uniform: exact from stamp to stamp, all else refused."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import check_refusal
from oracles import experiment_design
from oracles import irregular as oracle

TRUE = (2.0, 5.0, 2.3)  # K, T, L


def drawn(seed, N=300, noise=0.1, two_lags=None, L=2.3, offset=3.0):
    """Return a record at exponential stamps of mean 1, its input held about seven seconds."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.exponential(1.0, N))
    moves = np.floor(t / 7).astype(int)
    u = rng.choice([-1.0, 1.0], size=moves[-1] + 1)[moves]
    if two_lags is None:
        y = experiment_design.response((*TRUE, offset), u, t, t)
    else:
        y = oracle.response(oracle.p2d(*two_lags), L, u, t, t, offset)
    return pt.Record(u=u, y=y + noise * rng.normal(size=N), t=t)


def fitted(seeds):
    fits = [pt.estimate.process(drawn(seed), "P1D") for seed in seeds]
    return np.array([f.theta for f in fits]) - TRUE, np.mean([f.sd for f in fits], axis=0)


def test_exact_data_give_the_plant():
    fit = pt.estimate.process(drawn(1, noise=0.0), "P1D")
    assert fit.theta == approx(TRUE, rel=1e-6)
    assert fit.offset[0] == approx(3.0, abs=1e-6)
    two = drawn(2, N=200, noise=0.0, two_lags=(2.0, 5.0, 3.0), L=1.7)
    fit = pt.estimate.process(two, "P2D")
    assert sorted(fit.theta[1:3]) == approx([3.0, 5.0], rel=1e-3)
    assert fit.theta[3] == approx(1.7, abs=1e-3)


def test_errors_are_those_predicted():
    off, sd = fitted(range(20))
    assert np.all(abs(off.mean(axis=0)) < 3 * sd / np.sqrt(20))
    assert off.std(axis=0) == approx(sd, rel=0.5)  # 20 draws: 16 %


@pytest.mark.slow
def test_errors_of_a_hundred_records():
    """Recipe: bias -.001 -.011 .003, sd .012 .070 .028 against predicted .013 .064 .027."""
    off, sd = fitted(range(100))
    assert np.all(abs(off.mean(axis=0)) < 3 * sd / 10)
    assert off.std(axis=0) == approx(sd, rel=0.2)


def test_the_fit_is_that_of_direct_least_squares():
    rec = drawn(5)
    fit = pt.estimate.process(rec, "P1D")
    p, rss = oracle.fit(rec.y[:, 0], rec.u[:, 0], rec.t, rec.t, (*fit.theta, fit.offset[0]))
    # The oracle knows that the plant rests before the record: a few rows more.
    assert np.all(abs(fit.theta - p[:3]) < 0.5 * fit.sd)
    assert fit.loss == approx(rss / rec.N, rel=0.05)


def test_uniform_stamps_give_the_uniform_fit():
    """A step test at rest, no row of it history; the last row, off the grid, does not count."""
    rng = np.random.default_rng(16)
    t = np.arange(200) * 1.0
    u = 1.0 * (t >= 20) - 0.5 * (t >= 90)
    y = experiment_design.response((2.0, 9.0, 3.4, 1.0), u, t, t) + 0.02 * rng.normal(size=200)
    plain = pt.estimate.process(pt.Record(u=u, y=y, Ts=1.0), "P1D")
    odd = pt.Record(
        u=[*u, u[-1]],
        y=[*y, y[-1]],
        t=[*t, t[-1] + 3.0],
        Ts=1.0,
        valid=[*np.ones(200, bool), False],
    )
    assert odd.irregular
    fit = pt.estimate.process(odd, "P1D")
    assert fit.N == plain.N
    assert fit.theta == approx(plain.theta, rel=1e-6)
    assert fit.sd[0] == approx(plain.sd[0], rel=1e-3)


def test_missing_outputs_are_skipped_and_segments_honoured():
    rec = drawn(7)
    valid = np.random.default_rng(7).random(rec.N) > 0.15
    holed = pt.Record(u=rec.u, y=np.where(valid, rec.y[:, 0], 1e3), t=rec.t, valid=valid)
    fit = pt.estimate.process(holed, "P1D")
    assert np.all(abs(fit.theta - TRUE) < 4 * fit.sd)
    both = pt.Record.join([drawn(8, offset=3.0), drawn(9, offset=-4.0)])
    fit = pt.estimate.process(both, "P1D", offset="each")
    assert np.all(abs(fit.theta - TRUE) < 4 * fit.sd)
    assert fit.steps[0].size == approx(-7.0, abs=4 * fit.steps[0].sd)
    assert pt.validate.check(both, fit).fit > 85


def test_fresh_rows_are_judged_at_their_stamps():
    est, val = drawn(10, N=500).split(0.6)
    fit = pt.estimate.process(est, "P1D")
    verdict = pt.validate.check(val, fit)
    assert verdict.fit > 85
    assert verdict.t == approx(val.t[verdict.rows])
    got = fit.predict(val, None)
    assert np.nanstd(got[10:] - val.y[10:, 0]) < 0.13


@pytest.mark.parametrize(
    "verb",
    [
        lambda rec: pt.estimate.arx(rec, 1, 1, 1),
        lambda rec: pt.estimate.oe(rec, 1, 1, 1),
        lambda rec: pt.estimate.process(rec, "P1DZ"),
        lambda rec: pt.estimate.process(rec, "P1D", noise="arma"),
        lambda rec: pt.analyze.delay(rec),
        lambda rec: pt.analyze.informative(rec),
        lambda rec: pt.prep.smooth(rec),
        lambda rec: pt.validate.check(
            rec, pt.models.PolyModel(A=[1, -0.5], B=[1.0], nk=1, Ts=rec.Ts)
        ),
    ],
)
def test_what_cannot_serve_them_refuses(verb):
    with pytest.raises(pt.DataError) as caught:
        verb(drawn(11))
    check_refusal(caught.value, "D15", ())
    assert "resample" in caught.value.remedy


def test_resampling_makes_them_uniform():
    rec = pt.prep.resample(drawn(12), 1.0)
    assert not rec.irregular
    pt.estimate.arx(rec, 1, 2, 3)


def test_records_and_files_keep_their_stamps(tmp_path):
    rec = drawn(13, N=50)
    assert rec.Ts == approx(np.diff(rec.t).mean())
    lines = [f"{t},{u},{y}" for t, u, y in zip(rec.t, rec.u[:, 0], rec.y[:, 0], strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,valve,flow", *lines]))
    got = pt.read(path, u="valve", y="flow", stamps="irregular")
    assert got.t == approx(rec.t)
    assert got.irregular
    with pytest.raises(pt.DataError) as caught:
        pt.read(path, u="valve", y="flow")
    assert caught.value.code == "D15"
    for bad in ({"stamps": "any"}, {"stamps": "irregular", "Ts": 1.0}):
        with pytest.raises(pt.UsageError):
            pt.read(path, u="valve", y="flow", **bad)
    with pytest.raises(pt.UsageError):
        pt.Record(u=[1, 2, 3], y=[1, 2, 3])
    with pytest.raises(pt.DataError) as caught:
        pt.Record(u=[1, 2, 3], y=[1, 2, 3], t=[0.0, 2.0, 1.0])
    assert caught.value.code == "D13"
    assert rec.source != pt.Record(u=rec.u, y=rec.y, t=1.1 * rec.t, Ts=rec.Ts).source
