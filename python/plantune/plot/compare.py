"""Measured and simulated output on one page."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import plotly.graph_objects as go

from plantune.plot.record import BUCKETS, thinned
from plantune.plot.style import (
    MEASURED,
    Names,
    axis,
    figure,
    inert,
    line,
    look,
    record_name,
)
from plantune.record import Floats, Record
from plantune.validate import Verdict


def compare(*verdicts: Verdict, of: Record | None = None) -> go.Figure:
    """Draw measured output and simulations; the legend says the simulation fit.

    Parameters
    ----------
    *verdicts : Verdict
        Of the same record; the first is blue, the second orange.
    of : Record, optional
        Gives name and unit of the output.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> verdict = pt.validate.check(val, pt.estimate.arx(est, 2, 2, 3))
    >>> compare(verdict).data[1].name
    'ARX, simulation 85.3 %'
    """
    names = Names(of)
    widest = max(verdicts, key=lambda verdict: len(verdict.rows))
    seen = any(note.code == "M11" for verdict in verdicts for note in verdict.notes)
    where = "rows also used to fit" if seen else "fresh rows"
    fits = ", ".join(f"{inert(v.name)} {v.fit:.1f} %" for v in verdicts)
    fig = figure(
        f"Simulated {inert(names.y)} on {where}: {fits}",
        f"{record_name(widest.source)}: fit of the simulation, {len(widest.rows)} rows",
        [340],
    )
    line(fig, *_broken(widest, widest.y), "measured", MEASURED, width=2.4)
    for k, verdict in enumerate(verdicts):
        label = f"{inert(verdict.name)}, simulation {verdict.fit:.1f} %"
        color, dash = look(k)
        line(fig, *_broken(verdict, verdict.yhat), label, color, width=1.6, dash=dash)
    fig.update_xaxes(title_text=axis("time", names.time_unit))
    fig.update_yaxes(title_text=axis(names.y, names.y_unit))
    return fig


def _broken(verdict: Verdict, y: Floats) -> tuple[Floats, Floats]:
    """Break the line where rows are missing."""
    edges = [0, *(np.flatnonzero(np.diff(verdict.rows) != 1) + 1).tolist(), len(y)]
    parts = tuple(slice(a, b) for a, b in pairwise(edges))
    if len(parts) > BUCKETS:
        parts = (slice(0, len(y)),)
    return thinned(verdict.t, y, y, parts)
