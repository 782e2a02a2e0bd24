"""`plantune identify`: one model of a record, of a named kind."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from functools import partial
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


Option = typer.Option
Model = Annotated[
    Kind,
    Option(help="idt: the time constants of a step response; hysteresis: loops; else a structure."),
]
Orders = Annotated[str, Option(help=f"{orders_help()}. Several inputs: 1:2 in place of a number.")]
Delays = Annotated[str, Option(help="structures: delay in samples, 1:2 per input.")]
Regressors = Annotated[
    list[str] | None, Option(help='arx: a term of your own, e.g. "sign(y(t-1))".')
]
Split = Annotated[
    float | None, Option(help="structures: share of the rows to fit; the rest judges.")
]
Order = Annotated[str, Option(help="idt: number of poles, or auto.")]
MaxOrder = Annotated[int, Option(help="idt: highest order that auto tries.")]
StepAt = Annotated[float | None, Option(help="idt: time of the step, seconds; found by default.")]
Gain = Annotated[float | None, Option(help="idt: static gain y/u, if known.")]
LoopKind = Annotated[str, Option(help=f"hysteresis: {', '.join(KINDS)}.")]
Elements = Annotated[str, Option(help="hysteresis: number of elements, or auto.")]
Threshold = Annotated[
    float | None, Option(help="hysteresis, series: error that opens the next element.")
]
Skip = Annotated[int, Option(help="hysteresis, plays: rows before they are fitted.")]
Save = Annotated[Path | None, Option(help="JSON file for the model; not idt.")]
Out = Annotated[Path | None, Option(help="HTML file for the figure, or .json for the model.")]

Found = StepModes | Loops | Identified


@app.command()
@takes_record
def identify(
    reading: Reading,
    model: Model,
    orders: Orders = "",
    nk: Delays = "1",
    regressor: Regressors = None,
    split: Split = None,
    order: Order = "auto",
    max_order: MaxOrder = 4,
    step_at: StepAt = None,
    gain: Gain = None,
    kind: LoopKind = "auto",
    elements: Elements = "auto",
    threshold: Threshold = None,
    skip: Skip = 0,
    save: Save = None,
    out: Out = None,
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Identify one model of a record, and say what the data support of it."""
    how: dict[str, Callable[[Record], Found]] = {
        "idt": partial(_step_modes, order=order, step_at=step_at, gain=gain, max_order=max_order),
        "hysteresis": partial(_loops, kind=kind, elements=elements, threshold=threshold, skip=skip),
    }
    structure = partial(
        identified, name=model.value, orders=orders, nk=nk, regressors=regressor or [], split=split
    )
    with refusing(as_json):
        rec = reading.record(limits_of(limit))
        found = how.get(model.value, structure)(rec)
        _write(found, rec, save, out)
    show(found, as_json)


def _step_modes(rec: Record, *, order: str, **more: Any) -> StepModes:
    return idt(rec, _count(order, "order"), **more, limits=rec.limits)


def _loops(rec: Record, *, kind: str, elements: str, **more: Any) -> Loops:
    n = _count(elements, "elements")
    return hysteresis.identify(rec.u[:, 0], rec.y[:, 0], kind, n=n, **more)


def _write(found: Found, rec: Record, save: Path | None, out: Path | None) -> None:
    """Write the model and the figure; a .json file for the figure is meant for the model."""
    if out is not None and out.suffix == ".json":
        save, out = out, None
    if save is not None:
        _save(save, found)
    if out is not None:
        write_file(out, page(_drawn(found, rec)))


def _save(path: Path, found: Found) -> None:
    if isinstance(found, StepModes):
        text = "the time constants of a step response have no model file"
        raise refusal("U01", text, remedy="--json prints them")
    save_model(path, found.fit.model if isinstance(found, Identified) else found.model)


def _drawn(found: Found, rec: Record) -> go.Figure:
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
