"""Smooth over three rows: (x(t-1) + 2 x(t) + x(t+1)) / 4."""

from __future__ import annotations

from typing import Final, Literal

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Note, Where
from plantune.prep.rows import at_rows
from plantune.record import Record

_Y_ALONE: Final = (
    "y is smoothed and u is not: the true model then has u(t) and a wider numerator, and least "
    "squares is biased even without noise"
)


def smooth(rec: Record, signals: Literal["both", "y"] = "both") -> Record:
    """Smooth over three rows: (x(t-1) + 2 x(t) + x(t+1)) / 4.

    Gain `cos^2(w Ts / 2)`, no delay.  The first and the last row of each segment have no such
    value and are left out; an output counts where it does at all three rows.  `aux` stays as it
    is.

    Parameters
    ----------
    rec : Record
        Segments of fewer than three rows are left out.
    signals : "both" or "y"
        Inputs, outputs and reference; or the outputs alone, as source 000 does it.

    Returns
    -------
    Record
        Fewer rows, same `source`; a note F01 where the outputs alone are smoothed.

    Raises
    ------
    DataError
        No segment has three rows (D04).
    UsageError
        `signals` is neither (U01).

    Notes
    -----
    Source 000, (2.3-2).  White noise keeps 0.375 of its variance.  Smoothing y alone shifts a1 of
    a second-order motor by -0.06 to -0.13 without any noise; smooth both, or fit an output-error
    or instrumental-variable model to the record as it is.

    Examples
    --------
    >>> from plantune.record import Record
    >>> rec = smooth(Record(u=[0.0, 0.0, 4.0, 4.0], y=[0.0, 4.0, 0.0, 0.0], Ts=1.0))
    >>> rec.u[:, 0].tolist(), rec.y[:, 0].tolist(), rec.rows.tolist()
    ([1.0, 3.0], [2.0, 1.0], [1, 2])
    """
    if signals not in ("both", "y"):
        raise refusal(
            "U01", f"`signals` is {signals!r}, must be 'both' or 'y'", remedy="signals='both'"
        )
    both = signals == "both"
    out, ranges = _core.smooth(rec, rec.r, both, rec.limits or DEFAULT_LIMITS)
    left = sum(stop - start for start, stop in ranges)
    what = "y" if not both else "u and y" if rec.r is None else "u, y and r"
    said = f"smoothed {what} over three rows: {rec.N - left} of {rec.N} rows left out"
    doubt = () if both else (_y_alone(rec, left),)
    log = (*rec.log, said if both else f"{said}; F01: {_Y_ALONE}")
    return at_rows(rec, ranges, **out, log=log, notes=(*rec.notes, *doubt))


def _y_alone(rec: Record, rows: int) -> Note:
    return Note(
        code="F01",
        severity="warning",
        text=_Y_ALONE,
        where=Where(rec.y_names[0], None, None),
        count=rows,
        remedy="smooth both signals, or fit an output-error or instrumental-variable model",
    )
