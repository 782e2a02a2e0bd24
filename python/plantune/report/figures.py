"""The figures of the page, each with its claim above and what is drawn below."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from plantune import plot
from plantune.plot.embed import embedded
from plantune.report.about import fresh, is_process, rule_names, section, verdict_on_chosen
from plantune.report.text import escaped
from plantune.tune import robustness

if TYPE_CHECKING:
    from plantune.job import Run

HINT = (
    '<p class="small screen">Drag across a figure to zoom, double-click to return; a click '
    "on a legend entry hides its line.</p>"
)
Drawn = Iterator[tuple[str, Any, str]]
"""Name, figure, and what stands below it."""


def figures(run: Run) -> str:
    """Draw the record, what the models do on it, and the loops."""
    drawn = [*_record(run), *_models(run), *_loops(run), *_delay(run)]
    return section("figures", HINT + "".join(drawn_figure(*each) for each in drawn))


def _record(run: Run) -> Drawn:
    seen = verdict_on_chosen(run) if fresh(run) else None
    text = "Shaded: the rows kept apart from the fit, on which the models are judged."
    yield "record", plot.record(run.record, fresh=seen), text if seen else ""


def _models(run: Run) -> Drawn:
    """Draw all simulations; the errors and responses of the models that count."""
    rec = run.record
    text = (
        "Simulated from the input alone; the percentages are fits of the simulation, not of the "
        "one-step prediction."
    )
    yield "fit", plot.compare(*run.verdicts.values(), of=rec), text
    text = (
        "Lag 0, which is 1, is left out. Below, bars outside the band at lags of 0 and more are "
        "dynamics that the model misses; at negative lags, feedback."
    )
    for i, name in enumerate(run.relied):
        yield f"residuals-{i}", plot.residuals(run.verdicts[name], of=rec), text
    fits = [run.chosen]
    if run.rival is not None and is_process(run.chosen):
        fits.append(run.fits[run.rival])
    yield "step", plot.step(*fits, of=rec), ""
    text = "With the exact dead time; sampled models end at half the sampling rate."
    yield "bode", plot.bode(*fits, of=rec), text


def _loops(run: Run) -> Drawn:
    """Draw the recommended loop in full, the other rules beside it."""
    if not run.tunings:
        return
    first = run.tunings[0]
    text = "In brackets the 95 % intervals over the uncertainty of the model."
    yield "margins", plot.margins(first), text
    text = (
        "Any departure of the plant from its model is, at the crossover, a gain and a delay. The "
        "distance upwards to the border is the gain margin, that to the right the delay margin."
    )
    yield "robustness", plot.robustness(robustness(first, run.chosen)), text
    held = first.controller.Ts is not None
    loop = plot.closed_loop(run.responses[0], names=rule_names(run)[:1], of=run.record, held=held)
    yield "loop", loop, ""
    if run.comparison is not None:
        yield "rules", plot.rules(run.comparison, of=run.record), ""


def _delay(run: Run) -> Drawn:
    if "delay" in run.findings:
        text = (
            "The lower, the more of the output is explained. The choice counts parameters as "
            "well (BIC), so it need not be the lowest point."
        )
        yield "delay", plot.delay(run.findings["delay"], of=run.record), text


def drawn_figure(name: str, fig: Any, text: str) -> str:
    """Return a figure with its claim above and words below."""
    parts = embedded(fig)
    words = " ".join(
        f"{part[:1].upper()}{part[1:]}{'' if part.endswith('.') else '.'}"
        for part in (parts.subtitle, text)
        if part
    )
    return (
        f'<figure id="figure-{name}"><h3>{escaped(parts.title)}</h3>'
        f'<div class="plot" id="plot-{name}" role="img" style="height:{parts.height}px" '
        f'aria-label="{escaped(parts.title)}"></div>'
        f"<figcaption>{escaped(words, 600)}</figcaption>"
        f'<script type="application/json" data-figure="plot-{name}">{parts.json}</script></figure>'
    )
