"""Leave out single samples that are far off."""

from __future__ import annotations

from dataclasses import replace

from plantune import _core
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.prep.rows import with_doubts
from plantune.record import Record


def despike(rec: Record, limits: Limits | None = None) -> Record:
    """Mark the spikes of the outputs as values that do not count.

    Nothing is filled in: estimators leave these values out, also where they would appear as past
    outputs.

    Parameters
    ----------
    rec : Record
        Values that do not count already are not looked at.
    limits : Limits, optional
        Threshold D19; `analyze.health` says what a spike is.

    Returns
    -------
    Record
        Same rows and `source`; counts stand in the log, rows in a note D19.

    Raises
    ------
    DataError
        More values than the share D07 do not count then.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> y = rec.y[:, 0].copy()
    >>> y[700] = 20.0
    >>> clean = despike(pt.Record(u=rec.u, y=y, Ts=rec.Ts))
    >>> clean.log, clean.valid[[699, 700], 0].tolist()
    (('marked 1 of 1000 values as spikes: y 1',), [True, False])
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    rows, outputs, notes = _core.spikes(rec, limits)
    if not rows:
        return rec
    valid = rec.valid.copy()
    valid[rows, outputs] = False
    counts = ((name, outputs.count(i)) for i, name in enumerate(rec.y_names))
    each = ", ".join(f"{name} {n}" for name, n in counts if n)
    return replace(
        rec,
        valid=valid,
        log=(*rec.log, f"marked {len(rows)} of {rec.y.size} values as spikes: {each}"),
        notes=with_doubts(rec, notes, limits),
    )
