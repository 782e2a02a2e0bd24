"""Files to values and back: bytes in, a `Record` out; any result out as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from os import PathLike
from typing import Final, Literal

from plantune.errors import PlantuneError, refusal
from plantune.io.assemble import check, record_from
from plantune.io.csv import open_csv
from plantune.io.draft import Choice
from plantune.io.file import contents, format_seen, suffix_of
from plantune.io.jsonfile import (
    load_json,
    load_model,
    model_of,
    save_model,
    to_json,
    write_json,
    write_text,
)
from plantune.io.mat import open_mat
from plantune.io.parquet import open_parquet
from plantune.io.several import joined, named, names_of
from plantune.io.table import Name, Sheet
from plantune.notes import Limits
from plantune.record import Record

__all__ = [
    "load_json",
    "load_model",
    "model_of",
    "open_sheet",
    "read",
    "save_model",
    "to_json",
    "write_json",
    "write_text",
]

# A reader gets the bytes; a new format gets its line here.
_READERS: Final[Mapping[str, Callable[[bytes], Sheet]]] = {
    ".csv": open_csv,
    ".txt": open_csv,
    ".dat": open_csv,
    ".tsv": open_csv,
    ".mat": open_mat,
    ".parquet": open_parquet,
    ".pq": open_parquet,
}


def read(
    path: str | PathLike[str] | Sequence[str | PathLike[str]],
    u: Name | Sequence[Name] | None = None,
    y: Name | Sequence[Name] | None = None,
    Ts: float | None = None,
    *,
    r: Name | Sequence[Name] | None = None,
    aux: Name | Sequence[Name] = (),
    time: Name | Sequence[Name] | None = None,
    quality: Name | Mapping[Name, Name] | None = None,
    resample: float | None = None,
    missing: Literal["error", "segments", "mask"] = "error",
    sentinels: float | Sequence[float] = (),
    uncertain: Literal["drop", "keep"] = "drop",
    sort: bool | Literal["segments"] = False,
    ragged: Literal["error", "skip"] = "error",
    stamps: Literal["uniform", "irregular"] = "uniform",
    compressed: Literal["error", "keep"] = "error",
    units: Mapping[str, str] | None = None,
    limits: Limits | None = None,
) -> Record:
    r"""Read inputs and outputs from a table: csv, tsv, txt, dat, parquet or mat.

    In a text the delimiter is one of comma, semicolon, tab and white space, and a header is
    optional; without one, columns go by their number.  A header cell `power [V]` names the column
    `power` and gives its unit.  In a MAT file a vector goes by its name, a matrix `A` as `A[0]`,
    `A[1]` and on, a field of a structure as `s.field`.  What is done to the rows stands in the
    record's `log`, what they leave in doubt in its `notes`.

    Parameters
    ----------
    path : path, or a list of paths
        The file; a text in UTF-8, UTF-16 with its mark, or GB18030.  Several files with the same
        columns and sample time are segments of one record.
    u, y : name, number from 0, or a list of these
        Columns of the inputs and of the outputs.
    Ts : float, optional
        Sample time in seconds; may be left out where the file has uniform time stamps.
    r : like `y`, optional
        Columns of the reference, one per output.
    aux : name, number, or a list of these
        Further columns to keep.
    time : name or number, or two of these, optional
        Column of the time stamps: seconds or the unit in the header, or text such as
        `2024-01-31T23:59:59.5Z`, `31-Jan-2024 11:59:59 PM`, and `31/01/2024 23:59:59` where the
        column leaves one reading only.  Two columns are a date and a clock time.  By default a
        column called time, timestamp, datetime, t or date, or a pair called date and time.
    quality : name or number, or a mapping, optional
        Column that grades all others, or the quality column of each: words such as Good,
        Uncertain and Bad, OPC's numbers 0 to 255, or status codes of OPC UA.  Bad values count as
        missing.
    resample : float, optional
        Step in seconds of a uniform grid to bring the rows to; inputs and reference are held,
        outputs and `aux` interpolated.  `rows` then count the grid.
    missing : "error", "segments" or "mask"
        Refuse missing values; cut the record there; or keep the rows and mark the outputs that
        do not count.
    sentinels : float, or a list of these
        Values that mean missing, such as -9999.
    uncertain : "drop" or "keep"
        Whether values of quality Uncertain count as missing; a note tells either way.
    sort : False, True or "segments"
        Refuse time that goes back; sort the rows by their stamps; or cut the record there.
    ragged : "error" or "skip"
        Refuse rows of a text with missing or extra fields, or leave them out; the record is cut
        there.
    stamps : "uniform" or "irregular"
        Refuse stamps that are not uniform; or keep them as they are, for `estimate.process`.
    compressed : "error" or "keep"
        Refuse outputs that a historian has thinned out and filled again by lines or by held values,
        or keep them with a note; not asked of rows that `resample` has made.
    units : mapping of name to str, optional
        Units of columns, before those of the header.
    limits : Limits, optional
        Thresholds D07, D08 and D15.

    Returns
    -------
    Record

    Raises
    ------
    DataError
        Too large (D01), another format or damaged (D02), encoding (D03), no rows (D04), ragged
        (D05), not numbers (D06, D11), missing values (D07), infinite ones (D08), columns of
        different length (D09), doubled columns (D12), time stamps that go back, repeat, are not
        uniform or cannot be read in one way only (D13 to D16), outputs that a historian has
        compressed (D15), words that are no quality (D17).
    UsageError
        Columns or sample time not given, or not in the file; files that differ; scipy or pyarrow
        not installed (U01).

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
    choice = Choice(
        u=u,
        y=y,
        Ts=Ts,
        r=r,
        aux=aux,
        time=time,
        quality=quality,
        resample=resample,
        missing=missing,
        sentinels=(sentinels,) if isinstance(sentinels, Real) else tuple(sentinels),  # type: ignore[arg-type]
        uncertain=uncertain,
        sort=sort,
        ragged=ragged,
        stamps=stamps,
        compressed=compressed,
        units=units or {},
        limits=limits or Limits(),
    )
    if isinstance(path, str | PathLike):
        return _read_one(path, choice)
    return _read_several(tuple(path), choice)


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


def _read_one(path: str | PathLike[str], choice: Choice) -> Record:
    check(choice)
    return record_from(open_sheet(path), choice)


def _read_several(paths: tuple[str | PathLike[str], ...], choice: Choice) -> Record:
    files = names_of(paths)
    records = []
    for path, file in zip(paths, files, strict=True):
        try:
            records.append(_read_one(path, choice))
        except PlantuneError as error:
            raise named(error, file) from None
    return joined(records, files)


def _not_readable(suffix: str, data: bytes) -> PlantuneError:
    seen = format_seen(data) or f"a file ending in {suffix!r}"
    return refusal(
        "D02",
        f"this is {seen}; files ending in {', '.join(_READERS)} can be read",
        where=("", 0, None),
        remedy="save the table as CSV, or give the file the suffix of its format",
    )
