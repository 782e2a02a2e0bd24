"""Rows in time: sorted or cut, without repeats, on one step (D13 to D16)."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import DataError, PlantuneError, refusal, reworded
from plantune.io.draft import Choice, Draft
from plantune.io.file import too_few
from plantune.io.table import MOST_LINES
from plantune.notes import Limits, Note, Where

_SHORTEST_STEP: Final = 1e-6
_LONGEST_STEP: Final = 1e5
_SAME_STEP: Final = 0.05
"""Share by which the stamps may differ from the sample time given."""


def in_order(draft: Draft, sort: bool | str) -> Draft:
    """Sort the rows by their stamps, or cut where the clock goes back."""
    if not sort:
        return draft
    if draft.t is None:
        raise refusal(
            "U01",
            f"`sort` = {sort!r} needs a column of time stamps",
            remedy="name the column of the stamps, time=",
        )
    back = np.diff(draft.t) < 0
    if not back.any():
        return draft
    if sort == "segments":
        said = f"D13: cut where time goes back, {back.sum()} times"
        segment = draft.segment + np.append(0, np.cumsum(back))
        return replace(draft, segment=segment, log=(*draft.log, said), rows_tell_time=False)
    order = np.argsort(draft.t, kind="stable")
    moved = int((order != np.arange(draft.N)).sum())
    draft = draft.take(order, f"D13: sorted by time, {moved} of {draft.N} rows moved")
    return replace(draft, segment=np.zeros(draft.N, np.int64), rows_tell_time=False)


def newest_first(t: NDArray[np.float64]) -> bool:
    """Whether the rows run from the newest to the oldest, as some historians export them."""
    return len(t) > 1 and bool((np.diff(t) <= 0).all())


def without_repeats(draft: Draft) -> Draft:
    """Drop rows that repeat the row before, stamp and values (D14 is for other values)."""
    if draft.t is None:
        return draft
    x, t = draft.x, draft.t
    same = (x[1:] == x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1]))
    repeats = (t[1:] == t[:-1]) & same.all(axis=1)
    if not repeats.any():
        return draft
    count = int(repeats.sum())
    said = f"dropped {count} rows that repeat the stamp and the values before them"
    first = int(repeats.argmax()) + 1
    note = Note(
        code="D14",
        severity="warning",
        text=said,
        where=Where(*draft.where(first, draft.time_name)),
        count=count,
        remedy="check whether the logger writes rows twice, or holds old values",
    )
    kept = draft.take(np.append(True, ~repeats), f"D14: {said}")
    return replace(kept, notes=(*draft.notes, note), rows_tell_time=False)


def with_step(draft: Draft, choice: Choice) -> Draft:
    """Take the sample time from uniform stamps, or compare them with the one given."""
    if draft.t is None:
        if choice.Ts is None:
            raise refusal(
                "U01",
                "`Ts` is not given and the file has no column of time stamps",
                remedy="give Ts= in seconds, or name the column of the stamps, time=",
            )
        return draft
    step = _step(draft, choice.limits)
    _refuse_unlikely_step(step, draft, choice)
    if choice.Ts is None:
        return replace(draft, Ts=step)
    if abs(step - choice.Ts) <= _SAME_STEP * choice.Ts:
        return draft
    said = f"the stamps are {step:.6g} s apart; Ts = {choice.Ts:g} s was given and is used"
    note = Note(
        code="D16",
        severity="warning",
        text=said,
        where=Where(*draft.where(0, draft.time_name)),
        count=draft.N,
        measured=abs(step / choice.Ts - 1),
        limit=_SAME_STEP,
        remedy="leave Ts= out, or name the unit of the stamps in the header",
    )
    return replace(draft, log=(*draft.log, f"D16: {said}"), notes=(*draft.notes, note))


def as_stamped(draft: Draft, choice: Choice) -> Draft:
    """Keep the stamps as they are; the sample time is their mean step."""
    if draft.t is None or choice.resample is not None or choice.Ts is not None:
        lacks = (
            "needs a column of time stamps" if draft.t is None else "takes no `Ts` or `resample`"
        )
        raise refusal("U01", f"`stamps` = 'irregular' {lacks}", remedy="name the column: time=")
    step = _core.mean_step(np.ascontiguousarray(draft.t), draft.starts.tolist())
    if step is None:
        raise too_few(1, "no two rows follow each other")
    said = f"stamps kept as they are, {step:.6g} s apart in the mean"
    return replace(draft, Ts=step, rows_tell_time=False, log=(*draft.log, said))


def _step(draft: Draft, limits: Limits) -> float:
    """Return the step that the stamps of all segments share, as the longest has it (D15)."""
    parts = sorted(draft.parts, key=lambda part: part.start - part.stop)
    longest, *others = [part for k, part in enumerate(parts) if not k or part.stop - part.start > 1]
    step = _step_of(draft, longest, limits)
    for part in others:
        other = _step_of(draft, part, limits)
        off = abs(other / step - 1)
        if off > limits.D15:
            raise refusal(
                "D15",
                f"not uniformly sampled: steps of {step:.6g} s, and of {other:.6g} s in the "
                f"segment that begins in {draft.places.said(part.start)}",
                where=draft.where(part.start, draft.time_name),
                count=part.stop - part.start,
                measured=off,
                limit=limits.D15,
                remedy=f"resample to a uniform step: resample={step:.4g}",
            )
    return step


def _step_of(draft: Draft, part: slice, limits: Limits) -> float:
    try:
        return _core.uniform_step(np.ascontiguousarray(_stamps(draft)[part]), limits)
    except DataError as error:
        raise _in_file(error, draft, part.start) from None


def _refuse_unlikely_step(step: float, draft: Draft, choice: Choice) -> None:
    """D16 where only another unit makes sense of the stamps."""
    if choice.Ts is not None or _SHORTEST_STEP <= step <= _LONGEST_STEP:
        return
    raise refusal(
        "D16",
        f"`{draft.time_name}` gives a step of {step:.4g} s: the stamps look like another unit",
        where=draft.where(0, draft.time_name),
        count=draft.N,
        measured=step,
        limit=_LONGEST_STEP if step > _LONGEST_STEP else _SHORTEST_STEP,
        remedy="name the unit in the header, for instance 'time [ms]', or give Ts=",
    )


def on_grid(draft: Draft, held: list[bool], Ts: float) -> Draft:
    """Bring the rows of each segment to a uniform grid."""
    if draft.t is None or draft.Ts not in (None, Ts):
        why = "needs a column of time stamps" if draft.t is None else f"and Ts {draft.Ts} disagree"
        raise refusal("U01", f"`resample` = {Ts:g} {why}", remedy="name it: time=, without Ts=")
    parts = [part for part in draft.parts if part.stop - part.start > 1]
    if not parts:
        raise too_few(1, f"{len(draft.parts)} segments of one row each")
    _refuse_long_grid(draft, parts, Ts)
    grids = [_grid(draft, part, held, Ts) for part in parts]
    t = np.concatenate([grid[0] for grid in grids])
    first = np.concatenate([np.isin(np.arange(len(grid[0])), grid[2]) for grid in grids])
    before = np.concatenate([grid[3] + part.start for grid, part in zip(grids, parts, strict=True)])
    cuts = int(first.sum()) - 1
    said = (
        f"resampled {draft.N} rows to {len(t)} rows {Ts:g} s apart"
        f"{f', cut at {cuts} gaps' if cuts else ''}: inputs and reference "
        "held, outputs interpolated; rows count the grid"
    )
    return replace(
        draft,
        x=np.concatenate([grid[1] for grid in grids]),
        t=t,
        places=replace(draft.places.take(before), rows=_rows([grid[0] for grid in grids], Ts)),
        Ts=Ts,
        segment=np.cumsum(first),
        log=(*draft.log, said),
        rows_tell_time=bool((np.diff(t) > 0).all()),
    )


def _grid(
    draft: Draft, part: slice, held: list[bool], Ts: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[int], NDArray[np.int64]]:
    """Return times, columns, first rows and original rows of one segment."""
    t, x = (np.ascontiguousarray(rows[part]) for rows in (_stamps(draft), draft.x))
    try:
        return _core.resample(t, x, held, Ts)
    except DataError as error:
        raise _in_file(error, draft, part.start) from None


def _rows(grids: list[NDArray[np.float64]], Ts: float) -> NDArray[np.int64]:
    """Count the grid from the first stamp, a segment whose clock was set back behind the others."""
    rows: list[NDArray[np.int64]] = []
    for t in grids:
        begin = round(float(t[0] - grids[0][0]) / Ts)
        begin = max(begin, int(rows[-1][-1]) + 1) if rows else begin
        rows.append(begin + np.rint((t - t[0]) / Ts).astype(np.int64))
    return np.concatenate(rows)


def _refuse_long_grid(draft: Draft, parts: list[slice], Ts: float) -> None:
    t = _stamps(draft)
    wanted = sum(float(t[part.stop - 1] - t[part.start]) for part in parts) / Ts
    if wanted > MOST_LINES:
        raise refusal(
            "D01",
            f"resample={Ts:g} asks for {wanted:.3g} rows",
            where=(draft.time_name, 0, None),
            count=draft.N,
            measured=wanted,
            limit=float(MOST_LINES),
            remedy="choose a longer step",
        )


def _stamps(draft: Draft) -> NDArray[np.float64]:
    return np.empty(0) if draft.t is None else draft.t


def _in_file(error: DataError, draft: Draft, start: int) -> PlantuneError:
    """Return the core's refusal of the stamps with their place in the file."""
    _, row, _ = error.where or ("", 0, None)
    k = start + (row or 0)
    sort = 'sort=True sorts the rows by time, sort="segments" cuts where the clock was set'
    text = f"{error.text}; first in {draft.places.said(k)}"
    if newest_first(_stamps(draft)):
        text, sort = "the newest row comes first", "sort=True brings the rows into their order"
    return reworded(
        error,
        text,
        where=draft.where(k, draft.time_name),
        remedy=sort if error.code == "D13" else error.remedy,
    )
