"""Frequency response and coherence: ETFE, Welch, Blackman-Tukey, and their discs."""

import numpy as np
import pytest
import scipy.signal
from numpy.testing import assert_allclose
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from oracles import excitation
from oracles import frequency as oracle


def held(N, hold, seed):
    levels = np.random.default_rng(seed).choice([-1.0, 1.0], -(-N // hold))
    return np.repeat(levels, hold)[:N]


def plant(w):
    """Response of y(t) = .8 y(t-1) + .2 u(t-2)."""
    z = np.exp(1j * w)
    return 0.2 / (z * (z - 0.8))


def measured(N=2000, hold=3, sd=0.1, seed=1, **fields):
    rng = np.random.default_rng(1000 + seed)
    u = held(N + 200, hold, seed)
    y = lfilter([0, 0, 0.2], [1, -0.8], u) + sd * rng.normal(size=N + 200)
    return pt.Record(u=u[200:], y=7 + y[200:], Ts=1.0, **fields)


def columns(rec):
    return rec.u[:, 0], rec.y[:, 0]


def test_etfe_of_whole_periods_is_exact():
    """Source 001, (3.5-38): no leakage and no noise leave the plant itself."""
    base = excitation.prbs(7)
    u = np.tile(base, 12)
    y = lfilter([0, 0, 0.2], [1, -0.8], u)
    fr = pt.analyze.etfe(pt.Record(u=u[-127:], y=y[-127:], Ts=1.0), half=0)
    w, G = oracle.etfe(u[-127:] - u[-127:].mean(), y[-127:] - y[-127:].mean(), 1.0)
    assert_allclose(fr.w, w)
    assert_allclose(fr.G[:, 0, 0], G, atol=1e-9)
    assert_allclose(fr.G[:, 0, 0], plant(w), atol=1e-9)
    assert fr.radius is None and fr.coherence is None


@pytest.mark.parametrize("half", [2, 5, 15])
def test_smoothed_etfe_is_the_oracles(half):
    rec = measured(601)
    fr = pt.analyze.etfe(rec, half=half)
    w, G, g2, ratio = oracle.smoothed(*columns(rec), 1.0, half)
    assert_allclose(fr.w, w)
    assert_allclose(fr.G[:, 0, 0], G, rtol=1e-8)
    assert_allclose(fr.coherence[:, 0], g2, rtol=1e-8)
    assert_allclose(fr.radius[:, 0, 0], oracle.radius(G, g2, ratio), rtol=1e-6)


def test_welch_is_the_oracles_and_scipys():
    rec = measured()
    u, y = (x - x.mean() for x in columns(rec))
    fr = pt.analyze.spa(rec, n=128)
    w, G, g2, ratio = oracle.welch(u, y, 1.0, 128)
    assert_allclose(fr.w, w)
    assert_allclose(fr.G[:, 0, 0], G, rtol=1e-9)
    assert_allclose(fr.radius[:, 0, 0], oracle.radius(G, g2, ratio), rtol=1e-7)
    # sd^2 = r/(1 - r) (1 - g2)/g2 |G|^2, the head of the oracle.
    sd = np.sqrt(ratio / (1 - ratio) * (1 / g2 - 1)) * np.abs(G)
    assert_allclose(fr.sd[:, 0, 0], sd, rtol=1e-9)
    options = {"nperseg": 128, "detrend": False}
    _, Pyu = scipy.signal.csd(u, y, 1.0, "hann", **options)
    _, Pu = scipy.signal.welch(u, 1.0, "hann", **options)
    assert_allclose(fr.G[:, 0, 0], (Pyu / Pu)[1:], rtol=1e-9)
    f, C = scipy.signal.coherence(u, y, 1.0, "hann", **options)
    found = pt.analyze.coherence(rec, n=128)
    assert_allclose(found.w, 2 * np.pi * f[1:])
    assert_allclose(found.value[:, 0, 0], C[1:], rtol=1e-9)
    assert_allclose(found.multiple[:, 0], C[1:], rtol=1e-9)


def test_blackman_tukey_is_the_oracles_after_the_shift_by_the_delay():
    rec = measured()
    u, y = columns(rec)
    fr = pt.analyze.spa(rec, method="bt", M=60)
    assert "delay of 2" in fr.method
    # Both lose their last two rows to the shift, and their means before it.
    u, y = (u - u.mean())[:-2], (y - y.mean())[2:]
    G, g2, _ = oracle.spa(u, y, 1.0, 60, fr.w)
    inner = slice(0, 50)  # the oracle takes the means of the cut columns
    assert_allclose(fr.G[inner, 0, 0], (G * np.exp(-2j * fr.w))[inner], rtol=0.02)
    assert_allclose(fr.coherence[inner, 0], np.clip(g2, 0, 1)[inner], atol=0.02)


@pytest.mark.parametrize("way", [{}, {"n": 256}, {"method": "bt"}])
def test_each_way_comes_near_the_plant(way):
    fr = pt.analyze.spa(measured(4000, sd=0.05), **way)
    part = fr.coherent & (fr.w < 1.0)
    error = np.abs(fr.G[:, 0, 0] - plant(fr.w))[part]
    assert part.sum() >= 20 and np.sqrt(np.mean(error**2)) < 0.03


def test_auto_goes_by_the_memory_of_the_plant():
    """T + L is 6 rows: stretches of 128 from 960 rows on, lines below."""
    assert "stretches of 128 rows" in pt.analyze.spa(measured(2000)).method
    assert "ETFE smoothed" in pt.analyze.spa(measured(600)).method
    assert "stretches of 256 rows" in pt.analyze.spa(measured(4000), memory=10.0).method


def test_a_delay_of_one_more_sample_turns_the_phase():
    rec = measured()
    later = pt.Record(u=rec.u[:-1], y=rec.y[:-1], Ts=1.0)
    earlier = pt.Record(u=rec.u[:-1], y=rec.y[1:], Ts=1.0)
    a, b = (pt.analyze.spa(r, n=256) for r in (later, earlier))
    part = a.coherent & (a.w < 0.6)
    turn = np.angle(b.G[part, 0, 0] / a.G[part, 0, 0])
    assert_allclose(turn, a.w[part], atol=0.05)


def two_inputs(N=4000, sd=0.1, seed=5):
    u = np.column_stack([held(N, 2, seed), held(N, 3, seed + 1)])
    rng = np.random.default_rng(seed)
    y1 = lfilter([0, 0, 0.2], [1, -0.8], u[:, 0]) + lfilter([0, 0.5], [1, -0.5], u[:, 1])
    y2 = lfilter([0, -0.3], [1, -0.7], u[:, 1])
    y = np.column_stack([y1, y2]) + sd * rng.normal(size=(N, 2))
    return pt.Record(u=u, y=y, Ts=1.0)


def truth(w):
    z = np.exp(1j * w)
    G = np.zeros((len(w), 2, 2), complex)
    G[:, 0, 0], G[:, 0, 1], G[:, 1, 1] = plant(w), 0.5 / (z - 0.5), -0.3 / (z - 0.7)
    return G


def test_several_inputs_are_told_apart():
    rec = two_inputs()
    fr = pt.analyze.spa(rec, n=128)
    assert fr.G.shape == (64, 2, 2) and fr.coherence.shape == (64, 2)
    off = np.abs(fr.G - truth(fr.w))
    assert np.mean(off[fr.coherent] < fr.radius[fr.coherent]) == approx(0.95, abs=0.04)
    # Each alone would take the other for a disturbance; both together explain y.
    found = pt.analyze.coherence(rec, n=128)
    assert (found.multiple[:10, 0] > found.value[:10, 0].max(axis=1)).all()
    # The same with one input at a time is the simple formula.
    one = pt.analyze.spa(pt.Record(u=rec.u[:, 1], y=rec.y[:, 1], Ts=1.0), n=128)
    assert one.G.shape == (64, 1, 1)


def test_inputs_that_move_together_are_refused():
    rec = two_inputs()
    u = np.column_stack([rec.u[:, 0], 2 * rec.u[:, 0] + 1])
    with pytest.raises(pt.NotIdentifiable, match="X11"):
        pt.analyze.spa(pt.Record(u=u, y=rec.y, Ts=1.0), n=128)


def test_segments_are_honoured():
    """Two experiments at other levels: as if their spectra were averaged."""
    a, b = measured(1000, seed=1), measured(1000, seed=2)
    u, y = (np.concatenate([getattr(r, c)[:, 0] for r in (a, b)]) for c in "uy")
    y[1000:] += 40
    joined = pt.analyze.spa(pt.Record(u=u, y=y, Ts=1.0, starts=[0, 1000]), n=128)
    true = plant(joined.w)
    part = joined.coherent & (joined.w < 1)
    assert np.abs(joined.G[:, 0, 0] - true)[part].max() < 0.15
    # Joined without saying so, the jump is taken for a disturbance.
    careless = pt.analyze.spa(pt.Record(u=u, y=y, Ts=1.0), n=128)
    assert careless.coherence[0, 0] < joined.coherence[0, 0]


def test_rows_that_do_not_count_are_skipped():
    rec = measured(2000)
    y = np.array(rec.y[:, 0])
    y[700:720] = 1e5
    valid = np.ones(2000, bool)
    valid[700:720] = False
    fr = pt.analyze.spa(pt.Record(u=rec.u, y=y, Ts=1.0, valid=valid), n=128)
    part = fr.coherent & (fr.w < 1)
    assert np.abs(fr.G[:, 0, 0] - plant(fr.w))[part].max() < 0.15


def test_what_cannot_be_analysed_is_refused():
    rec = measured(200)
    with pytest.raises(pt.NotIdentifiable, match="X01"):
        pt.analyze.spa(pt.Record(u=np.ones(200), y=rec.y, Ts=1.0))
    with pytest.raises(pt.NotIdentifiable, match="X03"):
        pt.analyze.spa(rec, n=256)
    with pytest.raises(pt.NotIdentifiable, match="X03"):
        pt.analyze.etfe(pt.Record(u=rec.u[:12], y=rec.y[:12], Ts=1.0))
    for wrong in ({"method": "fft"}, {"M": 2}, {"M": 100}, {"memory": 0.0}, {"window": "?"}):
        with pytest.raises(pt.UsageError, match="U01"):
            pt.analyze.spa(rec, **wrong)
    with pytest.raises(pt.UsageError, match="half"):
        pt.analyze.etfe(two_inputs(), half=0)
    with pytest.raises(pt.UsageError, match="half"):
        pt.analyze.etfe(rec, half=80)
    with pytest.raises(pt.UsageError, match="method"):
        pt.analyze.coherence(rec, method="etfe")


def test_no_relation_is_said_and_shown():
    rng = np.random.default_rng(3)
    rec = pt.Record(u=held(2000, 3, 1), y=rng.normal(size=2000), Ts=1.0)
    found = pt.analyze.coherence(rec, n=128)
    assert "X04" in {note.code for note in found.notes}
    # Of 64 frequencies chance exceeds the limit at about three.
    assert np.mean(found.value > found.limit) < 0.15


def coverage(records, limit=1.0, **way):
    inside = []
    for rec in records:
        fr = pt.analyze.spa(rec, **way)
        part = (fr.w > 0.02) & (fr.w < 2.0)
        inside.append((np.abs(fr.G[:, 0, 0] - plant(fr.w)) < fr.radius[:, 0, 0])[part])
    return np.mean(np.concatenate(inside))


def test_the_discs_hold_what_they_promise():
    records = [measured(2000, seed=seed) for seed in range(20)]
    assert coverage(records) == approx(0.95, abs=0.025)


def test_coherence_bands_cover():
    """Long records tell the true coherence; short ones must hold it."""
    true = pt.analyze.coherence(measured(400_000, hold=1, sd=0.5), n=64)
    inside = []
    for seed in range(30):
        found = pt.analyze.coherence(measured(2000, hold=1, sd=0.5, seed=seed), n=64)
        inside.append((found.low <= true.value) & (true.value <= found.high))
    assert np.mean(inside) == approx(0.95, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("hold", [1, 10])
@pytest.mark.parametrize("N", [600, 1000, 4000])
def test_the_discs_hold_for_short_and_long_records_and_slow_clocks(N, hold):
    records = [measured(N, hold=hold, seed=seed) for seed in range(200)]
    assert 0.925 <= coverage(records) <= 0.985
