"""A text split into rows of cells: delimiter, quotes, line numbers (D01, D05)."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from itertools import islice
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal

WHITE: Final = " "
_DELIMITERS: Final = ("\t", ";", ",", WHITE)  # where several fit equally, the first
_LONGEST_LINE: Final = 2**21  # bytes; ten thousand columns of numbers take a tenth
_SAMPLE: Final = 50  # lines that show the delimiter

Rows = list[list[str]]
Lines = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Text:
    """A text in UTF-8 and how to split it."""

    data: bytes
    delimiter: str

    def open(self) -> TextIOWrapper:
        """Return the characters as a file."""
        return TextIOWrapper(BytesIO(self.data), "utf-8-sig")

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


def count_lines(data: bytes) -> int:
    """Return the number of lines."""
    ends = max(data.count(b"\n"), data.count(b"\r"))
    return ends + (not data.endswith((b"\n", b"\r")))


def refuse_long_line(data: bytes) -> None:
    """Refuse a line that no table has, before it is split into millions of fields (D01)."""
    end = b"\n" if b"\n" in data else b"\r"
    ends = np.flatnonzero(np.frombuffer(data, np.uint8) == end[0])
    lengths = np.diff(ends, prepend=-1, append=len(data)) - 1
    k = int(lengths.argmax())
    if lengths[k] > _LONGEST_LINE:
        raise refusal(
            "D01",
            f"file line {k + 1} has {lengths[k]} bytes",
            where=(f"line {k + 1}", None, None),
            count=1,
            measured=float(lengths[k]),
            limit=float(_LONGEST_LINE),
            remedy="look for missing line ends",
        )


def is_blank(cells: list[str]) -> bool:
    """Whether a row holds nothing."""
    return not cells or (len(cells) == 1 and not cells[0].strip())


def delimiter_of(data: bytes) -> str:
    """Return the delimiter that splits most of the first lines into equally many fields."""
    text = TextIOWrapper(BytesIO(data), "utf-8-sig")
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
