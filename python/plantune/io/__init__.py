"""Files to values and back: bytes in, a `Record` out; any result out as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Final, Literal

from plantune.errors import refusal
from plantune.io.assemble import Choice, record_from
from plantune.io.csv import open_csv
from plantune.io.file import contents, format_seen, suffix_of
from plantune.io.jsonfile import load_model, save_model, to_json, write_json
from plantune.io.table import Name, Sheet
from plantune.notes import Limits
from plantune.record import Record

__all__ = ["load_model", "open_sheet", "read", "save_model", "to_json", "write_json"]

# A reader gets the bytes; a new format gets its line here.
_READERS: Final[Mapping[str, Callable[[bytes], Sheet]]] = {
    ".csv": open_csv,
    ".txt": open_csv,
    ".dat": open_csv,
    ".tsv": open_csv,
}


def read(
    path: str | PathLike[str],
    u: Name | Sequence[Name] | None = None,
    y: Name | Sequence[Name] | None = None,
    Ts: float | None = None,
    *,
    r: Name | Sequence[Name] | None = None,
    aux: Name | Sequence[Name] = (),
    time: Name | None = None,
    resample: float | None = None,
    missing: Literal["error", "segments", "mask"] = "error",
    units: Mapping[str, str] | None = None,
    limits: Limits | None = None,
) -> Record:
    r"""Read inputs and outputs from a table: csv, tsv, txt or dat.

    The delimiter is one of comma, semicolon, tab and white space.  A header is optional; without
    one, columns go by their number.  A header cell `power [V]` names the column `power` and gives
    its unit.  What is done to the rows stands in the record's `log`.

    Parameters
    ----------
    path : path
        The file; UTF-8, UTF-16 with its mark, or GB18030.
    u, y : name, number from 0, or a list of these
        Columns of the inputs and of the outputs.
    Ts : float, optional
        Sample time in seconds; may be left out where the file has uniform time stamps.
    r : like `y`, optional
        Columns of the reference, one per output.
    aux : name, number, or a list of these
        Further columns to keep.
    time : name or number, optional
        Column of the time stamps: seconds, or ISO 8601 with or without a zone.  By default a
        column called time, timestamp, datetime, t or date.
    resample : float, optional
        Step in seconds of a uniform grid to bring the rows to; inputs and reference are held,
        outputs and `aux` interpolated.  `rows` then count the grid.
    missing : "error", "segments" or "mask"
        Refuse missing values; cut the record there; or keep the rows and mark the outputs that
        do not count.
    units : mapping of name to str, optional
        Units of columns, before those of the header.
    limits : Limits, optional
        Thresholds D07 and D15.

    Returns
    -------
    Record

    Raises
    ------
    DataError
        Too large (D01), another format (D02), encoding (D03), no rows (D04), ragged (D05), not
        numbers (D06), missing values (D07), doubled columns (D12), time stamps that go back,
        repeat, are not uniform or cannot be read (D13 to D16).
    UsageError
        Columns or sample time not given, or not in the file (U01).

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "heater.csv"
    ...     _ = path.write_text("time,power [V],temp\n0.0,1,20.0\n0.5,2,20.5\n1.0,2,21.0\n")
    ...     rec = read(path, u="power", y="temp")
    >>> print(rec)
    Record power -> temp: 3 rows, Ts 0.5 s, 1 segment
    >>> rec.units["power"]
    'V'
    """
    choice = Choice(u, y, Ts, r, aux, time, resample, missing, units or {}, limits or Limits())
    return record_from(open_sheet(path), choice)


def open_sheet(path: str | PathLike[str]) -> Sheet:
    r"""Return the table of a file, its header read and nothing chosen yet.

    Raises
    ------
    DataError
        Too large (D01), another format (D02), encoding (D03), no rows (D04).
    UsageError
        There is no such file (U01).

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "heater.csv"
    ...     _ = path.write_text("time,power [V]\n0.0,1\n0.5,2\n")
    ...     sheet = open_sheet(path)
    >>> [(column.name, column.unit) for column in sheet.columns]
    [('time', ''), ('power', 'V')]
    """
    suffix = suffix_of(path)
    data = contents(path)
    if suffix not in _READERS:
        raise _not_readable(suffix, data)
    return _READERS[suffix](data)


def _not_readable(suffix: str, data: bytes) -> Exception:
    seen = format_seen(data) or f"a file ending in {suffix!r}"
    return refusal(
        "D02",
        f"this is {seen}; files ending in {', '.join(_READERS)} can be read",
        remedy="save the table as CSV",
    )
