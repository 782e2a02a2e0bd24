"""Impulse and step response of a record without a model, and models over it."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from plantune.analyze import ImpulseResponse
from plantune.estimate import Fit
from plantune.models import PolyModel, ProcessModel, TransferFunction
from plantune.plot.style import (
    MEASURED,
    SEQUENCE,
    Names,
    axis,
    band,
    figure,
    inert,
    line,
    record_name,
)
from plantune.record import Floats, Record

MEASURED_BAND = "rgba(134, 141, 150, 0.22)"
WIDTH = 1.96
"""Half width of a 95 % band, standard deviations."""


def impulse(
    found: ImpulseResponse,
    *models: Fit | PolyModel | ProcessModel | TransferFunction,
    of: Record | None = None,
    input: int = 0,
) -> go.Figure:
    """Draw the taps with their 95 % bands, and the step response that they sum to.

    Parameters
    ----------
    found : ImpulseResponse
        From `analyze.impulse`.
    *models : Fit, or a linear model of `plantune.models`
        Drawn over it: a model that is true lies within the bands.
    of : Record, optional
        Gives units.
    input : int
        Which input.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> fig = impulse(pt.analyze.impulse(rec, n=40), pt.estimate.process(rec), of=rec)
    >>> [trace.name for trace in fig.data if trace.name]
    ['95 % band', 'record', '95 % band', 'record', 'P1D', 'P1D']
    """
    names = Names(of, input)
    u, y = inert(found.inputs[input]), inert(found.output)
    way = f"{found.kernel.upper()} prior" if found.kernel else "least squares"
    fig = figure(
        f"Response of {y} to {u} without a model",
        f"{record_name(found.source)}: {len(found.lags)} taps, {way}, {found.N} rows, 95 % bands",
        [230, 250],
    )
    single = found.g.ndim == 1
    curves = [(found.g, found.sd), (found.step, found.step_sd)]
    for row, (x, sd) in enumerate(curves, 1):
        x, sd = (x, sd) if single else (x[:, input], sd[:, input])
        shown = {"showlegend": row == 1, "row": row}
        low, high = x - WIDTH * sd, x + WIDTH * sd
        band(fig, found.t, low, high, "95 % band", MEASURED_BAND, **shown)
        line(fig, found.t, x, "record", MEASURED, row, showlegend=row == 1)
        fig.data[-1].update(mode="lines+markers", marker={"size": 5})
    for k, model in enumerate(models):
        _over(fig, found, model, input, SEQUENCE[k % len(SEQUENCE)])
    fig.add_hline(y=0, line={"width": 1, "color": MEASURED, "dash": "dot"}, row=1, col=1)
    fig.update_xaxes(range=[0.0, found.t[-1]])
    fig.update_xaxes(title_text=axis("time", names.time_unit), row=2, col=1)
    fig.update_yaxes(title_text=axis("per sample", names.gain_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis("step", names.gain_unit), row=2, col=1)
    return fig


def _over(fig: go.Figure, found: ImpulseResponse, model: Any, input: int, color: str) -> None:
    """Draw a model's taps and steps at the same lags."""
    name = inert(model.method if isinstance(model, Fit) else type(model).__name__)
    plant = model.model if isinstance(model, Fit) else model
    times = np.concatenate([[found.t[0] - (found.t[1] - found.t[0])], found.t])
    step: Floats = plant.step(np.maximum(times, 0.0), input)
    step[times < 0] = 0.0
    line(fig, found.t, np.diff(step), name, color, 1)
    line(fig, found.t, step[1:], name, color, 2, showlegend=False)
