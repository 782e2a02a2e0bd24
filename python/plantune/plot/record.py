"""The record as it was measured."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from plantune import _core
from plantune.plot.style import FRESH, MEASURED, SET_POINT, axis, figure, inert, line, record_name
from plantune.record import Floats, Record
from plantune.text import column
from plantune.validate import Verdict

BUCKETS = 600
"""Stretches per signal of which the least and greatest value are drawn."""


def record(rec: Record, fresh: Verdict | None = None) -> go.Figure:
    """Draw outputs and set point above the inputs, over one time axis.

    Parameters
    ----------
    rec : Record
        Of any length: of a long one the least and greatest values of each stretch are drawn.
        Lines break between segments and where an output does not count.
    fresh : Verdict, optional
        The rows it judged are shaded.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.Record(u=[0, 1, 1, 1], y=[0.0, 0.0, 0.4, 0.6], Ts=0.1, units={"y": "K"})
    >>> fig = record(rec)
    >>> fig.layout.yaxis.title.text, fig.layout.xaxis2.title.text
    ('y [K]', 'time [s]')
    """
    outputs, inputs = len(rec.y_names), len(rec.u_names)
    segments = len(rec.starts)
    parts = f", {segments} segments" if segments > 1 else ""
    inputs_read, outputs_read = (
        inert(", ".join(map(column, names))) for names in (rec.u_names, rec.y_names)
    )
    fig = figure(
        f"{inputs_read} → {outputs_read}, as recorded",
        f"{record_name(rec.source)}: {rec.N} rows every {rec.Ts:g} {rec.time_unit}{parts}",
        [220] * outputs + [max(90, 150 - 20 * inputs)] * inputs,
    )
    for i, name in enumerate(rec.y_names):
        row, y = i + 1, drawn(rec, rec.y[:, i], rec.valid[:, i])
        if rec.r is not None:
            dashed = {"dash": "dash", "width": 1.2, "opacity": 0.6, "held": True}
            label = f"set point of {inert(name)}"
            line(fig, *drawn(rec, rec.r[:, i]), label, SET_POINT, row, **dashed)
        line(fig, *y, inert(name), MEASURED, row, width=1.4, showlegend=rec.r is not None)
        fig.update_yaxes(title_text=axis(name, rec.units.get(name, "")), row=row, col=1)
    for i, name in enumerate(rec.u_names):
        row, u = outputs + i + 1, drawn(rec, rec.u[:, i])
        line(fig, *u, inert(name), MEASURED, row, width=1.4, held=True, showlegend=False)
        fig.update_yaxes(title_text=axis(name, rec.units.get(name, "")), row=row, col=1)
    fig.update_xaxes(title_text=axis("time", rec.time_unit), row=outputs + inputs, col=1)
    if fresh is not None and len(fresh.t):
        edges = {"x0": fresh.t[0], "x1": fresh.t[-1], "fillcolor": FRESH, "line_width": 0}
        fig.add_vrect(**edges, layer="below", row="all", col=1)
        square = {"symbol": "square", "size": 14, "color": FRESH, "line": {"width": 1}}
        shaded = {"name": "fresh rows, judged here", "mode": "markers", "marker": square}
        fig.add_trace(go.Scatter(x=[None], y=[None], **shaded), row=1, col=1)
    fig.update_layout(showlegend=rec.r is not None or fresh is not None)
    return fig


def drawn(rec: Record, x: Floats, valid: np.ndarray | None = None) -> tuple[Floats, Floats]:
    """Return times and values worth drawing, NaN wherever the line breaks."""
    counts = np.ones(rec.N, bool) if valid is None else valid
    # More breaks than a screen can show are no breaks.
    parts = rec.segments if len(rec.starts) <= BUCKETS else (slice(0, rec.N),)
    return thinned(rec.time, np.where(counts, x, np.nan), x, parts)


def thinned(t: Floats, x: Floats, held: Floats, parts: tuple[slice, ...]) -> tuple[Floats, Floats]:
    """Thin each part to its envelope and join them with breaks."""
    held = np.ascontiguousarray(held)
    times: list[Floats] = []
    values: list[Floats] = []
    for part in parts:
        share = max(1, round(BUCKETS * (part.stop - part.start) / len(x)))
        rows = _core.envelope(held, part.start, part.stop, share)
        times += [t[rows], t[rows[-1:]]]
        values += [x[rows], np.array([np.nan])]
    return np.concatenate(times[:-1]), np.concatenate(values[:-1])
