"""Columns of any reader to a `Record`: stamps, repeats, gaps, missing values, each step logged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import DataError, PlantuneError, refusal
from plantune.io.choose import Chosen, Names, choose
from plantune.io.stamps import seconds
from plantune.io.table import Lines, Name, Sheet
from plantune.notes import Limits
from plantune.record import Floats, Record

_SHORTEST_STEP: Final = 1e-6
_LONGEST_STEP: Final = 1e5
_SAME_STEP: Final = 0.05
"""Share by which the stamps may differ from the sample time given."""


@dataclass(frozen=True, slots=True)
class Choice:
    """What the caller of `read` asked for."""

    u: Names
    y: Names
    Ts: float | None
    r: Names
    aux: Names
    time: Name | None
    resample: float | None
    missing: str
    units: Mapping[str, str]
    limits: Limits


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """A record in the making."""

    x: Floats  # (N, columns asked for), NaN where missing
    t: Floats | None  # seconds
    rows: NDArray[np.int64]  # data row in the file, from 0
    lines: Lines
    names: tuple[str, ...]
    time_name: str
    Ts: float | None
    starts: NDArray[np.int64]
    log: tuple[str, ...]
    rows_tell_time: bool = True  # not after repeated rows were dropped

    @property
    def N(self) -> int:
        """Number of rows."""
        return len(self.x)

    def take(self, keep: NDArray[np.bool_], said: str) -> Draft:
        """Return the rows to keep, with a line in the log."""
        return replace(
            self,
            x=self.x[keep],
            t=None if self.t is None else self.t[keep],
            rows=self.rows[keep],
            lines=self.lines[keep],
            log=(*self.log, said),
        )


def record_from(sheet: Sheet, choice: Choice) -> Record:
    """Return the record that the caller asked for."""
    _check(choice)
    chosen = choose(sheet.columns, choice.u, choice.y, choice.r, choice.aux, choice.time)
    draft = _draft(sheet, chosen, choice)
    _refuse_output_equal_to_input(draft, chosen)
    _refuse_infinite(draft, choice.limits)
    if choice.missing == "error":
        _refuse_missing(
            draft,
            range(len(draft.names)),
            'missing="segments" cuts the record there, missing="mask" leaves these outputs out',
        )
    draft = _without_repeats(draft)
    if choice.resample is None:
        draft = _with_step(draft, choice)
    else:
        draft = _on_grid(draft, chosen, choice, float(choice.resample))
    if choice.missing == "mask":
        draft = _marked(draft, chosen, choice.limits)
    if choice.missing == "segments":
        draft = _cut(draft, choice.limits)
    return _record(sheet, chosen, choice, draft)


def _check(choice: Choice) -> None:
    if choice.missing not in ("error", "segments", "mask"):
        raise refusal(
            "U01",
            f"`missing` is {choice.missing!r}, must be 'error', 'segments' or 'mask'",
            remedy="leave it out to refuse missing values",
        )
    for name, value in (("Ts", choice.Ts), ("resample", choice.resample)):
        if value is not None and not (isinstance(value, Real) and 0 < value < np.inf):
            raise refusal(
                "U01",
                f"`{name}` is {value!r}, must be a positive number of seconds",
                remedy=f"give {name}= in seconds, for instance {name}=0.1",
            )


def _draft(sheet: Sheet, chosen: Chosen, choice: Choice) -> Draft:
    table = sheet.read(chosen.numbers, chosen.time)
    changed = tuple(note.text for note in choice.limits.changes())
    draft = Draft(
        x=table.numbers,
        t=None,
        rows=np.arange(len(table.numbers)),
        lines=table.lines,
        names=tuple(sheet.columns[i].name for i in chosen.numbers),
        time_name="",
        Ts=None if choice.Ts is None else float(choice.Ts),
        starts=np.array([0]),
        log=(*table.log, *changed),
    )
    if table.stamps is None or chosen.time is None:
        return draft
    title = sheet.columns[chosen.time].title
    draft = replace(draft, time_name=title)
    try:
        t, said = seconds(table.stamps, title, table.lines)
    except DataError as error:
        if chosen.time_is_named or choice.Ts is None or choice.resample is not None:
            raise
        return replace(draft, log=(*draft.log, f"time stamps not used: {error.text}"))
    return replace(draft, t=t, log=(*draft.log, f"time from column {title}", *said))


def _refuse_output_equal_to_input(draft: Draft, chosen: Chosen) -> None:
    nu, ny = len(chosen.u), len(chosen.y)
    for i in range(nu):
        for j in range(nu, nu + ny):
            if np.array_equal(draft.x[:, i], draft.x[:, j], equal_nan=True):
                raise refusal(
                    "D12",
                    f"output equals input: `{draft.names[j]}` and `{draft.names[i]}` hold the "
                    "same numbers in every row",
                    where=(draft.names[j], 0, None),
                    count=draft.N,
                    remedy="name the measured output as y=",
                )


def _refuse_infinite(draft: Draft, limits: Limits) -> None:
    """D08, before interpolation makes a missing value of it."""
    beyond = np.abs(draft.x) > limits.D08
    if not beyond.any():
        return
    i = int(beyond.any(axis=0).argmax())
    row = int(beyond[:, i].argmax())
    raise refusal(
        "D08",
        f"`{draft.names[i]}` is infinite or beyond {limits.D08:g} in {beyond[:, i].sum()} rows, "
        f"first in file line {draft.lines[row]}",
        where=(draft.names[i], int(draft.rows[row]), _time_of(draft, row)),
        count=int(beyond[:, i].sum()),
        measured=float(abs(draft.x[row, i])),
        limit=limits.D08,
        remedy="remove these rows or change the unit of the column",
    )


def _refuse_missing(draft: Draft, columns: Sequence[int], remedy: str) -> None:
    """D07 where a value of these columns is missing."""
    missing = np.isnan(draft.x)
    counts = missing.sum(axis=0)
    gaps = [i for i in columns if counts[i]]
    if not gaps:
        return
    i = gaps[0]
    row = int(missing[:, i].argmax())
    also = f"; {len(gaps) - 1} further columns have gaps" if len(gaps) > 1 else ""
    raise refusal(
        "D07",
        f"`{draft.names[i]}` is missing in {counts[i]} of {draft.N} rows, "
        f"first in file line {draft.lines[row]}{also}",
        where=(draft.names[i], int(draft.rows[row]), _time_of(draft, row)),
        count=int(counts[i]),
        measured=float(counts[i] / draft.N),
        limit=0.0,
        remedy=remedy,
    )


def _without_repeats(draft: Draft) -> Draft:
    """Drop rows that repeat the row before, stamp and values (D14 is for other values)."""
    if draft.t is None:
        return draft
    x, t = draft.x, draft.t
    same = (x[1:] == x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1]))
    repeats = (t[1:] == t[:-1]) & same.all(axis=1)
    if not repeats.any():
        return draft
    said = f"D14: dropped {repeats.sum()} rows that repeat the stamp and the values before them"
    return replace(draft.take(np.append(True, ~repeats), said), rows_tell_time=False)


def _with_step(draft: Draft, choice: Choice) -> Draft:
    """Take the sample time from uniform stamps, or compare them with the one given."""
    if draft.t is None:
        if choice.Ts is None:
            raise refusal(
                "U01",
                "`Ts` is not given and the file has no column of time stamps",
                remedy="give Ts= in seconds, or name the column of the stamps, time=",
            )
        return draft
    try:
        step = _core.uniform_step(np.ascontiguousarray(draft.t), choice.limits)
    except DataError as error:
        raise _at_file_line(error, draft) from None
    _refuse_unlikely_step(step, draft, choice)
    if choice.Ts is None:
        return replace(draft, Ts=step)
    if abs(step - choice.Ts) <= _SAME_STEP * choice.Ts:
        return draft
    said = f"D16: the stamps are {step:.6g} s apart; Ts = {choice.Ts:g} s was given and is used"
    return replace(draft, log=(*draft.log, said))


def _refuse_unlikely_step(step: float, draft: Draft, choice: Choice) -> None:
    """D16 where only another unit makes sense of the stamps."""
    t0 = 0.0 if draft.t is None else float(draft.t[0])
    excel_days = 32874 <= t0 <= 73050 and step < 1e-3  # 1990 to 2100 in days from 1900
    if choice.Ts is not None or (_SHORTEST_STEP <= step <= _LONGEST_STEP and not excel_days):
        return
    guess = "days (a spreadsheet's serials)" if excel_days else "another unit"
    raise refusal(
        "D16",
        f"`{draft.time_name}` gives a step of {step:.4g} s: the stamps look like {guess}",
        where=(draft.time_name, 0, t0),
        count=draft.N,
        measured=step,
        limit=_LONGEST_STEP if step > _LONGEST_STEP else _SHORTEST_STEP,
        remedy="name the unit in the header, for instance 'time [ms]', or give Ts=",
    )


def _on_grid(draft: Draft, chosen: Chosen, choice: Choice, Ts: float) -> Draft:
    """Bring the rows to a uniform grid."""
    if draft.t is None or choice.Ts not in (None, Ts):
        why = "needs a column of time stamps" if draft.t is None else f"and Ts {choice.Ts} disagree"
        raise refusal("U01", f"`resample` = {Ts:g} {why}", remedy="name it: time=, without Ts=")
    held = [*[True] * len(chosen.u), *[False] * len(chosen.y)]
    held += [*[True] * len(chosen.r), *[False] * len(chosen.aux)]
    try:
        t, x, starts, rows = _core.resample(
            np.ascontiguousarray(draft.t), np.ascontiguousarray(draft.x), held, Ts
        )
    except DataError as error:
        raise _at_file_line(error, draft) from None
    cuts = f", cut at {len(starts) - 1} gaps" if len(starts) > 1 else ""
    said = (
        f"resampled {draft.N} rows to {len(t)} rows {Ts:g} s apart{cuts}: inputs and reference "
        "held, outputs interpolated; rows count the grid"
    )
    return replace(
        draft,
        x=x,
        t=t,
        rows=np.rint((t - t[0]) / Ts).astype(np.int64),
        lines=draft.lines[rows],
        Ts=Ts,
        starts=np.array(starts, np.int64),
        log=(*draft.log, said),
        rows_tell_time=True,
    )


def _marked(draft: Draft, chosen: Chosen, limits: Limits) -> Draft:
    """Check that only outputs are missing; the record marks these rows itself."""
    outputs = chosen.outputs
    others = [i for i in range(len(draft.names)) if not outputs.start <= i < outputs.stop]
    _refuse_missing(draft, others, 'missing="mask" marks outputs only; missing="segments" cuts')
    missing = np.isnan(draft.x)
    _refuse_too_many_lost(draft, missing, limits)
    said = [
        f"`{name}` marked as missing in {n} of {draft.N} rows"
        for name, n in zip(draft.names, missing.sum(axis=0), strict=True)
        if n
    ]
    return replace(draft, log=(*draft.log, *said))


def _cut(draft: Draft, limits: Limits) -> Draft:
    """Drop rows with a missing value; what follows a gap is a new segment."""
    missing = np.isnan(draft.x)
    keep = np.logical_not(missing.any(axis=1))
    if keep.all():
        return draft
    _refuse_too_many_lost(draft, missing, limits)
    first = np.zeros(draft.N, bool)
    first[draft.starts] = True
    segment = np.cumsum(first | ~keep)[keep]  # grows at each start and over each gap
    starts = np.flatnonzero(np.diff(segment, prepend=segment[0] - 1))
    columns = ", ".join(
        f"{name} {n}" for name, n in zip(draft.names, missing.sum(axis=0), strict=True) if n
    )
    said = f"dropped {(~keep).sum()} of {draft.N} rows with missing values ({columns})"
    draft = draft.take(keep, f"{said}, {len(starts)} segments remain")
    return replace(draft, starts=starts)


def _refuse_too_many_lost(draft: Draft, missing: NDArray[np.bool_], limits: Limits) -> None:
    lost = missing.any(axis=1)
    share = float(lost.mean())
    if share <= limits.D07:
        return
    row = int(lost.argmax())
    name = draft.names[int(missing[row].argmax())]
    raise refusal(
        "D07",
        f"values are missing in {lost.sum()} of {draft.N} rows, "
        f"first in file line {draft.lines[row]}",
        where=(name, int(draft.rows[row]), _time_of(draft, row)),
        count=int(lost.sum()),
        measured=share,
        limit=limits.D07,
        remedy="record again, or choose other columns",
    )


def _record(sheet: Sheet, chosen: Chosen, choice: Choice, draft: Draft) -> Record:
    edges = np.cumsum([len(chosen.u), len(chosen.y), len(chosen.r)])
    u, y, r, aux = np.split(draft.x, edges, axis=1)
    names = draft.names
    units = {c.name: c.unit for c in (sheet.columns[i] for i in chosen.numbers) if c.unit}
    return Record(
        u=u,
        y=y,
        Ts=draft.Ts,  # type: ignore[arg-type]  # known by now
        r=r if chosen.r else None,
        aux={name: aux[:, k] for k, name in enumerate(names[edges[2] :])},
        t0=0.0 if draft.t is None else float(draft.t[0]),
        t=None if draft.rows_tell_time else draft.t,
        valid=~np.isnan(y),
        starts=draft.starts,
        u_names=names[: edges[0]],
        y_names=names[edges[0] : edges[1]],
        units={**units, **choice.units},
        rows=draft.rows,
        log=draft.log,
        limits=choice.limits if choice.limits.changes() else None,
    )


def _at_file_line(error: DataError, draft: Draft) -> PlantuneError:
    """Return the core's refusal of the stamps with the row and line of the file."""
    _, row, time = error.where or ("", 0, None)
    k = row or 0
    return refusal(
        error.code,
        f"{error.text}; first in file line {draft.lines[k]}",
        where=(draft.time_name, int(draft.rows[k]), time),
        count=error.count,
        measured=error.measured,
        limit=error.limit,
        remedy=error.remedy,
    )


def _time_of(draft: Draft, row: int) -> float | None:
    if draft.t is not None:
        return float(draft.t[row])
    return None if draft.Ts is None else float(draft.rows[row] * draft.Ts)
