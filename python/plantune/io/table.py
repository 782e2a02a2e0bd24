"""What a reader hands over: the columns it has, then the ones asked for."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from plantune.errors import refusal
from plantune.record import Floats

Name = str | int
"""How a caller names a column: by its name, or by its number from 0."""

Cells = Floats | NDArray[np.bytes_] | NDArray[np.datetime64]
"""A column as it stands: numbers with NaN where missing, UTF-8, or times with NaT."""

MOST_COLUMNS: Final = 10_000
MOST_LINES: Final = 5_000_000
LONGEST_NAME: Final = 200
LONGEST_CELL: Final = 40
"""Bytes kept of a cell that stays text: a time stamp, a word of quality."""

_UNIT = re.compile(r"^(.*\S)\s*\[([^\[\]]*)\]$")


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its header cell, and that cell as name and unit."""

    title: str
    name: str
    unit: str = ""
    length: int | None = None  # where columns of one file may differ


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Where each row stands: its number below the header and, in a text, its line."""

    rows: NDArray[np.int64]
    lines: NDArray[np.int64] | None = None

    def __len__(self) -> int:
        return len(self.rows)

    def said(self, k: int) -> str:
        """Return the place of row `k` in words."""
        return f"row {self.rows[k]}" if self.lines is None else f"file line {self.lines[k]}"

    def row(self, k: int) -> int:
        """Return the number of row `k` in the file."""
        return int(self.rows[k])

    def take(self, keep: NDArray[np.bool_] | NDArray[np.int64]) -> Places:
        """Return the places of some rows."""
        return Places(self.rows[keep], None if self.lines is None else self.lines[keep])


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns asked for: as numbers with NaN where missing; stamps and words as they stand."""

    numbers: Floats  # (N, columns asked for)
    cells: Mapping[int, Cells]  # by number of the column
    places: Places
    log: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Wanted:
    """Columns by number: to read as numbers, as stamps (numbers, times or text), as they stand."""

    numbers: Sequence[int] = ()
    stamps: Sequence[int] = ()
    words: Sequence[int] = ()
    skip_ragged: bool = False

    @property
    def cells(self) -> tuple[int, ...]:
        """Columns that may stay text."""
        return (*self.stamps, *self.words)

    @property
    def every(self) -> tuple[int, ...]:
        """All columns, each once."""
        return tuple(dict.fromkeys((*self.numbers, *self.cells)))


class Sheet(Protocol):
    """A file whose header has been read."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns, in the order of the file."""

    def read(self, wanted: Wanted) -> Table:
        """Return the columns wanted."""


def beside(columns: Sequence[Floats], N: int) -> Floats:
    """Return columns of `N` rows side by side, as `Table.numbers`; there may be none."""
    return np.stack(columns, axis=1) if columns else np.empty((N, 0))


def column(cell: str, number: int) -> Column:
    """Return the column that a header cell names, by its number where the cell is empty."""
    title = inert(cell, number)
    match = _UNIT.match(title)
    return Column(title, match[1], match[2].strip()) if match else Column(title, title)


def inert(cell: str, number: int) -> str:
    """Return a name as text that does nothing, its number where it is empty.

    White space is one space, and what does not print is shown as a mark.
    """
    title = " ".join(cell.split()) or str(number)
    title = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in title)
    if len(title) > LONGEST_NAME:
        raise refusal(
            "D01",
            f"the name of column {number} has {len(title)} characters",
            where=(f"column {number}", None, None),
            count=len(title),
            measured=float(len(title)),
            limit=float(LONGEST_NAME),
            remedy="shorten the header, or look for a missing line break or quote",
        )
    return title


def short(text: str, longest: int = 30) -> str:
    """Return text in quotes on one line, cut where it is long."""
    return repr(text if len(text) <= longest else text[: longest - 1] + "…")
