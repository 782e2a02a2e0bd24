"""Leave out stretches in which a signal does not tell what the plant does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.prep.rows import at_rows, with_doubts
from plantune.record import Record

Ends = tuple[float, float]
"""Lowest and highest value that an actuator reaches."""


def exclude(
    rec: Record,
    *,
    u_limits: Ends | Sequence[Ends] | Literal["auto"] | None = None,
    stuck: bool = True,
    limits: Limits | None = None,
) -> Record:
    """Leave out stuck outputs, and rows at which an input lies at a limit of the actuator.

    Parameters
    ----------
    rec : Record
        Any number of inputs and outputs.
    u_limits : (low, high), one pair per input, or "auto"
        Ends of the actuator's travel, where a command is not what the plant gets.  "auto" takes an
        end of the input's travel for a limit where the input dwells on it, as `analyze.health`
        does.  By default no row is taken as saturated.
    stuck : bool
        Whether stretches are cut on which an output stands still while an input moves.
    limits : Limits, optional
        Thresholds D18, M03 and M03_most.

    Returns
    -------
    Record
        The rows that are left, each run of them a segment, so that nothing reaches over a hole.
        Counts stand in the log, and in a note where more than 5 % of the rows are saturated (M03)
        or some are stuck (D18).

    Raises
    ------
    DataError
        More than half of the rows are stuck (D18), or none are left (D04).
    NotIdentifiable
        More than half of the rows are saturated (M03).
    UsageError
        `u_limits` is no ascending pair, or not one per input (U01).

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> u = np.clip(60 * np.sin(np.arange(100) / 8), -50, 50)
    >>> rec = exclude(pt.Record(u=u, y=u + 1, Ts=1.0), u_limits=(-50, 50))
    >>> rec.log[-1]
    'excluded 37 of 100 rows: u at a limit'
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    found = _core.exclude(rec, _ends(rec, u_limits), u_limits == "auto", stuck, limits)
    if not found["log"]:
        return rec
    return at_rows(
        rec,
        found["kept"],
        log=(*rec.log, *found["log"]),
        notes=with_doubts(rec, found["notes"], limits),
    )


def _ends(rec: Record, u_limits: object) -> list[Ends] | None:
    """Return one pair per input; none where they are not known."""
    if u_limits is None or u_limits == "auto":
        return None
    try:
        pairs = list(u_limits)  # type: ignore[call-overload]
        if not any(hasattr(pair, "__len__") for pair in pairs):
            pairs = [pairs] * rec.nu
        return [(float(low), float(high)) for low, high in pairs]
    except (TypeError, ValueError):
        raise refusal(
            "U01",
            f"`u_limits` is {u_limits!r}, must be (low, high), one such pair per input, or 'auto'",
            remedy="u_limits=(0, 100)",
        ) from None
