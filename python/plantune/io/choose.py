"""Which columns a caller means (U01, D12)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from plantune.errors import PlantuneError, refusal
from plantune.io.draft import Choice, Names
from plantune.io.table import Column, Name, short

_TIME_NAMES: Final = ("time", "timestamp", "datetime", "t", "date")
_CHINESE: Final = {"时间": "time", "時間": "time", "日期": "date"}
_FIRST_WORD = re.compile(r"[^\W_]+")


@dataclass(frozen=True, slots=True)
class Chosen:
    """Column numbers by role; `time_is_named` when the caller named it.

    Two columns of time are a date and a clock time.
    """

    u: tuple[int, ...]
    y: tuple[int, ...]
    r: tuple[int, ...]
    aux: tuple[int, ...]
    time: tuple[int, ...]
    time_is_named: bool
    quality: Mapping[int, int]  # place in `numbers` to column

    @property
    def outputs(self) -> range:
        """Places of the outputs in `numbers`."""
        return range(len(self.u), len(self.u) + len(self.y))

    @property
    def numbers(self) -> tuple[int, ...]:
        """Columns to read as numbers: inputs, outputs, reference, aux."""
        return (*self.u, *self.y, *self.r, *self.aux)


def choose(columns: tuple[Column, ...], choice: Choice) -> Chosen:
    """Return the column numbers that the names stand for."""
    given = (("u", choice.u), ("y", choice.y))
    absent = " and ".join(f"`{name}`" for name, names in given if names is None)
    if absent:
        raise refusal(
            "U01",
            f"{absent} not given; columns are {_listed(columns)}",
            remedy="name the input and the output, for instance u=0, y=1",
        )
    u, y, r, aux = (
        _numbers(columns, names) for names in (choice.u, choice.y, choice.r, choice.aux)
    )
    _refuse_twice(columns, (*u, *y))
    _refuse_lengths(columns, (*u, *y, *r, *aux))
    time = choose_time(columns, choice.time, (*u, *y, *r, *aux))
    named = choice.time is not None
    quality = _quality(columns, (*u, *y, *r, *aux), choice)
    _refuse_lengths(columns, (*u, *(time if named else ()), *quality.values()))
    return Chosen(u, y, r, aux, time, named, quality)


def choose_time(
    columns: tuple[Column, ...], names: Names, taken: tuple[int, ...] = ()
) -> tuple[int, ...]:
    """Return the columns of time stamps: those named, or those called so and not taken."""
    time = _numbers(columns, names) or _called_time(columns, taken)
    _refuse_many_times(columns, time)
    return time


def _numbers(columns: tuple[Column, ...], names: Names) -> tuple[int, ...]:
    if names is None:
        return ()
    several = (names,) if isinstance(names, str | int) else tuple(names)
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


def _called_time(columns: tuple[Column, ...], taken: tuple[int, ...]) -> tuple[int, ...]:
    """Return the column whose first word is a usual name of time stamps.

    Where one is called date and another time, both: which of them counts is for their cells to say.
    """
    words = [_FIRST_WORD.match(c.title.lower()) for c in columns]
    lengths = {columns[i].length for i in taken[:1]} or {c.length for c in columns}
    found: dict[str, int] = {}
    for i, word in enumerate(words):
        if word and i not in taken and columns[i].length in lengths:
            found.setdefault(_CHINESE.get(word[0], word[0]), i)
    if {"date", "time"} <= found.keys():
        return found["date"], found["time"]
    return tuple(found[name] for name in _TIME_NAMES if name in found)[:1]


def _quality(
    columns: tuple[Column, ...], numbers: tuple[int, ...], choice: Choice
) -> Mapping[int, int]:
    """Return the quality column of each column that has one."""
    if choice.quality is None:
        return {}
    if not isinstance(choice.quality, Mapping):
        column = _find(columns, choice.quality)
        return dict.fromkeys(range(len(numbers)), column)
    chosen = {}
    for name, quality in choice.quality.items():
        i = _find(columns, name)
        if i not in numbers:
            raise refusal(
                "U01",
                f"`quality` names {short(columns[i].name)}, which is not among the columns read",
                remedy="name columns given as u=, y=, r= or aux=",
            )
        chosen.update({k: _find(columns, quality) for k, n in enumerate(numbers) if n == i})
    return chosen


def _refuse_many_times(columns: tuple[Column, ...], time: tuple[int, ...]) -> None:
    if len(time) > 2 or len(set(time)) < len(time):
        names = ", ".join(short(columns[i].name) for i in time)
        raise refusal(
            "U01",
            f"`time` names {names}: one column of stamps, or a date and a clock time",
            remedy="give time='name', or time=('Date', 'Time')",
        )


def _refuse_lengths(columns: tuple[Column, ...], chosen: tuple[int, ...]) -> None:
    """D09 where columns of one file differ in length."""
    for i in chosen:
        own, first = columns[i].length, columns[chosen[0]].length
        if own is not None and first is not None and own != first:
            raise refusal(
                "D09",
                f"{short(columns[chosen[0]].name)} has {first} rows and "
                f"{short(columns[i].name)} has {own}",
                where=(columns[i].name, min(own, first), None),
                count=abs(own - first),
                measured=float(own),
                limit=float(first),
                remedy="name columns of one length",
            )


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
    def of(c: Column) -> str:
        return short(c.title) + ("" if c.length is None else f" ({c.length} rows)")

    shown = ", ".join(f"{i} {of(c)}" for i, c in enumerate(columns[:most]))
    return shown + (f" and {len(columns) - most} more" if len(columns) > most else "")
