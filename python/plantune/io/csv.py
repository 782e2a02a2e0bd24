"""Tables of text: delimiter, header, rows (D03 to D06)."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from itertools import islice
from typing import Final
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.encoding import encoding_of
from plantune.io.file import refuse_binary
from plantune.io.numbers import Numbers, writes_number
from plantune.io.stamps import looks_like_stamp
from plantune.io.table import MOST_COLUMNS, MOST_LINES, Column, Lines, Table, column
from plantune.record import Floats

WHITE: Final = " "
_DELIMITERS: Final = ("\t", ";", ",", WHITE)  # where several fit equally, the first
_SAMPLE: Final = 50  # lines that show the delimiter
_CELLS_AT_ONCE: Final = 10_000  # stays in the cache
_LONGEST_STAMP: Final = 40

Rows = list[list[str]]


def open_csv(data: bytes) -> CsvSheet:
    """Return the table of a text file, its header read."""
    refuse_binary(data)
    encoding = encoding_of(data)
    if _lines(data) > MOST_LINES:
        raise _too_many(_lines(data), "lines", MOST_LINES)
    text = _Text(data, encoding, _delimiter(data, encoding))
    cells = next((cells for _, cells in text.rows() if not _is_blank(cells)), None)
    if cells is None:
        raise _too_few(0, "nothing")
    if len(cells) > MOST_COLUMNS:
        raise _too_many(len(cells), "columns", MOST_COLUMNS)
    header = not any(writes_number(cell) or looks_like_stamp(cell) for cell in cells)
    columns = tuple(column(cell if header else "", i) for i, cell in enumerate(cells))
    return CsvSheet(columns, text, header)


@dataclass(frozen=True, slots=True)
class _Text:
    """A text and how to split it."""

    data: bytes
    encoding: str
    delimiter: str

    def open(self) -> TextIOWrapper:
        return TextIOWrapper(BytesIO(self.data), self.encoding)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield every row with the line on which it ends; a refusal names where it begins."""
        if self.delimiter == WHITE:
            yield from ((line, row.split()) for line, row in enumerate(self.open(), 1))
            return
        reader = csv.reader(self.open(), delimiter=self.delimiter, strict=True)
        line = 0
        try:
            for cells in reader:
                line = reader.line_num
                yield line, cells
        except csv.Error as error:
            raise _not_split(line + 1, reader.line_num, str(error)) from None

    def stretches(self, length: int) -> Iterator[tuple[Lines, Rows]]:
        """Yield the same rows by the thousand, which is several times faster."""
        text = self.open()
        white = self.delimiter == WHITE
        reader = csv.reader(text, delimiter=self.delimiter, strict=True)
        source = (row.split() for row in text) if white else reader
        line = 0
        while rows := self._next(source, length):
            ends = np.arange(1, len(rows) + 1)
            if not white and reader.line_num - line != len(rows):  # a quoted cell with line breaks
                ends += np.cumsum([sum(cell.count("\n") for cell in cells) for cells in rows])
            yield line + ends, rows
            line += int(ends[-1])

    def _next(self, source: Iterator[list[str]], length: int) -> Rows:
        try:
            return list(islice(source, length))
        except csv.Error:
            return [cells for _, cells in self.rows()]  # raises, and says where


