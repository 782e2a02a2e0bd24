"""Whether the record was taken in closed loop."""

from __future__ import annotations

from dataclasses import dataclass

from plantune import _core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, Where
from plantune.record import Record

_CHANCE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class ClosedLoop:
    """Whether inputs answer the output; true where one does.

    Attributes
    ----------
    p : tuple of float
        Chance that an open loop looks as closed as this, per input.
    notes : tuple of Note
        X09 per input that answers.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> bool(pt.validate.closed_loop(pt.datasets.hair_dryer()))
    False
    """

    p: tuple[float, ...]
    notes: tuple[Note, ...]
    source: str

    def __bool__(self) -> bool:
        return bool(self.notes)

    def __str__(self) -> str:
        word = "closed loop" if self else "no feedback seen"
        p = ", ".join(f"{p:.2g}" for p in self.p)
        return "\n".join([f"{word}: p = {p}", *(f"  {note}" for note in self.notes)])


def closed_loop(rec: Record, *, direct: bool = False, limits: Limits | None = None) -> ClosedLoop:
    """Test whether an input answers the errors of the output.

    Parameters
    ----------
    rec : Record
        One output; at least four rows per lag of an ARX(10, 10).
    direct : bool
        Whether y answers u in the same row (`nk = 0`).  Only answers of u to earlier rows are then
        feedback.
    limits : Limits, optional
        Thresholds of the record.

    Returns
    -------
    ClosedLoop
        True where some input follows errors of y with p < 0.001.

    Notes
    -----
    u(t) is regressed on its past and on e(t), e(t-1), e(t-2), the errors of ARX(10, 10), under
    Huber's weights so that moves of the set point do not hide the answer.  An input of few levels
    whose steps are rare answers nothing.  Source 001, 3.5.6; Caines and Chan 1975.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5)
    >>> found = closed_loop(rec)
    >>> bool(found), [note.code for note in found.notes]
    (True, ['X09'])
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    p = tuple(_core.p_of_feedback(rec, direct, limits)) if rec.ny == 1 else (1.0,) * rec.nu
    notes = (_note(rec.u_names[i], chance) for i, chance in enumerate(p) if chance < _CHANCE)
    return ClosedLoop(p=p, notes=tuple(notes), source=rec.source)


def _note(name: str, p: float) -> Note:
    return Note(
        code="X09",
        severity="warning",
        text=f"feedback detected: {name} answers errors of the output; output-error and process "
        "models are biased by it",
        where=Where(name, None, None),
        measured=p,
        limit=_CHANCE,
        remedy="take ARMAX or BJ, whose noise model takes up the feedback",
    )
