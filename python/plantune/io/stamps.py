"""Time stamps to seconds: numbers in a unit, or ISO 8601 text (D07, D16)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.table import Lines, short
from plantune.record import Floats

_ISO = re.compile(
    r"(\d{4})-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d{1,9})?)?\s?(Z|[+-]\d\d(?::?\d\d)?)?"
)
_UNIT = re.compile(r"(?:[\[(]\s*|[/_\s])([^\W\d]+)\s*[\])]?$")
_SECONDS: Final = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
}
_END_OF_2100: Final = 4_133_980_800.0
"""Seconds from 1970."""


def looks_like_stamp(cell: str) -> bool:
    """Whether a cell is an ISO 8601 date and time."""
    return _ISO.fullmatch(cell.strip()) is not None


def seconds(
    stamps: Floats | NDArray[np.bytes_], title: str, lines: Lines
) -> tuple[Floats, tuple[str, ...]]:
    """Return stamps in seconds, and what to log.

    Numbers keep their zero; text counts from its first stamp.

    Raises
    ------
    DataError
        A stamp is missing (D07), is no ISO 8601, has another zone than the first, or lies outside
        1990 to 2100 (D16).
    """
    if stamps.dtype.kind == "S":
        texts = np.char.strip(stamps.astype(np.bytes_)).astype(np.bytes_)
        return _of_one_shape(texts, title, lines) or _from_texts(texts, title, lines)
    t = stamps.astype(np.float64)
    missing = np.flatnonzero(~np.isfinite(t))
    if len(missing):
        raise _missing(title, len(missing), int(missing[0]), lines)
    return _from_numbers(t, title)


def _from_numbers(stamps: Floats, title: str) -> tuple[Floats, tuple[str, ...]]:
    unit, scale = _unit(title)
    t = stamps if scale == 1.0 else stamps * scale
    if t[0] >= _END_OF_2100:
        raise refusal(
            "D16",
            f"`{title}` begins at {t[0]:.6g} s, which as seconds from 1970 is after 2100",
            where=(title, 0, None),
            count=len(t),
            measured=float(t[0]),
            limit=_END_OF_2100,
            remedy=f"name the unit in the header, for instance '{title.split()[0]} [ms]'",
        )
    return t, () if scale == 1.0 else (f"time converted from {unit} to seconds",)


def _unit(title: str) -> tuple[str, float]:
    """Return the unit that a title such as `time [ms]` or `t/s` ends in, and its seconds."""
    match = _UNIT.search(title)
    unit = match[1].lower() if match else "s"
    if unit in _SECONDS:
        return unit, _SECONDS[unit]
    if match and match[0].endswith(("]", ")")):
        raise refusal(
            "D16",
            f"the time column `{title}` is in {short(unit)}, which is no known unit of time",
            where=(title, None, None),
            count=1,
            remedy="use one of " + ", ".join(["s", "ms", "us", "ns", "min", "h", "d"]),
        )
    return "s", 1.0


def _of_one_shape(
    texts: NDArray[np.bytes_], title: str, lines: Lines
) -> tuple[Floats, tuple[str, ...]] | None:
    """Read stamps that differ from the first in digits only; None where others are among them."""
    first = _ISO.fullmatch(texts[0].decode("latin-1"))
    if first is None:
        return None
    letters = np.ascontiguousarray(texts).view(np.uint8).reshape(len(texts), -1)
    digit = (letters >= ord("0")) & (letters <= ord("9"))
    zone = slice(first.start(2), first.end(2)) if first[2] else slice(0)
    same = (letters == letters[0]) | (digit & digit[0])
    if not same.all() or (letters[:, zone] != letters[0, zone]).any():
        return None
    clock = texts.astype(f"S{first.start(2)}") if first[2] else texts
    return _from_clock(np.char.strip(clock), texts, first[2], title, lines)


def _from_texts(
    texts: NDArray[np.bytes_], title: str, lines: Lines
) -> tuple[Floats, tuple[str, ...]]:
    cells = [text.decode("latin-1") for text in texts.tolist()]
    matches = [_ISO.fullmatch(cell) for cell in cells]
    if None in matches:
        raise _not_iso(texts, [match is None for match in matches], title, lines)
    zones = [match[2] for match in matches if match is not None]
    if any(zone != zones[0] for zone in zones):
        raise _mixed_zones(zones, title, lines)
    clock = [cell[: len(cell) - len(zones[0] or "")].strip() for cell in cells]
    return _from_clock(np.array(clock, np.bytes_), texts, zones[0], title, lines)


def _from_clock(
    clock: NDArray[np.bytes_],
    texts: NDArray[np.bytes_],
    zone: str | None,
    title: str,
    lines: Lines,
) -> tuple[Floats, tuple[str, ...]]:
    """Return seconds since the first of dates and times of one zone."""
    outside = (clock < b"1990") | (clock >= b"2101")
    if outside.any():
        raise _outside(texts, np.flatnonzero(outside), title, lines)
    points = np.char.replace(clock, b",", b".")
    try:
        ns = points.astype("datetime64[ns]").view(np.int64)
    except ValueError:
        raise _not_iso(texts, [not _on_calendar(t) for t in points], title, lines) from None
    said = f"time 0 is {texts[0].decode('latin-1')}" + ("" if zone else ", zone not stated")
    return (ns - ns[0]) / 1e9, (said,)


def _on_calendar(text: bytes) -> bool:
    try:
        np.datetime64(text.decode("latin-1"), "ns")
    except ValueError:
        return False
    return True


def _not_iso(
    texts: NDArray[np.bytes_], bad: Sequence[bool], title: str, lines: Lines
) -> PlantuneError:
    empty = np.flatnonzero(texts == b"")
    if len(empty):
        return _missing(title, len(empty), int(empty[0]), lines)
    row, count = bad.index(True), sum(bad)
    return refusal(
        "D16",
        f"`{title}` holds {count} stamps that are no ISO 8601 date and time, "
        f"first {_shown(texts[row])} in file line {lines[row]}",
        where=(title, row, None),
        count=count,
        measured=float(count),
        limit=0.0,
        remedy="write stamps as 2024-01-31T23:59:59.5Z, or as seconds",
    )


def _mixed_zones(zones: Sequence[str | None], title: str, lines: Lines) -> PlantuneError:
    row = next(k for k, zone in enumerate(zones) if zone != zones[0])
    seen = ", ".join(f"{zone or 'none'} {n}x" for zone, n in Counter(zones).most_common(4))
    return refusal(
        "D16",
        f"`{title}` mixes time zones: {seen}; first change in file line {lines[row]}",
        where=(title, row, None),
        count=sum(zone != zones[0] for zone in zones),
        measured=float(len(set(zones))),
        limit=1.0,
        remedy="write all stamps in one zone, best UTC",
    )


def _outside(
    texts: NDArray[np.bytes_], rows: NDArray[np.intp], title: str, lines: Lines
) -> PlantuneError:
    row = int(rows[0])
    return refusal(
        "D16",
        f"`{title}` holds {len(rows)} stamps outside 1990 to 2100, "
        f"first {_shown(texts[row])} in file line {lines[row]}",
        where=(title, row, None),
        count=len(rows),
        measured=float(texts[row][:4]),
        limit=2100.0 if texts[row] > b"2100" else 1990.0,
        remedy="set the clock of the logger, or give Ts= and leave the stamps out",
    )


def _shown(text: bytes) -> str:
    return short(text.decode("latin-1"))


def _missing(title: str, count: int, row: int, lines: Lines) -> PlantuneError:
    return refusal(
        "D07",
        f"`{title}` has no time stamp in {count} of {len(lines)} rows, "
        f"first in file line {lines[row]}",
        where=(title, row, None),
        count=count,
        measured=count / len(lines),
        limit=0.0,
        remedy="remove these rows, or give Ts= and leave the stamps out",
    )
