"""A run on the terminal: model, verdict, settings, doubts."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from plantune.job import Run
from plantune.notes import Note
from plantune.text import number
from plantune.tune import Comparison


def show(run: Run, folder: Path) -> None:
    """Print a run."""
    console = Console(highlight=False)
    console.print()
    heading = Text(run.title, style="bold") + Text(f"  {run.record}", style="dim")
    console.print(heading, soft_wrap=True)
    console.print()
    console.print(_judged(run))
    console.print(f"{run.chosen.method}  {run.chosen.model}")
    console.print(_model(run))
    if run.comparison is not None:
        console.print(f"{run.tunings[0].rule}, step of the set point with the exact delay")
        console.print(_settings(run))
        console.print(rules_table(run.comparison))
    for note in run.named_notes():
        console.print(shown_note(note), soft_wrap=True)
    console.print(Text(f"report: {folder / 'report.html'}", style="bold"), soft_wrap=True)


def _judged(run: Run) -> Table:
    seen = any(note.code == "M11" for v in run.verdicts.values() for note in v.notes)
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("on rows used to fit" if seen else "on fresh rows")
    for heading in ("simulation, %", "one step, %", "rows"):
        table.add_column(heading, justify="right")
    table.add_column("errors")
    table.add_column("")
    for name, v in run.verdicts.items():
        found = {note.code for note in v.notes}
        errors = [
            "coloured" if "M08" in found else "white",
            *["follow the input"] * ("V02" in found),
        ]
        mark = Text("trusted", "green") if name == run.trusted else Text("")
        cells = [f"{v.fit:.1f}", f"{v.fit_1step:.1f}", str(v.N), ", ".join(errors)]
        table.add_row(("✓ " if v else "✗ ") + name, *cells, mark)
    return table


def rules_table(comparison: Comparison) -> Table:
    """Set the rules side by side."""
    derivative = any(row.tuning.controller.Td for row in comparison.rows)
    terms = ("Kp", "Ti", "Td") if derivative else ("Kp", "Ti")
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("rule", min_width=20)
    for heading in (*terms, "Ms", "overshoot, %", "IAE load"):
        table.add_column(heading, justify="right")
    for row in comparison.rows:
        pid, steps = row.tuning.controller, row.set_point.indices
        values = [pid.Kp, pid.Ti, pid.Td] if derivative else [pid.Kp, pid.Ti]
        values += [row.tuning.margins.Ms, steps.overshoot]
        cells = [number(x, 3) for x in (*values, row.load.indices.iae)]
        table.add_row(row.tuning.rule.replace("_", " "), *cells)
    return table


def _model(run: Run) -> Table:
    fit = run.chosen
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("± 1 sd", justify="right")
    if run.truth:
        table.add_column("true", justify="right")
    values = [*zip(fit.names, fit.theta, fit.sd, strict=True)]
    for name, value, sd in [*values, ("offset", fit.offset[0], fit.offset_sd)]:
        true = [f"{run.truth[name]:.6g}"] if run.truth else []
        table.add_row(name, f"{value:.6g}", f"{sd:.2g}", *true)
    return table


def _settings(run: Run) -> Table:
    tuning, time = run.tunings[0], run.record.time_unit
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("95 % over the model's uncertainty", justify="right")
    pid, margins = tuning.controller, tuning.margins
    for name, value in (("Kp", pid.Kp), (f"Ti, {time}", pid.Ti), (f"Ki, 1/{time}", pid.Ki)):
        table.add_row(name, f"{value:.5g}", "")
    for name, field, value in (
        ("gain margin", "gain", margins.gain),
        ("phase margin, deg", "phase_deg", margins.phase_deg),
        (f"delay margin, {time}", "delay", margins.delay),
        ("Ms", "Ms", margins.Ms),
        ("Mt", "Mt", margins.Mt),
    ):
        band = tuning.bands.get(field)
        table.add_row(name, f"{value:.4g}", f"{band[0]:.4g} … {band[1]:.4g}" if band else "")
    indices = run.responses[0].indices
    table.add_row("overshoot, %", f"{indices.overshoot:.3g}", "")
    table.add_row(f"settling, {time}", f"{indices.settling:.4g}", "")
    return table


def shown_note(note: Note) -> Text:
    """Return a doubt with its code and remedy."""
    colour = {"warning": "yellow", "error": "red"}.get(note.severity, "dim")
    remedy = f" → {note.remedy}" if note.remedy else ""
    return Text(f"{note.code} ", colour) + Text(note.text) + Text(remedy, "dim")
