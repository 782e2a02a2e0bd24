"""Columns of any reader to a `Record`, step by step, each one logged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from numbers import Real

import numpy as np

from plantune import _core
from plantune.errors import DataError, from_note, refusal
from plantune.io.choose import Chosen, choose
from plantune.io.draft import Choice, Draft
from plantune.io.missing import cut, marked, refuse_missing, without_sentinels
from plantune.io.order import as_stamped, in_order, on_grid, with_step, without_repeats
from plantune.io.quality import graded
from plantune.io.stamps import seconds, which_count
from plantune.io.table import Column, Sheet, Table, Wanted
from plantune.notes import Limits, notes_from_core
from plantune.record import Record


def record_from(sheet: Sheet, choice: Choice) -> Record:
    """Return the record that the caller asked for."""
    chosen = choose(sheet.columns, choice)
    words = tuple(dict.fromkeys(chosen.quality.values()))
    table = sheet.read(Wanted(chosen.numbers, chosen.time, words, choice.ragged == "skip"))
    draft = _timed(_draft(sheet.columns, chosen, table, choice), sheet.columns, chosen, table)
    draft = _counting(draft, sheet.columns, chosen, table, choice)
    if choice.missing == "error":
        refuse_missing(
            draft,
            range(len(draft.names)),
            'missing="segments" cuts the record there, missing="mask" leaves these outputs out',
        )
    draft = without_repeats(in_order(draft, choice.sort))
    if choice.stamps == "irregular":
        draft = as_stamped(draft, choice)
    elif choice.resample is None:
        draft = with_step(draft, choice)
    else:
        draft = on_grid(draft, _held(chosen), float(choice.resample))
    if choice.missing == "mask":
        draft = marked(draft, chosen.outputs, choice.limits)
    if choice.missing == "segments":
        draft = cut(draft, choice.limits)
    return _uncompressed(_record(sheet.columns, chosen, choice, draft), choice)


def _uncompressed(rec: Record, choice: Choice) -> Record:
    """Refuse outputs that a historian has compressed, or note them (D15)."""
    if choice.resample is not None or rec.irregular:
        return rec
    keep = choice.compressed == "keep"
    notes = notes_from_core(_core.compression(rec, keep, choice.limits)[1])
    if notes and not keep:
        raise from_note(notes[0])
    return replace(rec, notes=(*rec.notes, *notes)) if notes else rec


def check(choice: Choice) -> None:
    """Refuse options that are none (U01)."""
    for name, value, allowed in (
        ("missing", choice.missing, ("error", "segments", "mask")),
        ("sort", choice.sort, (False, True, "segments")),
        ("ragged", choice.ragged, ("error", "skip")),
        ("uncertain", choice.uncertain, ("drop", "keep")),
        ("stamps", choice.stamps, ("uniform", "irregular")),
        ("compressed", choice.compressed, ("error", "keep")),
    ):
        if value not in allowed:
            raise refusal(
                "U01",
                f"`{name}` is {value!r}, must be {', '.join(map(repr, allowed[:-1]))} "
                f"or {allowed[-1]!r}",
                remedy="leave it out to refuse what is wrong",
            )
    for name, step in (("Ts", choice.Ts), ("resample", choice.resample)):
        if step is not None and not (isinstance(step, Real) and 0 < step < np.inf):
            raise refusal(
                "U01",
                f"`{name}` is {step!r}, must be a positive number of seconds",
                remedy=f"give {name}= in seconds, for instance {name}=0.1",
            )
    for sentinel in choice.sentinels:
        if not isinstance(sentinel, Real):
            raise refusal(
                "U01",
                f"`sentinels` holds {sentinel!r}, must hold numbers",
                remedy="give the values that mean missing, for instance sentinels=(-9999,)",
            )


def _draft(columns: Sequence[Column], chosen: Chosen, table: Table, choice: Choice) -> Draft:
    """Return the rows as they stand in the file; those beside a skipped one are apart."""
    changed = tuple(note.text for note in choice.limits.changes())
    rows = table.places.rows
    _refuse_too_many_skipped(table, choice.limits)
    return Draft(
        x=table.numbers,
        t=None,
        places=table.places,
        names=tuple(columns[i].name for i in chosen.numbers),
        time_name="",
        Ts=None if choice.Ts is None else float(choice.Ts),
        segment=rows - np.arange(len(rows)),
        log=(*table.log, *changed),
    )


def _refuse_too_many_skipped(table: Table, limits: Limits) -> None:
    N, read = int(table.places.rows[-1]) + 1, len(table.places)
    if 1 - read / N > limits.D07:
        raise refusal(
            "D05",
            f"{N - read} of {N} rows are ragged: too many to skip",
            where=("", None, None),
            count=N - read,
            measured=1 - read / N,
            limit=limits.D07,
            remedy="look whether the delimiter stands in a text without quotes",
        )


def _timed(draft: Draft, columns: Sequence[Column], chosen: Chosen, table: Table) -> Draft:
    """Return the rows with their stamps in seconds."""
    time = chosen.time
    if not time:
        return draft
    if len(time) == 2 and not chosen.time_is_named:
        time = tuple(time[k] for k in which_count(*(table.cells[i] for i in time)))
    cells = [table.cells[i] for i in time]
    draft = replace(draft, time_name=" ".join(columns[i].title for i in time))
    try:
        t, said = seconds(cells, draft.time_name, draft.places)
    except DataError as error:
        if chosen.time_is_named or draft.Ts is None:
            raise
        return replace(draft, log=(*draft.log, f"time stamps not used: {error.text}"))
    names = "columns" if len(cells) == 2 else "column"
    return replace(draft, t=t, log=(*draft.log, f"time from {names} {draft.time_name}", *said))


def _counting(
    draft: Draft, columns: Sequence[Column], chosen: Chosen, table: Table, choice: Choice
) -> Draft:
    """Return the rows with the values that do not count as missing; refuse D12 and D08."""
    _refuse_output_equal_to_input(draft, chosen)
    draft = without_sentinels(draft, choice.sentinels)
    if chosen.quality:
        keep = choice.uncertain == "keep"
        draft = graded(draft, chosen.quality, columns, table.cells, keep)
    _refuse_infinite(draft, choice.limits)
    return draft


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
        f"first in {draft.places.said(row)}",
        where=draft.where(row, draft.names[i]),
        count=int(beyond[:, i].sum()),
        measured=float(abs(draft.x[row, i])),
        limit=limits.D08,
        remedy="remove these rows or change the unit of the column",
    )


def _held(chosen: Chosen) -> list[bool]:
    """Whether each column keeps its value between rows: inputs and reference do."""
    held = [*[True] * len(chosen.u), *[False] * len(chosen.y)]
    return [*held, *[True] * len(chosen.r), *[False] * len(chosen.aux)]


def _record(columns: Sequence[Column], chosen: Chosen, choice: Choice, draft: Draft) -> Record:
    edges = np.cumsum([len(chosen.u), len(chosen.y), len(chosen.r)])
    u, y, r, aux = np.split(draft.x, edges, axis=1)
    names = draft.names
    units = {c.name: c.unit for c in (columns[i] for i in chosen.numbers) if c.unit}
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
        rows=draft.places.rows,
        log=draft.log,
        limits=choice.limits if choice.limits.changes() else None,
        notes=draft.notes,
    )
