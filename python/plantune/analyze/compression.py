"""Whether a historian has compressed an output, and filled it again."""

from __future__ import annotations

from dataclasses import dataclass

from plantune import _core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Record


@dataclass(frozen=True, slots=True)
class OutputCompression:
    """What one output shows.

    Attributes
    ----------
    name : str
        Of the output.
    repeated, in_line : float
        Share of rows that repeat the one before, after a real move; and of those in exact line with
        their neighbours, on a slope.
    step : float or None
        Step in which it is read, where there is one.
    refilled : "line", "hold" or None
        How it was filled again; None where it was not compressed.

    Examples
    --------
    >>> import plantune as pt
    >>> output = pt.analyze.compression(pt.datasets.hair_dryer()).outputs[0]
    >>> output.name, output.in_line < 0.01, output.step
    ('temp', True, None)
    """

    name: str
    repeated: float
    in_line: float
    step: float | None
    refilled: str | None


@dataclass(frozen=True, slots=True, eq=False)
class Compression:
    """What the outputs of a record show of a historian's compression; true where there is none.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.analyze.compression(pt.datasets.hair_dryer())
    >>> bool(found), found.outputs[0].refilled
    (True, None)
    """

    outputs: tuple[OutputCompression, ...]
    notes: tuple[Note, ...]
    source: str

    def __bool__(self) -> bool:
        return all(output.refilled is None for output in self.outputs)

    def __str__(self) -> str:
        said = {"line": "compressed, filled by lines", "hold": "compressed, held"}
        lines = (f"{o.name}: {said.get(o.refilled or '', 'as measured')}" for o in self.outputs)
        return "\n".join(lines)


def compression(rec: Record, limits: Limits | None = None) -> Compression:
    """Look for outputs that a historian has thinned out and filled again on their old grid (D15).

    Exception reporting leaves held values, swinging doors leave straight lines; measured noise
    leaves neither.  Dynamics faster than these stretches are lost, so that T and L of a model are
    those of the compression.  Inputs are not looked at: a controller rests and ramps by itself.

    Parameters
    ----------
    rec : Record
        Any number of outputs.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Compression

    Notes
    -----
    Of 900 raw, quantised, rounded or printed signals none is taken for compressed; of 1800
    compressed ones 1795 are found.  Bristol 1990; METHODS 8, pitfall 7.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> y = np.random.default_rng(1).normal(size=2000).cumsum()
    >>> kept = np.arange(0, 2000, 7)
    >>> thin = np.interp(np.arange(2000), kept, y[kept])
    >>> found = compression(pt.Record(u=y, y=thin, Ts=1.0))
    >>> found.outputs[0].refilled, found.notes[0].code
    ('line', 'D15')
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    outputs, notes = _core.compression(rec, True, limits)
    return Compression(
        outputs=tuple(
            OutputCompression(name=name, **d) for name, d in zip(rec.y_names, outputs, strict=True)
        ),
        notes=(*notes_from_core(notes), *limits.changes()),
        source=rec.source,
    )
