"""What an auto-tuner decided along a record."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go

from plantune import _core
from plantune.adapt import AdaptLog
from plantune.plot.record import BUCKETS
from plantune.plot.style import (
    MEASURED,
    MODEL,
    SECOND,
    SET_POINT,
    Names,
    axis,
    band,
    figure,
    inert,
    line,
    record_name,
)
from plantune.record import Floats, Record
from plantune.text import counted

LEAST = 1e-3
"""Share of a parameter that its panel shows at least."""

_PLUS = {"symbol": "cross-thin", "size": 15, "color": SET_POINT, "line": {"width": 2}}
_DOT = {"symbol": "circle", "size": 4.5, "color": MODEL}
_RING = {"symbol": "circle-open", "size": 8, "color": SECOND, "line": {"width": 2}}
_CROSS = {"symbol": "x-thin", "size": 9, "color": SECOND, "line": {"width": 2}}


def adapt(log: AdaptLog, of: Record | None = None) -> go.Figure:
    """Draw the loop above what was identified and what was tuned, over one time axis.

    From above: output and set point, with a plus where an operating point begins and a cross where
    an alarm was raised; gain, time constant and dead time with two standard deviations and a dot
    where an estimate was accepted; the gains at work, with a ring where they changed, and the ones
    that the rule asks for.

    Parameters
    ----------
    log : AdaptLog
        Of any length.
    of : Record, optional
        Gives names and units.

    Returns
    -------
    plotly.graph_objects.Figure

    Notes
    -----
    After figures 3.7-6 to 3.7-8 of source 001.  Estimates are drawn from the first accepted one
    on, or all if none was.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(t_end=4.0)
    >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    >>> log = pt.adapt.replay(rec, pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid))
    >>> len(adapt(log, of=rec).layout.title.text) > 20
    True
    """
    signals = Names(of)
    accepted, retuned = np.flatnonzero(log.accepted), np.flatnonzero(log.retuned)
    when = f", first at {log.t[accepted[0]]:.4g} {signals.time_unit}" if len(accepted) else ""
    of_record = f"{record_name(log.source)}: " if log.source else ""
    fig = figure(
        f"Auto-tuner: {len(accepted)} estimates accepted{when}",
        f"{of_record}{counted(len(retuned), 'retuning')}, {counted(int(log.alarm.sum()), 'alarm')}",
        [180, 100, 100, 100, 100, 100],
    )
    _loop(fig, log, inert(signals.y))
    fig.update_yaxes(title_text=axis(signals.y, signals.y_unit), row=1, col=1)
    units = (signals.gain_unit, signals.time_unit, signals.time_unit)
    for i, (name, unit) in enumerate(zip("KTL", units, strict=True)):
        _parameter(fig, log, i, i + 2)
        fig.update_yaxes(title_text=axis(name, unit), row=i + 2, col=1)
    gains = {"Kp": signals.control_unit, "Ki": f"{signals.control_unit}/{signals.time_unit}"}
    for i, (name, unit) in enumerate(gains.items()):
        _gain(fig, log, i, i + 5)
        fig.update_yaxes(title_text=axis(name, unit), row=i + 5, col=1)
    # The last settings act for another Ts; without a range, marks would widen the axis.
    fig.update_xaxes(range=[log.t[0], log.t[-1] + log.settings.Ts])
    fig.update_xaxes(title_text=axis("time", signals.time_unit), row=6, col=1)
    return fig


def _loop(fig: go.Figure, log: AdaptLog, name: str) -> None:
    if not np.isnan(log.r).all():
        dashed: dict[str, Any] = {"dash": "dash", "width": 1.2, "opacity": 0.6, "held": True}
        line(fig, *_curve(log.t, log.r), "set point", SET_POINT, **dashed)
    line(fig, *_curve(log.t, log.y), name, MEASURED, width=1.4)
    _marks(fig, log, log.new_point, log.y, "operating point begins", _PLUS, 1)
    _marks(fig, log, log.alarm, log.y, "alarm", _CROSS, 1)


def _parameter(fig: go.Figure, log: AdaptLog, i: int, row: int) -> None:
    x, sd = (log.K, log.T, log.L)[i], log.sd[:, i]
    accepted = np.flatnonzero(log.accepted)
    begin = accepted[0] if len(accepted) else 0
    shown = np.arange(len(x)) >= begin
    legend: dict[str, Any] = {"showlegend": row == 2}
    x, margin = np.where(shown, x, np.nan), 2 * sd
    rows = _rows(x)
    rows = rows[~np.isnan(x[rows])]  # a fill has no breaks
    edges = (log.t[rows], (x - margin)[rows], (x + margin)[rows])
    if len(rows) and np.max(edges[2]) - np.min(edges[1]) < LEAST * abs(x[rows[-1]]):
        # Without noise what is left to see is rounding.
        about = sorted((1 + way * LEAST) * float(x[rows[-1]]) for way in (-1, 1))
        fig.update_yaxes(range=about, row=row, col=1)
    band(fig, *edges, "two standard deviations", row=row, shape="hv", **legend)
    line(
        fig, *_curve(log.t, x), "estimate", MODEL, row, held=True, legendgroup="estimate", **legend
    )
    _marks(fig, log, log.accepted, x, "accepted", _DOT, row, row == 2)


def _gain(fig: go.Figure, log: AdaptLog, i: int, row: int) -> None:
    legend: dict[str, Any] = {"showlegend": row == 5}
    x = (log.Kp, log.Ki)[i]
    target: dict[str, Any] = {
        "dash": "dot",
        "width": 1.2,
        "held": True,
        "legendgroup": "asked for",
        **legend,
    }
    line(fig, *_curve(log.t, log.target[:, i]), "asked for", MODEL, row, **target)
    line(fig, *_curve(log.t, x), "at work", SECOND, row, held=True, legendgroup="at work", **legend)
    _marks(fig, log, log.retuned, x, "retuned", _RING, row, row == 5)


def _marks(
    fig: go.Figure,
    log: AdaptLog,
    where: np.ndarray,
    x: Floats,
    name: str,
    marker: dict[str, Any],
    row: int,
    showlegend: bool = True,
) -> None:
    """Draw a mark wherever it happened; of very many, so many that they still fill the line."""
    rows = np.flatnonzero(where)
    rows = rows[:: max(1, len(rows) // BUCKETS)]
    if len(rows):
        look = {"mode": "markers", "marker": marker, "legendgroup": name}
        mark = go.Scatter(x=log.t[rows], y=x[rows], name=name, showlegend=showlegend, **look)
        fig.add_trace(mark, row=row, col=1)


def _curve(t: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return the times and values that its envelope needs."""
    rows = _rows(x)
    return t[rows], x[rows]


def _rows(x: Floats) -> np.ndarray:
    """Return the rows of an envelope; what is not a number counts as the first that is."""
    known = x[~np.isnan(x)]
    held = np.nan_to_num(x, nan=known[0] if len(known) else 0.0)
    return np.asarray(_core.envelope(np.ascontiguousarray(held), 0, len(x), BUCKETS))
