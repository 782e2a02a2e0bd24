"""Which columns a caller means (U01, D12)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from plantune.errors import PlantuneError, refusal
from plantune.io.table import Column, Name, short

_TIME_NAMES: Final = ("time", "timestamp", "datetime", "t", "date")
_FIRST_WORD = re.compile(r"[^\W_]+")

Names = Name | Sequence[Name] | None


@dataclass(frozen=True, slots=True)
class Chosen:
    """Column numbers by role; `time_is_named` when the caller named it."""

    u: tuple[int, ...]
    y: tuple[int, ...]
    r: tuple[int, ...]
    aux: tuple[int, ...]
    time: int | None
    time_is_named: bool

    @property
    def outputs(self) -> range:
        """Places of the outputs in `numbers`."""
        return range(len(self.u), len(self.u) + len(self.y))

    @property
    def numbers(self) -> tuple[int, ...]:
        """Columns to read as numbers: inputs, outputs, reference, aux."""
        return (*self.u, *self.y, *self.r, *self.aux)


def choose(
    columns: tuple[Column, ...], u: Names, y: Names, r: Names, aux: Names, time: Name | None
) -> Chosen:
    """Return the column numbers that the names stand for."""
    absent = " and ".join(f"`{name}`" for name, given in (("u", u), ("y", y)) if given is None)
    if absent:
        raise refusal(
            "U01",
            f"{absent} not given; columns are {_listed(columns)}",
            remedy="name the input and the output, for instance u=0, y=1",
        )
    inputs, outputs = _numbers(columns, u), _numbers(columns, y)
    references, others = _numbers(columns, r), _numbers(columns, aux)
    _refuse_twice(columns, (*inputs, *outputs))
    if time is not None:
        stamps: int | None = _find(columns, time)
    else:
        stamps = _called_time(columns, {*inputs, *outputs, *references, *others})
    return Chosen(inputs, outputs, references, others, stamps, time is not None)


def _numbers(columns: tuple[Column, ...], names: Names) -> tuple[int, ...]:
    if names is None:
        return ()
    several = (names,) if isinstance(names, str | int) else names
    return tuple(_find(columns, name) for name in several)


def _find(columns: tuple[Column, ...], name: Name) -> int:
    if isinstance(name, str):
        places = [i for i, c in enumerate(columns) if name in (c.title, c.name)]
        if len(places) > 1:
            raise _doubled(columns, name, places)
        if places:
            return places[0]
    number = int(name) if not isinstance(name, str) or name.isdecimal() else -1
    if 0 <= number < len(columns):
        return number
    raise refusal(
        "U01",
        f"there is no column {short(str(name))}; columns are {_listed(columns)}",
        remedy="take a name or a number from these",
    )


def _called_time(columns: tuple[Column, ...], taken: set[int]) -> int | None:
    """Return the column whose first word is a usual name of time stamps."""
    words = [_FIRST_WORD.match(c.title.lower()) for c in columns]
    for name in _TIME_NAMES:
        for i, word in enumerate(words):
            if word and word[0] == name and i not in taken:
                return i
    return None


def _refuse_twice(columns: tuple[Column, ...], chosen: tuple[int, ...]) -> None:
    for i in chosen:
        if chosen.count(i) > 1:
            name = columns[i].name
            raise refusal(
                "D12",
                f"column {short(name)} is asked for {chosen.count(i)} times: output equals input",
                where=(name, 0, None),
                count=chosen.count(i),
                measured=float(chosen.count(i)),
                limit=1.0,
                remedy="name each input and output once",
            )


def _doubled(columns: tuple[Column, ...], name: str, places: list[int]) -> PlantuneError:
    titles = {columns[i].title for i in places}
    by_title = " or by its whole header" if len(titles) > 1 else ""
    return refusal(
        "D12",
        f"{len(places)} columns are called {short(name)}: numbers {', '.join(map(str, places))}",
        where=(name, 0, None),
        count=len(places),
        measured=float(len(places)),
        limit=1.0,
        remedy=f"choose one by its number{by_title}",
    )


def _listed(columns: tuple[Column, ...], most: int = 12) -> str:
    shown = ", ".join(f"{i} {short(c.title)}" for i, c in enumerate(columns[:most]))
    return shown + (f" and {len(columns) - most} more" if len(columns) > most else "")
