"""A plant with hysteresis that follows a reference: what is left, and the input that did it."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from plantune.hysteresis import Tracking
from plantune.plot.style import MEASURED, axis, figure, line, look

MOST = 20_000
"""Points of a curve; of longer runs every second, third, ... row is drawn."""


def tracking(
    runs: Tracking | dict[str, Tracking],
    *,
    x: str = "input",
    y: str = "output",
    x_unit: str = "",
    y_unit: str = "",
) -> go.Figure:
    """Draw the output over the reference, what is left of it, and the input.

    Output over reference is the loop that compensation leaves: a straight line where it is right.

    Parameters
    ----------
    runs : Tracking or dict
        Of `pt.hysteresis.track`; several by name, on the same reference.
    x, y : str
        Names of input and output.
    x_unit, y_unit : str
        Their units.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> plant = pt.hysteresis.PlayStack(r=[0, 0.5], w=[1, 1])
    >>> r = np.sin(np.arange(500) / 20)
    >>> gain = pt.hysteresis.PlayStack(r=[0], w=[0.5])
    >>> runs = {
    ...     "a mere gain": pt.hysteresis.track(plant, r, 0.1, inverse=gain),
    ...     "the inverse": pt.hysteresis.track(plant, r, 0.1, inverse=plant.inverse()),
    ... }
    >>> tracking(runs).layout.yaxis2.title.text
    'error [% of range]'
    """
    named = runs if isinstance(runs, dict) else {"y": runs}
    left = "; ".join(f"{name} {100 * run.relative:.2g} %" for name, run in named.items())
    first = next(iter(named.values()))
    fig = figure(
        f"Left of the reference: {left} rms",
        f"{len(first.r)} rows, percent of the range of the reference",
        [300, 140, 140],
        gap=62,  # the axes of the panels differ
    )
    line(
        fig,
        first.r[[first.r.argmin(), first.r.argmax()]],
        np.array(_ends(first)),
        "right",
        MEASURED,
    )
    for k, (name, run) in enumerate(named.items()):
        color, dash = look(k)
        shown = slice(None, None, -(-len(run.r) // MOST))
        more: dict[str, Any] = {"width": 1.5, "dash": dash, "legendgroup": name}
        line(fig, run.r[shown], run.y[shown], name, color, **more)
        left_over = 100 * (run.y - run.r) * run.relative / run.rms if run.rms else 0 * run.r
        line(fig, run.t[shown], left_over[shown], name, color, 2, showlegend=False, **more)
        line(fig, run.t[shown], run.u[shown], name, color, 3, showlegend=False, **more)
    fig.update_xaxes(title_text=axis("reference", y_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis(y, y_unit), row=1, col=1)
    fig.update_yaxes(title_text="error [% of range]", row=2, col=1)
    fig.update_xaxes(title_text="time [s]", row=2, col=1)
    fig.update_yaxes(title_text=axis(x, x_unit), row=3, col=1)
    fig.update_xaxes(title_text="time [s]", row=3, col=1)
    return fig


def _ends(run: Tracking) -> tuple[float, float]:
    return float(run.r.min()), float(run.r.max())
