"""Where the power of a signal lies over frequency."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.analyze import NoiseReport, Spectrum
from plantune.plot.style import (
    MEASURED,
    MODEL,
    Names,
    axis,
    band,
    figure,
    inert,
    line,
    record_name,
)
from plantune.record import Record

DECADES = {"dtick": "D2", "tickformat": "~g"}
"""Ticks at 1, 2 and 5 of every decade."""


def spectrum(found: Spectrum | NoiseReport, of: Record | None = None) -> go.Figure:
    """Draw a power spectral density with its 95 % band; of a noise report the periodogram too.

    Parameters
    ----------
    found : Spectrum or NoiseReport
        From `analyze.spectrum` or `analyze.noise`.
    of : Record, optional
        Gives the unit of the signal.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fig = spectrum(pt.analyze.spectrum(pt.datasets.hair_dryer(), n=128))
    >>> fig.layout.title.text, fig.layout.xaxis.title.text
    ('Spectrum of temp', 'frequency [rad/s]')
    """
    smooth = found.spectrum if isinstance(found, NoiseReport) else found
    names = Names(of)
    unit = (of.units if of is not None else {}).get(smooth.signal, "")
    stretches = f"{smooth.averaged} stretch{'es' if smooth.averaged > 1 else ''}"
    fig = figure(
        f"Spectrum of {inert(smooth.signal)}",
        f"{record_name(smooth.source)}: Welch, {stretches} of {smooth.n} rows, 95 % band",
        [320],
    )
    # On logarithmic axes there is no frequency zero.
    if isinstance(found, NoiseReport):
        raw = found.periodogram
        line(fig, raw.w[1:], raw.P[1:], "periodogram", MEASURED, width=0.7, opacity=0.55)
    band(fig, smooth.w[1:], smooth.low[1:], smooth.high[1:], "95 %")
    line(fig, smooth.w[1:], smooth.P[1:], "density", MODEL)
    fig.update_xaxes(type="log", title_text=axis("frequency", f"rad/{names.time_unit}"), **DECADES)
    density = f"{unit}²·{names.time_unit}/rad" if unit else ""
    fig.update_yaxes(type="log", title_text=axis("density", density, 30), exponentformat="power")
    return fig
