"""Leave out stretches in which a signal does not tell what the plant does."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits, Note, Where
from plantune.prep.rows import at_rows
from plantune.record import Record

_MANY = 0.05
_TOO_MANY = 0.5


def exclude(
    rec: Record,
    *,
    u_limits: tuple[float, float] | None = None,
    limits: Limits | None = None,
) -> Record:
    """Leave out stuck outputs, and rows at which an input lies at a limit of the actuator.

    Parameters
    ----------
    rec : Record
        Any number of inputs and outputs.
    u_limits : (low, high), optional
        Ends of the actuator's travel, where a command is not what the plant gets.  Without them
        no row is taken as saturated: an input of two levels looks the same.
    limits : Limits, optional
        Threshold D18.

    Returns
    -------
    Record
        The rows that are left, each run of them a segment, so that nothing reaches over a hole.
        Counts stand in the log, and in a note where more than 5 % of the rows are saturated (M03)
        or some are stuck (D18).

    Raises
    ------
    DataError
        More than half of the rows are stuck (D18).
    NotIdentifiable
        More than half of the rows are saturated (M03).
    UsageError
        `u_limits` is no ascending pair (U01).

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> u = np.clip(60 * np.sin(np.arange(100) / 8), -50, 50)
    >>> rec = exclude(pt.Record(u=u, y=u + 1, Ts=1.0), u_limits=(-50, 50))
    >>> rec.log[-1]
    'excluded 37 of 100 rows: u at a limit'
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    return _saturated(_stuck(rec, limits), u_limits)


def _stuck(rec: Record, limits: Limits) -> Record:
    """Cut the stuck stretches of every output."""
    stuck = _core.health(rec, limits)["stuck"]
    lost = np.zeros(rec.N, bool)
    for _, first, last in stuck:
        lost |= (rec.rows >= first) & (rec.rows <= last)
    names = dict.fromkeys(name for name, *_ in stuck)
    return _cut(rec, lost, "D18", f"{', '.join(names)} stuck", 0.0)


def _saturated(rec: Record, u_limits: tuple[float, float] | None) -> Record:
    """Cut the rows at which an input lies at or beyond a limit."""
    if u_limits is None:
        return rec
    low, high = u_limits
    if not low < high:
        raise refusal("U01", f"`u_limits` is {u_limits!r}, must ascend", remedy="u_limits=(0, 100)")
    at_limit = (rec.u <= low) | (rec.u >= high)
    names = [name for name, own in zip(rec.u_names, at_limit.T, strict=True) if own.any()]
    return _cut(rec, np.any(at_limit, axis=1), "M03", f"{', '.join(names)} at a limit", _MANY)


def _cut(rec: Record, lost: NDArray[np.bool_], code: str, what: str, least: float) -> Record:
    """Return the runs of rows left; a note beyond the share `least`, a refusal beyond a half."""
    count = int(lost.sum())
    if count == 0:
        return rec
    share, first = count / rec.N, int(np.flatnonzero(lost)[0])
    place = (what.partition(",")[0].partition(" ")[0], int(rec.rows[first]), float(rec.time[first]))
    text = f"{what} in {count} of {rec.N} rows"
    if share > _TOO_MANY:
        raise refusal(
            code,
            text,
            where=place,
            count=count,
            measured=share,
            limit=_TOO_MANY,
            remedy="record again, with smaller moves of the input and sound sensors",
        )
    note = Note(
        code=code,
        severity="warning",
        text=f"{text}: they are left out",
        where=Where(*place),
        count=count,
        measured=share,
        limit=least,
        remedy="record with smaller moves, and log what the actuator and the sensor really do",
    )
    return at_rows(
        rec,
        list(_kept(rec, lost)),
        log=(*rec.log, f"excluded {count} of {rec.N} rows: {what}"),
        notes=(*rec.notes, note) if share > least else rec.notes,
    )


def _kept(rec: Record, lost: NDArray[np.bool_]) -> Iterable[tuple[int, int]]:
    """Yield the runs of rows that are left, each within its segment."""
    for part in rec.segments:
        kept = np.flatnonzero(~lost[part]) + part.start
        for run in np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1):
            if len(run):
                yield int(run[0]), int(run[-1]) + 1
