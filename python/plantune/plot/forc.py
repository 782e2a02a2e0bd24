"""Reversal curves, and the weights of relays that they are."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from plantune.hysteresis import Forc, Preisach
from plantune.plot.style import MEASURED, MODEL, SECOND, SET_POINT, axis, figure, line

POSITIVE = ((0.0, "#ffffff"), (1.0, MODEL))
SIGNED = ((0.0, SECOND), (0.5, "#ffffff"), (1.0, MODEL))
"""Negative weights orange, none white, positive ones blue."""


def forc(
    result: Forc | Preisach, *, x: str = "x", y: str = "y", x_unit: str = "", y_unit: str = ""
) -> go.Figure:
    """Draw the weight of the relays over where they go down and up, under the curves if known.

    Each cell has the weight of its relays, in units of the output; negative ones, which noise
    makes, are orange.

    Parameters
    ----------
    result : Forc or Preisach
        From `hysteresis.forc`, or a model.
    x, y : str
        Names of input and output.
    x_unit, y_unit : str
        Their units.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> model = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
    >>> forc(model).layout.title.text
    'Relays: 2 x 2 cells'
    """
    curves = result.curves if isinstance(result, Forc) else ()
    n = len(result.levels) - 1
    name = f"{len(curves)} reversal curves" if curves else f"Relays: {n} x {n} cells"
    fig = figure(
        name,
        "weight of the relays that go up at alpha and down at beta",
        [230, 330] if curves else [360],
        gap=76.0,
    )
    map_row = 2 if curves else 1
    for k, (xs, ys) in enumerate(curves):
        line(fig, xs, ys, "measured", MEASURED, width=1.2, showlegend=k == 0)
    if curves:
        fig.update_xaxes(title_text=axis(x, x_unit), row=1, col=1)
        fig.update_yaxes(title_text=axis(y, y_unit), row=1, col=1)
    _map(fig, result, axis("weight", y_unit), map_row)
    ends = result.levels[[0, -1]]
    dashed = {"dash": "dash", "width": 1.2, "opacity": 0.6}
    line(fig, ends, ends, "alpha = beta", SET_POINT, row=map_row, **dashed)
    fig.update_xaxes(title_text=axis("down at beta", x_unit), range=ends, row=map_row, col=1)
    fig.update_yaxes(title_text=axis("up at alpha", x_unit), range=ends, row=map_row, col=1)
    return fig


def _map(fig: go.Figure, result: Forc | Preisach, label: str, row: int) -> None:
    """Colour the cells on and below the diagonal."""
    mu = np.array(result.mu)
    known = np.tri(len(mu), dtype=bool)
    most, signed = np.abs(mu).max(), (mu < 0).any()
    bar = {"title": {"text": label, "side": "top", "font": {"size": 13}}, "thickness": 14}
    bar |= {"outlinewidth": 0, "tickfont": {"size": 12}}
    if row == 2:
        bar |= {"len": 0.56, "y": 0.0, "yanchor": "bottom"}
    heat = go.Heatmap(
        x=result.levels,
        y=result.levels,
        z=np.where(known, mu, np.nan),
        zmin=-most if signed else 0.0,
        zmax=most,
        colorscale=SIGNED if signed else POSITIVE,
        colorbar=bar,
        hovertemplate="beta %{x:.4g}<br>alpha %{y:.4g}<br>%{z:.4g}<extra></extra>",
        hoverongaps=False,
    )
    fig.add_trace(heat, row=row, col=1)
