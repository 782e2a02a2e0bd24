"""Dates and clock times in text to seconds, when the whole column leaves one reading (D16).

Stamps of a logger have few shapes: they differ in their digits.  One match of a pattern per shape
says which digits are the day and which the minute, for all stamps of that shape at once.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.table import Places, short
from plantune.record import Floats

Texts = NDArray[np.bytes_]
Ints = NDArray[np.int32]
Rows = NDArray[np.intp]

_MOST_SHAPES: Final = 100
_AT_ONCE: Final = 100_000  # rows
_MONTHS: Final = tuple(b"jan feb mar apr may jun jul aug sep oct nov dec".split())
_CLOCK = (
    rb"(?P<hour>\d\d?):(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.,](?P<part>\d{1,9}))?)?"
    rb"(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?\s?(?P<zone>Z|UTC|[+-]\d\d(?::?\d\d)?)?"
)
_DATES: Final = {
    "year first": rb"(?P<year>\d{4})(?P<sign>[-/.])(?P<month>\d\d?)(?P=sign)(?P<day>\d\d?)",
    "month by name": rb"(?P<day>\d\d?)[-/. ](?P<name>[A-Za-z]{3})[a-z]*[-/. ](?P<year>\d{4}|\d\d)",
    "day first": rb"(?P<day>\d\d?)\.(?P<month>\d\d?)\.(?P<year>\d{4})",
    "two readings": rb"(?P<day>\d\d?)(?P<sign>[-/])(?P<month>\d\d?)(?P=sign)(?P<year>\d{4})",
}
_STAMPS: Final = {
    name: re.compile(rb"%b(?:(?:T|,? +)%b)?" % (date, _CLOCK)) for name, date in _DATES.items()
}
_FIELDS: Final = ("year", "month", "day", "hour", "minute", "second")


def looks_like_stamp(cell: str) -> bool:
    """Whether a cell is a date, a clock time or both."""
    text = cell.strip().encode()
    return _form(text) is not None or is_clock_only(text)


def is_date_only(text: bytes) -> bool:
    """Whether a cell is a date without a clock time."""
    return any(re.fullmatch(date, text.strip()) for date in _DATES.values())


def is_clock_only(text: bytes) -> bool:
    """Whether a cell is a clock time without a date."""
    return re.fullmatch(_CLOCK, text.strip()) is not None


def seconds_of_text(
    columns: Sequence[Texts], title: str, places: Places
) -> tuple[Floats, tuple[str, ...]]:
    """Return seconds from the earliest stamp, and what to log (D07, D16)."""
    column = _Column(tuple(columns), title, places)
    clock = _read(column)
    said = _settle_date(column, clock)
    refuse_outside(clock.fields["year"], column.title, places, lambda k: short(column.shown(k)))
    said += _settle_half(column, clock)
    ns = _nanoseconds(clock)
    _refuse_lost_half(column, clock, ns)
    if len(clock.zones) > 1:
        raise _mixed_zones(column, clock)
    first = int(ns.argmin())
    zone = "" if clock.zones[0] else ", zone not stated"
    return (ns - ns[first]) / 1e9, (f"time 0 is {column.shown(first)}{zone}", *said)


@dataclass(frozen=True, slots=True, eq=False)
class _Column:
    columns: tuple[Texts, ...]
    title: str
    places: Places

    def texts(self, part: slice) -> Texts:
        """Return the stamps of some rows, their columns joined, without white space around."""
        texts = np.char.strip(self.columns[0][part])
        for more in self.columns[1:]:
            texts = np.char.add(np.char.add(texts, b" "), np.char.strip(more[part]))
        texts = np.char.strip(texts)
        return texts.astype(f"S{max(1, int(np.char.str_len(texts).max()))}")

    def shown(self, k: int) -> str:
        return bytes(self.texts(slice(k, k + 1))[0]).decode("utf-8", "replace")

    def refusal(self, text: str, rows: Rows, remedy: str, **evidence: float) -> PlantuneError:
        """Return D16 for these rows; `{first}` and `{n}` in the text stand for them."""
        k = int(rows[0])
        first = f"{short(self.shown(k))} in {self.places.said(k)}"
        return refusal(
            "D16",
            f"`{self.title}` {text.format(n=len(rows), first=first)}",
            where=(self.title, self.places.row(k), None),
            count=len(rows),
            remedy=remedy,
            **(evidence or {"measured": float(len(rows)), "limit": 0.0}),
        )


@dataclass(slots=True, eq=False)
class _Clock:
    """The fields of every stamp.

    `ns` is the part of the second, `half` 0 where not stated, 1 for AM and 2 for PM, `zone` the
    number in `zones`.
    """

    fields: dict[str, Ints]
    zones: list[str] = field(default_factory=list)
    form: str = ""


def _read(column: _Column) -> _Clock:
    """Return the fields of all stamps; refuse those that are none, or of another form."""
    N = len(column.places)
    clock = _Clock({name: np.zeros(N, np.int32) for name in (*_FIELDS, "ns", "half", "zone")})
    for start in range(0, N, _AT_ONCE):
        part = slice(start, min(N, start + _AT_ONCE))
        texts = column.texts(part)
        empty = np.flatnonzero(texts == b"")
        if len(empty):
            raise missing(column.title, start + empty, column.places)
        unread = _read_part(clock, texts, start)
        if unread.any():
            at_least = "" if part.stop == N else "at least "
            raise column.refusal(
                f"holds {at_least}{{n}} stamps that are no ISO 8601 date and time, nor of one "
                "other form, first {first}",
                start + np.flatnonzero(unread),
                "write stamps as 2024-01-31T23:59:59.5Z, or as seconds",
            )
    return clock


def _read_part(clock: _Clock, texts: Texts, start: int) -> NDArray[np.bool_]:
    """Fill in the fields of some stamps; return which of them are none."""
    letters = np.ascontiguousarray(texts).view(np.uint8).reshape(len(texts), -1)
    unread = np.ones(len(texts), bool)
    for rows in _shapes(letters):
        first = bytes(texts[rows[0]])
        form = _form(first)
        clock.form = clock.form or form or ""
        if form is not None and form == clock.form:
            _take(
                clock, first, letters if len(rows) == len(letters) else letters[rows], start + rows
            )
            unread[rows] = ~_on_calendar(clock, start + rows)
    return unread


def _shapes(letters: NDArray[np.uint8]) -> Iterator[Rows]:
    """Yield the rows of each shape: the same but for the digits; not those of too many shapes."""
    digit = (letters >= ord("0")) & (letters <= ord("9"))
    masked = np.where(digit, np.uint8(ord("0")), letters)
    shape = masked.view(f"S{letters.shape[1]}")[:, 0]
    rest = np.arange(len(shape))
    for _ in range(_MOST_SHAPES):
        same = shape[rest] == shape[rest[0]]
        yield rest[same]
        rest = rest[~same]
        if not len(rest):
            return


def _form(text: bytes) -> str | None:
    return next((name for name, stamp in _STAMPS.items() if stamp.fullmatch(text)), None)


def _take(clock: _Clock, first: bytes, letters: NDArray[np.uint8], rows: Rows) -> None:
    """Fill in the fields of the stamps of one shape, of which one says where each field is."""
    match = _STAMPS[clock.form].fullmatch(first)
    texts: dict[str, bytes] = {} if match is None else match.groupdict()
    spans = {name: match.span(name) for name, text in texts.items() if match and text}

    def number(name: str) -> Ints:
        value = np.zeros(len(rows), np.int32)
        for place in range(*spans[name]):
            value = 10 * value + (letters[:, place] - ord("0"))
        return value

    for name in _FIELDS:
        if name in spans:
            clock.fields[name][rows] = number(name)
    if "part" in spans:
        clock.fields["ns"][rows] = number("part") * 10 ** (9 - len(texts["part"]))
    if "half" in spans:
        clock.fields["half"][rows] = 1 if texts["half"] in b"Aa" else 2
    if "name" in spans:
        month = texts["name"].lower()
        clock.fields["month"][rows] = _MONTHS.index(month) + 1 if month in _MONTHS else 0
        year = clock.fields["year"]
        year[rows] += np.where(year[rows] < 100, 2000, 0).astype(np.int32)
    zone = np.ascontiguousarray(letters[:, slice(*spans["zone"])]) if "zone" in spans else None
    _take_zones(clock, zone, rows)


def _take_zones(clock: _Clock, letters: NDArray[np.uint8] | None, rows: Rows) -> None:
    if letters is None:
        zones, which = np.array([b""]), np.zeros(len(rows), np.int64)
    else:
        texts = letters.view(f"S{letters.shape[1]}")[:, 0]
        zones, which = np.unique(texts, return_inverse=True)
    names = [zone.decode() for zone in zones.tolist()]
    clock.zones.extend([name for name in names if name not in clock.zones])
    clock.fields["zone"][rows] = np.array([clock.zones.index(name) for name in names])[which]


def _on_calendar(clock: _Clock, rows: Rows) -> NDArray[np.bool_]:
    """Whether each of these stamps exists; days and months may yet change places."""
    f = {name: values[rows] for name, values in clock.fields.items()}
    fine = (f["hour"] < 24) & (f["minute"] < 60) & (f["second"] < 60)
    fine &= (clock.fields["half"][rows] == 0) | ((f["hour"] >= 1) & (f["hour"] <= 12))
    if clock.form == "two readings":
        return fine & (np.maximum(f["day"], f["month"]) <= 31)
    return fine & _is_day(f["year"], f["month"], f["day"])


def _is_day(year: Ints, month: Ints, day: Ints) -> NDArray[np.bool_]:
    first = _first_of_month(year, np.clip(month, 1, 12))
    length = ((first + 1).astype("M8[D]") - first.astype("M8[D]")).astype(np.int64)
    exists: NDArray[np.bool_] = (month >= 1) & (month <= 12) & (day >= 1) & (day <= length)
    return exists


def _first_of_month(year: Ints, month: Ints) -> NDArray[np.datetime64]:
    return (12 * (year - 1970) + month - 1).astype("M8[M]")


def _settle_date(column: _Column, clock: _Clock) -> tuple[str, ...]:
    """Find out which of two numbers is the day."""
    if clock.form != "two readings":
        return () if clock.form == "year first" else (f"dates read with the {_LONG[clock.form]}",)
    year, a, b = (clock.fields[name] for name in ("year", "day", "month"))
    day_first, month_first = _is_day(year, b, a), _is_day(year, a, b)
    if day_first.all() and month_first.all():
        raise column.refusal(
            f"has two readings: {{first}} is {year[0]}-{b[0]:02}-{a[0]:02} with the day first "
            f"and {year[0]}-{a[0]:02}-{b[0]:02} with the month first",
            np.arange(len(a)),
            "write dates as 2024-01-31",
            measured=2.0,
            limit=1.0,
        )
    if not (day_first.all() or month_first.all()):
        raise column.refusal(
            "holds {n} dates that fit neither day first nor month first as the others do, "
            "first {first}",
            np.flatnonzero(~(day_first if day_first.sum() >= month_first.sum() else month_first)),
            "write dates as 2024-01-31",
        )
    if month_first.all():
        clock.fields.update(day=b, month=a)
    first = "day" if day_first.all() else "month"
    return (f"dates read with the {first} first: no other reading fits",)


_LONG: Final = {"month by name": "day first, the month by name", "day first": "day first"}


def _settle_half(column: _Column, clock: _Clock) -> tuple[str, ...]:
    """Bring hours with AM and PM to 24."""
    without = np.flatnonzero(clock.fields["half"] == 0)
    if len(without) == len(clock.fields["half"]):
        return ()
    if len(without):
        raise column.refusal(
            "has AM or PM in some stamps, and none in {n}, first {first}",
            without,
            "write all stamps with AM or PM, or none in 24 hours",
        )
    hour = clock.fields["hour"]
    hour[:] = hour % 12 + 12 * (clock.fields["half"] == 2)
    return ("clock of 12 hours read with AM and PM",)


def _refuse_lost_half(column: _Column, clock: _Clock, ns: NDArray[np.int64]) -> None:
    """D16 where a clock of hours 1 to 12 without AM or PM goes from 12 back to 1."""
    hour = clock.fields["hour"]
    if clock.fields["half"].any() or hour.min() < 1 or hour.max() > 12:
        return
    back = np.flatnonzero((np.diff(ns) < 0) & (hour[:-1] == 12) & (hour[1:] == 1)) + 1
    if len(back):
        raise column.refusal(
            "goes from 12 o'clock back to 1 in {n} places, first {first}: "
            "a clock of 12 hours without AM and PM",
            back,
            "write the hours from 0 to 23, or AM and PM behind them",
        )


def _nanoseconds(clock: _Clock) -> NDArray[np.int64]:
    """Return nanoseconds from 1970."""
    f = clock.fields
    days = _first_of_month(f["year"], f["month"]).astype("M8[D]").astype(np.int64) + f["day"] - 1
    seconds = ((24 * days + f["hour"]) * 60 + f["minute"]) * 60 + f["second"]
    return seconds * 1_000_000_000 + f["ns"]


def _mixed_zones(column: _Column, clock: _Clock) -> PlantuneError:
    counts = Counter(clock.fields["zone"].tolist())
    seen = ", ".join(f"{clock.zones[i] or 'none'} {n}x" for i, n in counts.most_common(4))
    return column.refusal(
        f"mixes time zones: {seen}; first change at {{first}}",
        np.flatnonzero(clock.fields["zone"] != clock.fields["zone"][0]),
        "write all stamps in one zone, best UTC",
        measured=float(len(clock.zones)),
        limit=1.0,
    )


def refuse_outside(
    years: NDArray[Any], title: str, places: Places, shown: Callable[[int], str]
) -> None:
    """Refuse stamps outside 1990 to 2100 (D16)."""
    outside = np.flatnonzero((years < 1990) | (years > 2100))
    if not len(outside):
        return
    k = int(outside[0])
    raise refusal(
        "D16",
        f"`{title}` holds {len(outside)} stamps outside 1990 to 2100, "
        f"first {shown(k)} in {places.said(k)}",
        where=(title, places.row(k), None),
        count=len(outside),
        measured=float(years[k]),
        limit=2100.0 if years[k] > 2100 else 1990.0,
        remedy="set the clock of the logger, or give Ts= and leave the stamps out",
    )


def missing(title: str, rows: NDArray[np.intp], places: Places) -> PlantuneError:
    """Return the refusal of rows without a stamp (D07)."""
    k = int(rows[0])
    return refusal(
        "D07",
        f"`{title}` has no time stamp in {len(rows)} of {len(places)} rows, "
        f"first in {places.said(k)}",
        where=(title, places.row(k), None),
        count=len(rows),
        measured=len(rows) / len(places),
        limit=0.0,
        remedy="remove these rows, or give Ts= and leave the stamps out",
    )
