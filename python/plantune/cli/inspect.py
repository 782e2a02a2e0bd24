"""`plantune inspect`: what a file holds, and all that is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from plantune import report
from plantune.cli.main import app
from plantune.cli.options import Json, LimitOption, limits_of
from plantune.cli.output import print_json, refusing, whole_folder
from plantune.cli.reading import Reading, takes_record
from plantune.cli.summary import shown_note
from plantune.inspection import ColumnSeen, FileSeen, Inspection, Stamps
from plantune.inspection import inspect as look
from plantune.io import to_json

# Columns up to which the table is printed.
_MOST_COLUMNS = 50


@app.command()
@takes_record
def inspect(
    reading: Reading,
    out: Annotated[Path, typer.Option(help="Folder for the page.")] = Path("plantune-out"),
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Show what a file holds and its record shows, and all that is wrong; nothing is refused."""
    with refusing(as_json):
        limits, rows = limits_of(limit), reading.between
        seen = look(reading.path, **reading.options(), between=rows, limits=limits)
        with whole_folder(out) as staging:
            report.write_inspection(staging / "inspection.html", seen, reading.title)
    if as_json:
        print_json({**to_json(seen, longest=100), "out": str(out)})
    else:
        _show(seen, out / "inspection.html")


def _show(seen: Inspection, page: Path) -> None:
    console = Console(highlight=False)
    for file in (seen, *seen.others):
        _show_file(console, file)
    if seen.record is not None:
        console.print(Text(str(seen.record), style="bold"), soft_wrap=True)
    for moves in seen.excitation.values():
        console.print(str(moves), soft_wrap=True)
    if seen.impulse is not None:
        lines = str(seen.impulse).splitlines()[: 1 + len(seen.impulse.inputs)]
        console.print("\n".join(lines), soft_wrap=True)
    for name, found in seen.delay.items():
        likely = " or ".join(map(str, found.likely))
        console.print(f"delay from {name}: nk = {likely} by {found.trusted}", soft_wrap=True)
    if seen.informative is not None:
        for stretch in seen.informative.stretches:
            console.print(str(stretch), soft_wrap=True)
    for note in seen.findings:
        console.print(shown_note(note), soft_wrap=True)
        if note.evidence:
            console.print(Text(f"    {note.evidence}", "dim"), soft_wrap=True)
    if not seen.findings:
        console.print("nothing wrong found")
    console.print(Text("next", style="bold"))
    for k, step in enumerate(seen.steps, 1):
        console.print(f"{k}. {step}", soft_wrap=True)
    console.print(Text(f"page: {page}", style="bold"), soft_wrap=True)


def _show_file(console: Console, file: FileSeen) -> None:
    console.print(Text(file.name, style="bold"), soft_wrap=True)
    if file.columns:
        console.print(_columns(file.columns[:_MOST_COLUMNS]))
    if len(file.columns) > _MOST_COLUMNS:
        console.print(f"and {len(file.columns) - _MOST_COLUMNS} more columns")
    if file.stamps:
        console.print(_stamps(file.stamps), soft_wrap=True)


def _columns(columns: tuple[ColumnSeen, ...]) -> Table:
    table = Table(box=box.SIMPLE_HEAD)
    for heading in ("", "column", "holds"):
        table.add_column(heading)
    for heading in ("values", "missing", "min", "max", "distinct"):
        table.add_column(heading, justify="right")
    for c in columns:
        counts = [c.values, c.missing, c.low, c.high, c.distinct]
        cells = [
            "" if x is None else f"{x:.6g}" if isinstance(x, float) else str(x) for x in counts
        ]
        name = f"{c.name} [{c.unit}]" if c.unit else c.name
        table.add_row(str(c.number), Text(name), c.holds, *cells)
    return table


def _stamps(stamps: Stamps) -> str:
    steps = f"step {stamps.step:.6g} s (1 % {stamps.p1:.6g}, 99 % {stamps.p99:.6g})"
    said = "".join(f"; {text}" for text in stamps.said)
    return f"stamps: {steps}, {stamps.gaps} gaps, {stamps.back} repeated or back{said}"
