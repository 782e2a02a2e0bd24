"""The section on the models: what they are, how they did on fresh rows, which is trusted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from plantune.estimate.candidates import size
from plantune.models import ProcessModel
from plantune.plot.style import Names
from plantune.report.about import is_process, section, units, where
from plantune.report.text import escaped, table, with_sd
from plantune.text import number

if TYPE_CHECKING:
    from plantune.estimate import Fit
    from plantune.job import Run
    from plantune.validate import Verdict


def model(run: Run) -> str:
    """Parameters with their standard deviations, and how the models did on fresh rows."""
    parts = [_equation(run.chosen.model), _parameters(run), _judged(run), _why(run)]
    others = [fit for fit in run.fits.values() if not is_process(fit)]
    return section("model", "".join([*parts, *map(_details, others)]))


def _equation(plant: object) -> str:
    if isinstance(plant, ProcessModel):
        return (
            '<p class="equation"><i>y</i> = <i>K</i> e<sup>−<i>L</i> s</sup> / (<i>T</i> s + 1) '
            "<i>u</i> + offset</p>"
        )
    return f"<pre>{escaped(plant, 2000)}</pre>"


def _parameters(run: Run) -> str:
    fit, unit, truth = run.chosen, units(run), run.truth or {}
    parameters = list(zip(fit.names, fit.theta, fit.sd, strict=True))
    if len(fit.offset):
        parameters.append(("offset", float(fit.offset[0]), fit.offset_sd))
    head = ["parameter", "value ± sd", "unit"]
    cells = [[name, with_sd(x, sd), unit.get(name, "")] for name, x, sd in parameters]
    if truth:
        head.append("true value")
        for row in cells:
            row.append(number(truth[row[0]], 6) if row[0] in truth else "–")
    caption = f"{fit.method}, fitted on {fit.N} rows that have a history; ± one standard deviation."
    return table(caption, head, cells)


def _judged(run: Run) -> str:
    """One column per model, those of an earlier study last."""
    unit = Names(run.record).y_unit or "y"
    rows: list[tuple[str, Any]] = [
        ("fit of the simulation [%]", lambda v: f"{v.fit:.1f}"),
        ("fit one step ahead [%]", lambda v: f"{v.fit_1step:.1f}"),
        (f"RMSE of the simulation [{unit}]", lambda v: number(v.rmse)),
        ("rows judged", lambda v: str(v.N)),
        ("errors are white", lambda v: _without(v, "M08")),
        ("errors are free of the input", lambda v: _without(v, "V02")),
        ("parameters, delay counted", lambda v: _size(run.fits.get(v.name))),
        ("verdict", lambda v: "passes" if v else "does not pass"),
        ("trusted", lambda v: "✓" if v.name == run.trusted else ""),
    ]
    verdicts = list(run.verdicts.values())
    return table(
        f"How the models fitted on one part of the record do on {where(run)}.",
        ["", *(v.name for v in verdicts)],
        [[label, *(value(v) for v in verdicts)] for label, value in rows],
        "Fit = 100 (1 - |y - ŷ| / |y - mean of y|). The simulation sees the input alone; one "
        "step ahead also sees the last measured output.",
    )


def _without(verdict: Verdict, code: str) -> str:
    return "no" if any(note.code == code for note in verdict.notes) else "yes"


def _size(fit: Fit | None) -> str:
    return "given" if fit is None else str(size(fit))


def _why(run: Run) -> str:
    reasons = (note for note in run.notes if note.code == "V10")
    return "".join(f"<p>{escaped(note.text, 1000)}.</p>" for note in reasons)


def _details(fit: Fit) -> str:
    head = f"{fit.method}, as fitted on the estimation part"
    return f"<details><summary>{escaped(head)}</summary><pre>{escaped(fit, 4000)}</pre></details>"
