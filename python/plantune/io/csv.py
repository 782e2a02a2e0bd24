"""Tables of text: header and rows to columns (D03 to D06)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Final
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.dates import looks_like_stamp
from plantune.io.encoding import UTF_8, encoding_of
from plantune.io.file import refuse_binary, too_few, too_many
from plantune.io.numbers import Numbers, writes_number
from plantune.io.table import (
    LONGEST_CELL,
    MOST_COLUMNS,
    MOST_LINES,
    Column,
    Places,
    Table,
    Wanted,
    beside,
    column,
)
from plantune.io.text import (
    WHITE,
    Lines,
    Rows,
    Text,
    count_lines,
    delimiter_of,
    is_blank,
    refuse_long_line,
)

_CELLS_AT_ONCE: Final = 10_000  # stays in the cache


def open_csv(data: bytes) -> CsvSheet:
    """Return the table of a text file, its header read."""
    refuse_binary(data)
    encoding = encoding_of(data)
    if count_lines(data) > MOST_LINES:
        raise too_many(count_lines(data), "lines", MOST_LINES)
    if encoding != UTF_8:
        data = data.decode(encoding).encode()
    refuse_long_line(data)
    text = Text(data, delimiter_of(data))
    cells = next((cells for _, cells in text.rows() if not is_blank(cells)), None)
    if cells is None:
        raise too_few(0, "nothing")
    if len(cells) > MOST_COLUMNS:
        raise too_many(len(cells), "columns", MOST_COLUMNS)
    header = not any(writes_number(cell) or looks_like_stamp(cell) for cell in cells)
    columns = tuple(column(cell if header else "", i) for i, cell in enumerate(cells))
    return CsvSheet(columns, text, header, encoding)


@dataclass(frozen=True, slots=True)
class CsvSheet:
    """A text file whose header has been read."""

    columns: tuple[Column, ...]
    text: Text
    header: bool
    encoding: str

    def read(self, wanted: Wanted) -> Table:
        """Return the columns wanted; words are text."""
        return self._at_once(wanted) or self._row_by_row(wanted)

    def _at_once(self, wanted: Wanted) -> Table | None:
        """Read a file without any blemish, ten times faster; None where there is one."""
        data, delimiter = self.text.data, self.text.delimiter
        lines = count_lines(data)
        unclosed = data.count(b'"') % 2
        if unclosed or lines * len(self.columns) > len(data) + 1:
            return None  # fewer bytes than cells is ragged, and takes much memory to find out
        as_text = self._as_text(wanted)
        kinds = dict.fromkeys(range(len(self.columns)), "U1")
        kinds.update(dict.fromkeys((*wanted.numbers, *wanted.stamps), "f8"))
        kinds.update(dict.fromkeys(as_text, f"S{LONGEST_CELL}"))
        try:
            with catch_warnings():
                simplefilter("error")
                cells = np.loadtxt(
                    self.text.open(),
                    dtype=[(str(i), kind) for i, kind in kinds.items()],
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
        taken = {i: np.ascontiguousarray(cells[str(i)]) for i in wanted.cells}
        if any(taken[i].view(np.uint8).max() > 127 for i in as_text):
            return None  # loadtxt gives Latin-1
        rows = np.arange(len(cells))
        return Table(
            beside([cells[str(i)] for i in wanted.numbers], len(cells)),
            taken,
            Places(rows, rows + 1 + self.header),
            self._log(len(cells)),
        )

    def _as_text(self, wanted: Wanted) -> set[int]:
        """Return the columns to read as text: words, and stamps that do not begin as numbers."""
        filled = (cells for _, cells in self.text.rows() if not is_blank(cells))
        first = next(islice(filled, int(self.header), None), []) if wanted.stamps else []
        known = [i for i in wanted.stamps if i < len(first)]
        return {*wanted.words, *(i for i in known if not writes_number(first[i]))}

    def _row_by_row(self, wanted: Wanted) -> Table:
        """Read any file; refuse what is wrong with its place and count."""
        numbers, as_text = wanted.numbers, self._as_text(wanted)
        as_numbers = {*numbers, *wanted.stamps} - (as_text - {*numbers})
        values = {i: self._numbers(i) for i in as_numbers}
        texts: dict[int, list[NDArray[np.bytes_]]] = {i: [] for i in as_text}
        body = _Body(self.text, len(self.columns), self.header, wanted.skip_ragged)
        for rows in body.stretches():
            for i, value in values.items():
                value.take([row[i] for row in rows])
            for i, text in texts.items():
                cut = [row[i].encode("utf-8", "replace") for row in rows]
                text.append(np.array(cut, f"S{LONGEST_CELL}"))
            if any(values[i].is_text for i in numbers):
                break
        places = body.places()
        with_commas = [values[i].name for i in numbers if values[i].first_comma is not None]
        commas = (f"decimal commas read in {', '.join(with_commas)}",) if with_commas else ()
        return Table(
            beside([values[i].column(places) for i in numbers], len(places)),
            {
                i: np.concatenate(texts[i]) if i in texts else values[i].column(places)
                for i in wanted.cells
            },
            places,
            self._log(body.N) + body.log() + commas,
        )

    def _numbers(self, i: int) -> Numbers:
        return Numbers(self.columns[i].name, comma_is_free=self.text.delimiter == ";")

    def _log(self, N: int) -> tuple[str, ...]:
        delimiter = {"\t": "tab", WHITE: "white space"}.get(
            self.text.delimiter, self.text.delimiter
        )
        read = f"read {N} rows of {len(self.columns)} columns, delimiter {delimiter}"
        if self.encoding == UTF_8:
            return (read,)
        return (read, f"text read as {self.encoding.upper()}")


class _Body:
    """The rows below the header with their places, all of one width (D05)."""

    def __init__(self, text: Text, width: int, header: bool, skip_ragged: bool) -> None:
        self.text = text
        self.width = width
        self.skip = int(header)
        self.skip_ragged = skip_ragged
        self.N = 0
        self.blank = 0
        self.ragged = 0
        self.first_ragged: tuple[int, int, int] | None = None  # row, line, fields
        self.rows: list[Lines] = []
        self.lines: list[Lines] = []

    def stretches(self) -> Iterator[Rows]:
        """Yield the rows of the right width, and count the others."""
        for lines, rows in self.text.stretches(max(1, _CELLS_AT_ONCE // self.width)):
            numbers = np.arange(len(rows)) + self.N + self.ragged
            if self.skip or set(map(len, rows)) != {self.width}:
                numbers, lines, rows = self._sorted_out(lines, rows)
            self.N += len(rows)
            self.rows.append(numbers)
            self.lines.append(lines)
            if rows:
                yield rows

    def _sorted_out(self, lines: Lines, rows: Rows) -> tuple[Lines, Lines, Rows]:
        """Leave out the header, blank lines and ragged rows, which count all the same."""
        widths = np.fromiter(map(len, rows), np.int64, len(rows))
        doubtful = widths != (-1 if self.skip or self.width == 1 else self.width)
        keep, counts = np.ones((2, len(rows)), bool)
        before = self.N + self.ragged
        for k in np.flatnonzero(doubtful).tolist():
            if is_blank(rows[k]) or self.skip:
                keep[k] = counts[k] = False
                self.blank += is_blank(rows[k])
                self.skip = int(self.skip and is_blank(rows[k]))
            elif widths[k] != self.width:
                keep[k] = False
                self.ragged += 1
                if self.first_ragged is None:
                    row = before + int(counts[:k].sum())
                    self.first_ragged = (row, int(lines[k]), int(widths[k]))
        kept = np.flatnonzero(keep)
        numbers = before + np.cumsum(counts) - 1
        return numbers[kept], lines[kept], [rows[k] for k in kept.tolist()]

    def places(self) -> Places:
        """Return the place of each row, once all were of one width and at least two."""
        if self.first_ragged is not None and not self.skip_ragged:
            raise self._refusal(*self.first_ragged)
        if self.N < 2:
            raise too_few(self.N, "one row of data" if self.N else "a header")
        return Places(np.concatenate(self.rows), np.concatenate(self.lines))

    def log(self) -> tuple[str, ...]:
        """Return what was left out."""
        said = [f"{self.blank} blank lines skipped"] * bool(self.blank)
        if self.first_ragged is not None:
            _, line, fields = self.first_ragged
            said.append(
                f"D05: skipped {self.ragged} ragged rows, first file line {line} with {fields} "
                f"fields instead of {self.width}"
            )
        return tuple(said)

    def _refusal(self, row: int, line: int, fields: int) -> PlantuneError:
        return refusal(
            "D05",
            f"file line {line} has {fields} fields, the first line has {self.width}",
            where=("", row, None),
            count=self.ragged,
            measured=float(fields),
            limit=float(self.width),
            remedy='complete or remove the row, or skip such rows: ragged="skip"; '
            "a text with the delimiter in it needs quotes",
        )
