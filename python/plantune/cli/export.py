"""`plantune export`: a model or a tuning in the language of what it will run in."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from plantune.cli.main import app
from plantune.cli.options import Json
from plantune.cli.output import print_json, refusing, write_file
from plantune.errors import refusal
from plantune.export import c_source, structured_text, to_control
from plantune.io import load_json, model_of
from plantune.tune import tuning_of

_NUMBERS = Annotated[
    float | None, typer.Option(help="Range of the controller's output, both ends.")
]


class Target(str, Enum):
    """What a file can be exported to."""

    st = "st"
    c = "c"
    control_json = "control-json"


@app.command()
def export(
    file: Annotated[Path, typer.Argument(help="model.json or tuning.json of `plantune tune`.")],
    to: Annotated[
        Target,
        typer.Option(
            help="Structured text of IEC 61131-3, C99, or num, den and dt for python-control."
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="File to write; printed by default.")] = None,
    Ts: Annotated[float | None, typer.Option("--Ts", help="Sample time, seconds.")] = None,
    u_min: _NUMBERS = None,
    u_max: _NUMBERS = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the block, or prefix of the C names.")
    ] = None,
    u_unit: Annotated[str, typer.Option(help="Unit of u, for the comments.")] = "",
    y_unit: Annotated[str, typer.Option(help="Unit of y, for the comments.")] = "",
    order: Annotated[int, typer.Option(help="Of the Padé form, for control-json.")] = 3,
    as_json: Json = False,
) -> None:
    """Write a controller or a plant for a PLC, for a C program, or for python-control."""
    code: dict[str, Any] = {"Ts": Ts, "u_min": u_min, "u_max": u_max}
    units: dict[str, Any] = {"u_unit": u_unit, "y_unit": y_unit}
    writers: Mapping[Target, Callable[[Any], str]] = {
        Target.st: lambda what: structured_text(what, **code, **units, name=name),
        Target.c: lambda what: c_source(what, **code, **units, prefix=name),
        Target.control_json: lambda what: _control_json(what, order, **code),
    }
    with refusing(as_json):
        text = writers[to](_loaded(file))
        if out is not None:
            write_file(out, text)
    if as_json:
        print_json({"to": to.value, "out": out and str(out), "text": text})
    elif out is None:
        sys.stdout.write(text)
    else:
        print(out)


def _loaded(file: Path) -> Any:
    """Return the tuning, model or controller of a file."""
    values = load_json(file)
    is_tuning = isinstance(values, dict) and "controller" in values
    return tuning_of(values) if is_tuning else model_of(values)


def _control_json(what: Any, order: int, **code: Any) -> str:
    """Return `num den dt` of a transfer function, as `control.TransferFunction` takes them."""
    if any(value is not None for value in code.values()):
        raise refusal(
            "U01", "a transfer function has neither Ts nor limits of u", remedy="leave them out"
        )
    system = to_control(what, order=order)
    num, den = ([[p.tolist() for p in row] for row in side] for side in (system.num, system.den))
    return json.dumps({"num": num, "den": den, "dt": system.dt}) + "\n"
