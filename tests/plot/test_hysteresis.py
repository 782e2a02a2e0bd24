"""A loop with its models."""

import numpy as np

import plantune as pt

REC = pt.datasets.piezo_stage(cycles=1)
X, Y = REC.u[:, 0], REC.y[:, 0]


def test_any_model_is_drawn_over_the_loop_and_below_it_what_it_leaves():
    plays = pt.hysteresis.PlayStack.identify(X, Y, n=5)
    curved = pt.hysteresis.PlayStack.identify(X, Y, asymmetric=True)
    fig = pt.plot.hysteresis(plays, X, Y, curved, of=REC)
    measured, first, left, second, _ = fig.data
    assert np.array_equal(measured.y, Y) and np.array_equal(measured.x, X)
    assert np.array_equal(first.y, plays.simulate(X))
    assert np.allclose(left.y, 100 * (first.y - Y) / np.ptp(Y))
    assert first.line.color != second.line.color
    assert fig.layout.xaxis.title.text == "voltage [V]" and "record" in str(fig.layout.title)


def test_elements_are_marked():
    slip = pt.hysteresis.SeriesSlip.identify(X, Y)
    marks = [trace for trace in pt.plot.hysteresis(slip, X, Y).data if trace.mode == "markers"]
    assert [len(trace.x) for trace in marks] == [len(slip.up), len(slip.down)]
    assert np.array_equal(marks[0].x, slip.up[:, 0])


def test_long_records_are_drawn_by_fewer_points():
    x = np.tile(X, 40)
    fig = pt.plot.hysteresis(pt.hysteresis.PlayStack(r=[0], w=[1]), x, x)
    assert len(fig.data[0].x) <= 20_000
