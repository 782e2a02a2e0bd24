"""A loop, the model of it, and what the model leaves."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from plantune import _core
from plantune.hysteresis import SeriesSlip
from plantune.models.hysteresis.base import HysteresisModel, column
from plantune.plot.style import MEASURED, Names, axis, figure, line, look, record_name
from plantune.record import Floats, Record

MOST = 20_000
"""Points of a curve; of longer records every second, third, ... row is drawn."""


def hysteresis(
    model: HysteresisModel,
    x: ArrayLike,
    y: ArrayLike,
    *others: HysteresisModel,
    of: Record | None = None,
) -> go.Figure:
    """Draw a loop with the model over it, and below the error in percent of the range.

    The model starts in its virgin state with the first row.  Of a `SeriesSlip` the breakpoints are
    marked, where one element ends and the next begins.

    Parameters
    ----------
    model : PlayStack, SeriesSlip, ...
        Any model of `pt.hysteresis`.
    x, y : array (N,)
        Measured input and output.
    *others : PlayStack, ...
        Further models: orange, green, ...
    of : Record, optional
        Gives names and units.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.piezo_stage(cycles=1)
    >>> x, y = rec.u[:, 0], rec.y[:, 0]
    >>> slip = pt.hysteresis.SeriesSlip.identify(x, y)
    >>> fig = hysteresis(slip, x, y, of=rec)
    >>> fig.layout.yaxis2.title.text
    'error [% of range]'
    """
    x, y = column(x, "x"), column(y, "y")
    names = Names(of)
    models = (model, *others)
    judged = [_core.hysteresis_against(m, x, y) for m in models]
    labels = [f"{_name(m)}, {rms:.2g} % rms" for m, (_, _, rms) in zip(models, judged, strict=True)]
    fig = figure(
        f"Loop and model: {'; '.join(labels)}",
        f"{record_name(of.source) if of is not None else 'the record'}: {len(x)} rows, "
        "errors in percent of the range of the output",
        [360, 150],
        gap=62,  # the axes of the panels differ
    )
    shown = slice(None, None, -(-len(x) // MOST))
    line(fig, x[shown], y[shown], "measured", MEASURED, width=3.2)
    rows = np.arange(len(x))[shown]
    for k, (m, (f, e, _), label) in enumerate(zip(models, judged, labels, strict=True)):
        color, dash = look(k)
        line(fig, x[shown], f[shown], label, color, width=1.5, dash=dash, legendgroup=label)
        line(fig, rows, e[shown], label, color, 2, width=1.3, legendgroup=label, showlegend=False)
        if isinstance(m, SeriesSlip):
            _elements(fig, m, color)
    fig.update_xaxes(title_text=axis(names.u, names.u_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis(names.y, names.y_unit), row=1, col=1)
    fig.update_xaxes(title_text="row [1]", range=[0, 1.02 * (len(x) - 1)], row=2, col=1)
    fig.update_yaxes(
        title_text="error [% of range]", zeroline=True, zerolinecolor="#9aa3ad", row=2, col=1
    )
    return fig


def _name(model: HysteresisModel) -> str:
    """Return a kind of model as it is read: `play stack`, `series slip`."""
    return model.kind.replace("_", " ")


def _elements(fig: go.Figure, model: SeriesSlip, color: str) -> None:
    """Mark the breakpoints, those of the rising group by triangles that point up."""
    for group, way, symbol in (
        (model.up, "rising", "triangle-up"),
        (model.down, "falling", "triangle-down"),
    ):
        fig.add_trace(_marks(group, way, symbol, color), row=1, col=1)


def _marks(group: Floats, way: str, symbol: str, color: str) -> go.Scatter:
    return go.Scatter(
        x=group[:, 0],
        y=group[:, 1],
        mode="markers",
        name=f"elements, {way}",
        marker={
            "symbol": symbol,
            "size": 11,
            "color": color,
            "line": {"color": "#ffffff", "width": 1},
        },
        customdata=group[:, 2],
        hovertemplate="from %{x:.4g}, slope %{customdata:.4g}",
    )
