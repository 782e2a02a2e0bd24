"""A filter over a record: estimates stay, and what the filter cannot know is marked."""

import numpy as np
import pytest
from pytest import approx
from scipy import signal

import plantune as pt
from contract.records import TRUE_ARX, b0, check_refusal, codes

FILTERS = {
    "low": pt.prep.lowpass,
    "high": lambda rec: pt.prep.highpass(rec, order=3),
    "band": pt.prep.bandpass,
}
REST = (400.0 - pt.datasets.engine.ENGINE_LOOP.offset) / pt.datasets.engine.ENGINE_LOOP.K


def engine_from_rest():
    """Return the engine loop with rows before its first switch: its own row 0 has moved already."""
    rec = pt.datasets.engine_loop()

    def before(x, level):
        return np.concatenate([np.full((20, 1), level), x])

    return pt.Record(
        u=before(rec.u, REST), y=before(rec.y, 400.0), r=before(rec.r, 400.0), Ts=rec.Ts
    )


def moving_b0(**fields):
    """Return B0 without noise, begun in mid-motion."""
    u, y = b0(N=1100, sd=0.0)
    return pt.Record(u=u[37:], y=y[37:], Ts=0.1, **fields)


# --- estimates stay ---


@pytest.mark.parametrize("through", FILTERS.values(), ids=FILTERS)
def test_a_record_from_rest_keeps_its_estimates(through):
    rec = engine_from_rest()
    truth = pt.datasets.engine.ENGINE_LOOP
    a1 = -np.exp(-rec.Ts / truth.T)
    assert pt.estimate.arx(through(rec), 1, 1, 6).theta == approx(
        [a1, truth.K * (1 + a1)], abs=1e-9
    )
    assert pt.estimate.process(through(rec)).theta == approx([truth.K, truth.T, truth.L], abs=1e-9)


def test_the_low_pass_keeps_the_estimates_of_the_engine_loop():
    rec = pt.datasets.engine_loop()
    fit = pt.estimate.arx(pt.prep.lowpass(rec), 1, 1, 6)
    assert fit.theta == approx(pt.estimate.arx(rec, 1, 1, 6).theta, abs=1e-9)


@pytest.mark.parametrize("w", [20.0, 5.0])
def test_a_record_in_mid_motion_keeps_its_estimates(w):
    out = pt.prep.lowpass(moving_b0(), w=w)
    assert out.notes == () and not out.valid[0, 0]
    assert pt.estimate.arx(out, 1, 1, 1).theta == approx(TRUE_ARX, abs=1e-9)
    # It is the marks that do it.
    unmarked = pt.Record(u=out.u, y=out.y, Ts=out.Ts)
    assert np.abs(pt.estimate.arx(unmarked, 1, 1, 1).theta - TRUE_ARX).max() > 1e-4


def test_filtering_y_alone_would_not_keep_them():
    rec = moving_b0()
    alone = pt.Record(u=rec.u, y=pt.prep.lowpass(rec, w=5.0).y, Ts=rec.Ts)
    assert np.abs(pt.estimate.arx(alone, 1, 1, 1).theta - TRUE_ARX).max() > 0.05


# --- what is filtered ---


def test_each_segment_is_filtered_on_its_own():
    rng = np.random.default_rng(3)
    x = rng.normal(50, 1, (600, 5))
    rec = pt.Record(
        u=x[:, :2], y=x[:, 2:4], r=x[:, 3:1:-1], aux={"load": x[:, 4]}, Ts=0.02, starts=[0, 250]
    )
    out = pt.prep.lowpass(rec, order=3, w=30.0)
    sos = signal.butter(3, 30.0, fs=2 * np.pi / 0.02, output="sos")
    zi = signal.sosfilt_zi(sos)
    for name in ("u", "y", "r"):
        for j in range(2):
            for part in rec.segments:
                column = getattr(rec, name)[part, j]
                expected, _ = signal.sosfilt(sos, column, zi=zi * column[0])
                assert getattr(out, name)[part, j] == approx(expected, abs=1e-11)
    assert np.array_equal(out.aux["load"], rec.aux["load"])
    assert (out.source, out.Ts, out.N) == (rec.source, rec.Ts, rec.N)
    assert np.array_equal(out.rows, rec.rows) and np.array_equal(out.starts, rec.starts)


