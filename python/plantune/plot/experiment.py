"""A planned experiment: what is applied, and what is expected to come of it."""

from __future__ import annotations

import plotly.graph_objects as go

from plantune.analyze import Experiment
from plantune.plot.style import MODEL, SECOND, axis, figure, line
from plantune.text import number


def experiment(plan: Experiment) -> go.Figure:
    """Draw the expected output above the planned input, each within its limits.

    Parameters
    ----------
    plan : Experiment
        From `analyze.experiment`.  Dotted lines are its limits, where it has some.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fig = experiment(pt.analyze.experiment((2.0, 10.0, 3.4), 1.0, noise_sd=0.1, time=300.0))
    >>> fig.layout.title.text
    'prbs, amplitude 0.324: K ± 1.9 %, T ± 5 %, L ± 1.3 %'
    """
    shares = ", ".join(f"{name} ± {number(100 * plan.relative[name], 2)} %" for name in "KTL")
    fig = figure(
        f"{plan.shape}, amplitude {number(plan.amplitude, 3)}: {shares}",
        f"planned for {plan.source}; L as a share of T + L",
        [240, 150],
    )
    line(fig, plan.t, plan.y, "expected output, without noise", MODEL)
    line(fig, plan.t, plan.u, "input", SECOND, 2, held=True)
    for row, (name, limits) in enumerate((("y", plan.y_limits), ("u", plan.u_limits)), start=1):
        for level in limits or ():
            fig.add_hline(y=level, line={"dash": "dot", "color": "#000000", "width": 1}, row=row)
        fig.update_yaxes(title_text=axis(name, f"unit of {name}"), row=row, col=1)
    fig.update_xaxes(title_text=axis("time", "s"), row=2, col=1)
    return fig
