"""What each delay leaves unexplained."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.analyze import DelayScan
from plantune.plot.style import MODEL, SECOND, Names, axis, figure, line, record_name
from plantune.record import Record


def delay(scan: DelayScan, of: Record | None = None) -> go.Figure:
    """Draw the loss of the best ARX model at each delay.

    The choice counts parameters as well (BIC), so it need not be the lowest point.

    Parameters
    ----------
    scan : DelayScan
        From `analyze.delay`.
    of : Record, optional
        Gives the unit of the output.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fig = delay(pt.analyze.delay(pt.datasets.hair_dryer()))
    >>> fig.layout.title.text, fig.layout.xaxis.title.text
    ('Delay: 3 samples, next best 2', 'delay nk [samples]')
    """
    names = Names(of)
    plural = "" if scan.nk == 1 else "s"
    fig = figure(
        f"Delay: {scan.nk} sample{plural}, next best {scan.runner_up}",
        f"{record_name(scan.source)}: one-step loss of the best ARX model at each delay, "
        f"{scan.N} rows",
        [250],
    )
    line(fig, scan.candidates, scan.loss, "loss", MODEL)
    fig.update_traces(mode="lines+markers", marker={"size": 6})
    best = scan.candidates == scan.nk
    marker = {"color": SECOND, "size": 12}
    fig.add_trace(
        go.Scatter(
            x=scan.candidates[best], y=scan.loss[best], name=f"best: nk = {scan.nk}",
            mode="markers", marker=marker,
        )
    )  # fmt: skip
    unit = f"{names.y_unit}²" if names.y_unit else ""
    fig.update_xaxes(title_text=axis("delay nk", "samples"))
    fig.update_yaxes(title_text=axis("loss", unit))
    return fig
