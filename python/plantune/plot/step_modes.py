"""The modes of a step response."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.estimate import StepModes
from plantune.estimate.step_modes import Mode
from plantune.plot.record import thinned
from plantune.plot.style import (
    BAND,
    MEASURED,
    MODEL,
    Names,
    axis,
    band,
    figure,
    line,
    look,
    record_name,
)
from plantune.record import Record

_FILLS = (BAND, "rgba(224, 122, 0, 0.16)", "rgba(42, 140, 106, 0.16)", "rgba(160, 60, 143, 0.16)")


def step_modes(found: StepModes, of: Record | None = None) -> go.Figure:
    """Draw a step response with its fitted curve, what each mode adds, and the residual.

    Bands are 95 %.  Modes that lie close have large parts of opposite sign, and wide bands.

    Parameters
    ----------
    found : StepModes
        From `estimate.idt`.
    of : Record, optional
        Gives names and units.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> y = 1 - np.exp(-np.arange(200) * 0.1 / 2.5)
    >>> found = pt.estimate.idt(pt.Record(u=np.ones(200), y=y, Ts=0.1))
    >>> step_modes(found).layout.title.text
    'Step response: T = 2.5 s'
    """
    names = Names(of)
    fig = figure(
        "Step response: " + _title(found),
        f"{record_name(found.source)}: {found.N} rows, order {found.order}, bands 95 %",
        [260, 150, 110],
    )
    t, y, curve = found.t, found.y, found.curve
    every = (slice(0, len(t)),)
    line(fig, *thinned(t, y, y, every), "measured", MEASURED, width=2.4)
    band(fig, t, *found.curve_band, "95 % of the curve")
    line(fig, t, curve, "sum of the modes", MODEL)
    for i, mode in enumerate(found.modes[: len(found.parts)]):
        low, high = (edge[i] for edge in found.parts_band)
        color, dash = look(i + 1)
        fill = _FILLS[(i + 1) % len(_FILLS)]
        band(fig, found.parts_t, low, high, _named(mode), fill, row=2, showlegend=False)
        line(fig, found.parts_t, found.parts[i], _named(mode), color, row=2, dash=dash)
    error = y - curve
    line(fig, *thinned(t, error, error, every), "residual", MEASURED, row=3, showlegend=False)
    fig.update_xaxes(title_text=axis("time", names.time_unit), row=3, col=1)
    for row, name in enumerate((names.y, "part of each", "residual"), start=1):
        fig.update_yaxes(title_text=axis(name, names.y_unit), row=row, col=1)
    return fig


def _title(found: StepModes) -> str:
    lags = ", ".join(f"{mode.T:.4g}" for mode in found.modes if mode.zeta is None)
    pairs = [_named(mode) for mode in found.modes if mode.zeta is not None]
    return "; ".join([*([f"T = {lags} s"] if lags else []), *pairs])


def _named(mode: Mode) -> str:
    if mode.zeta is None:
        return f"T = {mode.T:.4g} s"
    return f"pair near {mode.T:.4g} s, zeta {mode.zeta:.3g}"
