"""What is wrong with a record before any model."""

from __future__ import annotations

from dataclasses import dataclass

from plantune import _core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Record


@dataclass(frozen=True, slots=True)
class Stretch:
    """Rows of the file, both ends included, on which a signal keeps one value."""

    signal: str
    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Spike:
    """A single sample off its surroundings, by `size` robust standard deviations."""

    signal: str
    row: int
    size: float


@dataclass(frozen=True, slots=True)
class Sentinel:
    """A number that stands for a missing value."""

    signal: str
    value: float
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class Health:
    """What was found; true where nothing forbids a model.

    Attributes
    ----------
    stuck : tuple of Stretch
        Outputs that stand still while an input moves.
    spikes : tuple of Spike
        Single samples of outputs far off both neighbours.
    sentinels : tuple of Sentinel
        Codes such as -9999, in inputs and outputs.
    saturated : tuple of Stretch
        Inputs that seem to lie at a limit of their actuator.
    notes : tuple of Note
        The same in words, with severity "error" where the record must not be fitted.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.analyze.health(pt.datasets.hair_dryer())
    >>> bool(found), found.stuck, found.spikes, found.sentinels
    (True, (), (), ())
    """

    stuck: tuple[Stretch, ...]
    spikes: tuple[Spike, ...]
    sentinels: tuple[Sentinel, ...]
    saturated: tuple[Stretch, ...]
    notes: tuple[Note, ...]
    source: str

    def __bool__(self) -> bool:
        return all(note.severity != "error" for note in self.notes)

    def __str__(self) -> str:
        counts = (
            (len(self.stuck), "stuck stretches"),
            (len(self.spikes), "spikes"),
            (len(self.sentinels), "sentinels"),
            (len(self.saturated), "stretches of an input at a limit"),
        )
        head = ", ".join(f"{n} {what}" for n, what in counts if n) or "nothing wrong"
        return "\n".join([head, *(f"  {note}" for note in self.notes)])


def health(rec: Record, limits: Limits | None = None) -> Health:
    """Look for signals that stand still, saturate, jump, or are read too coarsely.

    Parameters
    ----------
    rec : Record
        Any number of inputs and outputs; outputs that do not count are not looked at.
    limits : Limits, optional
        Thresholds D18, D19, M03 and M04.

    Returns
    -------
    Health
        It never refuses; the main job does, where a note has severity "error".

    Notes
    -----
    *Stuck* (D18): an output keeps its value for more than `max(50, D18 N)` rows after an input
    moved by a tenth of its travel; an error where at most the share D18 of the rows remains.
    *Spike* (D19): a sample lies more than D19 robust standard deviations of the second
    difference off the rows around it, and these lie on a smooth curve without it.
    *Sentinel* (D19, an error): a known code that lies further from all other values than these
    lie from each other.
    *Saturated* (M03): an input lies at an end of its travel in more than the share M03 of the rows,
    and five times as often as on any value in between; an error beyond the share `M03_most`.
    *Compressed* (D15): an output lies in exact line with its neighbours, or repeats itself between
    jumps, in more rows than a measurement does; `read` refuses it.
    *Quantised* (M04): the least step between two values of an output is more than the share M04 of
    its response; an error where it takes one value.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> y = rec.y[:, 0].copy()
    >>> y[700] = 20.0
    >>> print(health(pt.Record(u=rec.u, y=y, Ts=rec.Ts)).spikes[0].row)
    700
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    d = _core.health(rec, limits)
    return Health(
        stuck=tuple(Stretch(*s) for s in d["stuck"]),
        spikes=tuple(Spike(*s) for s in d["spikes"]),
        sentinels=tuple(Sentinel(*s) for s in d["sentinels"]),
        saturated=tuple(Stretch(*s) for s in d["saturated"]),
        notes=(*_unsaid(notes_from_core(d["notes"]), rec), *limits.changes()),
        source=rec.source,
    )


def _unsaid(notes: tuple[Note, ...], rec: Record) -> tuple[Note, ...]:
    """Leave out compression where reading the record has noted it."""
    said = any(note.code == "D15" for note in rec.notes)
    return tuple(note for note in notes if not (said and note.code == "D15"))
