"""`plantune identify`: one model of a record, of a named kind."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from plantune import hysteresis, plot
from plantune.cli.main import app
from plantune.cli.options import Json, LimitOption, limits_of
from plantune.cli.output import print_json, refusing, write_file
from plantune.cli.reading import Reading, takes_record
from plantune.cli.structures import Identified, identified, orders_help, structures
from plantune.errors import refusal
from plantune.estimate import StepModes, idt
from plantune.hysteresis import Loops
from plantune.hysteresis.identify import KINDS
from plantune.io import save_model, to_json
from plantune.plot.embed import page
from plantune.record import Record
from plantune.validate import check

if TYPE_CHECKING:
    import plotly.graph_objects as go

_LONGEST = 100  # rows of an array up to which JSON holds it


_KINDS = {name: name for name in ("idt", "hysteresis", *structures())}
Kind: Any = Enum("Kind", _KINDS, type=str)  # type: ignore[misc]  # verbs that there are
"""What can be identified: a step response, loops, or a model structure."""


@app.command()
@takes_record
def identify(
    reading: Reading,
    model: Annotated[
        Kind,
        typer.Option(
            help="idt: the time constants of a step response; hysteresis: loops; else a structure."
        ),
    ],
    orders: Annotated[
        str, typer.Option(help=f"{orders_help()}. Several inputs: 1:2 in place of a number.")
    ] = "",
    nk: Annotated[str, typer.Option(help="structures: delay in samples, 1:2 per input.")] = "1",
    regressor: Annotated[
        list[str] | None, typer.Option(help='arx: a term of your own, e.g. "sign(y(t-1))".')
    ] = None,
    split: Annotated[
        float | None, typer.Option(help="structures: share of the rows to fit; the rest judges.")
    ] = None,
    order: Annotated[str, typer.Option(help="idt: number of poles, or auto.")] = "auto",
    max_order: Annotated[int, typer.Option(help="idt: highest order that auto tries.")] = 4,
    step_at: Annotated[
        float | None, typer.Option(help="idt: time of the step, seconds; found by default.")
    ] = None,
    gain: Annotated[float | None, typer.Option(help="idt: static gain y/u, if known.")] = None,
    kind: Annotated[str, typer.Option(help=f"hysteresis: {', '.join(KINDS)}.")] = "auto",
    elements: Annotated[
        str, typer.Option(help="hysteresis: number of elements, or auto.")
    ] = "auto",
    threshold: Annotated[
        float | None, typer.Option(help="hysteresis, series: error that opens the next element.")
    ] = None,
    skip: Annotated[int, typer.Option(help="hysteresis, plays: rows before they are fitted.")] = 0,
    save: Annotated[Path | None, typer.Option(help="JSON file for the model; not idt.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="HTML file for the figure, or .json for the model.")
    ] = None,
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Identify one model of a record, and say what the data support of it."""
    with refusing(as_json):
        rec = reading.record(limits_of(limit))
        found: StepModes | Loops | Identified
        if out is not None and out.suffix == ".json":
            save, out = out, None
        if model.value == "idt":
            found = idt(
                rec,
                _count(order, "order"),
                step_at=step_at,
                gain=gain,
                max_order=max_order,
                limits=rec.limits,
            )
        elif model.value == "hysteresis":
            x, y = rec.u[:, 0], rec.y[:, 0]
            n = _count(elements, "elements")
            found = hysteresis.identify(x, y, kind, n=n, threshold=threshold, skip=skip)
        else:
            found = identified(rec, model.value, orders, nk, regressor or [], split)
        if save is not None:
            _save(save, found)
        if out is not None:
            write_file(out, page(_drawn(found, rec)))
    show(found, as_json)


def _save(path: Path, found: StepModes | Loops | Identified) -> None:
    if isinstance(found, StepModes):
        text = "the time constants of a step response have no model file"
        raise refusal("U01", text, remedy="--json prints them")
    save_model(path, found.fit.model if isinstance(found, Identified) else found.model)


def _drawn(found: StepModes | Loops | Identified, rec: Record) -> go.Figure:
    if isinstance(found, Identified):
        return plot.compare(found.verdict or check(rec, found.fit), of=rec)
    if isinstance(found, StepModes):
        return plot.step_modes(found, of=rec)
    return plot.hysteresis(found.model, rec.u[:, 0], rec.y[:, 0], of=rec)


def show(found: Any, as_json: bool) -> None:
    """Print a result as one JSON object or as it prints itself."""
    if as_json:
        print_json(to_json(found, longest=_LONGEST))
    else:
        Console(highlight=False, markup=False).print(str(found), soft_wrap=True)


def _count(given: str, name: str) -> int | str:
    if given == "auto" or given.isdecimal():
        return given if given == "auto" else int(given)
    raise refusal(
        "U01",
        f"`--{name}` is {given!r}, must be auto or a whole number",
        where=(name, None, None),
        remedy=f"--{name} auto",
    )
