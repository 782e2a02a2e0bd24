"""What a file holds: its columns, its stamps, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import DataError, PlantuneError
from plantune.io import open_sheet
from plantune.io.choose import choose_time
from plantune.io.draft import Names
from plantune.io.numbers import Numbers
from plantune.io.order import newest_first
from plantune.io.stamps import seconds, which_count
from plantune.io.table import Cells, Places, Sheet, Wanted
from plantune.notes import Limits, Note, note_of
from plantune.record import Floats


@dataclass(frozen=True, slots=True)
class ColumnSeen:
    """One column: `holds` is numbers, stamps, text, or nothing where it could not be read.

    `values` of its cells are numbers (or stamps), `missing` are empty; `text` says what else it
    holds.
    """

    number: int
    name: str
    unit: str
    holds: str
    values: int | None = None
    missing: int | None = None
    low: float | None = None
    high: float | None = None
    distinct: int | None = None
    text: str = ""


@dataclass(frozen=True, slots=True)
class Stamps:
    """Steps of a column of time stamps: median, 1 % and 99 % quantile in seconds.

    `gaps` are longer than one and a half medians, `back` repeat the stamp before or go back;
    `said` is what the stamps were taken for.
    """

    column: str
    said: tuple[str, ...]
    step: float
    p1: float
    p99: float
    gaps: int
    back: int


@dataclass(frozen=True, slots=True, eq=False)
class FileSeen:
    """One file: its name, every column, and the time stamps where they can be read."""

    name: str
    columns: tuple[ColumnSeen, ...]
    stamps: Stamps | None


def file_seen(
    path: str | PathLike[str], name: str, time: Names, limits: Limits, findings: list[Note]
) -> FileSeen:
    """Look at every column of a file; where its table is refused, only names are known."""
    names: tuple[ColumnSeen, ...] = ()
    try:
        sheet = open_sheet(path)
        names = tuple(
            ColumnSeen(number=i, name=c.name, unit=c.unit, holds="")
            for i, c in enumerate(sheet.columns)
        )
        columns, stamps = _columns(sheet, names, time, limits, findings)
    except PlantuneError as error:
        if not Path(path).is_file():
            raise
        findings.append(note_of(error))
        return FileSeen(name, names, None)
    return FileSeen(name, columns, stamps)


def _columns(
    sheet: Sheet,
    names: Sequence[ColumnSeen],
    time: Names,
    limits: Limits,
    findings: list[Note],
) -> tuple[tuple[ColumnSeen, ...], Stamps | None]:
    at = choose_time(sheet.columns, time)
    cells, places = _cells(sheet, [*at, *(c.number for c in names if c.number not in at)], findings)
    at = tuple(i for i in at if i in cells)
    if len(at) == 2 and time is None:
        at = tuple(at[k] for k in which_count(*(cells[i] for i in at)))
    seen = {c.number: _column(c, _numbers(c, cells.get(c.number), places)) for c in names}
    if not at:
        return tuple(seen.values()), None
    title = " ".join(sheet.columns[i].title for i in at)
    try:
        t, said = seconds([cells[i] for i in at], title, places)
    except PlantuneError as error:
        findings.append(note_of(error))
        return tuple(seen.values()), None
    seen |= {i: _column(names[i], t, "stamps") for i in at}
    return tuple(seen.values()), _stamps(title, t, said, limits, findings)


def _cells(
    sheet: Sheet, wanted: Sequence[int], findings: list[Note]
) -> tuple[dict[int, Cells], Places]:
    """Return the columns as they stand, but for those that are neither numbers, times nor text."""
    left, as_text, skip = list(wanted), False, False
    while True:
        try:
            stamps, words = ((), left) if as_text else (left, ())
            table = sheet.read(Wanted((), stamps, words, skip))
            return dict(table.cells), table.places
        except DataError as error:
            name = error.where[0] if error.where else ""
            others = [i for i in left if sheet.columns[i].name != name]
            if error.code == "D06" and not as_text:
                as_text = True
            elif error.code == "D05" and not skip:
                findings.append(note_of(error))
                skip = True
            elif error.code == "D11" and 0 < len(others) < len(left):
                left = others
            else:
                raise


def _numbers(
    name: ColumnSeen, cells: Cells | None, places: Places
) -> Floats | NDArray[np.datetime64] | str:
    """Return a column as numbers or as times, or what else it holds."""
    if cells is None:
        return "neither numbers nor text"
    if cells.dtype.kind != "S":
        return cells  # type: ignore[return-value]
    numbers = Numbers(name.name, comma_is_free=True)
    try:
        numbers.take([cell.decode("utf-8", "replace") for cell in cells.tolist()])
        return numbers.column(places)
    except DataError as error:
        return error.text


def _column(
    name: ColumnSeen, x: Floats | NDArray[np.datetime64] | str, holds: str = "numbers"
) -> ColumnSeen:
    if isinstance(x, str):
        return replace(name, holds="text", text=x)
    times = x.dtype.kind == "M"
    values = x[~(np.isnat(x) if times else np.isnan(x))]
    ends = [] if times or not len(values) else [float(values.min()), float(values.max())]
    return replace(
        name,
        holds="stamps" if times else holds,
        values=len(values),
        missing=len(x) - len(values),
        low=ends[0] if ends else None,
        high=ends[1] if ends else None,
        distinct=len(np.unique(values)),
    )


def _stamps(
    title: str, t: Floats, said: tuple[str, ...], limits: Limits, findings: list[Note]
) -> Stamps | None:
    t = np.ascontiguousarray(t)
    try:
        _core.uniform_step(t, limits)
    except PlantuneError as error:
        findings.append(note_of(error))
    if newest_first(t):
        t, said = np.ascontiguousarray(t[::-1]), (*said, "the newest row comes first")
    steps = _core.steps(t)
    return None if steps is None else Stamps(column=title, said=said, **steps)
