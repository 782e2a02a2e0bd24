"""`plantune identify`: one model of a record, of a named kind."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from plantune import plot
from plantune.cli.main import app
from plantune.cli.options import Json, LimitOption, limits_of
from plantune.cli.output import print_json, refusing, write_file
from plantune.cli.reading import Reading, takes_record
from plantune.errors import refusal
from plantune.estimate import idt
from plantune.io import to_json
from plantune.plot.embed import page

_LONGEST = 100  # rows of an array up to which JSON holds it


class Kind(str, Enum):
    """What can be identified."""

    idt = "idt"


@app.command()
@takes_record
def identify(
    reading: Reading,
    model: Annotated[Kind, typer.Option(help="idt: the time constants of a step response.")],
    order: Annotated[str, typer.Option(help="idt: number of poles, or auto.")] = "auto",
    max_order: Annotated[int, typer.Option(help="idt: highest order that auto tries.")] = 4,
    step_at: Annotated[
        float | None, typer.Option(help="idt: time of the step, seconds; found by default.")
    ] = None,
    gain: Annotated[float | None, typer.Option(help="idt: static gain y/u, if known.")] = None,
    out: Annotated[Path | None, typer.Option(help="HTML file for the figure.")] = None,
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Identify one model of a record, and say what the data support of it."""
    with refusing(as_json):
        rec = reading.record(limits_of(limit))
        found = idt(
            rec, _order(order), step_at=step_at, gain=gain, max_order=max_order, limits=rec.limits
        )
        if out is not None:
            write_file(out, page(plot.step_modes(found, of=rec)))
    show(found, as_json)


def show(found: Any, as_json: bool) -> None:
    """Print a result as one JSON object or as it prints itself."""
    if as_json:
        print_json(to_json(found, longest=_LONGEST))
    else:
        Console(highlight=False, markup=False).print(str(found), soft_wrap=True)


def _order(order: str) -> int | str:
    if order == "auto" or order.isdecimal():
        return order if order == "auto" else int(order)
    raise refusal(
        "U01",
        f"`--order` is {order!r}, must be auto or a whole number",
        where=("order", None, None),
        remedy="--order auto",
    )
