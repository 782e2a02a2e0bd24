"""What each of four ways says about a delay."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from plantune.analyze import DelayEvidence
from plantune.plot.style import (
    BAND,
    MEASURED,
    MODEL,
    SECOND,
    Names,
    axis,
    band,
    figure,
    inert,
    line,
    record_name,
)
from plantune.record import Floats, Record

WIDTH = 1.96
"""Half width of a 95 % band, standard deviations."""


def delay_evidence(found: DelayEvidence, of: Record | None = None) -> go.Figure:
    """Draw four panels over the delay: OE weights, first taps, ARX loss, correlations.

    A dashed line marks the delay of the evidence, an orange mark what each way says.

    Parameters
    ----------
    found : DelayEvidence
        From `analyze.delay_evidence`.
    of : Record, optional
        Gives names.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fig = delay_evidence(pt.analyze.delay_evidence(pt.datasets.hair_dryer()))
    >>> fig.layout.title.text
    'Delay: 3 samples (100 %)'
    """
    names = Names(of, found.input)
    others = [str(nk) for nk in found.likely if nk != found.nk]
    plural = "" if found.nk == 1 else "s"
    also = f", or {' or '.join(others)}" if others else ""
    fig = figure(
        f"Delay: {found.nk} sample{plural} ({found.weight:.0%}){also}".replace("%)", " %)"),
        f"{record_name(found.source)}: from {inert(names.u)} to {inert(names.y)}, four ways",
        [130, 150, 130, 170],
    )
    _weights(fig, found)
    _taps(fig, found, names.gain_unit)
    _loss(fig, found, f"{names.y_unit}²" if names.y_unit else "y²")
    _correlations(fig, found)
    for row in range(1, 5):
        fig.add_vline(x=found.nk, line={"dash": "dash", "color": MODEL, "width": 1}, row=row, col=1)
    low, high = found.oe.candidates[[0, -1]]
    fig.update_xaxes(range=[min(low, 0) - 0.8, high + 0.8])
    fig.update_xaxes(title_text=axis("delay, or lag", "samples"), row=4, col=1)
    fig.update_layout(bargap=0.4)
    return fig


def _weights(fig: go.Figure, found: DelayEvidence) -> None:
    bars = go.Bar(
        x=found.oe.candidates,
        y=found.oe.weights,
        name="weight",
        marker={"color": MODEL},
        showlegend=False,
    )
    fig.add_trace(bars, row=1, col=1)
    fig.update_yaxes(title_text=axis("OE weight", "1"), range=[0, 1.05], row=1, col=1)


def _taps(fig: go.Figure, found: DelayEvidence, unit: str) -> None:
    h, i = found.impulse, found.input
    g, sd = (h.g, h.sd) if h.g.ndim == 1 else (h.g[:, i], h.sd[:, i])
    band(fig, h.lags, g - WIDTH * sd, g + WIDTH * sd, "95 % of the taps", BAND, 2)
    line(fig, h.lags, g, "taps", MEASURED, 2, showlegend=False)
    fig.data[-1].update(mode="lines+markers", marker={"size": 5})
    _mark(fig, h.lags, g, found.ways[1].nk, 2)
    fig.update_yaxes(title_text=axis("taps", unit), row=2, col=1)


def _loss(fig: go.Figure, found: DelayEvidence, unit: str) -> None:
    line(fig, found.arx.candidates, found.arx.loss, "loss", MEASURED, 3, showlegend=False)
    fig.data[-1].update(mode="lines+markers", marker={"size": 5})
    _mark(fig, found.arx.candidates, found.arx.loss, found.arx.nk, 3)
    fig.update_yaxes(title_text=axis("ARX loss", unit), row=3, col=1)


def _correlations(fig: go.Figure, found: DelayEvidence) -> None:
    r = found.correlation
    edge = np.full(len(r.lags), r.band)
    band(fig, r.lags, -edge, edge, "99.7 % of no relation", BAND, 4)
    line(fig, r.lags, r.raw, "raw", MEASURED, 4, dash="dot")
    line(fig, r.lags, r.prewhitened, "pre-whitened", MODEL, 4)
    fig.data[-1].update(mode="lines+markers", marker={"size": 5})
    _mark(fig, r.lags, r.prewhitened, r.first, 4)
    fig.update_yaxes(title_text=axis("correlation", "1"), row=4, col=1)


def _mark(fig: go.Figure, x: Any, y: Floats, at: int | None, row: int) -> None:
    """Mark what a way says."""
    here = x == at
    mark = go.Scatter(
        x=x[here],
        y=y[here],
        name="what this way says",
        mode="markers",
        marker={"color": SECOND, "size": 11},
        legendgroup="says",
        showlegend=row == 2,
    )
    fig.add_trace(mark, row=row, col=1)
