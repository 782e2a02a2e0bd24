"""A measured frequency response, its coherence, and models over it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go

from plantune import _core
from plantune.estimate import Fit
from plantune.models import FrequencyResponse
from plantune.models.base import LinearModel
from plantune.models.frequency_response import COHERENT, Band
from plantune.plot.style import (
    MEASURED,
    Names,
    axis,
    band,
    figure,
    inert,
    line,
    look,
    record_name,
)
from plantune.record import Floats, Record

GREY = "rgba(134, 141, 150, 0.28)"
POINTS = 400
DECADES = {"dtick": "D2", "tickformat": "~g"}
"""Ticks at 1, 2 and 5 of every decade."""


def frequency(
    fr: FrequencyResponse,
    *fits: Fit | LinearModel,
    of: Record | None = None,
    input: int = 0,
    output: int = 0,
) -> go.Figure:
    """Draw magnitude, phase and coherence with 95 % bands, blank where y does not follow u.

    Parameters
    ----------
    fr : FrequencyResponse
        From `analyze.spa`, `analyze.etfe` or measured elsewhere.
    *fits : Fit or model
        Drawn over it, sampled behind a hold where `fr` is sampled.
    of : Record, optional
        Gives names and units.
    input, output : int
        Which pair.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> fig = frequency(pt.analyze.spa(rec, n=128), pt.estimate.process(rec, "P2D"), of=rec)
    >>> fig.layout.title.text
    'Frequency response from power to temp'
    """
    names = Names(of, input)
    y_name = of.y_names[output] if of is not None else fr.y_names[output]
    u_name = names.u if of is not None else fr.u_names[input]
    has_coherence = fr.coherence is not None
    heights = [210, 180, 110] if has_coherence else [210, 210]
    method = fr.method or f"{fr.n} frequencies"
    origin = f"{record_name(fr.source)}: " if fr.source else ""
    fig = figure(
        f"Frequency response from {inert(u_name)} to {inert(y_name)}",
        f"{origin}{inert(method, 90)}",
        heights,
    )
    _measured(fig, fr, fr.bode(output, input))
    for k, fit in enumerate(fits):
        _model(fig, fr, fit, input, k)
    if fr.coherence is not None:
        curve = fr.coherence[:, output]
        line(fig, fr.w, curve, "coherence", MEASURED, row=3, width=1.2, showlegend=False)
        fig.add_hline(COHERENT, line={"color": MEASURED, "width": 1, "dash": "dot"}, row=3, col=1)
        fig.update_yaxes(
            title_text=axis("coherence", "1"), range=[0, 1.05], dtick=0.5, row=3, col=1
        )
    fig.update_xaxes(type="log", **DECADES)
    fig.update_xaxes(
        title_text=axis("frequency", f"rad/{names.time_unit}"), row=len(heights), col=1
    )
    magnitude_title = axis("magnitude", names.gain_unit)
    fig.update_yaxes(title_text=magnitude_title, type="log", **DECADES, row=1, col=1)
    spans = [trace.y for trace in fig.data if trace.yaxis == "y2" and trace.name != "measured"]
    turns = max((float(np.nanmax(y) - np.nanmin(y)) for y in spans), default=0.0)
    dtick = 90 if turns < 540 else 180
    fig.update_yaxes(title_text=axis("phase", "°"), dtick=dtick, row=2, col=1)
    return fig


def _measured(fig: go.Figure, fr: FrequencyResponse, bode: tuple[Band, Band]) -> None:
    """Points with their bands, one band for each run of coherent points."""
    kept = fr.coherent & (fr.w > 0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(int)))
    runs = [slice(int(a), int(b)) for a, b in pairwise(edges)][::2]
    first = True
    for row, curve in enumerate(bode, 1):
        for run in runs:
            low, high = curve.low[run], curve.high[run]
            known = np.isfinite(low) & np.isfinite(high)
            if known.all():
                x, low, high = _widened(fr.w[run], low, high)
                # A magnitude band down to zero ends at the bottom of a logarithmic axis.
                low = np.maximum(low, 1e-3 * curve.value[run].min()) if row == 1 else low
                band(fig, x, low, high, "95 % of measured", GREY, row=row, showlegend=first)
                first = False
        marks = {"color": MEASURED, "size": 4}
        fig.add_trace(
            go.Scatter(
                x=fr.w[kept], y=curve.value[kept], name="measured", mode="markers", marker=marks,
                legendgroup="measured", showlegend=row == 1,
            ),
            row=row, col=1,
        )  # fmt: skip


def _widened(w: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """Return a band of a single point a hair wide, so that it is seen."""
    if len(w) > 1:
        return w, low, high
    return np.array([0.99 * w[0], 1.01 * w[0]]), low.repeat(2), high.repeat(2)


def _model(fig: go.Figure, fr: FrequencyResponse, fit: Any, input: int, k: int) -> None:
    model, label = (
        (fit.model, inert(fit.method)) if isinstance(fit, Fit) else (fit, inert(type(fit).__name__))
    )
    w = fr.w[fr.w > 0]
    grid = np.minimum(np.geomspace(w[0], w[-1], POINTS), w[-1])
    G = _core.frequency_seen(model, input, fr.Ts, grid)
    color, dash = look(k)
    curves = FrequencyResponse(w=grid, G=G, Ts=fr.Ts).bode()
    for row, curve in enumerate(curves, 1):
        line(
            fig, grid, curve.value, label, color, row=row, dash=dash,
            legendgroup=label, showlegend=row == 1,
        )  # fmt: skip
