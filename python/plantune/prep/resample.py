"""Bring a record to another sample time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.record import Floats, Record


def resample(rec: Record, Ts: float) -> Record:
    """Bring each segment to a uniform step: inputs and reference held, outputs interpolated.

    An output between two rows counts where both count.  No filter is applied, so a step longer
    than 1.5 times the record's own is refused: fast parts would come back as slow ones.

    Parameters
    ----------
    rec : Record
        Segments of one row are left out.
    Ts : float
        New sample time, seconds.

    Returns
    -------
    Record
        `t` is given; `rows` hold the original row at or before each new one; same `source`.

    Raises
    ------
    DataError
        No segment has two rows (D04).
    NotIdentifiable
        `Ts` is more than 1.5 times the record's own step (M10).
    UsageError
        `Ts` is not positive, or far too short for the record (U01).

    Examples
    --------
    >>> from plantune.record import Record
    >>> rec = resample(Record(u=[0.0, 1.0, 1.0], y=[0.0, 2.0, 4.0], Ts=1.0), 0.5)
    >>> rec.u[:, 0].tolist(), rec.y[:, 0].tolist()
    ([0.0, 0.0, 1.0, 1.0, 1.0], [0.0, 1.0, 2.0, 3.0, 4.0])
    >>> rec.rows.tolist(), rec.time.tolist()
    ([0, 0, 1, 1, 2], [0.0, 0.5, 1.0, 1.5, 2.0])
    """
    segments = [part for part in rec.segments if part.stop - part.start > 1]
    if not segments:
        raise refusal(
            "D04",
            f"none of {len(rec.segments)} segments has two rows",
            count=len(rec.segments),
            measured=1.0,
            limit=2.0,
            remedy="give a record with a contiguous part",
        )
    columns, held = _columns(rec)
    parts = [_on_grid(rec.time[part], columns[part], held, Ts) for part in segments]
    x, t = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    offsets = np.cumsum([0, *(len(p[1]) for p in parts)])
    starts = [p[2] + offset for p, offset in zip(parts, offsets, strict=False)]
    rows = [rec.rows[part][p[3]] for part, p in zip(segments, parts, strict=True)]
    u, y, r, valid, aux = np.split(x, np.cumsum(_widths(rec)), axis=1)
    return replace(
        rec,
        u=u,
        y=y,
        Ts=Ts,
        r=None if rec.r is None else r,
        aux={name: aux[:, k] for k, name in enumerate(rec.aux)},
        t0=float(t[0]),
        t=t,
        valid=valid == 1.0,
        starts=np.concatenate(starts),
        rows=np.concatenate(rows),
        log=(*rec.log, _said(rec, len(t), Ts, len(rec.segments) - len(segments))),
    )


def _columns(rec: Record) -> tuple[Floats, list[bool]]:
    """Return all signals side by side, and which of them are held."""
    aux = [x[:, None] for x in rec.aux.values()]
    r = [] if rec.r is None else [rec.r]
    columns = np.concatenate([rec.u, rec.y, *r, rec.valid.astype(np.float64), *aux], axis=1)
    nu, ny, nr, nv = _widths(rec)
    held = [True] * nu + [False] * ny + [True] * nr + [False] * (nv + len(aux))
    return columns, held


def _widths(rec: Record) -> tuple[int, int, int, int]:
    return rec.nu, rec.ny, 0 if rec.r is None else rec.ny, rec.ny


def _on_grid(
    t: Floats, columns: Floats, held: list[bool], Ts: float
) -> tuple[Floats, Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Return columns, times, starts and rows of one segment."""
    grid, new, starts, rows = _core.resample(np.ascontiguousarray(t), columns.T.tolist(), held, Ts)
    return np.stack(new, axis=1), grid, np.array(starts, np.int64), rows


def _said(rec: Record, N: int, Ts: float, left_out: int) -> str:
    said = (
        f"resampled {rec.N} rows at {rec.Ts:g} s to {N} rows at {Ts:g} s: inputs and reference "
        "held, outputs interpolated"
    )
    if Ts > rec.Ts:
        said += ", no filter against aliasing"
    return said + (f", {left_out} segments of one row left out" if left_out else "")
