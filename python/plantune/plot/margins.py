"""How far a loop is from instability."""

from __future__ import annotations

from math import isfinite

import numpy as np
import plotly.graph_objects as go

from plantune.plot.style import AXIS, MODEL, SECOND, THIRD, figure, record_name, rule_name
from plantune.tune import Tuning, sensitivities

POINTS = 600
_TURN = np.linspace(0.0, 2 * np.pi, 181)


def margins(tuning: Tuning) -> go.Figure:
    """Draw the open loop in the complex plane near -1, with its margins.

    The gain margin is read where the curve crosses the real axis, the phase margin where it
    meets the unit circle, and `Ms` is the circle around -1 that the curve just touches.  95 %
    intervals stand in the legend.

    Parameters
    ----------
    tuning : Tuning
        Controller, model and margins.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> tuning = pt.tune.imc_pi(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0), gain_margin=3)
    >>> [trace.name for trace in margins(tuning).data][-2:]
    ['gain margin 3.00 at 1.57 rad/s', 'phase margin 60.0° at 0.524 rad/s']
    """
    m, bands = tuning.margins, tuning.bands
    fig = figure(
        f"{rule_name(tuning.rule)}: how far the open loop keeps from −1",
        f"{record_name(tuning.source)}: open loop in the complex plane; "
        f"delay margin {m.delay:.3g} s" + _interval(bands.get("delay"), "{:.3g} s"),
        [470],
    )
    L = sensitivities(tuning.model, tuning.controller, _grid(tuning)).L
    _curve(fig, L.real, L.imag, "open loop", {"color": MODEL, "width": 2.2})
    dotted = {"color": AXIS, "width": 1.2, "dash": "dot"}
    _curve(fig, np.cos(_TURN), np.sin(_TURN), "unit circle", dotted)
    if isfinite(m.Ms):
        label = f"Ms = {m.Ms:.3g}" + _interval(bands.get("Ms"), "{:.3g}")
        circle = {"color": THIRD, "width": 1.6, "dash": "dash"}
        _curve(fig, np.cos(_TURN) / m.Ms - 1, np.sin(_TURN) / m.Ms, label, circle)
    point = {"mode": "markers", "hoverinfo": "name"}
    black = {"symbol": "x-thin", "size": 12, "line": {"width": 3, "color": "#000000"}}
    fig.add_trace(go.Scatter(x=[-1], y=[0], name="−1", marker=black, **point))
    if isfinite(m.gain) and isfinite(m.w_gain):
        at = sensitivities(tuning.model, tuning.controller, [m.w_gain]).L
        label = f"gain margin {m.gain:.2f}" + _interval(bands.get("gain"), "{:.2f}")
        label += f" at {m.w_gain:.3g} rad/s"
        marker = {"color": SECOND, "size": 11, "symbol": "diamond"}
        fig.add_trace(go.Scatter(x=at.real, y=at.imag, name=label, marker=marker, **point))
    if isfinite(m.phase_deg) and isfinite(m.w_phase):
        at = sensitivities(tuning.model, tuning.controller, [m.w_phase]).L
        label = f"phase margin {m.phase_deg:.1f}°" + _interval(bands.get("phase_deg"), "{:.1f}")
        label += f" at {m.w_phase:.3g} rad/s"
        marker = {"color": SECOND, "size": 11, "symbol": "circle"}
        fig.add_trace(go.Scatter(x=at.real, y=at.imag, name=label, marker=marker, **point))
    line = {"zeroline": True, "zerolinecolor": AXIS, "dtick": 0.5}
    fig.update_xaxes(title_text="real part [1]", range=[-2.4, 1.5], constrain="domain", **line)
    fig.update_yaxes(
        title_text="imaginary part [1]", range=[-1.7, 0.9], scaleanchor="x", scaleratio=1, **line
    )
    return fig


def _interval(band: tuple[float, float] | None, form: str) -> str:
    if band is None:
        return ""
    return f" ({form.format(band[0])} to {form.format(band[1])})"


def _curve(fig: go.Figure, x: object, y: object, name: str, line: dict[str, object]) -> None:
    fig.add_trace(go.Scatter(x=x, y=y, name=name, mode="lines", line=line, hoverinfo="name"))


def _grid(tuning: Tuning) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Frequencies around the gain crossover, or around the plant's own where there is none."""
    m = tuning.margins
    crosses = isfinite(m.w_phase) and m.w_phase > 0
    middle = m.w_phase if crosses else 8.0 / tuning.model.horizon()
    return np.geomspace(0.2 * middle, 40 * middle, POINTS)
