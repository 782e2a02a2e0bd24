"""Frequency response with the model's uncertainty."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from plantune import _core
from plantune.estimate import Fit
from plantune.models import PolyModel, ProcessModel
from plantune.plot.style import (
    BAND,
    SECOND_BAND,
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
from plantune.tune import bode_band

POINTS = 300
DECADES = {"dtick": "D2", "tickformat": "~g"}
"""Ticks at 1, 2 and 5 of every decade."""


def bode(
    *fits: Fit, of: Record | None = None, input: int = 0, w: ArrayLike | None = None
) -> go.Figure:
    """Draw magnitude and phase over frequency, with their 95 % bands.

    Parameters
    ----------
    *fits : Fit
        The first is blue, the second orange; sampled models end at half the sampling rate.
    of : Record, optional
        Gives names and units.
    input : int
        Which input.
    w : array, optional
        Frequencies in rad/s; by default around `1/(T + L)` and up to where the dead time has
        turned the phase by more than 180 degrees.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    >>> fig = bode(fit)
    >>> fig.layout.xaxis2.title.text, fig.layout.yaxis2.title.text
    ('frequency [rad/s]', 'phase [°]')
    """
    names = Names(of, input)
    grid = _grid(fits) if w is None else np.asarray(w, float)
    methods = " and ".join(inert(fit.method) for fit in fits)
    fig = figure(
        f"Frequency response of {methods}, 95 % bands",
        f"{record_name(fits[0].source)}: from {inert(names.u)} to {inert(names.y)}",
        [210, 210],
    )
    for k, fit in enumerate(fits):
        color, shade = SEQUENCE[k % len(SEQUENCE)], (BAND, SECOND_BAND)[k % 2]
        ws = grid[grid <= np.pi / fit.model.Ts] if isinstance(fit.model, PolyModel) else grid
        magnitude, phase = bode_band(fit, ws, input)
        label, of_fit = inert(fit.method), f"95 % of {inert(fit.method)}"
        band(fig, ws, *magnitude, of_fit, shade)
        band(fig, ws, *phase, of_fit, shade, row=2, showlegend=False)
        gain = np.abs(fit.model.freqresp(ws, input))
        line(fig, ws, gain, label, color, legendgroup=label)
        degrees = _core.phase_deg(fit.model, input, ws)
        line(fig, ws, degrees, label, color, row=2, legendgroup=label, showlegend=False)
    fig.update_xaxes(type="log", **DECADES)
    fig.update_xaxes(title_text=axis("frequency", f"rad/{names.time_unit}"), row=2, col=1)
    magnitude_title = axis("magnitude", names.gain_unit)
    fig.update_yaxes(title_text=magnitude_title, type="log", **DECADES, row=1, col=1)
    fig.update_yaxes(title_text=axis("phase", "°"), dtick=90, row=2, col=1)
    return fig


def _grid(fits: tuple[Fit, ...]) -> Floats:
    for fit in fits:
        if isinstance(fit.model, ProcessModel):
            T, L = sum(fit.model.times), fit.model.L
            top = max(10 / (T + L), min(4 / L, 1000 / (T + L)) if L > 0 else 0.0)
            return np.geomspace(0.05 / (T + L), top, POINTS)
    Ts = fits[0].Ts or 1.0
    return np.geomspace(1e-3 * np.pi / Ts, np.pi / Ts, POINTS)
