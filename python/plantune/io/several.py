"""Several files as segments of one record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Final

import numpy as np

from plantune.errors import PlantuneError, refusal, reworded
from plantune.record import Record

_SAME_STEP: Final = 1e-4
"""Share by which sample times taken from stamps may differ; they are rounded decimals."""


def joined(records: Sequence[Record], files: Sequence[str]) -> Record:
    """Return records of the same columns as segments of one; rows count on from file to file.

    Parameters
    ----------
    records : sequence of Record
        One per file, in the order wanted.
    files : sequence of str
        Their names, for the log and for refusals.
    """
    first = records[0]
    offsets = np.cumsum([0, *(int(rec.rows.max()) + 1 for rec in records)])
    parts, log = [], []
    for rec, file, offset in zip(records, files, offsets.tolist(), strict=False):
        _refuse_difference(first, files[0], rec, file)
        rows = rec.rows + offset
        log.append(f"{file}: rows {rows.min()} to {rows.max()}, {rec.N} kept, Ts {rec.Ts:.9g} s")
        log += [f"{file}: {said}" for said in rec.log]
        notes = tuple(replace(note, text=f"{file}: {note.text}") for note in rec.notes)
        parts.append(replace(rec, rows=rows, Ts=first.Ts, notes=notes, source=""))
    return replace(Record.join(parts), log=tuple(log))


def names_of(paths: Sequence[str | PathLike[str]]) -> list[str]:
    """Return the names of several files, with their folders where two have one name."""
    if not paths:
        raise refusal("U01", "`path` is an empty list", remedy="name at least one file")
    files = [Path(path).name for path in paths]
    return files if len(set(files)) == len(files) else [str(path) for path in paths]


def named(error: PlantuneError, file: str) -> PlantuneError:
    """Return a refusal that says in which of several files it was."""
    return reworded(error, f"{file}: {error.text}")


def _refuse_difference(first: Record, first_file: str, rec: Record, file: str) -> None:
    for what, one, other in (
        ("inputs", first.u_names, rec.u_names),
        ("outputs", first.y_names, rec.y_names),
        ("further columns", tuple(first.aux), tuple(rec.aux)),
        ("units", dict(first.units), dict(rec.units)),
    ):
        if one != other:
            raise refusal(
                "U01",
                f"{file} differs from {first_file} in its {what}: {_listed(other)} "
                f"instead of {_listed(one)}",
                remedy="bring the headers to the same names and units, or read the files apart",
            )
    if abs(rec.Ts / first.Ts - 1) > _SAME_STEP:
        raise refusal(
            "U01",
            f"{file} differs from {first_file} in its sample time: {rec.Ts:.6g} s instead of "
            f"{first.Ts:.6g} s",
            measured=abs(rec.Ts / first.Ts - 1),
            limit=_SAME_STEP,
            remedy=f"bring both to one step: resample={first.Ts:.4g}",
        )


def _listed(names: object) -> str:
    if isinstance(names, dict):
        return ", ".join(f"{name} [{unit}]" for name, unit in names.items()) or "none"
    return ", ".join(names) if isinstance(names, tuple) and names else "none"
