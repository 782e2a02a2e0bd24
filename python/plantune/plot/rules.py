"""Tuning rules side by side."""

from __future__ import annotations

from math import isfinite

import plotly.graph_objects as go

from plantune.plot.style import (
    AXIS,
    SET_POINT,
    Names,
    axis,
    figure,
    line,
    look,
    record_name,
    rule_name,
)
from plantune.record import Record
from plantune.tune import Comparison, Row


def rules(comparison: Comparison, of: Record | None = None) -> go.Figure:
    """Draw the output after a step of the set point above that after a step of the load.

    Parameters
    ----------
    comparison : Comparison
        Of tuning rules; the first is blue, the second orange.
    of : Record, optional
        Gives name and unit of the output.

    Returns
    -------
    plotly.graph_objects.Figure
        An unstable loop is named in the legend and not drawn.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=5.939, T=0.1491, L=0.1)
    >>> fig = rules(pt.tune.compare(plant, [pt.tune.simc, pt.tune.ziegler_nichols]))
    >>> [trace.name for trace in fig.data if trace.showlegend is None]
    ['set point', 'SIMC, tau c = L', 'Ziegler-Nichols']
    """
    names, rows = Names(of), comparison.rows
    fig = figure(
        f"{len(rows)} tunings of one plant: set point above, load below",
        f"{record_name(comparison.source)}: simulated unit steps; IAE after the load "
        + " / ".join(_error(row) for row in rows),
        [240, 200],
    )
    r = rows[0].set_point
    line(fig, r.t, r.r, "set point", SET_POINT, dash="dash", width=1.4, held=True)
    for k, row in enumerate(rows):
        label = rule_name(row.tuning.rule)
        color, dash = look(k)
        style = {"dash": dash, "legendgroup": label}
        if not row.tuning.margins.stable:
            line(fig, [None], [None], f"{label}: unstable", color, 1, **style)
            continue
        line(fig, row.set_point.t, row.set_point.y, label, color, 1, **style)
        line(fig, row.load.t, row.load.y, label, color, 2, showlegend=False, **style)
    fig.add_hline(0, line={"color": AXIS, "width": 1}, row=2, col=1)
    settled = [row.set_point.indices.settling for row in rows if row.tuning.margins.stable]
    longest = max((x for x in settled if isfinite(x)), default=0.0)
    if longest > 0:
        # The first view; the curves go on to the right.
        fig.update_xaxes(range=[0, min(float(r.t[-1]), 1.5 * longest)])
    fig.update_xaxes(title_text=axis("time", names.time_unit), row=2, col=1)
    fig.update_yaxes(title_text=axis(names.y, names.y_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis(f"{names.y} after load", names.y_unit), row=2, col=1)
    return fig


def _error(row: Row) -> str:
    return f"{row.load.indices.iae:.3g}" if row.tuning.margins.stable else "–"
