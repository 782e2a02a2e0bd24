"""How the noise of a signal is distributed, and how it hangs together in time."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.analyze import NoiseReport
from plantune.plot.style import MEASURED, MODEL, axis, band, figure, inert, line, record_name
from plantune.text import number


def noise(report: NoiseReport) -> go.Figure:
    """Draw the histogram beside a normal law, and the autocorrelation in the band of white noise.

    Parameters
    ----------
    report : NoiseReport
        From `analyze.noise`.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> e = np.random.default_rng(1).normal(size=400)
    >>> fig = noise(pt.analyze.noise(pt.Record(u=np.zeros(400), y=20 + e, Ts=0.1)))
    >>> fig.layout.title.text, fig.layout.xaxis2.title.text
    ('Noise of y: sd 0.91', 'lag [rows]')
    """
    name, bins = inert(report.signal), report.histogram
    unit = f" {inert(report.unit, 12)}" if report.unit else ""
    fig = figure(
        f"Noise of {name}: sd {number(report.var**0.5, 3)}{unit}",
        f"{record_name(report.source)}: {report.N} rows; bins by {bins.rule}",
        [230, 200],
        gap=84,
    )
    widths = bins.edges[1:] - bins.edges[:-1]
    marker = {"color": MEASURED, "opacity": 0.55, "line": {"width": 0}}
    fig.add_trace(
        go.Bar(x=bins.centres, y=bins.density, width=widths, name="rows", marker=marker),
        row=1, col=1,
    )  # fmt: skip
    line(fig, bins.centres, bins.normal, "normal law", MODEL)
    stems = {"color": MEASURED, "opacity": 0.8, "line": {"width": 0}}
    fig.add_trace(
        go.Bar(
            x=report.lags[1:], y=report.R[1:], name="autocorrelation", marker=stems,
            showlegend=False,
        ),
        row=2, col=1,
    )  # fmt: skip
    ends = [0.5, len(report.R) - 0.5]
    edge = [report.R_band, report.R_band]
    band(fig, ends, [-report.R_band, -report.R_band], edge, "95 % of white noise", row=2)
    fig.update_layout(bargap=0.25)
    fig.update_xaxes(title_text=axis(report.signal, report.unit), row=1, col=1)
    fig.update_yaxes(title_text=axis("density", f"1/{report.unit}" if report.unit else ""), row=1)
    fig.update_xaxes(title_text=axis("lag", "rows"), row=2, col=1)
    fig.update_yaxes(title_text="R(lag) [1]", range=[-1.0, 1.0], row=2, col=1)
    return fig
