"""The options that say how to read a record, once for all commands that take one."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from plantune.errors import refusal
from plantune.io import read
from plantune.notes import Limits
from plantune.record import Record

Several = list[str] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What the command line says of the record; the options of `plantune.io.read`."""

    data: Annotated[
        list[Path], typer.Argument(help="Record: csv, parquet or mat; several are segments of one.")
    ]
    u: Annotated[str | None, typer.Option(help="Input column, by name or number from 0.")] = None
    y: Annotated[str | None, typer.Option(help="Output column.")] = None
    Ts: Annotated[float | None, typer.Option("--Ts", help="Sample time, seconds.")] = None
    r: Annotated[str | None, typer.Option(help="Set-point column.")] = None
    time: Annotated[
        Several, typer.Option(help="Column of time stamps; twice: of dates, of clock times.")
    ] = None
    quality: Annotated[
        Several, typer.Option(help="Column that grades all others, or COLUMN=QUALITY, repeatable.")
    ] = None
    uncertain: Annotated[str, typer.Option(help="Values of quality Uncertain: drop or keep.")] = (
        "drop"
    )
    missing: Annotated[str, typer.Option(help="error, segments or mask.")] = "error"
    sentinel: Annotated[
        list[float] | None, typer.Option(help="Value that means missing, repeatable.")
    ] = None
    sort: Annotated[bool, typer.Option("--sort", help="Sort the rows by their stamps.")] = False
    sort_segments: Annotated[
        bool, typer.Option("--sort-segments", help="Cut where the clock goes back.")
    ] = False
    ragged: Annotated[str, typer.Option(help="Rows with other fields: error or skip.")] = "error"
    compressed: Annotated[
        str, typer.Option(help="Outputs compressed by a historian: error or keep.")
    ] = "error"
    resample: Annotated[float | None, typer.Option(help="Bring jittered stamps to this step.")] = (
        None
    )

    between: Annotated[
        tuple[float, float] | None, typer.Option(help="Only rows between these times, seconds.")
    ] = None

    @property
    def title(self) -> str:
        """The name of the record."""
        more = f" and {len(self.data) - 1} more" if len(self.data) > 1 else ""
        return self.data[0].stem + more

    def record(self, limits: Limits) -> Record:
        """Read the record."""
        rec = read(self.path, **self.options(), limits=limits)
        return rec if self.between is None else rec.between(*self.between)

    @property
    def path(self) -> Path | list[Path]:
        """The file, or the files."""
        return self.data if len(self.data) > 1 else self.data[0]

    def options(self) -> dict[str, Any]:
        """Return the options as `plantune.io.read` takes them."""
        return {
            "u": _column(self.u),
            "y": _column(self.y),
            "Ts": self.Ts,
            "r": _column(self.r),
            "time": None if not self.time else [_name(name) for name in self.time],
            "quality": _quality(self.quality or []),
            "resample": self.resample,
            "missing": self.missing,
            "sentinels": tuple(self.sentinel or ()),
            "uncertain": self.uncertain,
            "sort": "segments" if self.sort_segments else self.sort,
            "ragged": self.ragged,
            "compressed": self.compressed,
        }


def takes_record(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command, whose first argument is a `Reading`, the options of one instead."""
    names = [field.name for field in fields(Reading)]

    def run(**given: Any) -> None:
        command(Reading(**{name: given.pop(name) for name in names}), **given)

    own = get_type_hints(command, include_extras=True)
    hints = get_type_hints(Reading, include_extras=True)
    parameters = [
        *_parameters(inspect.signature(Reading), hints),
        *_parameters(inspect.signature(command), own)[1:],
    ]
    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


def _parameters(signature: inspect.Signature, hints: dict[str, Any]) -> list[inspect.Parameter]:
    return [
        p.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[p.name])
        for p in signature.parameters.values()
    ]


def _name(name: str) -> str | int:
    return int(name) if name.isdecimal() else name


def _column(name: str | None) -> str | int | None:
    return None if name is None else _name(name)


def _quality(given: list[str]) -> str | int | Mapping[str | int, str | int] | None:
    if not given:
        return None
    if len(given) == 1 and "=" not in given[0]:
        return _name(given[0])
    pairs = [text.rpartition("=") for text in given]
    if not all(name and quality for name, _, quality in pairs):
        raise refusal(
            "U01",
            f"`--quality` is {', '.join(map(repr, given))}: one column, or COLUMN=QUALITY for each",
            remedy="--quality status, or --quality temp=temp_status",
        )
    return {_name(name): _name(quality) for name, _, quality in pairs}
