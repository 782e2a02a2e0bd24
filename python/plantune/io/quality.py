"""What a historian says of its values: Good, Uncertain or Bad (D17)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.draft import Draft
from plantune.io.table import Cells, Column, Places, short
from plantune.notes import Note, Where

BAD, UNCERTAIN, GOOD, _UNKNOWN = range(4)
Grades = NDArray[np.int8]

_WORDS: Final = {
    **dict.fromkeys(("good", "ok", "valid", "normal", "true"), GOOD),
    **dict.fromkeys(("uncertain", "questionable", "doubtful", "suspect"), UNCERTAIN),
    **dict.fromkeys(("substituted", "estimated"), UNCERTAIN),
    **dict.fromkeys(("bad", "invalid", "error", "fail", "failed", "fault", "false"), BAD),
    **dict.fromkeys(("offline", "no data", "nan", "na", "n/a", "null", "none", ""), BAD),
}
_BEGINNINGS: Final = ("good", "uncertain", "bad")  # of the names of OPC, as in `BadSensorFailure`
_CLASSIC: Final = ((0, 63, BAD), (64, 127, UNCERTAIN), (192, 255, GOOD))
_MOST_WORDS: Final = 10_000  # distinct; a column of more is no quality
_AT_ONCE: Final = 100_000  # rows
_UA: Final = np.array([GOOD, UNCERTAIN, BAD, _UNKNOWN], np.int8)  # by the top two of 32 bits


def graded(
    draft: Draft,
    quality: Mapping[int, int],
    columns: Sequence[Column],
    cells: Mapping[int, Cells],
    keep: bool,
) -> Draft:
    """Count values of quality Bad as missing, and Uncertain ones unless they are to be kept.

    Parameters
    ----------
    draft : Draft
        The rows.
    quality : mapping of int to int
        For each column of the draft that has one, the number of its quality column.
    columns : sequence of Column
        All columns of the file.
    cells : mapping of int to array
        The cells of the quality columns, by number.
    keep : bool
        Whether Uncertain values count.
    """
    x, notes, log, causes = draft.x.copy(), list(draft.notes), list(draft.log), list(draft.causes)
    known = {k: grades(cells[k], columns[k].title, draft.places) for k in set(quality.values())}
    fate = "kept" if keep else "dropped"
    for i, k in quality.items():
        name, grade = draft.names[i], known[k]
        bad, uncertain, good = (int(n) for n in np.bincount(grade, minlength=3)[:3])
        log.append(
            f"quality of `{name}` from {columns[k].title}: {good} Good, "
            f"{uncertain} Uncertain {fate}, {bad} Bad dropped"
        )
        x[grade < (UNCERTAIN if keep else GOOD), i] = np.nan
        if bad:
            causes.append(f"{name}: {bad} of quality Bad")
        if uncertain and not keep:
            causes.append(f"{name}: {uncertain} of quality Uncertain")
        if uncertain:
            notes.append(_doubt(draft, i, grade, fate))
    return replace(draft, x=x, notes=tuple(notes), log=tuple(log), causes=tuple(causes))


def grades(cells: Cells, title: str, places: Places) -> Grades:
    """Return the grade of each cell: words, OPC numbers 0 to 255, or OPC UA status codes."""
    if cells.dtype.kind == "M":
        raise _unknown(np.unique(cells.astype(str)), np.arange(len(cells)), title, places)
    if cells.dtype.kind == "S":
        words, which = _vocabulary(cells.astype(np.bytes_, copy=False), title, places)
        numbers = np.array([_number(word) for word in words])
        named = np.array([_of_word(word) for word in words], np.int8)
    else:
        numbers, which = np.unique(cells.astype(np.float64), return_inverse=True)
        words = [f"{number:g}" for number in numbers]
        named = np.where(np.isnan(numbers), BAD, _UNKNOWN).astype(np.int8)
    found = np.where(np.isnan(numbers), named, _of_numbers(numbers, title, places))
    grade = found.astype(np.int8)[which]
    unknown = np.flatnonzero(grade == _UNKNOWN)
    if len(unknown):
        raise _unknown([words[k] for k in which[unknown]], unknown, title, places)
    return grade


def _vocabulary(
    cells: NDArray[np.bytes_], title: str, places: Places
) -> tuple[list[str], NDArray[np.int64]]:
    """Return the distinct words, and for each cell the number of its word."""
    numbers: dict[bytes, int] = {}
    which = np.zeros(len(cells), np.int64)
    for start in range(0, len(cells), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        tokens, of_token = np.unique(np.char.strip(cells[part]), return_inverse=True)
        own = [numbers.setdefault(token, len(numbers)) for token in tokens.tolist()]
        which[part] = np.array(own)[of_token.ravel()]
        if len(numbers) > _MOST_WORDS:
            first = [token.decode("utf-8", "replace") for token in tokens.tolist()]
            raise _unknown(first, np.arange(start, start + len(tokens)), title, places)
    return [token.decode("utf-8", "replace") for token in numbers], which


def _of_word(word: str) -> int:
    lower = word.lower()
    if lower in _WORDS:
        return _WORDS[lower]
    return next((_WORDS[start] for start in _BEGINNINGS if lower.startswith(start)), _UNKNOWN)


def _number(word: str) -> float:
    """Return the number that a cell writes, hexadecimal too; NaN where it writes none."""
    try:
        return float(int(word, 16)) if word.lower().startswith("0x") else float(word)
    except ValueError:
        return np.nan


def _of_numbers(numbers: NDArray[np.float64], title: str, places: Places) -> Grades:
    """Return the grades of distinct numbers, all of OPC classic or all of OPC UA."""
    given = numbers[~np.isnan(numbers)]
    if len(given) and 0 <= given.min() and given.max() < _CLASSIC[1][0]:
        raise _two_readings(given, title, places)
    whole = np.isfinite(numbers) & (numbers == np.rint(numbers)) & (np.abs(numbers) < 2.0**32)
    codes = np.where(whole, numbers, 0).astype(np.int64)
    if np.abs(codes).max(initial=0) > 65535:
        return np.where(whole, _UA[(codes >> 30) & 3], _UNKNOWN).astype(np.int8)
    grade = np.full(len(codes), _UNKNOWN, np.int8)
    for low, high, meaning in _CLASSIC:
        grade[whole & (codes >= low) & (codes <= high)] = meaning
    return grade


def _doubt(draft: Draft, i: int, grade: Grades, fate: str) -> Note:
    uncertain = grade == UNCERTAIN
    where = draft.where(int(uncertain.argmax()), draft.names[i])
    return Note(
        code="D17",
        severity="warning",
        text=f"`{draft.names[i]}` is of quality Uncertain in {uncertain.sum()} of {draft.N} rows, "
        f"which are {fate}",
        where=Where(*where),
        count=int(uncertain.sum()),
        measured=float(uncertain.mean()),
        limit=0.0,
        remedy="find out why the source doubts them",
    )


def _two_readings(given: NDArray[np.float64], title: str, places: Places) -> PlantuneError:
    seen = ", ".join(f"{number:g}" for number in given[:5])
    return refusal(
        "D17",
        f"`{title}` holds {seen} only: all Bad as OPC numbers, while 0 is Good as an OPC UA code",
        where=(title, places.row(0), None),
        count=len(places),
        measured=float(given.max()),
        limit=float(_CLASSIC[1][0]),
        remedy="write Good, Uncertain, Bad; or leave quality= out where all rows are good",
    )


def _unknown(
    words: list[str] | NDArray[np.str_], rows: NDArray[np.intp], title: str, places: Places
) -> PlantuneError:
    counts = Counter(map(str, words))
    shown = ", ".join(f"{short(word)} {n}x" for word, n in counts.most_common(6))
    more = f" and {len(counts) - 6} others" if len(counts) > 6 else ""
    k = int(rows[0])
    return refusal(
        "D17",
        f"`{title}` holds {len(rows)} words that are no quality, "
        f"first in {places.said(k)}: {shown}{more}",
        where=(title, places.row(k), None),
        count=len(rows),
        measured=float(len(rows)),
        limit=0.0,
        remedy="write Good, Uncertain or Bad, or OPC's numbers",
    )
