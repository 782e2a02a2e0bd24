"""What the inputs of a record excite."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from plantune import _core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record
from plantune.text import counted, number


@dataclass(frozen=True, slots=True, eq=False)
class InputExcitation:
    """What one input does.

    Attributes
    ----------
    name : str
        Of the input.
    order : int
        Parameters of a linear model that its motion supports; `at_least` where more were not
        looked for.
    crest : float
        Largest deviation from the mean over the standard deviation: 1 of a PRBS.
    moves : int
        Rows at which it changes.
    hold, longest_hold : float
        Median and longest time between two moves, seconds.
    levels : tuple of (value, share)
        Values taken and the share of the rows at each; empty beyond a dozen.
    band : (low, high)
        Frequencies between which 90 % of its power lies, rad/s.
    w, P : array (n,)
        Its periodogram over the longest segment, rad/s and squared units per rad/s.
    advice : tuple of str
        What follows.
    notes : tuple of Note
        Doubts.
    """

    name: str
    order: int
    at_least: bool
    crest: float
    moves: int
    hold: float
    longest_hold: float
    levels: tuple[tuple[float, float], ...]
    band: tuple[float, float]
    w: Floats
    P: Floats
    advice: tuple[str, ...]
    notes: tuple[Note, ...]

    def __str__(self) -> str:
        order = f"{'at least ' if self.at_least else ''}{self.order}"
        low, high = (number(w, 3) for w in self.band)
        levels = f", {counted(len(self.levels), 'level')}" if self.levels else ""
        lines = [
            f"{self.name}: supports {order} parameters; {counted(self.moves, 'move')}{levels}, "
            f"held {number(self.hold, 3)} s (longest {number(self.longest_hold, 3)} s)",
            f"  crest factor {number(self.crest, 3)}, 90 % of the power from {low} to {high} rad/s",
        ]
        lines += [f"  advice: {line}" for line in self.advice]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


@dataclass(frozen=True, slots=True, eq=False)
class Excitation:
    """What every input excites.

    Attributes
    ----------
    inputs : tuple of InputExcitation
        In the order of the record; `excitation["power"]` is the one of that name.
    memory : float or None
        `T + L` in seconds by which the advice goes, where a quick model gives it.
    notes : tuple of Note
        Of all inputs.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.excitation(pt.datasets.hair_dryer()))
    power: supports at least 20 parameters
    """

    inputs: tuple[InputExcitation, ...]
    memory: float | None
    notes: tuple[Note, ...]
    source: str

    def __getitem__(self, name: str) -> InputExcitation:
        for one in self.inputs:
            if one.name == name:
                return one
        raise KeyError(name)

    def __iter__(self) -> Iterator[InputExcitation]:
        return iter(self.inputs)

    def __str__(self) -> str:
        return "\n".join(str(one) for one in self.inputs)


def excitation(rec: Record, limits: Limits | None = None) -> Excitation:
    """Say what each input excites: how many parameters, which frequencies, by how many moves.

    Parameters
    ----------
    rec : Record
        Segments are honoured.
    limits : Limits, optional
        Thresholds X01 and X02.

    Returns
    -------
    Excitation
        It never refuses: an input that stands still has note X01, one that supports fewer than
        three parameters X02.

    Notes
    -----
    The order is the rank of the centred, scaled Hankel matrix (Ljung 1999, 13.2), looked for up
    to 20.  Advice compares the clock with `T + L`: moves every 0.8 to 1.6 (T + L) show gain, lag
    and delay best.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> t = np.arange(500)
    >>> rec = pt.Record(u=np.sin(0.3 * t), y=np.sin(0.3 * t - 1.0), Ts=1.0)
    >>> one = excitation(rec)["u"]
    >>> one.order, [note.code for note in one.notes]
    (2, ['X02'])
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    found, memory = _core.excitation(rec, limits)
    inputs = tuple(map(_input, found))
    notes = tuple(note for one in inputs for note in one.notes)
    return Excitation(
        inputs=inputs, memory=memory, notes=(*notes, *limits.changes()), source=rec.source
    )


def _input(d: dict[str, Any]) -> InputExcitation:
    levels = tuple(tuple(level) for level in d["levels"])
    advice, notes = tuple(d["advice"]), notes_from_core(d["notes"])
    return InputExcitation(**{**d, "levels": levels, "advice": advice, "notes": notes})
