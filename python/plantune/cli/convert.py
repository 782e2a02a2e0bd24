"""`plantune convert`: settings of a controller in another form, or on a vendor's faceplate."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Any

import typer

from plantune.cli.main import app
from plantune.cli.options import Json
from plantune.cli.output import fail, print_json
from plantune.errors import PlantuneError
from plantune.export import VendorSettings, vendor, vendors
from plantune.io import to_json
from plantune.models import PID, Form, Nearest

# Forms that `--to` knows beside the names of `vendors()`.
_FORMS = ("ideal", "parallel", "series", "pb", "velocity")


class Given(str, Enum):
    """The forms that settings are given in."""

    ideal = "ideal"
    parallel = "parallel"
    series = "series"
    pb = "pb"


class TimeUnit(str, Enum):
    """The unit of times."""

    s = "s"
    min = "min"


_Kp = Annotated[
    float | None,
    typer.Option("--Kp", help="Proportional gain, u/y; negative for a process of negative gain."),
]
_Ki = Annotated[float | None, typer.Option("--Ki", help="Integral gain (parallel).")]
_Kd = Annotated[float | None, typer.Option("--Kd", help="Derivative gain (parallel).")]
_PB = Annotated[float | None, typer.Option("--PB", help="Proportional band, percent (pb).")]
_Ti = Annotated[float | None, typer.Option("--Ti", help="Integral time; none without it.")]
_Td = Annotated[float | None, typer.Option("--Td", help="Derivative time.")]
_Tf = Annotated[float | None, typer.Option("--Tf", help="Filter time.")]
_Ts = Annotated[
    float | None, typer.Option("--Ts", help="Sample time of a sampled controller, seconds.")
]
_pv = Annotated[
    float | None,
    typer.Option("--pv-span", help="Span of the measurement: gains in percent of span."),
]
_op = Annotated[float | None, typer.Option("--op-span", help="Span of the output.")]


@app.command()
def convert(
    to: Annotated[
        str,
        typer.Option(
            help="ideal, parallel, series, pb, velocity, or a controller: "
            + ", ".join(profile.name for profile in vendors())
        ),
    ],
    from_: Annotated[Given, typer.Option("--from", help="Form of what is given.")] = Given.ideal,
    Kp: _Kp = None,
    Ki: _Ki = None,
    Kd: _Kd = None,
    PB: _PB = None,
    Ti: _Ti = None,
    Td: _Td = None,
    Tf: _Tf = None,
    Ts: _Ts = None,
    pv_span: _pv = None,
    op_span: _op = None,
    time_unit: Annotated[
        TimeUnit, typer.Option(help="Of the times given, and of those of a form printed.")
    ] = TimeUnit.s,
    digits: Annotated[
        int | None, typer.Option(help="Significant digits of a controller, instead of its own.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Convert PID settings to another form, or to what is entered on a controller.

    Spans scale what is printed; a proportional band is read in percent of both spans.
    """
    letters = {"Kp": Kp, "Ki": Ki, "Kd": Kd, "PB": PB, "Ti": Ti, "Td": Td, "Tf": Tf}
    given: dict[str, Any] = {name: value for name, value in letters.items() if value is not None}
    spans = {"pv_span": pv_span, "op_span": op_span}
    try:
        read = spans if from_ is Given.pb else {}
        pid = PID.from_form(from_.value, **given, **read, Ts=Ts, time_unit=time_unit.value)
        found = (
            pid.to(to, **spans, time_unit=time_unit.value)
            if to in _FORMS
            else vendor(pid, to, **spans, digits=digits)
        )
    except PlantuneError as error:
        studied = {"nearest": _nearest(error.result)} if isinstance(error.result, Nearest) else None
        fail(error, as_json, studied)
        raise typer.Exit(error.exit_code) from None
    if as_json:
        print_json(_fields(found))
    else:
        print(found)


def _fields(found: Form | VendorSettings) -> dict[str, Any]:
    """Return the fields of a form, its name and its repeats per minute first, or of an entry."""
    fields: dict[str, Any] = to_json(found)
    if isinstance(found, VendorSettings):
        return fields
    letters = {letter: fields.pop(letter) for letter in found.letters}
    repeats = to_json(getattr(found, "repeats_per_minute", None))
    return {"form": found.form, **letters, "repeats_per_minute": repeats, **fields}


def _nearest(nearest: Nearest) -> dict[str, Any]:
    return {**_fields(nearest.form), "deviation": nearest.deviation}
