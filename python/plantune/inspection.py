"""A look into a file before anything is decided: its columns, its stamps, all that is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Final

import numpy as np

from plantune import _core
from plantune.analyze import DelayScan, delay, health
from plantune.errors import DataError, PlantuneError
from plantune.io import open_sheet, read
from plantune.io.choose import Names, choose
from plantune.io.stamps import seconds
from plantune.io.table import Name, Sheet
from plantune.notes import DEFAULT_LIMITS, Limits, Note, note_of
from plantune.record import Floats, Record

MOST_ORDER: Final = 8
"""Parameters up to which the excitation is looked at."""


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
class Inspection:
    r"""What was seen in a file.

    Attributes
    ----------
    name : str
        Of the file.
    columns : tuple of ColumnSeen
        Every column.
    stamps : Stamps or None
        The column of time stamps, where there is one that can be read.
    record : str
        The record that these columns make; empty where they make none.
    excitation : mapping of name to int
        Parameters of a linear model that each input supports, at most 8.
    delay : mapping of name to DelayScan
        From each input, where it can be scanned.
    findings : tuple of Note
        All that is wrong or in doubt; severity "error" for what every other verb refuses.

    Examples
    --------
    >>> import plantune as pt
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "heater.csv"
    ...     _ = path.write_text("time,power [V],temp\n0.0,1,20.0\n0.5,2,\n1.0,2,21.0\n")
    ...     seen = pt.inspect(path, u="power", y="temp")
    >>> [(c.name, c.unit, c.holds, c.values, c.high) for c in seen.columns]
    [('time', '', 'stamps', 3, 1.0), ('power', 'V', 'numbers', 3, 2.0),
     ('temp', '', 'numbers', 2, 21.0)]
    >>> seen.stamps.step, [(note.code, note.severity) for note in seen.findings][0]
    (0.5, ('D07', 'error'))
    """

    name: str
    columns: tuple[ColumnSeen, ...]
    stamps: Stamps | None
    record: str
    excitation: Mapping[str, int]
    delay: Mapping[str, DelayScan]
    findings: tuple[Note, ...]

    def __bool__(self) -> bool:
        return all(note.severity != "error" for note in self.findings)


def inspect(
    path: str | PathLike[str],
    u: Names = None,
    y: Names = None,
    Ts: float | None = None,
    *,
    time: Name | None = None,
    limits: Limits | None = None,
    **options: Any,
) -> Inspection:
    r"""List the columns of a file and, given inputs and outputs, all that is wrong with them.

    Nothing readable is refused: a refusal of `read` is a finding, and where one has a usual way
    on (missing values, stamps that are not uniform) the look goes on behind it.  Without `u` and
    `y` nothing is guessed about which column is which.

    Parameters
    ----------
    path : path
        As for `read`.
    u, y, Ts, time, limits, **options
        As for `read`.

    Returns
    -------
    Inspection

    Raises
    ------
    UsageError
        There is no such file (U01).

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "still.csv"
    ...     rows = "".join(f"3.5,{20 + k % 7}\n" for k in range(200))
    ...     _ = path.write_text("power,temp\n" + rows)
    ...     seen = inspect(path, u="power", y="temp", Ts=1.0)
    >>> [note.code for note in seen.findings], seen.excitation
    (['X01'], {'power': 0})
    """
    limits = limits or DEFAULT_LIMITS
    findings: list[Note] = []
    columns: tuple[ColumnSeen, ...] = ()
    stamps = None
    options = {**options, "Ts": Ts, "time": time, "limits": limits}
    try:
        sheet = open_sheet(path)
        columns = _names(sheet)
        columns, stamps = _columns(sheet, time, limits, findings)
    except PlantuneError as error:
        if not Path(path).is_file():
            raise
        findings.append(note_of(error))
    rec = None
    if columns and not (u is None and y is None):
        rec = _record(path, {**options, "u": u, "y": y}, stamps, findings)
    excitation, scans = _look(rec, limits, findings) if rec else ({}, {})
    return Inspection(
        name=Path(path).name,
        columns=columns,
        stamps=stamps,
        record=str(rec) if rec else "",
        excitation=excitation,
        delay=scans,
        findings=tuple(dict.fromkeys(findings)),
    )


# --- the table ---


def _names(sheet: Sheet) -> tuple[ColumnSeen, ...]:
    return tuple(
        ColumnSeen(number=i, name=c.name, unit=c.unit, holds="")
        for i, c in enumerate(sheet.columns)
    )


def _columns(
    sheet: Sheet, time: Name | None, limits: Limits, findings: list[Note]
) -> tuple[tuple[ColumnSeen, ...], Stamps | None]:
    """Look at every column; the whole table may be refused, then only names are known."""
    names = _names(sheet)
    try:
        at = choose(sheet.columns, (), (), None, (), time).time
        numbers = _numbers(sheet, [c.number for c in names if c.number != at])
    except PlantuneError as error:
        findings.append(note_of(error))
        return names, None
    seen = {i: _column(names[i], x) for i, x in numbers.items()}
    stamps = None
    if at is not None:
        others = [i for i, x in numbers.items() if not isinstance(x, PlantuneError)]
        seen[at], stamps = _stamps(sheet, names[at], others, limits, findings)
    return tuple(seen[c.number] for c in names), stamps


def _numbers(sheet: Sheet, wanted: Sequence[int]) -> dict[int, Floats | PlantuneError]:
    """Return each column as numbers, or why it is none."""
    found: dict[int, Floats | PlantuneError] = {}
    left = list(wanted)
    while left:
        try:
            x = sheet.read(left, None).numbers
        except DataError as error:
            name = error.where[0] if error.where else ""
            text = [i for i in left if sheet.columns[i].name == name]
            if error.code != "D06" or not text:
                raise
            found |= dict.fromkeys(text, error)
            left = [i for i in left if i not in text]
        else:
            return found | {i: x[:, k] for k, i in enumerate(left)}
    return found


def _column(name: ColumnSeen, x: Floats | PlantuneError, holds: str = "numbers") -> ColumnSeen:
    if isinstance(x, PlantuneError):
        return ColumnSeen(name.number, name.name, name.unit, "text", text=x.text)
    values = x[~np.isnan(x)]
    return ColumnSeen(
        name.number,
        name.name,
        name.unit,
        holds,
        values=len(values),
        missing=len(x) - len(values),
        low=float(values.min()) if len(values) else None,
        high=float(values.max()) if len(values) else None,
        distinct=len(np.unique(values)),
    )


def _stamps(
    sheet: Sheet, name: ColumnSeen, others: Sequence[int], limits: Limits, findings: list[Note]
) -> tuple[ColumnSeen, Stamps | None]:
    """Read a column as time stamps, beside one of numbers; what is wrong with them is found."""
    if not others:  # a reader gives stamps beside numbers only
        return _column(name, _numbers(sheet, [name.number])[name.number]), None
    try:
        table = sheet.read(others[:1], name.number)
        if table.stamps is None:
            return name, None
        title = sheet.columns[name.number].title
        t, said = seconds(table.stamps, title, table.lines)
    except PlantuneError as error:
        findings.append(note_of(error))
        return _column(name, error), None
    seen = _column(name, t, "stamps")
    steps = _core.steps(np.ascontiguousarray(t))
    try:
        _core.uniform_step(np.ascontiguousarray(t), limits)
    except PlantuneError as error:
        findings.append(note_of(error))
    return seen, None if steps is None else Stamps(column=name.name, said=said, **steps)


# --- the record ---


def _record(
    path: str | PathLike[str],
    options: dict[str, Any],
    stamps: Stamps | None,
    findings: list[Note],
) -> Record | None:
    """Read the record; behind a refusal with a usual way on, go on."""
    ways: dict[str, dict[str, Any]] = {"D07": {"missing": "segments"}}
    if stamps is not None and stamps.step > 0:
        ways["D15"] = {"resample": stamps.step}
    while True:
        try:
            return read(path, **options)
        except PlantuneError as error:
            findings[:] = [*(n for n in findings if n.code != error.code), note_of(error)]
            if error.code not in ways:
                return None
            options = {**options, **ways.pop(error.code)}


def _look(
    rec: Record, limits: Limits, findings: list[Note]
) -> tuple[dict[str, int], dict[str, DelayScan]]:
    """Look at a record as the main job does; return excitation and delay of each input."""
    findings += [*rec.notes, *health(rec, limits).notes]
    orders = _core.excitation_orders(rec, MOST_ORDER, limits)
    scans = {}
    for i, name in enumerate(rec.u_names if rec.ny == 1 else ()):
        try:
            scans[name] = delay(rec, (0, max(1, min(20, rec.N // 4))), input=i, limits=limits)
            findings += scans[name].notes
        except PlantuneError as error:
            findings.append(note_of(error))
    return dict(zip(rec.u_names, orders, strict=True)), scans