def test_the_log_says_what_was_done():
    out = pt.prep.bandpass(engine_from_rest())
    assert out.log[-1].startswith(
        "band-pass Butterworth of order 5, 1 to 20 rad/s, on u, y and r: 302 outputs marked, 0.3"
    )


# --- the unknown start ---


def test_rows_are_marked_until_the_start_is_forgotten():
    rec = moving_b0(starts=[0, 600])
    out = pt.prep.lowpass(rec)
    rows = pt.prep.Butterworth("low", 5, 20.0, rec.Ts).forgets(1e-6)
    first = [*range(rows), *range(600, 600 + min(rows, 46))]
    assert np.flatnonzero(~out.valid[:, 0]).tolist() == first


def test_f02_a_tenth_of_each_segment_at_most_is_marked():
    out = pt.prep.bandpass(moving_b0(starts=[0, 600]))
    assert np.flatnonzero(~out.valid[:, 0]).tolist() == [*range(60), *range(600, 646)]
    (note,) = out.notes
    design = pt.prep.Butterworth("band", 5, (1.0, 20.0), 0.1)
    assert (note.code, note.severity, note.count, note.limit) == ("F02", "warning", 2, 0.02)
    assert note.where.row == 0
    assert design.forgets(note.measured) == 46 < design.forgets(0.999 * note.measured)


def test_f02_is_a_limit():
    rec, limits = moving_b0(), pt.Limits(F02=0.2)
    assert codes(pt.prep.bandpass(rec)) == ["F02"]
    changed = pt.prep.bandpass(rec, limits=limits).notes
    assert [note.severity for note in changed] == ["info"]
    assert "F02 is 0.2 instead of 0.02" in changed[0].text
    once_more = pt.prep.lowpass(pt.prep.bandpass(rec, limits=limits), limits=limits)
    assert once_more.notes == changed


# --- holes ---


def with_hole(rows, value):
    """Return the engine loop with outputs that do not count, and its filtered twin without."""
    rec = pt.datasets.engine_loop(noise_var=1.5)
    y, valid = rec.y.copy(), np.ones(rec.N, bool)
    y[rows], valid[rows] = value, False
    return rec, pt.Record(u=rec.u, y=y, r=rec.r, Ts=rec.Ts, valid=valid)


@pytest.mark.parametrize("value", [np.nan, -9999.0, 65535.0])
def test_what_counts_behind_a_hole_is_what_it_would_be_without(value):
    rec, holed = with_hole(slice(1000, 1005), value)
    plain, out = pt.prep.lowpass(rec), pt.prep.lowpass(holed)
    lost = np.flatnonzero(plain.valid & ~out.valid)
    assert lost[0] == 1000 and 1005 + 100 < lost[-1] < 1005 + 130
    # 1e-6 of what the held value missed, below 100.
    assert out.y[out.valid] == approx(plain.y[out.valid], abs=1e-4)
    assert np.array_equal(out.u, plain.u)


def test_d07_holes_that_a_filter_spreads_too_far():
    _, holed = with_hole(slice(1000, 1005), np.nan)
    with pytest.raises(pt.DataError) as caught:
        pt.prep.bandpass(holed)
    check_refusal(caught.value, "D07", ("where", "count", "measured", "limit"))
    assert caught.value.where[:2] == ("y", 1000) and "segments" in caught.value.remedy


# --- M10 ---


@pytest.mark.parametrize(
    "through",
    [
        lambda rec: pt.prep.lowpass(rec, w=40.0),
        lambda rec: pt.prep.highpass(rec, w=np.pi / 0.1),
        lambda rec: pt.prep.bandpass(rec, w=(1.0, 31.5)),
    ],
    ids=["low", "high", "band"],
)
def test_m10_cut_off_at_or_above_nyquist(through):
    with pytest.raises(pt.NotIdentifiable) as caught:
        through(moving_b0())
    check_refusal(caught.value, "M10", ("where", "measured", "limit"))
    assert caught.value.limit == approx(np.pi / 0.1)
