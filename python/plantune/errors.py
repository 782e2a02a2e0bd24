"""Refusals, one class per exit code; every one carries its evidence.

::

    PlantuneError
    ├── UsageError        U01            wrong argument                 exit 2
    ├── DataError         D01 … D20      the data are wrong             exit 2
    ├── NotIdentifiable   X.., M..       the data do not support it     exit 3
    ├── NumericsError     N..            the numbers cannot be trusted  exit 4
    └── RunError          R.., C..       a running service              exit 5
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


class PlantuneError(Exception):
    """A refusal that says what is wrong, where, how much, and what to do.

    Attributes
    ----------
    text, code : str
        What is wrong; its row in the catalogue of bad inputs, such as `D07`.
    where : tuple or None
        Column, row and time in seconds of the first place.
    count : int or None
        How many rows or places.
    measured, limit : float or None
        The number that decided, and what it was compared with.
    remedy : str
        What to do.
    result : object
        A partial result that may be studied, or None.
    notes : tuple of Note
        Doubts found on the way to the refusal, which may be its cause.  A traceback shows them
        under the message (from Python 3.11 on), and so does the command line.

    Examples
    --------
    >>> import plantune as pt
    >>> try:
    ...     pt.Record(u=[1, 2, 3], y=[1.0, float("nan"), 3.0], Ts=0.1)
    ... except pt.PlantuneError as error:
    ...     print(error.code, error.where, error.count, error.exit_code)
    D07 ('y', 1, 0.1) 1 2
    """

    exit_code = 1

    def __init__(
        self,
        text: str,
        *,
        code: str,
        where: tuple[str, int | None, float | None] | None = None,
        count: int | None = None,
        measured: float | None = None,
        limit: float | None = None,
        remedy: str = "",
        result: Any = None,
        notes: Iterable[Any] = (),
    ) -> None:
        super().__init__(text)
        self.text = text
        self.code = code
        self.where = where
        self.count = count
        self.measured = measured
        self.limit = limit
        self.remedy = remedy
        self.result = result
        self.notes = notes

    @property
    def notes(self) -> tuple[Any, ...]:
        """Doubts found on the way to the refusal; a traceback shows them under the message."""
        return self._notes

    @notes.setter
    def notes(self, notes: Iterable[Any]) -> None:
        self._notes = tuple(notes)
        self.__notes__ = [f"found before: {note}" for note in self._notes]

    def __str__(self) -> str:
        """At most three lines: what; where, how many, measured against which limit; what to do."""
        lines = [f"{self.code}: {self.text}", evidence(self), f"do: {self.remedy}"]
        return "\n".join(line for line in lines if line and line != "do: ")

    def __reduce__(self) -> Any:
        fields = {"code": self.code, **fields_of(self), "result": self.result, "notes": self.notes}
        return _restore, (type(self), self.text, fields)


class UsageError(PlantuneError, ValueError):
    """A wrong argument (U01).

    Examples
    --------
    >>> import plantune as pt
    >>> try:
    ...     pt.models.PID(Kp=1.0, Ti=-2.0)
    ... except pt.UsageError as error:
    ...     print(error.text)
    `Ti` is -2.0, must be positive, or inf
    """

    exit_code = 2


class DataError(PlantuneError, ValueError):
    """The data are wrong (D01 to D20).

    Examples
    --------
    >>> import plantune as pt
    >>> try:
    ...     pt.Record(u=[0, 1, 1], y=[0.0, 0.5], Ts=0.1)
    ... except pt.DataError as error:
    ...     print(error.code, error.text)
    D09 u has 3 rows and y has 2
    """

    exit_code = 2


class NotIdentifiable(PlantuneError):  # noqa: N818 - the name says what is wrong
    """The data do not support what was asked (X and M codes).

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.Record(u=[5.0] * 100, y=range(100), Ts=0.1)
    >>> try:
    ...     pt.estimate.arx(rec, 1, 1)
    ... except pt.NotIdentifiable as error:
    ...     print(error.code, error.text)
    X01 not exciting: u stays at 5 from 0 s to 9.9 s
    """

    exit_code = 3


class NumericsError(PlantuneError, ArithmeticError):
    """The numbers cannot be trusted (N codes).

    Examples
    --------
    >>> import plantune as pt
    >>> issubclass(pt.NumericsError, ArithmeticError), pt.NumericsError.exit_code
    (True, 4)
    """

    exit_code = 4


class RunError(PlantuneError):
    """A running service cannot go on (R and C codes).

    Examples
    --------
    >>> import plantune as pt
    >>> issubclass(pt.RunError, pt.PlantuneError), pt.RunError.exit_code
    (True, 5)
    """

    exit_code = 5


_CLASSES = {
    "U": UsageError,
    "D": DataError,
    "X": NotIdentifiable,
    "M": NotIdentifiable,
    "N": NumericsError,
    "R": RunError,
    "C": RunError,
}


def refusal(code: str, text: str, **evidence: Any) -> PlantuneError:
    """Return the exception for a code, its class picked by the code's first letter."""
    return _CLASSES[code[0]](text, code=code, **evidence)


def from_core(note: dict[str, Any], result: Any = None) -> PlantuneError:
    """Return the exception for a refusal of the core."""
    note = dict(note)
    del note["severity"]
    return refusal(note.pop("code"), note.pop("text"), result=result, **note)


def from_note(note: Any, result: Any = None) -> PlantuneError:
    """Return the exception for a note of severity "error"."""
    return refusal(note.code, note.text, result=result, **fields_of(note))


def reworded(error: PlantuneError, text: str, **changed: Any) -> PlantuneError:
    """Return the same refusal in other words, with some of its fields changed."""
    return refusal(error.code, text, **{**fields_of(error), **changed})


def fields_of(finding: Any) -> dict[str, Any]:
    """Return what a refusal or a note holds beside its code and its text."""
    names = ("where", "count", "measured", "limit", "remedy")
    return {name: getattr(finding, name) for name in names}


def evidence(finding: Any) -> str:
    """Return where, how many and measured against which limit, as one line."""
    parts = []
    if finding.where is not None:
        column, row, time = finding.where
        at = [column] if column else []
        if row is not None:
            at.append(f"row {row}")
        if time is not None:
            at.append(f"{time:.6g} s")
        parts.append("at " + ", ".join(at))
    if finding.count is not None:
        parts.append(f"count {finding.count}")
    if finding.measured is not None:
        parts.append(f"measured {finding.measured:.4g}, limit {finding.limit:.4g}")
    return "; ".join(parts)


def _restore(kind: type[PlantuneError], text: str, fields: dict[str, Any]) -> PlantuneError:
    return kind(text, **fields)
