"""A look into files before anything is decided: columns, stamps, record, all that is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

from plantune.analyze import (
    DelayEvidence,
    ImpulseResponse,
    Informative,
    InputExcitation,
    NoiseReport,
)
from plantune.errors import PlantuneError
from plantune.inspection.files import FileSeen, file_seen
from plantune.inspection.look import NOTHING, look
from plantune.inspection.steps import steps
from plantune.io import read
from plantune.io.draft import Names
from plantune.io.several import joined, names_of
from plantune.models import FrequencyResponse
from plantune.notes import DEFAULT_LIMITS, Limits, Note, merged, note_of
from plantune.record import Record


@dataclass(frozen=True, slots=True, eq=False)
class Inspection(FileSeen):
    r"""What was seen in a file, or in several that make one record.

    Attributes
    ----------
    name : str
        Of the first file.
    columns : tuple of ColumnSeen
        Every column of it.
    stamps : Stamps or None
        Its time stamps, where there are some that can be read.
    record : Record or None
        The record that these columns make, where they make one.
    part : Record or None
        What noise, responses and delays are those of: the record, or its best stretch where that
        is less than half of it.
    excitation : mapping of name to InputExcitation
        How each input moves, and how many parameters of a linear model it supports.
    noise : mapping of name to NoiseReport
        Of each output.
    response : FrequencyResponse or None
        With coherence and bands.
    impulse : ImpulseResponse or None
        Of the first output.
    delay : mapping of name to DelayEvidence
        From each input, where there is one output.
    informative : Informative or None
        Stretches in which the input drives the output, ranked by what they say of it.
    steps : tuple of str
        What to do next, in the order in which it is done.
    findings : tuple of Note
        All that is wrong or in doubt; severity "error" for what every other verb refuses.
    others : tuple of FileSeen
        The further files.

    Examples
    --------
    >>> import plantune as pt
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "heater.csv"
    ...     _ = path.write_text("time,power [V],temp\n0.0,1,20.0\n0.5,2,\n1.0,2,21.0\n")
    ...     seen = pt.inspect(path, u="power", y="temp")
    >>> [(c.name, c.unit, c.holds, c.values, c.high) for c in seen.columns]
    [('time', '', 'stamps', 3, 1.0), ('power', 'V', 'numbers', 3, 2.0),
     ('temp', '', 'numbers', 2, 21.0)]
    >>> seen.stamps.step, [(note.code, note.severity) for note in seen.findings][0]
    (0.5, ('D07', 'error'))
    """

    record: Record | None
    part: Record | None
    excitation: Mapping[str, InputExcitation]
    noise: Mapping[str, NoiseReport]
    response: FrequencyResponse | None
    impulse: ImpulseResponse | None
    delay: Mapping[str, DelayEvidence]
    informative: Informative | None
    steps: tuple[str, ...]
    findings: tuple[Note, ...]
    others: tuple[FileSeen, ...] = ()

    def __bool__(self) -> bool:
        return all(note.severity != "error" for note in self.findings)


def inspect(
    path: str | PathLike[str] | Sequence[str | PathLike[str]],
    u: Names = None,
    y: Names = None,
    Ts: float | None = None,
    *,
    time: Names = None,
    between: tuple[float, float] | None = None,
    limits: Limits | None = None,
    **options: Any,
) -> Inspection:
    r"""List the columns of files and, given inputs and outputs, all that is wrong with them.

    Nothing readable is refused: a refusal of `read` is a finding, and where one has a usual way
    on (missing values, ragged rows, stamps that go back or are not uniform) the look goes on behind
    it.  Without `u` and `y` nothing is guessed about which column is which.

    Parameters
    ----------
    path : path, or a list of paths
        As for `read`.
    u, y, Ts, time, limits, **options
        As for `read`.
    between : (start, stop), optional
        Times in seconds; only rows between them are looked at.

    Returns
    -------
    Inspection

    Raises
    ------
    UsageError
        There is no such file (U01).

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "still.csv"
    ...     rows = "".join(f"3.5,{20 + k % 7}\n" for k in range(200))
    ...     _ = path.write_text("power,temp\n" + rows)
    ...     seen = inspect(path, u="power", y="temp", Ts=1.0)
    >>> [note.code for note in seen.findings], seen.excitation["power"].order
    (['X01'], 0)
    """
    paths = [path] if isinstance(path, str | PathLike) else list(path)
    names = names_of(paths)
    limits = limits or DEFAULT_LIMITS
    options = {**options, "u": u, "y": y, "Ts": Ts, "time": time, "limits": limits}
    found: list[list[Note]] = [[] for _ in paths]
    every = list(zip(paths, names, found, strict=True))
    files = [file_seen(path, name, time, limits, notes) for path, name, notes in every]
    records: list[Record | None] = []
    ways: dict[str, Any] = {}
    if not (u is None and y is None):
        step = files[0].stamps.step if files[0].stamps else 0.0
        seen = (here for here, file in zip(every, files, strict=True) if file.columns)
        records = [_record(path, options, step, notes, ways) for path, _, notes in seen]
    given = {} if Ts is None else {"Ts": Ts}
    findings = list(merged(list(zip(names, found, strict=True))))
    rec = _whole(records, names, findings)
    if rec is not None and between is not None:
        rec = rec.between(*between)
    shown = NOTHING if rec is None else look(rec, limits, findings)
    return Inspection(
        name=files[0].name,
        columns=files[0].columns,
        stamps=files[0].stamps,
        record=rec,
        **shown,
        steps=steps(
            files[0].name, rec, shown["informative"], shown["impulse"], findings, ways | given
        ),
        findings=tuple(dict.fromkeys(findings)),
        others=tuple(files[1:]),
    )


def _record(
    path: str | PathLike[str],
    options: dict[str, Any],
    step: float,
    findings: list[Note],
    taken: dict[str, Any],
) -> Record | None:
    """Read the record of a file; behind a refusal with a usual way on, take it and go on."""
    ways: dict[str, dict[str, Any]] = {
        "D05": {"ragged": "skip"},
        "D07": {"missing": "segments"},
        "D13": {"sort": True},
        "D15, compressed": {"compressed": "keep"},
    }
    if step > 0:
        ways["D15"] = {"resample": step}
    while True:
        try:
            return read(path, **options)
        except PlantuneError as error:
            findings[:] = [*(n for n in findings if n.code != error.code), note_of(error)]
            way = _way(error, ways)
            if way is None:
                return None
            taken |= way
            options = {**options, **way}


def _way(error: PlantuneError, ways: dict[str, dict[str, Any]]) -> dict[str, Any] | None:
    """Take the way on behind a refusal, each once."""
    if error.code == "D15" and "compressed" in error.text:
        return ways.pop("D15, compressed", None)
    return ways.pop(error.code, None)


def _whole(
    records: Sequence[Record | None], names: Sequence[str], findings: list[Note]
) -> Record | None:
    """Return the record of all files, where each of them makes one."""
    parts = [rec for rec in records if rec is not None]
    if not parts or len(parts) < len(names):
        return None
    if len(parts) == 1:
        return parts[0]
    try:
        return joined(parts, names)
    except PlantuneError as error:
        findings.append(note_of(error))
        return None
