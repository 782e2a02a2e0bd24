"""How much gain and delay a loop can bear, and where the data put the plant."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from plantune.plot.style import MODEL, SECOND, figure, record_name, rule_name
from plantune.tune import Robustness

# Far beyond this factor the border is of no interest.
_MOST = 8.0


def robustness(seen: Robustness) -> go.Figure:
    """Draw the border of stability over gain and delay changes, with the identified cloud.

    Each point is a model that the data leave open; all of them should lie well inside.  The cross
    is the model that was tuned on.

    Parameters
    ----------
    seen : Robustness
        Border and cloud.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> tuning = pt.tune.imc_pi(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0), gain_margin=3)
    >>> [trace.name for trace in robustness(pt.tune.robustness(tuning)).data]
    ['unstable beyond', 'the model']
    """
    tuning, cloud = seen.tuning, len(seen.cloud_gain)
    fig = figure(
        f"{rule_name(tuning.rule)}: changes of the plant that the loop survives",
        f"{record_name(tuning.source)}: gain and dead time beside the model, at the crossover"
        + (f"; {cloud} models that the data leave open" if cloud else ""),
        [430],
    )
    gain = tuning.margins.gain
    top = max(2.0, min(_MOST, 2.0 * gain)) if np.isfinite(gain) else _MOST
    high = np.minimum(np.where(np.isnan(seen.high), 0.0, seen.high), top)
    border = {"color": SECOND, "width": 2.2}
    fig.add_trace(
        go.Scatter(
            x=seen.delay,
            y=high,
            name="unstable beyond",
            mode="lines",
            line=border,
            fill="tozeroy",
            fillcolor="rgba(42, 140, 106, 0.10)",
        )
    )
    if cloud:
        fig.add_trace(
            go.Scatter(
                x=seen.cloud_delay,
                y=seen.cloud_gain,
                name="models that the data leave open",
                mode="markers",
                marker={"color": MODEL, "size": 4, "opacity": 0.45},
            )
        )
    cross = {"symbol": "x-thin", "size": 13, "line": {"width": 3, "color": "#000000"}}
    fig.add_trace(go.Scatter(x=[0], y=[1], name="the model", mode="markers", marker=cross))
    fig.update_xaxes(title_text="change of the dead time [s]")
    fig.update_yaxes(title_text="change of the gain [factor]", range=[0, top])
    return fig
