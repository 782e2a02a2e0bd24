"""Time stamps to seconds: numbers in a unit, times, or text (D07, D16)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.dates import (
    is_clock_only,
    is_date_only,
    missing,
    refuse_outside,
    seconds_of_text,
)
from plantune.io.table import Cells, Places, short
from plantune.record import Floats

_UNIT = re.compile(r"(?:[\[(]\s*|[/_\s])([^\W\d]+)\s*[\])]?$")
_SECONDS: Final = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "µs", "μs", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minute", "minutes"), 60.0),
    **dict.fromkeys(("h", "hour", "hours"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
}
_1990: Final = 631_152_000.0
_END_OF_2100: Final = 4_133_980_800.0
"""Seconds from 1970."""
_SERIALS: Final = (
    ("a spreadsheet's serials", 32_874, 73_415),  # days from 1900: 1990 to 2100
    ("MATLAB's serials", 726_834, 767_376),  # days from year 0
)
_LONGEST_SERIAL_STEP: Final = 1e-3  # days; from there on, seconds are as likely

Said = tuple[str, ...]


def which_count(date: Cells, time: Cells) -> tuple[int, ...]:
    """Return which of two columns called date and time are the stamps: both, or one that is whole.

    Both where they are a date and a clock time in text, as their first cells show.
    """
    if time.dtype.kind != "S" or not is_clock_only(bytes(time[0])):
        return (1,)
    halves = date.dtype.kind == "S" and is_date_only(bytes(date[0]))
    return (0, 1) if halves else (0,)


def seconds(columns: Sequence[Cells], title: str, places: Places) -> tuple[Floats, Said]:
    """Return stamps in seconds, and what to log.

    Numbers keep their zero; times and text count from the earliest.

    Parameters
    ----------
    columns : one array, or two of text
        The stamps, or their dates and their clock times.
    title : str
        Name of the column; a unit at its end counts.
    places : Places
        Where each stamp stands.

    Raises
    ------
    DataError
        A stamp is missing (D07), cannot be read in one way only, has another zone than the first,
        or lies outside 1990 to 2100 (D16).
    """
    if len(columns) == 2:
        if any(column.dtype.kind != "S" for column in columns):
            raise _no_pair(title, places)
        return seconds_of_text([c.astype(np.bytes_, copy=False) for c in columns], title, places)
    stamps = columns[0]
    if stamps.dtype.kind == "S":
        return seconds_of_text([stamps.astype(np.bytes_, copy=False)], title, places)
    absent = np.isnat(stamps) if stamps.dtype.kind == "M" else ~np.isfinite(stamps)
    if absent.any():
        raise missing(title, np.flatnonzero(absent), places)
    if stamps.dtype.kind == "M":
        return _from_times(stamps.astype(stamps.dtype), title, places)
    return _from_numbers(stamps.astype(np.float64), title)


def _from_times(stamps: NDArray[np.datetime64], title: str, places: Places) -> tuple[Floats, Said]:
    years = stamps.astype("M8[Y]").astype(np.int64) + 1970
    refuse_outside(years, title, places, lambda k: str(stamps[k]))
    ns = stamps.astype("M8[ns]").view(np.int64)
    return (ns - ns.min()) / 1e9, (f"time 0 is {stamps.min()}",)


def _from_numbers(stamps: Floats, title: str) -> tuple[Floats, Said]:
    unit, scale = _unit(title)
    t = stamps if scale in (None, 1.0) else stamps * scale
    said: Said = () if scale in (None, 1.0) else (f"time converted from {unit} to seconds",)
    if scale is not None and scale > 1.0:  # minutes to days do not count from 1970
        return t, said
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
    if t[0] >= _1990:
        first = np.datetime64(int(t[0]), "s")
        return t, (*said, f"time counts from 1970: the first stamp is {first}Z")
    if scale is None:
        _refuse_serials(t, title)
    return t, said


def _refuse_serials(t: Floats, title: str) -> None:
    """D16 where days from 1900 or from year 0 are read as seconds."""
    step = abs(float(t[-1] - t[0])) / max(len(t) - 1, 1)
    for name, low, high in _SERIALS:
        if low <= t[0] <= high and step < _LONGEST_SERIAL_STEP:
            raise refusal(
                "D16",
                f"`{title}` begins at {t[0]:.6f} and grows by {step:.3g} a row: "
                f"the stamps look like days ({name})",
                where=(title, 0, float(t[0])),
                count=len(t),
                measured=step,
                limit=_LONGEST_SERIAL_STEP,
                remedy=f"name the unit in the header: '{title.split()[0]} [d]', or '… [s]'",
            )


def _unit(title: str) -> tuple[str, float | None]:
    """Return the unit that a title such as `time [ms]` or `t/s` ends in, and its seconds.

    None where the title names none: seconds then.
    """
    match = _UNIT.search(title)
    if match is None:
        return "s", None
    unit = match[1].lower()
    if unit in _SECONDS:
        return unit, _SECONDS[unit]
    if match[0].endswith(("]", ")")):
        raise refusal(
            "D16",
            f"the time column `{title}` is in {short(unit)}, which is no known unit of time",
            where=(title, None, None),
            count=1,
            remedy="use one of " + ", ".join(["s", "ms", "us", "ns", "min", "h", "d"]),
        )
    return "s", None


def _no_pair(title: str, places: Places) -> PlantuneError:
    return refusal(
        "D16",
        f"`{title}`: a date and a clock time in two columns are text, and one of these is not",
        where=(title, places.row(0), None),
        count=len(places),
        remedy="name one column of stamps as time=, or write 2024-01-31 and 23:59:59",
    )
