"""What the model leaves unexplained."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go

from plantune.plot.style import BAND, MODEL, figure, inert, record_name
from plantune.record import Record
from plantune.validate import Verdict


def residuals(verdict: Verdict, of: Record | None = None) -> go.Figure:
    """Draw the correlations of the one-step errors with their 99 % bands.

    Above the errors with themselves, from lag 1 (lag 0 is 1 by definition); below with each
    input, where a bar outside the band at a lag >= 0 is dynamics that the model misses.

    Parameters
    ----------
    verdict : Verdict
        Its `residuals`.
    of : Record, optional
        Gives the names of the inputs.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> verdict = pt.validate.check(val, pt.estimate.arx(est, 2, 2, 3))
    >>> residuals(verdict).layout.xaxis.title.text
    'lag [samples]'
    """
    r = verdict.residuals
    inputs = of.u_names if of is not None else tuple(f"u{i + 1}" for i in range(len(r.crosscorr)))
    inputs = ("u",) if of is None and len(r.crosscorr) == 1 else inputs
    fig = figure(
        f"Errors of {inert(verdict.name)} one step ahead: bars inside the band are chance",
        f"{record_name(verdict.source)}: {verdict.N} rows, bands 99 %",
        [170] * (1 + len(r.crosscorr)),
        gap=62,  # the lags of the panels differ
        bargap=0.5,
    )
    _bars(fig, 1, r.lags[1:], r.autocorr[1:], r.band, "errors with<br>themselves [1]", True)
    for i, curve in enumerate(r.crosscorr):
        name = f"errors with<br>{inert(inputs[i], 16)} [1]"
        _bars(fig, 2 + i, r.cross_lags, curve, float(r.cross_band[i]), name, False)
    return fig


def _bars(
    fig: go.Figure, row: int, lags: Any, values: Any, limit: float, name: str, legend: bool
) -> None:
    first, last = float(lags[0]) - 1, float(lags[-1]) + 1
    edges = {"x": [first, last], "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    fig.add_trace(go.Scatter(y=[-limit] * 2, showlegend=False, **edges), row=row, col=1)
    fill = {"fill": "tonexty", "fillcolor": BAND, "legendgroup": "band", "showlegend": legend}
    fig.add_trace(go.Scatter(y=[limit] * 2, name="99 % band", **edges, **fill), row=row, col=1)
    fig.add_trace(
        go.Bar(x=lags, y=values, name="correlation", marker_color=MODEL, showlegend=legend),
        row=row,
        col=1,
    )
    fig.update_xaxes(title_text="lag [samples]", range=[first, last], row=row, col=1)
    fig.update_yaxes(title_text=name, zeroline=True, zerolinecolor="#9aa3ad", row=row, col=1)
