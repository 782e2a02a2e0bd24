"""Bring a record to another sample time."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.prep.rows import with_doubts
from plantune.record import Floats, Record

_LONGER: Final = 1.5
"""Steps longer than this many own steps pass the filter."""


def resample(rec: Record, Ts: float, filter: bool = True, limits: Limits | None = None) -> Record:
    """Bring each segment to a uniform step; a longer step passes a filter first.

    Up to 1.5 times the record's own step, inputs and reference are held and outputs and `aux`
    interpolated; an output between two rows counts where both count.

    To a longer step, all signals first pass the same low-pass (Butterworth of order 8 at 0.8 of
    the new Nyquist frequency) forward and backward, so nothing is delayed and every row keeps its
    time.  Outputs and `aux` are then read at the new rows, between two rows interpolated; inputs
    and reference are the mean over the step that they act for.  (Read at its start, they would act
    half a step late, and the dead time would come out half a step short, less half an old one.)

    Parameters
    ----------
    rec : Record
        Segments of one row are left out; with the filter, also those in which it still remembers
        the unknown past or future everywhere: about 16 new rows.
    Ts : float
        New sample time, seconds.
    filter : bool
        False refuses steps that need the filter.
    limits : Limits, optional
        Thresholds F02 and D07.

    Returns
    -------
    Record
        `t` is given; `rows` hold the original row at or before each new one; same `source`.  With
        the filter, outputs near a segment's ends, at most a tenth of it, do not count until the
        filter has forgotten what it cannot know, nor do outputs around holes; a note F02 says
        where more is left.

    Raises
    ------
    DataError
        No segment is long enough (D04); holes spread too far (D07).
    NotIdentifiable
        `Ts` is more than 1.5 times the record's own step, and the filter is off (M10).
    UsageError
        `Ts` is not positive, or far too short or too long for the record (U01).

    Notes
    -----
    The mean is what makes the samples of an integrator exact, and of a lag much slower than `Ts`
    nearly so.  Without noise, T and L of `process` came out within 0.1 % of T and 1 % of `Ts` at
    T = 10 Ts, and within 4 % at T = 2.5 Ts: keep the new step below a tenth of the time constant.

    Examples
    --------
    >>> from plantune.record import Record
    >>> rec = resample(Record(u=[0.0, 1.0, 1.0], y=[0.0, 2.0, 4.0], Ts=1.0), 0.5)
    >>> rec.u[:, 0].tolist(), rec.y[:, 0].tolist()
    ([0.0, 0.0, 1.0, 1.0, 1.0], [0.0, 1.0, 2.0, 3.0, 4.0])
    >>> rec.rows.tolist(), rec.time.tolist()
    ([0, 0, 1, 1, 2], [0.0, 0.5, 1.0, 1.5, 2.0])

    >>> from plantune.datasets import engine_loop
    >>> slow = resample(engine_loop(), 0.06)
    >>> print(slow)
    Record actuator -> output: 1000 rows, Ts 0.06 s, 1 segment
    """
    if filter and rec.Ts * _LONGER < Ts < np.inf:
        return _decimated(rec, Ts, limits or rec.limits or DEFAULT_LIMITS)
    return _on_grid(rec, Ts)


def _decimated(rec: Record, Ts: float, limits: Limits) -> Record:
    further, held = _further(rec)
    out = _core.decimate(rec, further, held, Ts, limits)
    marks, rows = out["marks"], out["rows"]
    t = rec.time[rows] + out["after"]
    r, aux = np.split(out["further"], [sum(held)], axis=1)
    said = (
        f"resampled {rec.N} rows at {rec.Ts:g} s to {len(t)} rows at {Ts:g} s: low-pass both ways "
        "on every signal, inputs and reference averaged over the new step; "
        f"{int((~out['valid']).sum())} outputs do not count, {marks['left']:.2g} of an unknown "
        f"start left{_and_left_out(out['left_out'], 'too short for the filter')}"
    )
    return replace(
        rec,
        **{name: out[name] for name in ("u", "y", "valid", "starts")},
        Ts=Ts,
        r=None if rec.r is None else r,
        aux={name: aux[:, k] for k, name in enumerate(rec.aux)},
        t0=float(t[0]),
        t=t,
        rows=rec.rows[rows],
        log=(*rec.log, said),
        notes=with_doubts(rec, marks["notes"], limits),
    )


def _on_grid(rec: Record, Ts: float) -> Record:
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
    parts = [_segment_on_grid(rec.time[part], columns[part], held, Ts) for part in segments]
    x, t = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    offsets = np.cumsum([0, *(len(p[1]) for p in parts)])
    starts = [p[2] + offset for p, offset in zip(parts, offsets, strict=False)]
    rows = [rec.rows[part][p[3]] for part, p in zip(segments, parts, strict=True)]
    nr = 0 if rec.r is None else rec.ny
    u, y, valid, r, aux = np.split(x, np.cumsum([rec.nu, rec.ny, rec.ny, nr]), axis=1)
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
    further, held = _further(rec)
    columns = np.concatenate([rec.u, rec.y, rec.valid.astype(np.float64), further], axis=1)
    return columns, [True] * rec.nu + [False] * (2 * rec.ny) + held


def _further(rec: Record) -> tuple[Floats, list[bool]]:
    """Return reference and `aux` side by side, and which of them are held."""
    r = [] if rec.r is None else [rec.r]
    aux = [x[:, None] for x in rec.aux.values()]
    further = np.concatenate([np.empty((rec.N, 0)), *r, *aux], axis=1)
    return further, [True] * sum(x.shape[1] for x in r) + [False] * len(aux)


def _segment_on_grid(
    t: Floats, columns: Floats, held: list[bool], Ts: float
) -> tuple[Floats, Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Return columns, times, starts and rows of one segment."""
    grid, x, starts, rows = _core.resample(np.ascontiguousarray(t), columns, held, Ts)
    return x, grid, np.array(starts, np.int64), rows


def _said(rec: Record, N: int, Ts: float, left_out: int) -> str:
    said = (
        f"resampled {rec.N} rows at {rec.Ts:g} s to {N} rows at {Ts:g} s: inputs and reference "
        "held, outputs interpolated"
    )
    if Ts > rec.Ts:
        said += ", no filter against aliasing"
    return said + _and_left_out(left_out, "of one row")


def _and_left_out(segments: int, why: str) -> str:
    return f", {segments} segments {why} left out" if segments else ""
