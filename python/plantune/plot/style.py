"""What all figures share: colours, fonts, axes, and names shown as inert text."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from plantune.record import Record
from plantune.text import column

MEASURED = "#868d96"
MODEL = "#1767b0"
SECOND = "#e07a00"
THIRD = "#2a8c6a"
FOURTH = "#a03c8f"
SET_POINT = "#000000"
BAND = "rgba(23, 103, 176, 0.16)"
SECOND_BAND = "rgba(224, 122, 0, 0.16)"
FRESH = "rgba(23, 103, 176, 0.06)"
SEQUENCE = (MODEL, SECOND, THIRD, FOURTH)
DASHES = ("solid", "dash")
"""Of the first round of colours, and of the second."""

INK, GRID, AXIS = "#1d2733", "#e6e9ed", "#9aa3ad"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
LONGEST = 28
"""Letters of a name on an axis or in a legend; the rest becomes an ellipsis."""

_AXIS = {
    "showline": True,
    "linecolor": AXIS,
    "gridcolor": GRID,
    "zeroline": False,
    "ticks": "outside",
    "tickcolor": AXIS,
    "ticklen": 4,
    "automargin": True,
    "title": {"standoff": 8, "font": {"size": 14}},
    "tickfont": {"size": 13},
    "exponentformat": "power",
    "minexponent": 6,
}
_LEGEND = {
    "orientation": "h",
    "x": 0,
    "xanchor": "left",
    "yref": "container",
    "y": 0,
    "yanchor": "bottom",
    "bgcolor": "rgba(0,0,0,0)",
}
_TEMPLATE = go.layout.Template(
    layout={
        "font": {"family": FONT, "size": 14, "color": INK},
        "title": {"x": 0, "xref": "paper", "xanchor": "left", "font": {"size": 17, "weight": 600}},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "margin": {"l": 16, "r": 16, "t": 72, "b": 76},
        "xaxis": _AXIS,
        "yaxis": _AXIS,
        "legend": _LEGEND,
        "hovermode": "closest",
        "hoverlabel": {"namelength": -1, "font": {"family": FONT, "size": 13}},
        "modebar": {
            "bgcolor": "rgba(0,0,0,0)",
            "color": AXIS,
            "activecolor": MODEL,
            # The first would send the figure, data and all, to a server.
            "remove": [
                "sendChartToCloud",
                "select2d",
                "lasso2d",
                "autoScale2d",
                "zoomIn2d",
                "zoomOut2d",
            ],
        },
    }
)


def figure(
    title: str, subtitle: str, heights: Sequence[float], gap: float | None = None, **layout: Any
) -> go.Figure:
    """Return an empty light figure with one panel per height, in pixels.

    The panels share their x axis, unless a `gap` in pixels leaves each room for its own.

    Examples
    --------
    >>> figure("Title", "what it says", [200, 100]).layout.height
    464
    """
    room = 148  # title above; time axis and legend below
    between = 16 if gap is None else gap
    panels = sum(heights) + between * (len(heights) - 1)
    fig = make_subplots(
        rows=len(heights),
        cols=1,
        shared_xaxes=gap is None,
        row_heights=list(heights),
        vertical_spacing=between / panels if len(heights) > 1 else 0.0,
    )
    fig.update_layout(
        template=_TEMPLATE,
        title={"text": title, "subtitle": {"text": subtitle}},
        height=round(panels) + room,
        showlegend=True,
        **layout,
    )
    return fig


def look(k: int) -> tuple[str, str]:
    """Return colour and dash of curve `k`.

    Examples
    --------
    >>> look(0), look(4)
    (('#1767b0', 'solid'), ('#1767b0', 'dash'))
    """
    around, within = divmod(k, len(SEQUENCE))
    return SEQUENCE[within], DASHES[around % len(DASHES)]


def line(fig: go.Figure, x: Any, y: Any, name: str, color: str, row: int = 1, **more: Any) -> None:
    """Draw a line in a panel; `held=True` as the stairs of a zero-order hold."""
    style = {"color": color, "width": more.pop("width", 1.8), "dash": more.pop("dash", "solid")}
    # plotly would leave out points where it finds a line straight enough.
    style["simplify"] = False
    style["shape"] = "hv" if more.pop("held", False) else "linear"
    trace = go.Scatter(x=x, y=y, name=name, mode="lines", line=style, connectgaps=False, **more)
    fig.add_trace(trace, row=row, col=1)


def band(
    fig: go.Figure,
    x: Any,
    low: Any,
    high: Any,
    name: str,
    color: str = BAND,
    row: int = 1,
    **more: Any,
) -> None:
    """Fill between two curves."""
    edge = {"width": 0, "shape": more.pop("shape", "linear"), "color": color}
    group = {"legendgroup": name, "hoverinfo": "skip", "mode": "lines", "line": edge}
    shown = more.pop("showlegend", True)
    fig.add_trace(go.Scatter(x=x, y=low, showlegend=False, **group), row=row, col=1)
    fill = {"fill": "tonexty", "fillcolor": color}
    fig.add_trace(
        go.Scatter(x=x, y=high, name=name, showlegend=shown, **group, **fill), row=row, col=1
    )


def inert(name: object, longest: int = LONGEST) -> str:
    """Return a name as text in which no markup acts, shortened to `longest` letters.

    Examples
    --------
    >>> inert("<b>temp</b>")
    '&lt;b&gt;temp&lt;/b&gt;'
    """
    plain = " ".join(str(name).split())
    if len(plain) > longest:
        plain = plain[: longest - 1] + "…"
    return html.escape(plain, quote=False)


def axis(name: str, unit: str, longest: int = 20) -> str:
    """Return `name [unit]`, the name alone where nobody gave the unit.

    Examples
    --------
    >>> axis("time", "s"), axis("temp", "")
    ('time [s]', 'temp')
    """
    shown, known = inert(column(name), longest), inert(unit, 12)
    return f"{shown} [{known}]" if known else shown


class Names:
    """Names and units of one input and one output, from a record or, without one, the letters."""

    def __init__(self, of: Record | None, input: int = 0) -> None:
        self.u, self.y = (of.u_names[input], of.y_names[0]) if of is not None else ("u", "y")
        self.time_unit = of.time_unit if of is not None else "s"
        units = of.units if of is not None else {}
        self.u_unit, self.y_unit = units.get(self.u, ""), units.get(self.y, "")
        self.u, self.y = column(self.u), column(self.y)

    @property
    def gain_unit(self) -> str:
        """Unit of y over u; the letters where a unit is not known."""
        return over(self.y_unit, self.u_unit, "y/u")

    @property
    def control_unit(self) -> str:
        """Unit of u over y."""
        return over(self.u_unit, self.y_unit, "u/y")


def over(top: str, bottom: str, unknown: str) -> str:
    """Return the unit of a ratio.

    Examples
    --------
    >>> over("K", "%", "y/u"), over("%", "rad/s", "u/y"), over("", "%", "y/u")
    ('K/%', '%/(rad/s)', 'y/u')
    """
    if not top or not bottom:
        return unknown
    return f"{top}/({bottom})" if "/" in bottom or " " in bottom else f"{top}/{bottom}"


def rule_name(rule: str) -> str:
    """Return a tuning rule as it is read, without the underscores of its arguments.

    Examples
    --------
    >>> rule_name("IMC-PI, gain_margin = 3")
    'IMC-PI, gain margin = 3'
    """
    return inert(rule.replace("_", " "), 60)


def record_name(source: str) -> str:
    """Return how a record is called in a title: the head of its fingerprint.

    Examples
    --------
    >>> record_name("0123456789abcdef"), record_name("")
    ('record 01234567', 'no record')
    """
    return f"record {inert(source[:8])}" if source else "no record"
