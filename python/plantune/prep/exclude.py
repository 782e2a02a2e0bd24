"""Leave out stretches in which a signal does not tell what the plant does."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from plantune.analyze import health
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
        Stuck values do not count (D18); saturated rows end a segment (M03).  Counts stand in the
        log, and in a note where more than 5 % of the rows are saturated.

    Raises
    ------
    DataError
        More values than the share D07 do not count then.
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
    'excluded 36 of 100 rows: u 1 at a limit'
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    return _saturated(_stuck(rec, limits), u_limits)


def _stuck(rec: Record, limits: Limits) -> Record:
    """Mark the stuck stretches of every output as values that do not count."""
    valid, said = rec.valid.copy(), []
    for name, first, last in ((s.signal, s.first, s.last) for s in health(rec, limits).stuck):
        rows = (rec.rows >= first) & (rec.rows <= last)
        valid[rows, rec.y_names.index(name)] = False
        said.append(f"{name} {int(rows.sum())}")
    if not said:
        return rec
    log = f"marked stuck values: {', '.join(said)}"
    return replace(rec, valid=valid, log=(*rec.log, log))


def _saturated(rec: Record, u_limits: tuple[float, float] | None) -> Record:
    """Cut the rows at which an input lies at or beyond a limit."""
    if u_limits is None:
        return rec
    low, high = u_limits
    if not low < high:
        raise refusal("U01", f"`u_limits` is {u_limits!r}, must ascend", remedy="u_limits=(0, 100)")
    at_limit = (rec.u <= low) | (rec.u >= high)
    lost = at_limit.any(axis=1)
    count = int(lost.sum())
    if count == 0:
        return rec
    share = count / rec.N
    names = [name for name, own in zip(rec.u_names, at_limit.T, strict=True) if own.any()]
    first = int(np.flatnonzero(lost)[0])
    evidence = {
        "where": (names[0], int(rec.rows[first]), float(rec.time[first])),
        "count": count,
        "measured": share,
    }
    text = f"{', '.join(names)} at a limit in {count} of {rec.N} rows"
    if share > _TOO_MANY:
        raise refusal(
            "M03",
            text,
            **evidence,
            limit=_TOO_MANY,
            remedy="record with smaller moves of the input",
        )
    note = Note(
        code="M03",
        severity="warning",
        text=f"{text}: they are left out",
        **{**evidence, "where": Where(*evidence["where"])},  # type: ignore[misc]
        limit=_MANY,
        remedy="record with smaller moves, or log the actuator's position",
    )
    return at_rows(
        rec,
        list(_kept(rec, lost)),
        log=(*rec.log, f"excluded {count} of {rec.N} rows: {', '.join(names)} at a limit"),
        notes=(*rec.notes, note) if share > _MANY else rec.notes,
    )


def _kept(rec: Record, lost: NDArray[np.bool_]) -> Iterable[tuple[int, int]]:
    """Yield the runs of rows that are left, each within its segment."""
    for part in rec.segments:
        kept = np.flatnonzero(~lost[part]) + part.start
        for run in np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1):
            if len(run):
                yield int(run[0]), int(run[-1]) + 1
