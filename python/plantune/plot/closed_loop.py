"""The loop's answer to its set point."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import plotly.graph_objects as go

from plantune.plot.style import SEQUENCE, SET_POINT, Names, axis, figure, inert, line
from plantune.record import Record
from plantune.simulate import Response


def closed_loop(
    *responses: Response,
    names: Sequence[str] = (),
    of: Record | None = None,
    held: bool = False,
) -> go.Figure:
    """Draw output and set point above the controller output.

    Parameters
    ----------
    *responses : Response
        To the same set point; the first is blue, the second orange.
    names : sequence of str
        One per response, for the legend.
    of : Record, optional
        Gives names and units.
    held : bool
        Whether the controller holds its output between the rows, as a sampled one does.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=5.939, T=0.1491, L=0.1)
    >>> response = pt.simulate.step(plant, pt.models.PID(Kp=0.131451, Ti=0.1491), t_end=3.0)
    >>> closed_loop(response).layout.title.text
    'Closed loop: overshoot 5.6 %, settling 0.604 s'
    """
    signals = Names(of)
    overshoot = _numbers(responses, "overshoot", ".1f")
    settling = _numbers(responses, "settling", ".3g")
    iae, itae = _numbers(responses, "iae", ".3g"), _numbers(responses, "itae", ".3g")
    fig = figure(
        f"Closed loop: overshoot {overshoot} %, settling {settling} {signals.time_unit}",
        f"simulated step of the set point, changes from the operating point; IAE {iae}, "
        f"ITAE {itae}",
        [240, 150],
    )
    r = responses[0]
    line(fig, r.t, r.r, "set point", SET_POINT, dash="dash", width=1.4, held=True)
    for k, response in enumerate(responses):
        label = inert(names[k], 40) if k < len(names) else f"{k + 1}" * (len(responses) > 1)
        label = label or inert(signals.y)
        color = SEQUENCE[k % len(SEQUENCE)]
        line(fig, response.t, response.y, label, color, legendgroup=label)
        below = {"legendgroup": label, "showlegend": False, "held": held}
        line(fig, response.t, response.u, label, color, row=2, **below)
    fig.update_xaxes(title_text=axis("time", signals.time_unit), row=2, col=1)
    settled = [response.indices.settling for response in responses]
    if all(map(isfinite, settled)) and max(settled) > 0:
        # The first view; the curves go on to the right.
        fig.update_xaxes(range=[0, min(float(r.t[-1]), 3 * max(settled))])
    fig.update_yaxes(title_text=axis(signals.y, signals.y_unit), row=1, col=1)
    fig.update_yaxes(title_text=axis(signals.u, signals.u_unit), row=2, col=1)
    return fig


def _numbers(responses: Sequence[Response], name: str, form: str) -> str:
    """Write an index of each response, in their order."""
    found = [float(getattr(response.indices, name)) for response in responses]
    return " / ".join(f"{x:{form}}" if isfinite(x) else "–" for x in found)
