"""The stretches of a record where the plant is steady, or where it moves."""

from __future__ import annotations

from plantune import _core
from plantune.notes import DEFAULT_LIMITS, Note, Where
from plantune.prep.rows import at_rows
from plantune.record import Record


def steady(rec: Record, T_max: float, L_max: float = 0.0, tolerance: float = 0.02) -> Record:
    """Return the stretches where nothing has moved for 5 T_max + L_max.

    There the output tells noise and disturbances.  A row is steady if every input, and the
    reference where there is one, has stayed within the tolerance since that time before it.

    Parameters
    ----------
    rec : Record
        Segments are searched one by one.
    T_max : float
        Largest time constant of the plant, seconds, > 0.
    L_max : float
        Largest dead time, seconds, >= 0.
    tolerance : float
        Share of each signal's travel in the whole record, 0 to 1; larger where the controller
        passes noise on to the input.

    Returns
    -------
    Record
        Each stretch a segment, with its rows and the same `source`; stretches shorter than
        `5 T_max + L_max` are left out, counted in the log and in a note F03.

    Raises
    ------
    DataError
        No stretch is long enough (D04): says how long the longest is.
    UsageError
        An argument out of its range (U01).

    Notes
    -----
    Source 001, 3.5.1, (3.5-1) and (3.5-2).

    Examples
    --------
    >>> from plantune.record import Record
    >>> u = [0.0] * 20 + [1.0] * 30
    >>> rest = steady(Record(u=u, y=u, Ts=0.1), T_max=0.2)
    >>> rest.rows.tolist()[:3], rest.starts.tolist(), rest.N
    ([10, 11, 12], [0, 10], 30)
    """
    return _stretches(rec, T_max, L_max, tolerance, "steady")


def moving(rec: Record, T_max: float, L_max: float = 0.0, tolerance: float = 0.02) -> Record:
    """Return the record without its steady stretches.

    What is left moves, or still settles: it is what a model can be estimated from.

    Parameters
    ----------
    rec : Record
        Segments are searched one by one.
    T_max : float
        Largest time constant of the plant, seconds, > 0.
    L_max : float
        Largest dead time, seconds, >= 0.
    tolerance : float
        Share of each signal's travel in the whole record, 0 to 1.

    Returns
    -------
    Record
        Each stretch a segment, with its rows and the same `source`; stretches shorter than
        `5 T_max + L_max` are left out, counted in the log and in a note F03.

    Raises
    ------
    DataError
        No stretch is long enough (D04): says how long the longest is.
    UsageError
        An argument out of its range (U01).

    Notes
    -----
    Source 001, 3.5.1, (3.5-1) and (3.5-2): shorter stretches cannot tell the slowest time
    constant.  The first `5 T_max + L_max` of a segment count as moving: nobody knows what was
    before.

    Examples
    --------
    >>> from plantune.record import Record
    >>> u = [0.0] * 20 + [1.0] * 30
    >>> moving(Record(u=u, y=u, Ts=0.1), T_max=0.2).rows.tolist()[9:12]
    [9, 20, 21]
    """
    return _stretches(rec, T_max, L_max, tolerance, "moving")


def _stretches(rec: Record, T_max: float, L_max: float, tolerance: float, kind: str) -> Record:
    limits = rec.limits or DEFAULT_LIMITS
    found = _core.stretches(rec, rec.r, T_max, L_max, tolerance, kind == "steady", limits)
    kept, dropped = found["kept"], found["dropped"]
    rows = sum(stop - start for start, stop in kept)
    said = f"{kind} stretches: {rows} of {rec.N} rows in {len(kept)} stretches"
    notes = rec.notes
    if dropped:
        short = (
            f"{dropped} {kind} stretches of {found['dropped_rows']} rows left out, each shorter "
            f"than 5 T_max + L_max, {found['needed']} rows"
        )
        said = f"{said}; {short}"
        notes = (*notes, _left_out(rec, short, found["dropped_rows"]))
    return at_rows(rec, kept, log=(*rec.log, said), notes=notes)


def _left_out(rec: Record, text: str, rows: int) -> Note:
    return Note(
        code="F03",
        severity="info",
        text=text,
        where=Where(rec.u_names[0], None, None),
        count=rows,
        remedy="give a shorter T_max or L_max if these stretches are needed",
    )