@dataclass(frozen=True, slots=True)
class CsvSheet:
    """A text file whose header has been read."""

    columns: tuple[Column, ...]
    text: _Text
    header: bool

    def read(self, numbers: Sequence[int], stamps: int | None) -> Table:
        """Return these columns as numbers, and one as time stamps."""
        return self._at_once(numbers, stamps) or self._row_by_row(numbers, stamps)

    def _at_once(self, numbers: Sequence[int], stamps: int | None) -> Table | None:
        """Read a file without any blemish, ten times faster; None where there is one."""
        data, delimiter = self.text.data, self.text.delimiter
        lines = _lines(data)
        odd = self.text.encoding != "utf-8-sig" or data.count(b'"') % 2  # a quote not closed
        if odd or lines * len(self.columns) > len(data) + 1:
            return None  # fewer bytes than cells is ragged, and takes much memory to find out
        kinds = ["f8" if i in numbers else "U1" for i in range(len(self.columns))]
        if stamps is not None:
            kinds[stamps] = "f8" if self._first_is_number(stamps) else f"S{_LONGEST_STAMP}"
        dtype = [(str(i), kind) for i, kind in enumerate(kinds)]
        try:
            with catch_warnings():
                simplefilter("error")
                cells = np.loadtxt(
                    self.text.open(),
                    dtype=dtype,
                    delimiter=None if delimiter == WHITE else delimiter,
                    comments=None,
                    quotechar='"',
                    skiprows=int(self.header),
                    ndmin=1,
                    max_rows=lines + 1,  # one more shows that the count was wrong
                )
        except (ValueError, UserWarning):
            return None
        if lines != len(cells) + self.header or len(cells) < 2:
            return None
        return Table(
            np.stack([cells[str(i)] for i in numbers], axis=1),
            None if stamps is None else np.ascontiguousarray(cells[str(stamps)]),
            np.arange(1, len(cells) + 1) + self.header,
            self._log(len(cells)),
        )

    def _first_is_number(self, i: int) -> bool:
        filled = (cells for _, cells in self.text.rows() if not _is_blank(cells))
        first = next(islice(filled, int(self.header), None), [])
        return i >= len(first) or writes_number(first[i])

    def _row_by_row(self, numbers: Sequence[int], stamps: int | None) -> Table:
        """Read any file; refuse what is wrong with its place and count."""
        comma_is_free = self.text.delimiter == ";"
        columns = {i: Numbers(self.columns[i].name, comma_is_free) for i in numbers}
        times = None
        if stamps is not None:
            times = _Times(self.columns[stamps].name, comma_is_free, self._first_is_number(stamps))
        body = _Body(self.text, len(self.columns), self.header)
        for rows in body.stretches():
            for i, numeric in columns.items():
                numeric.take([row[i] for row in rows])
            if times is not None and stamps is not None:
                times.take([row[stamps] for row in rows])
            if any(numeric.is_text for numeric in columns.values()):
                break
        lines = body.checked_lines()
        log = self._log(body.N)
        if body.blank:
            log += (f"{body.blank} blank lines skipped",)
        with_commas = [c.name for c in columns.values() if c.first_comma is not None]
        if with_commas:
            log += (f"decimal commas read in {', '.join(with_commas)}",)
        return Table(
            np.stack([columns[i].column(lines) for i in numbers], axis=1),
            times.column(lines) if times is not None else None,
            lines,
            log,
        )

    def _log(self, N: int) -> tuple[str, ...]:
        delimiter = {"\t": "tab", WHITE: "white space"}.get(
            self.text.delimiter, self.text.delimiter
        )
        read = f"read {N} rows of {len(self.columns)} columns, delimiter {delimiter}"
        if self.text.encoding == "utf-8-sig":
            return (read,)
        return (read, f"text read as {self.text.encoding.upper()}")


