"""What to do after a look: repairs, what to record, which rows to take, and the next command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from plantune.analyze import ImpulseResponse, Informative
from plantune.notes import Note
from plantune.record import Record

# Share of a gain below which its standard deviation tells it.
_TOLD = 0.25

# Options of `read` as the command line has them.
_AS_TYPED = {
    ("missing", "segments"): "--missing segments",
    ("sort", True): "--sort",
    ("ragged", "skip"): "--ragged skip",
    ("compressed", "keep"): "--compressed keep",
}


def steps(
    file: str,
    rec: Record | None,
    found: Informative | None,
    response: ImpulseResponse | None,
    findings: Sequence[Note],
    ways: Mapping[str, Any],
) -> tuple[str, ...]:
    """Return what to do next, in the order in which it is done.

    Parameters
    ----------
    file : str
        Its name.
    rec : Record or None
        The record, where there is one.
    found : Informative or None
        Its stretches, where they were searched.
    response : ImpulseResponse or None
        Its impulse response.
    findings : sequence of Note
        All that was found.
    ways : mapping
        Options of `read` behind which the record was made.
    """
    codes = {note.code for note in findings if note.severity == "error"}
    if rec is None:
        named = not codes
        what = "Name its input and its output, and look again: "
        command = f"`plantune inspect {file} --u COLUMN --y COLUMN`"
        repair = "Mend what is said below, then look again."
        return (f"{what}{command}" if named else repair,)
    todo = []
    typed = [_AS_TYPED.get(way) or f"--{way[0]} {way[1]:g}" for way in ways.items()]
    repairs = [text for text, name in zip(typed, ways, strict=True) if name != "Ts"]
    if repairs:
        todo.append(f"Read it with `{' '.join(repairs)}`, as this look has done.")
    if not _says_enough(found, response):
        todo.append(
            "Record an experiment: these rows do not say enough of gain, time constant and delay. "
            "`plantune design` plans one from a rough K, T and L."
        )
        return tuple(todo)
    rows, between = _best_rows(rec, found)
    if between:
        todo.append(f"Take the rows that say most: {rows}.")
        typed.append(between)
    if any(note.code == "X09" for note in findings):
        todo.append(
            "The loop is closed: take a model with a model of the noise, "
            '`process(rec, noise="arma")`, `armax` or `bj`.'
        )
    if rec.nu > 1 or rec.ny > 1:
        todo.append(
            "Identify: `estimate.subspace`, or `estimate.arx` and `oe` output by output; the main "
            "job takes one input and one output."
        )
        return tuple(todo)
    columns = f"--u {rec.u_names[0]} --y {rec.y_names[0]}"
    todo.append(f"Identify and tune: `{' '.join(['plantune tune', file, columns, *typed])}`")
    return tuple(todo)


def _says_enough(found: Informative | None, response: ImpulseResponse | None) -> bool:
    """Whether a stretch can be identified, or the gain of an input is told without a model."""
    if found is not None and found.identifiable:
        return True
    if response is None:
        return False
    gains, sds = np.atleast_1d(response.gain), np.atleast_1d(response.gain_sd)
    return bool((sds < _TOLD * np.abs(gains)).any())


def _best_rows(rec: Record, found: Informative | None) -> tuple[str, str]:
    """Say which stretch is the best, and how it is typed; nothing where that is all rows."""
    if found is None or not found.identifiable:
        return "", ""
    best = found.identifiable[0]
    if best.rows.stop - best.rows.start > rec.N // 2:
        return "", ""
    rows = f"{best.rows.stop - best.rows.start} rows from {best.start:g} to {best.end:g} s"
    return rows, f"--between {best.start:g} {best.end + rec.Ts:g}"
