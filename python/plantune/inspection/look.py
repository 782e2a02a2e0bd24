"""What a record shows before any model: one analysis after the other, each where it can be done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

from plantune import _core
from plantune.analyze import delay, health, impulse, informative
from plantune.errors import PlantuneError
from plantune.notes import Limits, Note, note_of
from plantune.record import Record

MOST_ORDER: Final = 8
"""Parameters up to which the excitation is looked at."""

_MOST_DELAY: Final = 20
_TAPS: Final = 60

Found = TypeVar("Found")


def look(rec: Record, limits: Limits, findings: list[Note]) -> dict[str, Any]:
    """Return the analyses of a record by the names they have in `Inspection`; add what they find.

    The delay is scanned for records of one output, an impulse response estimated of the first
    output; stretches are searched where there is one input.
    """
    findings += [*rec.notes, *health(rec, limits).notes]
    orders = _core.excitation_orders(rec, MOST_ORDER, limits)

    def found(analysis: Callable[[], Found]) -> Found | None:
        try:
            result = analysis()
        except PlantuneError as error:
            findings.append(note_of(error))
            return None
        refused = {note.code for note in findings if note.severity == "error"}
        findings.extend(n for n in result.notes if n.code not in refused)  # type: ignore[attr-defined]
        return result

    nk = (0, max(1, min(_MOST_DELAY, rec.N // 4)))
    scans = {
        name: found(lambda i=i: delay(rec, nk, input=i, limits=limits))  # type: ignore[misc]
        for i, name in enumerate(rec.u_names if rec.ny == 1 else ())
    }
    moved = any(orders)
    taps = min(_TAPS, rec.N // (4 * rec.nu))
    of_output = rec.y_names[0]
    return {
        "excitation": dict(zip(rec.u_names, orders, strict=True)),
        "delay": {name: scan for name, scan in scans.items() if scan is not None},
        "impulse": found(lambda: impulse(rec, taps, output=of_output, limits=limits))
        if moved and taps
        else None,
        "informative": found(lambda: informative(rec, limits=limits))
        if moved and rec.nu == 1
        else None,
    }
