"""What a record shows before any model: one analysis after the other, each where it can be done."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final, TypeVar

from plantune.analyze import (
    Informative,
    delay_evidence,
    excitation,
    health,
    impulse,
    informative,
    noise,
    spa,
)
from plantune.errors import PlantuneError
from plantune.notes import Limits, Note, note_of
from plantune.record import Record

NOTHING: Final[dict[str, Any]] = {
    "part": None,
    "excitation": {},
    "noise": {},
    "response": None,
    "impulse": None,
    "delay": {},
    "informative": None,
}
"""Of no record."""

_MOST_DELAY: Final = 20
_TAPS: Final = 60
_MOST_ROWS: Final = 20_000
"""Of the part that is looked at closely."""

Found = TypeVar("Found")


def look(rec: Record, limits: Limits, findings: list[Note]) -> dict[str, Any]:
    """Return the analyses of a record by the names they have in `Inspection`; add what they find.

    Stretches are searched where there is one input; where the best is less than half of the
    record, noise, responses and delay are those of it alone.  The delay is weighed for records of
    one output, the impulse response is that of the first output.
    """
    findings += [*rec.notes, *health(rec, limits).notes]

    def found(analysis: Callable[[], Found], but: tuple[str, ...] = ()) -> Found | None:
        try:
            result = analysis()
        except PlantuneError as error:
            findings.append(note_of(error))
            return None
        notes = (note for note in result.notes if note.code not in but)  # type: ignore[attr-defined]
        findings.extend(_new(notes, findings))
        return result

    moves = excitation(rec, limits)
    findings.extend(_new(moves.notes, findings))
    moved = any(each.order > 0 for each in moves.inputs)
    # What it finds nowhere, or closed, is asked again of the part that is looked at closely.
    stretches = (
        found(lambda: informative(rec, limits=limits), but=("X02", "X09"))
        if moved and rec.nu == 1
        else None
    )
    part = _part(rec, stretches)
    nk = (0, max(1, min(_MOST_DELAY, part.N // 4)))
    taps = min(_TAPS, part.N // (4 * rec.nu)) if moved else 0
    outputs = [
        (name, found(lambda y=name: noise(part, y, limits=limits), but=("X03", "X04")))  # type: ignore[misc]
        for name in rec.y_names
    ]  # a record that moves shows its response too: no fault of it
    delays = [
        (name, found(lambda i=i: delay_evidence(part, nk, input=i, limits=limits)))  # type: ignore[misc]
        for i, name in enumerate(rec.u_names if moved and rec.ny == 1 else ())
    ]
    first = rec.y_names[0]
    return {
        "part": part,
        "excitation": {each.name: each for each in moves.inputs},
        "noise": _there(outputs),
        "response": found(lambda: spa(part, limits=limits)) if moved else None,
        "impulse": found(lambda: impulse(part, taps, output=first, limits=limits))
        if taps
        else None,
        "delay": _there(delays),
        "informative": stretches,
    }


def _part(rec: Record, found: Informative | None) -> Record:
    """Return the best stretch of a record that says most there, and of a long one the beginning."""
    if found is not None and found.identifiable:
        best = found.identifiable[0].rows
        if best.stop - best.start <= rec.N // 2:
            rec = rec.take(best)
    return rec if rec.N <= _MOST_ROWS else rec.take(slice(0, _MOST_ROWS))


def _new(notes: Iterable[Note], findings: list[Note]) -> list[Note]:
    """Return the notes that no refusal has said already."""
    refused = {note.code for note in findings if note.severity == "error"}
    return [note for note in notes if note.code not in refused]


def _there(pairs: list[tuple[str, Found | None]]) -> dict[str, Found]:
    return {name: found for name, found in pairs if found is not None}
