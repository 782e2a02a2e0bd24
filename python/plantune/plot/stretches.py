"""A long record with the stretches that say something of its plant."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.analyze import Informative
from plantune.plot.record import record
from plantune.plot.style import FRESH, MODEL, SECOND, record_name
from plantune.record import Record

IDENTIFIABLE = "rgba(23, 103, 176, 0.16)"


def stretches(rec: Record, found: Informative, steps: object = None) -> go.Figure:
    """Draw a record with its informative stretches shaded and the best of them ranked.

    Parameters
    ----------
    rec : Record
        The record that was searched.
    found : Informative
        What was found: dark where gain, time constant and delay can be identified, light where u
        drives y but the rows say too little.
    steps : OffsetSteps or Fit, optional
        Steps of the level, marked by a dashed line each.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5)
    >>> fig = pt.plot.stretches(rec, pt.analyze.informative(rec))
    >>> fig.layout.title.text
    'actuator → output, where it tells the plant'
    """
    fig = record(rec)
    title = fig.layout.title.text.replace("as recorded", "where it tells the plant")
    fig.update_layout(title={"text": title, "subtitle": {"text": _subtitle(found)}})
    for rank, s in enumerate(found.stretches):
        color = IDENTIFIABLE if s.identifiable else FRESH
        shape = {"x0": s.start, "x1": s.end, "fillcolor": color, "line_width": 0}
        fig.add_vrect(**shape, layer="below", row="all", col=1)
        if s.identifiable:
            fig.add_annotation(
                x=(s.start + s.end) / 2,
                y=1.0,
                xref="x",
                yref="y domain",
                yanchor="top",
                text=str(rank + 1),
                showarrow=False,
                font={"color": MODEL, "size": 14, "weight": 600},
            )
    for t in _times(steps):
        fig.add_vline(x=t, line={"color": SECOND, "dash": "dash", "width": 1.2}, row="all", col=1)
    shades = [("can be identified", IDENTIFIABLE), ("u drives y, but says too little", FRESH)]
    for name, color in shades:
        square = {"symbol": "square", "size": 14, "color": color, "line": {"width": 1}}
        fig.add_trace(go.Scatter(x=[None], y=[None], name=name, mode="markers", marker=square))
    if len(_times(steps)):
        dash = {"color": SECOND, "dash": "dash"}
        fig.add_trace(
            go.Scatter(x=[None], y=[None], name="the level steps", mode="lines", line=dash)
        )
    fig.update_layout(showlegend=True)
    return fig


def _subtitle(found: Informative) -> str:
    best, name = found.best, record_name(found.source)
    if best is None:
        return f"{name}: nowhere does the input clearly drive the output"
    count = f"{len(found.identifiable)} of {len(found.stretches)} stretches can be identified"
    return f"{name}: {count}; the best: K = {best.K:.3g} ± {best.sd[0]:.2g}"


def _times(steps: object) -> list[float]:
    """Return the times of the steps of an OffsetSteps, or of a fit."""
    if steps is None:
        return []
    fitted = getattr(steps, "steps", None)
    return [s.time for s in fitted] if fitted is not None else list(getattr(steps, "t", ()))
