"""The page of a comparison: one model, several rules, no record."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plantune import plot
from plantune.plot.style import Names
from plantune.report.figures import HINT, drawn_figure
from plantune.report.sections import compared
from plantune.report.text import escaped
from plantune.tune import robustness

if TYPE_CHECKING:
    from plantune.tune import Comparison

_LEAD = (
    "Margins with the exact dead time. Ms, the moves of the controller output and the error after "
    "a load are what each rule costs."
)


def of_comparison(comparison: Comparison, title: str) -> list[str]:
    """Return the sections of the page, in the order in which they are read."""
    first = comparison.rows[0].tuning
    head = f"""<header>
<p class="kicker">plantune comparison</p>
<h1>{escaped(title)}</h1>
<p class="outcome">{escaped(str(comparison.model), 1200)}. No record stands behind this model:
the margins carry no interval.</p>
</header>"""
    figures = [
        ("rules", plot.rules(comparison), ""),
        ("margins", plot.margins(first), ""),
        ("robustness", plot.robustness(robustness(first)), ""),
    ]
    table = compared(comparison, Names(None), _LEAD)
    drawn = "".join(drawn_figure(*figure) for figure in figures)
    return [
        head,
        f'<section id="rules"><h2>Rules compared</h2>{table}</section>',
        f'<section id="figures"><h2>Figures</h2>{HINT}{drawn}</section>',
    ]
