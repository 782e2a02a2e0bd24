"""Figures inside a page of one's own, or on a page alone."""

from __future__ import annotations

import html
from dataclasses import dataclass

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs


@dataclass(frozen=True, slots=True)
class Embedded:
    """A figure taken apart: its words as plain text, the rest as JSON safe inside a page."""

    title: str
    subtitle: str
    height: int
    json: str


def embedded(fig: go.Figure) -> Embedded:
    """Take title and subtitle out of a figure, for a page that can wrap them.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.Record(u=[0, 1, 1], y=[0, 0, 1], Ts=1.0, y_names=["</script>"])
    >>> figure = embedded(pt.plot.record(rec))
    >>> figure.title, "</script>" in figure.json
    ('u → </script>, as recorded', False)
    """
    title = fig.layout.title
    heading, below = (html.unescape(text or "") for text in (title.text, title.subtitle.text))
    bare = go.Figure(fig)
    height = int(fig.layout.height) - 72
    bare.update_layout(
        title=None,
        height=height,
        margin={"t": 24, "b": 16},
        legend={"yref": "paper", "y": 1, "yanchor": "bottom"},
    )
    # plotly writes every "<", ">" and "/" of a text as an escape.
    return Embedded(heading, below, height, str(bare.to_json()))


def page(fig: go.Figure) -> str:
    """Return a page with one figure that works off line.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.Record(u=[0, 1, 1], y=[0, 0, 1], Ts=1.0)
    >>> "plotly.js" in page(pt.plot.record(rec))
    True
    """
    return str(fig.to_html(include_plotlyjs=True))


def library() -> str:
    """Return the drawing library that ships inside the plotly package.

    Examples
    --------
    >>> "plotly.js" in library()[:100]
    True
    """
    return str(get_plotlyjs())
