"""Impulse response: the evidence in closed form, the numbers of METHODS 2.3, bands counted."""

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import bound, impulse

TS = 0.02


def held(N, hold, rng):
    return np.repeat(rng.choice([-1.0, 1.0], size=-(-N // hold)), hold)[:N]


def engine(seed, N=360, hold=5, sd=2.0, ar=0.0):
    """Simulate the engine in open loop, u of +-5 held for 5 samples; return record and taps."""
    rng, p = np.random.default_rng([seed, 7]), bound.Engine()
    u = 5.0 * held(N, hold, rng)
    g = np.where(np.arange(61) >= p.nk, p.K * (1 - p.a) * p.a ** (np.arange(61.0) - p.nk), 0.0)
    y = lfilter(np.concatenate([np.zeros(p.nk), [p.K * (1 - p.a)]]), [1, -p.a], u)
    v = lfilter([np.sqrt(1 - ar**2)], [1, -ar], rng.normal(size=N + 200))[200:]
    return pt.Record(u=u, y=y + p.O + sd * v, Ts=TS), g[1:]


def error(h, g):
    return np.linalg.norm(h.g - g) / np.linalg.norm(g)


# -- the equations -----------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["tc", "dc", "ss"])
@pytest.mark.parametrize("nk", [1, 4])
def test_evidence_and_taps_are_those_of_the_full_covariance(kind, nk):
    """The thin QR is exact: N x N covariance of y, the level projected out; METHODS 2.3."""
    rec, _ = engine(0, N=110, hold=2)
    h = pt.analyze.impulse(rec, 20, kind, nk=nk, whiten=False)
    Phi, y = impulse.rows(rec.u[:, 0], rec.y[:, 0], 20)
    K = h.c / h.noise_sd**2 * impulse.kernel(kind, 20, h.lam, np.nan_to_num(h.rho), nk - 1)
    cost, s2 = impulse.evidence(Phi, y, K)
    assert h.noise_sd**2 == approx(s2, rel=1e-9)
    g, P = impulse.posterior(Phi, y, K, s2)
    assert h.g == approx(g, abs=1e-9 * np.abs(g).max())
    if kind == "tc":
        assert h.P == approx(P, abs=1e-9 * np.abs(P).max())
        assert h.sd == approx(np.sqrt(np.diag(P)), abs=1e-7 * np.abs(g).max())
    assert h.evidence == approx(cost, rel=1e-9)


def test_hyper_parameters_have_the_most_evidence():
    """A simplex from several starts finds none better."""
    rec, _ = engine(1, N=120)
    h = pt.analyze.impulse(rec, 20, nk=6, whiten=False)
    Phi, y = impulse.rows(rec.u[:, 0], rec.y[:, 0], 20)
    assert h.evidence == approx(impulse.fit(Phi, y, "tc", 5).cost, abs=0.02)


def test_least_squares_is_that_of_the_text():
    rec, _ = engine(2)
    h = pt.analyze.impulse(rec, 30, None, whiten=False)
    g, P, s2 = impulse.least_squares(*impulse.rows(rec.u[:, 0], rec.y[:, 0], 30))
    assert h.g == approx(g, rel=1e-9)
    assert h.P == approx(P, rel=1e-8, abs=1e-12)
    assert h.noise_sd == approx(np.sqrt(s2))


def test_step_and_gain_are_sums_with_their_covariance():
    h = pt.analyze.impulse(engine(3)[0])
    S = np.tril(np.ones((60, 60)))
    assert h.step == approx(S @ h.g)
    assert h.step_sd == approx(np.sqrt(np.diag(S @ h.P @ S.T)), rel=1e-9)
    assert (h.gain, h.gain_sd) == (h.step[-1], h.step_sd[-1])
    assert h.t == approx(h.lags * TS)


# -- what must hold ----------------------------------------------------------------------


def test_the_engine_with_60_taps():
    """METHODS 2.3: 300 rows, noise 2: least squares .55, TC at most .15."""
    records = [engine(seed) for seed in range(8)]
    least = [error(pt.analyze.impulse(rec, kernel=None), g) for rec, g in records]
    found = [(pt.analyze.impulse(rec), g) for rec, g in records]
    assert np.median(least) == approx(0.6, abs=0.15)
    assert max(error(h, g) for h, g in found) <= 0.15
    assert [h.nk for h, _ in found] == [6] * 8
    assert np.median([error(pt.analyze.impulse(rec, kernel="ss"), g) for rec, g in records]) < 0.05


@pytest.mark.parametrize(("ar", "first", "gain"), [(0.0, 0.85, 0.7), (0.9, 0.7, 0.6)])
def test_bands_hold_also_under_colour(ar, first, gain):
    """Of 20 records, with room for chance; 300 are counted below."""
    taps, alive, whole = coverage(range(20), ar)
    assert taps > 0.93 and alive >= first and whole >= gain


@pytest.mark.slow
@pytest.mark.parametrize(("ar", "first", "gain"), [(0.0, 0.93, 0.85), (0.9, 0.88, 0.72)])
def test_bands_hold_on_many_records(ar, first, gain):
    taps, alive, whole = coverage(range(300), ar)
    assert taps > 0.94 and alive >= first and whole >= gain


def coverage(seeds, ar):
    """Share of true taps, of the first live tap, and of the gain, within 95 % bands."""
    out = []
    for seed in seeds:
        rec, g = engine(seed, ar=ar)
        h = pt.analyze.impulse(rec)
        inside = np.abs(h.g - g) <= 1.96 * h.sd + 1e-12
        out.append((inside.mean(), inside[5], abs(h.gain - g.sum()) <= 1.96 * h.gain_sd))
    return np.mean(out, axis=0)


def test_colour_is_taken_into_account():
    rec, _ = engine(0, ar=0.9)
    white, plain = (pt.analyze.impulse(rec, whiten=w) for w in (True, False))
    assert white.D[1] < -0.6 and plain.D.tolist() == [1.0]
    assert white.gain_sd > 1.5 * plain.gain_sd


def test_two_inputs_have_a_prior_each():
    """A fast plant and a slow one, each found as if it were alone."""
    rng = np.random.default_rng(0)
    u = np.column_stack([held(600, 4, rng), held(600, 7, rng)])
    g = [0.5 ** np.arange(40.0) * (np.arange(40) >= 0), 0.1 * 0.9 ** np.arange(40.0)]
    y = lfilter([0, 1.0], [1, -0.5], u[:, 0]) + lfilter([0, 0, 0, 0.1], [1, -0.9], u[:, 1])
    rec = pt.Record(u=u, y=y + 0.1 * rng.normal(size=600), Ts=1.0, u_names=["fast", "slow"])
    h = pt.analyze.impulse(rec, 40)
    assert h.g.shape == (40, 2) and h.P.shape == (2, 40, 40)
    assert h.nk.tolist() == [1, 3]
    assert np.linalg.norm(h.g[:, 0] - g[0]) < 0.1 * np.linalg.norm(g[0])
    slow = np.concatenate([[0, 0], g[1][:38]])
    assert np.linalg.norm(h.g[:, 1] - slow) < 0.2 * np.linalg.norm(slow)
    assert h.lam[0] < h.lam[1]
    assert "slow" in str(h)


# -- properties --------------------------------------------------------------------------


def test_units_and_levels_scale_out():
    rec, _ = engine(4)
    h = pt.analyze.impulse(rec)
    other = pt.analyze.impulse(pt.Record(u=1e3 * rec.u + 7, y=1e-3 * rec.y - 5, Ts=TS))
    assert other.g == approx(1e-6 * h.g, rel=1e-6, abs=1e-15)
    assert other.gain_sd == approx(1e-6 * h.gain_sd, rel=1e-6)


def test_segments_are_one_record_without_the_rows_between():
    rec, g = engine(5, N=700)
    parts = pt.Record.join([rec.between(0, 6.0), rec.between(6.4, 14.0)])
    h = pt.analyze.impulse(parts)
    assert h.N < parts.N - 100
    assert error(h, g) < 0.1


def test_noise_free_taps_are_exact():
    """Up to what acts beyond the last tap."""
    rec, g = engine(6, hold=2, sd=0.0)
    assert error(pt.analyze.impulse(rec, kernel=None, whiten=False), g) < 5e-3
    assert error(pt.analyze.impulse(rec), g) < 1e-2


def test_a_direct_term_is_a_tap_at_lag_zero():
    rng = np.random.default_rng(3)
    u = rng.normal(size=400)
    y = lfilter([0.8], [1, -0.6], u) + 0.05 * rng.normal(size=400)
    h = pt.analyze.impulse(pt.Record(u=u, y=y, Ts=1.0), 20, direct=True)
    assert (h.lags[0], h.nk) == (0, 0)
    assert h.g[0] == approx(0.8, abs=0.05)


def test_a_response_that_goes_on_is_said():
    rng = np.random.default_rng(4)
    u = held(1500, 40, rng)
    y = lfilter([0, 0.01], [1, -0.99], u) + 0.01 * rng.normal(size=1500)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    assert [note.code for note in pt.analyze.impulse(rec, 30).notes] == ["X07"]
    assert pt.analyze.impulse(engine(0)[0]).notes == ()


def test_output_of_several_is_named():
    rng = np.random.default_rng(5)
    u = rng.normal(size=300)
    y = np.column_stack([np.r_[0, u[:-1]], np.r_[0, 0, 2 * u[:-2]]]) + 0.01
    rec = pt.Record(u=u, y=y, Ts=1.0, y_names=["a", "b"])
    assert pt.analyze.impulse(rec, 10, output="b").nk == 2
    with pytest.raises(pt.errors.UsageError, match="must be one of 'a', 'b'"):
        pt.analyze.impulse(rec, 10)


# -- refusals ----------------------------------------------------------------------------


def test_more_taps_than_rows_are_refused_with_a_number_that_fits():
    rec = engine(0, N=100)[0]
    with pytest.raises(pt.errors.NotIdentifiable, match="40 rows") as error:
        pt.analyze.impulse(rec)
    assert error.value.code == "X03"
    fits = int(error.value.remedy.split("n = ")[1].split()[0])
    assert pt.analyze.impulse(rec, fits, whiten=False).N > fits
    with pytest.raises(pt.errors.NotIdentifiable):
        pt.analyze.impulse(rec, fits + 1)


def test_an_input_that_stands_still_is_refused():
    rec = engine(0)[0]
    still = pt.Record(u=np.full(rec.N, 3.0), y=rec.y, Ts=TS)
    with pytest.raises(pt.errors.NotIdentifiable, match="not exciting") as error:
        pt.analyze.impulse(still)
    assert error.value.code == "X01"


def test_one_step_does_not_tell_taps_apart_without_a_prior():
    rng = np.random.default_rng(6)
    u = (np.arange(300) >= 20).astype(float)
    rec = pt.Record(u=u, y=lfilter([0, 0.2], [1, -0.8], u) + 0.01 * rng.normal(size=300), Ts=1.0)
    with pytest.raises(pt.errors.NotIdentifiable) as error:
        pt.analyze.impulse(rec, 60, None)
    assert error.value.code == "X02"


@pytest.mark.parametrize(
    ("given", "code"),
    [({"n": 0}, "U01"), ({"kernel": "rbf"}, "U01"), ({"nk": 61}, "U01"), ({"nk": -1}, "U01")],
)
def test_arguments_are_checked(given, code):
    with pytest.raises(pt.errors.UsageError) as error:
        pt.analyze.impulse(engine(0)[0], **given)
    assert error.value.code == code
