"""Cells of one column to numbers; NaN where a cell is empty or says so (D06)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from plantune.errors import PlantuneError, refusal
from plantune.io.table import Places, short
from plantune.record import Floats

MISSING: Final = frozenset({"", "nan", "na", "n/a", "null"})
MOST_TOKENS: Final = 100
"""Distinct bad tokens from which on a column counts as text."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?|[+-]?\d+,")


class Numbers:
    """One column on its way from text to numbers, stretch by stretch."""

    def __init__(self, name: str, comma_is_free: bool) -> None:
        self.name = name
        self.comma_is_free = comma_is_free  # the comma is not the delimiter
        self.N = 0
        self.parts: list[Floats] = []
        self.points = False
        self.commas: Counter[str] = Counter()
        self.bad: Counter[str] = Counter()
        self.words: dict[str, str] = {}  # cells seen that are no numbers, each as "nan"
        self.first_comma: int | None = None
        self.first_bad: int | None = None

    def take(self, cells: Sequence[str]) -> None:
        """Convert the next rows."""
        text = "".join(cells)
        self.points |= "." in text
        part = self._at_once(cells, text)
        if part is None:
            part = np.array([self._number(cell, k) for k, cell in enumerate(cells, self.N)])
        self.parts.append(part)
        self.N += len(cells)

    def _at_once(self, cells: Sequence[str], text: str) -> Floats | None:
        """Convert cells that are numbers, or words and decimal commas seen before."""
        if "_" in text:  # Python's own way to write a number, not a file's
            return None
        commas = text.count(",") if self.first_comma is not None and self.comma_is_free else 0
        plain = [self.words.get(cell, cell) for cell in cells] if self.words else cells
        if commas:
            plain = "\n".join(plain).replace(",", ".").split("\n")
        try:
            part = np.fromiter(map(float, plain), np.float64)
        except ValueError:
            return None
        if len(part) != len(cells):  # a line break in a quoted cell
            return None
        if commas:
            self.commas["…"] += commas
        if self.bad:
            again = Counter(cell.strip() for cell in cells if cell in self.words)
            self.bad.update({token: n for token, n in again.items() if token in self.bad})
        return part

    @property
    def is_text(self) -> bool:
        """Whether so many tokens are no numbers that reading on is idle."""
        return len(self.bad) >= MOST_TOKENS

    def column(self, places: Places) -> Floats:
        """Return the numbers; refuse tokens that are none (D06), `places` says where they stand."""
        if self.first_comma is not None and (self.points or not self.comma_is_free):
            self.bad += self.commas
            self.first_bad = min(
                self.first_comma, self.N if self.first_bad is None else self.first_bad
            )
        if self.first_bad is not None:
            raise self._refusal(places)
        return np.concatenate(self.parts)

    def _number(self, raw: str, row: int) -> float:
        cell = raw.strip()
        if cell in self.bad:
            self.bad[cell] += 1
            return np.nan
        if cell.lower() in MISSING:
            self._remember(raw)
            return np.nan
        if _DECIMAL_COMMA.fullmatch(cell):
            self.first_comma = row if self.first_comma is None else self.first_comma
            _count(self.commas, cell)
            return float(cell.replace(",", "."))
        number = as_number(cell)
        if number is None:
            self.first_bad = row if self.first_bad is None else self.first_bad
            _count(self.bad, cell)
            self._remember(raw)
            return np.nan
        return number

    def _remember(self, cell: str) -> None:
        if len(self.words) < MOST_TOKENS:
            self.words[cell] = "nan"

    def _refusal(self, places: Places) -> PlantuneError:
        row = self.first_bad or 0
        total = self.bad.total()
        shown = ", ".join(f"{short(token)} {n}x" for token, n in self.bad.most_common(5))
        more = f" and {len(self.bad) - 5} others" if len(self.bad) > 5 else ""
        at_least = "at least " if self.is_text else ""
        only_commas = self.bad == self.commas
        return refusal(
            "D06",
            f"`{self.name}` holds {at_least}{total} cells that are no numbers, "
            f"first in {places.said(row)}: {shown}{more}",
            where=(self.name, places.row(row), None),
            count=total,
            measured=float(total),
            limit=0.0,
            remedy=(
                "these look like decimal commas: save with points, "
                "or with ; between the columns and commas throughout"
                if only_commas
                else "empty these cells, then choose missing=, or pick another column"
            ),
        )


def writes_number(cell: str) -> bool:
    """Whether a cell is a number, with point or comma."""
    return as_number(cell) is not None or _DECIMAL_COMMA.fullmatch(cell.strip()) is not None


def as_number(cell: str) -> float | None:
    """Return the number that a cell writes, or None."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None


def _count(tokens: Counter[str], token: str) -> None:
    tokens[token if token in tokens or len(tokens) <= MOST_TOKENS else "…"] += 1
