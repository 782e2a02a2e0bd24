"""M03 and D18: saturated and stuck rows are left out, and the log says so."""

import numpy as np
import pytest

import plantune as pt
from contract.records import codes, refused


def saturated(high, N=1000):
    """The plant gets the command cut at `high`; the record holds the command."""
    rng = np.random.default_rng(1)
    u, y = np.repeat(rng.uniform(0, 100, N // 10), 10), np.zeros(N)
    for k in range(1, N):
        y[k] = 0.8 * y[k - 1] + 0.5 * min(u[k - 1], high) + 0.05 * rng.normal()
    return pt.Record(u=u, y=y, Ts=0.1)


def test_m03_saturated_rows_are_left_out_and_the_plant_comes_back():
    rec = saturated(80.0)
    out = pt.prep.exclude(rec, u_limits=(0.0, 80.0))
    lost = int((rec.u >= 80).sum())
    assert out.N == rec.N - lost
    assert (out.u < 80).all()
    assert f"excluded {lost} of 1000 rows" in out.log[-1]
    assert codes(out) == ["M03"]
    assert out.notes[0].count == lost
    good = pt.estimate.arx(out, 1, 1, 1)
    assert abs(good.theta - [-0.8, 0.5]).max() < 0.01
    assert abs(pt.estimate.arx(rec, 1, 1, 1).theta - [-0.8, 0.5]).max() > 0.02


def test_m03_more_than_half_is_refused():
    error = refused(lambda: pt.prep.exclude(saturated(40.0), u_limits=(0.0, 40.0)), "M03", ())
    assert error.measured > error.limit == 0.5


def test_without_limits_nothing_is_taken_as_saturated():
    rec = saturated(80.0)
    assert pt.prep.exclude(rec) is rec


def test_d18_stuck_rows_are_left_out():
    rec = saturated(200.0)
    y = rec.y[:, 0].copy()
    y[400:650] = y[400]
    out = pt.prep.exclude(pt.Record(u=rec.u, y=y, Ts=0.1))
    assert (out.N, out.starts.tolist(), codes(out)) == (750, [0, 400], ["D18"])
    assert out.log[-1] == "excluded 250 of 1000 rows: y stuck"
    assert abs(pt.estimate.arx(out, 1, 1, 1).theta - [-0.8, 0.5]).max() < 0.01


def test_limits_that_do_not_ascend_are_u01():
    refused(lambda: pt.prep.exclude(saturated(80.0), u_limits=(1.0, 0.0)), "U01", ())


@pytest.mark.parametrize("edge", [0.0])
def test_segments_are_kept_apart(edge):
    rec = saturated(80.0)
    both = pt.Record.join([rec, rec])
    out = pt.prep.exclude(both, u_limits=(edge, 80.0))
    alone = pt.prep.exclude(rec, u_limits=(edge, 80.0))
    assert out.N == 2 * alone.N
    assert len(out.starts) == 2 * len(alone.starts)
