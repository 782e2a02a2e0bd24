"""What a reader hands over: the columns it has, then the ones asked for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from plantune.errors import refusal
from plantune.record import Floats

Name = str | int
"""How a caller names a column: by its name, or by its number from 0."""

Lines = NDArray[np.int64]
"""Line in the file of each row."""

MOST_COLUMNS: Final = 10_000
MOST_LINES: Final = 5_000_000
LONGEST_NAME: Final = 200

_UNIT = re.compile(r"^(.*\S)\s*\[([^\[\]]*)\]$")


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its header cell, and that cell as name and unit."""

    title: str
    name: str
    unit: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns asked for: numbers with NaN where missing, stamps as numbers or as text."""

    numbers: Floats  # (N, columns asked for)
    stamps: Floats | NDArray[np.bytes_] | None
    lines: Lines
    log: tuple[str, ...]


class Sheet(Protocol):
    """A file whose header has been read."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """All columns, in the order of the file."""

    def read(self, numbers: Sequence[int], stamps: int | None) -> Table:
        """Return these columns as numbers, and one as time stamps."""


def column(cell: str, number: int) -> Column:
    """Return the column that a header cell names; its number where the cell is empty.

    The text stays inert: white space is one space, and what does not print is shown as a mark.
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
    match = _UNIT.match(title)
    return Column(title, match[1], match[2].strip()) if match else Column(title, title)


def short(text: str, longest: int = 30) -> str:
    """Return text in quotes on one line, cut where it is long."""
    return repr(text if len(text) <= longest else text[: longest - 1] + "…")