class _Body:
    """The rows below the header with their line numbers, all of one width (D05)."""

    def __init__(self, text: _Text, width: int, header: bool) -> None:
        self.text = text
        self.width = width
        self.skip = int(header)
        self.N = 0
        self.blank = 0
        self.ragged = 0
        self.first_ragged: tuple[int, int, int] | None = None  # row, line, fields
        self.lines: list[Lines] = []

    def stretches(self) -> Iterator[Rows]:
        """Yield the rows of the right width, and count the others."""
        for lines, rows in self.text.stretches(max(1, _CELLS_AT_ONCE // self.width)):
            if self.skip or set(map(len, rows)) != {self.width}:
                lines, rows = self._sorted_out(lines, rows)
            self.N += len(rows)
            self.lines.append(lines)
            if rows:
                yield rows

    def _sorted_out(self, lines: Lines, rows: Rows) -> tuple[Lines, Rows]:
        """Leave out the header, blank lines and ragged rows."""
        kept = []
        for k, cells in enumerate(rows):
            if _is_blank(cells):
                self.blank += 1
            elif self.skip:
                self.skip = 0
            elif len(cells) == self.width:
                kept.append(k)
            else:
                self.ragged += 1
                if self.first_ragged is None:
                    self.first_ragged = (self.N + len(kept), int(lines[k]), len(cells))
        return lines[kept], [rows[k] for k in kept]

    def checked_lines(self) -> Lines:
        """Return the line of each row, once all were of one width and at least two."""
        if self.first_ragged is not None:
            raise self._ragged(*self.first_ragged)
        if self.N < 2:
            raise _too_few(self.N, "one row of data" if self.N else "a header")
        return np.concatenate(self.lines)

    def _ragged(self, row: int, line: int, fields: int) -> PlantuneError:
        return refusal(
            "D05",
            f"file line {line} has {fields} fields, the first line has {self.width}",
            where=("", row, None),
            count=self.ragged,
            measured=float(fields),
            limit=float(self.width),
            remedy="complete or remove the row; a text with the delimiter in it needs quotes",
        )


class _Times:
    """The time column: numbers if its first cell is one, else text."""

    def __init__(self, name: str, comma_is_free: bool, is_number: bool) -> None:
        self.numbers = Numbers(name, comma_is_free)
        self.texts: list[NDArray[np.bytes_]] = []
        self.is_number = is_number

    def take(self, cells: list[str]) -> None:
        if self.is_number:
            self.numbers.take(cells)
        else:
            texts = [cell.encode("latin-1", "replace") for cell in cells]
            self.texts.append(np.array(texts, f"S{_LONGEST_STAMP}"))

    def column(self, lines: Lines) -> Floats | NDArray[np.bytes_]:
        return self.numbers.column(lines) if self.is_number else np.concatenate(self.texts)


def _lines(data: bytes) -> int:
    ends = max(data.count(b"\n"), data.count(b"\r"))
    return ends + (not data.endswith((b"\n", b"\r")))


def _is_blank(cells: list[str]) -> bool:
    return not cells or (len(cells) == 1 and not cells[0].strip())


def _delimiter(data: bytes, encoding: str) -> str:
    """Return the delimiter that splits most of the first lines into equally many fields."""
    text = TextIOWrapper(BytesIO(data), encoding)
    lines = list(islice((line for line in text if line.strip()), _SAMPLE))

    def agreeing(delimiter: str) -> int:
        widths = Counter(_width(line, delimiter) for line in lines)
        return max((n for width, n in widths.items() if width > 1), default=0)

    return max(_DELIMITERS, key=agreeing)


def _width(line: str, delimiter: str) -> int:
    if delimiter == WHITE:
        return len(line.split())
    try:
        return len(next(csv.reader([line], delimiter=delimiter)))
    except csv.Error:
        return 1


def _not_split(first: int, last: int, reason: str) -> PlantuneError:
    if "field limit" in reason and first == last:
        limit = csv.field_size_limit()
        return refusal(
            "D01",
            f"a field in file line {first} has more than {limit} characters",
            where=(f"line {first}", None, None),
            count=1,
            measured=float(limit + 1),
            limit=float(limit),
            remedy="look for missing delimiters, or remove the field",
        )
    quote = "a quote is not closed" if last > first or "end of data" in reason else reason
    return refusal(
        "D05",
        f"file line {first} cannot be split into fields: {quote}",
        where=(f"line {first}", None, None),
        count=1,
        remedy="close or remove the quote in this line",
    )


def _too_few(rows: int, what: str) -> PlantuneError:
    return refusal(
        "D04",
        f"the file holds {what} and no row of data" if rows == 0 else f"the file holds {what}",
        count=rows,
        measured=float(rows),
        limit=2.0,
        remedy="give a file with at least two rows of data",
    )


def _too_many(count: int, what: str, limit: int) -> PlantuneError:
    return refusal(
        "D01",
        f"the file has {count} {what}",
        count=count,
        measured=float(count),
        limit=float(limit),
        remedy="cut it into parts, or keep only what is needed",
    )
