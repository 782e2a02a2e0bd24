"""A planned experiment: what is applied, and what is expected to come of it."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.analyze import Experiment
from plantune.plot.style import MODEL, SECOND, SET_POINT, Names, axis, figure, inert, line
from plantune.record import Record
from plantune.text import number


def experiment(plan: Experiment, of: Record | None = None) -> go.Figure:
    """Draw the expected output above the planned input, each within its limits.

    Parameters
    ----------
    plan : Experiment
        From `analyze.experiment`.  Dotted lines are its limits, where it has some.
    of : Record, optional
        Gives names and units.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fig = experiment(pt.analyze.experiment((2.0, 10.0, 3.4), 1.0, noise_sd=0.1, time=300.0))
    >>> fig.layout.title.text
    'gbn, amplitude 0.249: K ± 2.2 %, T ± 5 %, L ± 1.5 %'
    """
    names = Names(of)
    shares = ", ".join(f"{name} ± {number(100 * plan.relative[name], 2)} %" for name in "KTL")
    fig = figure(
        f"{plan.shape}, amplitude {number(plan.amplitude, 3)}: {shares}",
        f"planned for {inert(plan.source, 90)}; L as a share of T + L",
        [240, 150],
    )
    line(fig, plan.t, plan.y, f"{inert(names.y)}, expected, without noise", MODEL)
    line(fig, plan.t, plan.u, inert(names.u), SECOND, 2, held=True)
    _limits(fig, plan, plan.y_limits, 1)
    _limits(fig, plan, plan.u_limits, 2)
    fig.update_yaxes(title_text=axis(names.y, names.y_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis(names.u, names.u_unit), row=2, col=1)
    fig.update_xaxes(title_text=axis("time", "s"), row=2, col=1)
    return fig


def _limits(fig: go.Figure, plan: Experiment, limits: tuple[float, float] | None, row: int) -> None:
    for level in limits or ():
        first = all(trace.name != "limits" for trace in fig.data)
        ends, style = plan.t[[0, -1]], {"dash": "dot", "width": 1.2, "legendgroup": "limits"}
        line(fig, ends, [level, level], "limits", SET_POINT, row, showlegend=first, **style)
