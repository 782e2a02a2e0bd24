"""The settled cycle of a relay test."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

from plantune.plot.record import thinned
from plantune.plot.style import MEASURED, MODEL, SET_POINT, Names, axis, figure, line, record_name
from plantune.record import Floats, Record
from plantune.tune import RelayTest

VIEW = 4
"""Periods of the first view; the curves go on to the right."""


def relay(test: RelayTest, of: Record | None = None) -> go.Figure:
    """Draw the settled periods as measured and as the inverted model has them, above the relay.

    Dashed: the outputs at which the relay switched.

    Parameters
    ----------
    test : RelayTest
        From `tune.relay`.
    of : Record, optional
        Gives names and units.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=3.0, L=1.0)
    >>> rec = pt.simulate.relay(plant, high=2.0, low=-1.0, hysteresis=0.1, Ts=0.05, t_end=60.0)
    >>> relay(pt.tune.relay(rec)).layout.title.text
    'Relay test: K = 2, T = 3, L = 1 s'
    """
    names = Names(of)
    fig = figure(
        f"Relay test: K = {test.K:.4g}, T = {test.T:.4g}, L = {test.L:.4g} {names.time_unit}",
        f"{record_name(test.source)}: {test.periods} settled periods, "
        f"{test.t_on:.4g} {names.time_unit} high and {test.t_off:.4g} {names.time_unit} low",
        [260, 110],
    )
    line(fig, *_drawn(test, test.y), "measured", MEASURED, width=2.4)
    line(fig, *_drawn(test, test.yhat), "model of the cycle", MODEL, width=1.6)
    ends = [test.t[0], test.t[-1]]
    dashed: dict[str, Any] = {"dash": "dash", "width": 1.2, "opacity": 0.6}
    for k, level in enumerate(test.thresholds):
        name = "relay switches"
        line(fig, ends, [level, level], name, SET_POINT, showlegend=k == 0, **dashed)
    line(fig, *_drawn(test, test.u), "relay", MEASURED, row=2, held=True, showlegend=False)
    period = test.t_on + test.t_off
    fig.update_xaxes(range=[ends[0], min(ends[1], ends[0] + VIEW * period)])
    fig.update_xaxes(title_text=axis("time", names.time_unit), row=2, col=1)
    fig.update_yaxes(title_text=axis(names.y, names.y_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis(names.u, names.u_unit), row=2, col=1)
    return fig


def _drawn(test: RelayTest, x: Floats) -> tuple[Floats, Floats]:
    return thinned(test.t, x, x, (slice(0, len(x)),))
