"""What preparations share: the rows of some ranges, and the notes that grow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from plantune.notes import Limits, Note, notes_from_core
from plantune.record import Record


def at_rows(rec: Record, ranges: Sequence[tuple[int, int]], **fields: Any) -> Record:
    """Return the rows of these ranges, each a segment of its own, with further fields replaced."""
    kept = np.concatenate([np.arange(start, stop) for start, stop in ranges])
    # Rows that ascend tell the time of each row; others do not.
    told = rec.t is None and bool((np.diff(rec.rows) > 0).all())
    signals = {
        "u": rec.u[kept],
        "y": rec.y[kept],
        "r": None if rec.r is None else rec.r[kept],
        "valid": rec.valid[kept],
    }
    return replace(
        rec,
        **{**signals, **fields},
        aux={name: x[kept] for name, x in rec.aux.items()},
        t0=float(rec.time[kept[0]]),
        t=None if told else rec.time[kept],
        starts=np.cumsum([0, *(stop - start for start, stop in ranges[:-1])]),
        rows=rec.rows[kept],
    )


def with_doubts(
    rec: Record, doubts: Iterable[Mapping[str, Any]], limits: Limits
) -> tuple[Note, ...]:
    """Return the notes of the record, then those of the core and of changed limits, each once."""
    return tuple(dict.fromkeys((*rec.notes, *notes_from_core(doubts), *limits.changes())))
