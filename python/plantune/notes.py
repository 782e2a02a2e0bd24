"""What the data leave in doubt, and the thresholds that decide it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

from plantune import _core
from plantune.errors import PlantuneError, evidence, fields_of, refusal


class Where(NamedTuple):
    """A place: column, first row in the original file, its time in seconds."""

    column: str
    row: int | None
    time: float | None


@dataclass(frozen=True, slots=True)
class Note:
    """A doubt or remark inside a result.

    Examples
    --------
    >>> note = Note(code="X03", severity="warning", text="few rows", remedy="record longer")
    >>> print(note)
    X03 few rows - record longer
    """

    code: str
    severity: str
    text: str
    where: Where | None = None
    count: int | None = None
    measured: float | None = None
    limit: float | None = None
    remedy: str = ""

    def __str__(self) -> str:
        tail = f" - {self.remedy}" if self.remedy else ""
        return f"{self.code} {self.text}{tail}"

    @property
    def evidence(self) -> str:
        """Where, how many, and measured against which limit, as one line."""
        return evidence(self)


def notes_from_core(notes: Iterable[Mapping[str, Any]]) -> tuple[Note, ...]:
    """Return the notes that the core sends as dicts."""
    return tuple(
        Note(**{**note, "where": Where(*note["where"]) if note["where"] else None})
        for note in notes
    )


def note_of(error: PlantuneError, severity: str = "error", text: str = "") -> Note:
    """Return a refusal as a note; a warning where other results stand beside it."""
    fields = fields_of(error)
    if error.where is not None:
        fields["where"] = Where(*error.where)
    return Note(code=error.code, severity=severity, text=text or error.text, **fields)


def merged(named: Sequence[tuple[str, Sequence[Note]]]) -> tuple[Note, ...]:
    """Return the notes that all share once, then the others with the name they speak of."""
    common = [note for note in named[0][1] if all(note in notes for _, notes in named)]
    own = [
        replace(note, text=f"{name}: {note.text}")
        for name, notes in named
        for note in notes
        if note not in common
    ]
    return (*common, *own)


_DEFAULT = _core.default_limits()


@dataclass(frozen=True, slots=True)
class Limits:
    """The thresholds behind every warning and refusal, one per code.

    A changed threshold leaves a note in every result it was used for.

    Examples
    --------
    >>> Limits(X02=1e-6).changes()[0].text
    'limit X02 is 1e-06 instead of 1e-05'
    """

    D07: float = _DEFAULT["D07"]
    """Largest share of rows that may be missing under a gap policy."""
    D08: float = _DEFAULT["D08"]
    """Largest finite magnitude."""
    D15: float = _DEFAULT["D15"]
    """Largest deviation of a time step, as a share of the step."""
    D18: float = _DEFAULT["D18"]
    """Share of the record that an output may stand still while an input moves."""
    D19: float = _DEFAULT["D19"]
    """Least size of a spike, in robust standard deviations."""
    X01: float = _DEFAULT["X01"]
    """Least input travel relative to the input's largest magnitude."""
    X02: float = _DEFAULT["X02"]
    """Least ratio of singular values of the input's Hankel matrix."""
    X03: float = _DEFAULT["X03"]
    """Rows per parameter below which intervals are doubtful."""
    X04: float = _DEFAULT["X04"]
    """Largest p-value at which a model counts as related to the data."""
    X05: float = _DEFAULT["X05"]
    """Largest delay as a share of the record."""
    X06: float = _DEFAULT["X06"]
    """Least relative loss difference between the best two delays."""
    X07: float = _DEFAULT["X07"]
    """Share of its final value that a response must reach to tell gain and time constant."""
    X08: float = _DEFAULT["X08"]
    """Least ratio of singular values of a record's regressor."""
    X10: float = _DEFAULT["X10"]
    """Distance in z below which a pole and a zero cancel, whatever their uncertainty."""
    N03: float = _DEFAULT["N03"]
    """Factor by which a value may lie outside of its declared range."""
    F02: float = _DEFAULT["F02"]
    """Most that a filter may remember of an unknown start, as a share of what it changed."""
    M03: float = _DEFAULT["M03"]
    """Share of the rows at which an input may lie at a limit of its actuator."""
    M03_most: float = _DEFAULT["M03_most"]
    """Largest share of the rows that may be left out as saturated or stuck."""
    M04: float = _DEFAULT["M04"]
    """Largest resolution of an output as a share of its response."""
    M05: float = _DEFAULT["M05"]
    """Least share of what a linear model leaves that a dead band must explain."""
    M06: float = _DEFAULT["M06"]
    """Least share of it that the turning points of the input must explain."""
    M09: float = _DEFAULT["M09"]
    """Largest sample time as a share of the time constant."""
    V01: float = _DEFAULT["V01"]
    """Least simulation fit, in percent, for a verdict to pass."""
    V03: float = _DEFAULT["V03"]
    """Fit in percent by which a polynomial model may be better than a process model."""
    V04: float = _DEFAULT["V04"]
    """Samples by which the delays of the two may differ, beside their uncertainty."""
    V06: float = _DEFAULT["V06"]
    """Least first sample of a step response the wrong way, as a share of the final value."""
    V07: float = _DEFAULT["V07"]
    """Least magnitude of a pole with negative real part that counts."""
    V09: float = _DEFAULT["V09"]
    """Least relative difference of mean squared errors that counts between ways to smooth."""
    V10: float = _DEFAULT["V10"]
    """Fit in percent within which models simulate fresh rows equally well."""
    V11: float = _DEFAULT["V11"]
    """Standard deviations by which feedback may move gain or time constant of a process model."""
    V13: float = _DEFAULT["V13"]
    """Points of simulation fit that another level may cost before it is said."""
    V16: float = _DEFAULT["V16"]
    """Largest share of its size by which a step response may differ from that of the record."""
    X12: float = _DEFAULT["X12"]
    """Standard deviations that a process gain must be away from zero to be tuned on."""
    T04: float = _DEFAULT["T04"]
    """Share of the best model's integral gain that tuning over its uncertainty shall keep."""
    C07: float = _DEFAULT["C07"]
    """Least gain margin, as a factor, over the model's uncertainty."""
    C07_phase: float = _DEFAULT["C07_phase"]
    """Least phase margin there, degrees."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 < value < float("inf"):
                raise refusal(
                    "U01",
                    f"limit {field.name} is {value}, must be positive and finite",
                    where=(field.name, None, None),
                    remedy=f"{field.name}={_DEFAULT[field.name]:g} is the default",
                )

    def changes(self) -> tuple[Note, ...]:
        """Return one note per threshold that differs from its default."""
        if self is DEFAULT_LIMITS:
            return ()
        return tuple(
            Note(
                code=field.name.partition("_")[0],
                severity="info",
                text=f"limit {field.name} is {getattr(self, field.name):g} "
                f"instead of {_DEFAULT[field.name]:g}",
                measured=getattr(self, field.name),
                limit=_DEFAULT[field.name],
            )
            for field in fields(self)
            if getattr(self, field.name) != _DEFAULT[field.name]
        )

    def with_changes(self, changes: Mapping[str, float]) -> Limits:
        """Return these limits with some replaced, by code."""
        unknown = [code for code in changes if code not in _DEFAULT]
        if unknown:
            raise refusal(
                "U01",
                f"there is no limit {unknown[0]!r}",
                remedy="choose one of " + ", ".join(_DEFAULT),
            )
        return replace(self, **changes)


DEFAULT_LIMITS = Limits()
