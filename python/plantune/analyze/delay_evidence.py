"""Delay four ways, and which of them to trust."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.analyze.delay import DelayScan, checked_range, scan_from_core
from plantune.analyze.impulse import ImpulseResponse, impulse_from_core
from plantune.analyze.xcorr import Correlation, correlation_from_core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record


class Way(NamedTuple):
    """What one way says: its delay, how sure it is (None where it cannot tell), and a remark."""

    name: str
    nk: int | None
    weight: float | None
    remark: str


@dataclass(frozen=True, slots=True, eq=False)
class OEScan:
    """Delays tried with output-error models on signals whose noise is white.

    Attributes
    ----------
    candidates, loss, orders, weights : array (k,)
        Every delay; mean squared error of its best model, squared units of filtered y, infinite
        where none was found; the order of that model; how likely the delay is.
    N : int
        Rows on which all were compared.

    Examples
    --------
    >>> import plantune as pt
    >>> oe = pt.analyze.delay_evidence(pt.datasets.hair_dryer(), nk=(1, 5)).oe
    >>> oe.candidates.tolist(), oe.weights.round(2).tolist()
    ([1, 2, 3, 4, 5], [0.0, 0.0, 1.0, 0.0, 0.0])
    """

    candidates: NDArray[np.int64]
    loss: Floats
    orders: NDArray[np.int64]
    weights: Floats
    N: int


@dataclass(frozen=True, slots=True, eq=False)
class DelayEvidence:
    """What a record says about a delay, four ways.

    Attributes
    ----------
    nk : int
        The delay to use, samples.
    weight : float
        How likely it is, 0 to 1.
    likely : tuple of int
        All delays of more than 5 % weight.
    trusted : str
        The way that says so: "oe", or "impulse" where no output-error model was found.
    correlation : Correlation
        Raw and pre-whitened.
    arx : DelayScan
        Scan of ARX models.
    oe : OEScan
        Scan of output-error models.
    impulse : ImpulseResponse
        Its `delays` have `weights`; of several inputs they are those of `input`.
    input : int
        Which input.
    feedback : bool
        Whether u answers y, as in closed loop; 0 is then no delay.
    notes : tuple of Note
        X06 with the delays that are not told apart, X09 where u follows y, X05 at the end of
        the range.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.analyze.delay_evidence(pt.datasets.hair_dryer())
    >>> found.nk, found.likely, found.trusted
    (3, (3,), 'oe')
    """

    nk: int
    weight: float
    likely: tuple[int, ...]
    trusted: str
    correlation: Correlation
    arx: DelayScan
    oe: OEScan
    impulse: ImpulseResponse
    input: int
    feedback: bool
    notes: tuple[Note, ...]
    source: str

    @property
    def ways(self) -> tuple[Way, ...]:
        """What each way says, the most trusted one first."""
        r, h = self.correlation, self.impulse
        weights = h.weights if h.weights.ndim == 1 else h.weights[self.input]
        best = int(np.argmax(weights))
        slow = len(r.A) > 1
        oe = Way("OE scan", self.nk, self.weight, "white noise behind B/F: to be trusted")
        if self.trusted != "oe":
            oe = Way("OE scan", None, None, "no output-error model was found")
        return (
            oe,
            Way(
                "impulse response",
                int(h.delays[best]),
                float(weights[best]),
                "a tap early where the plant begins softly",
            ),
            Way("ARX scan", self.arx.nk, None, f"order {self.arx.order}; how sure, it cannot tell"),
            Way(
                "pre-whitened correlation",
                r.first,
                None,
                "u follows y: not to be trusted"
                if self.feedback
                else "first lag outside the band; noise makes it late",
            ),
            Way(
                "raw correlation",
                r.peak,
                None,
                "late by about the clock of u" if slow else "u is white: the peak of the response",
            ),
        )

    def __str__(self) -> str:
        others = ", ".join(str(nk) for nk in self.likely if nk != self.nk)
        head = f"nk = {self.nk}, weight {self.weight:.2f}" + (f" (or {others})" if others else "")
        rows = [
            f"  {way.name:<25}{'-' if way.nk is None else way.nk:>4}"
            f"{'' if way.weight is None else f'{way.weight:.2f}':>7}  {way.remark}"
            for way in self.ways
        ]
        return "\n".join([head, *rows, *(f"  {note}" for note in self.notes)])


def delay_evidence(
    rec: Record,
    nk: tuple[int, int] = (0, 20),
    *,
    input: int = 0,
    limits: Limits | None = None,
) -> DelayEvidence:
    """Find a delay by correlation, ARX scan, OE scan and impulse response, and say which to trust.

    Parameters
    ----------
    rec : Record
        One output; of several inputs, what the others explain is taken away first.
    nk : (low, high)
        Delays in samples, inclusive; `nk = 1` means `u(t-1)`.  With a set point `r` in the record
        from 1 on: in closed loop 0 is the controller's path.
    input : int
        Which input.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    DelayEvidence

    Raises
    ------
    NotIdentifiable
        The range or the delay reaches beyond a third of the record (X05), the input stands still
        (X01) or moves too simply (X02), too few rows (X03).

    Notes
    -----
    The noise behind the impulse response gives a filter that makes it white; the scan of
    output-error models on the filtered signals is trusted.  Over 11 kinds of simulated records its
    weight was above 0.9 in 263 runs and right in 262 of them.  `delay` is the quick scan.  Source
    001, 3.5.4.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.analyze.delay_evidence(pt.datasets.hair_dryer())
    >>> print(found)
    nk = 3, weight 1.00
      OE scan                     3   1.00  white noise behind B/F: to be trusted
      impulse response            2   0.97  a tap early where the plant begins softly
      ARX scan                    3         order 3; how sure, it cannot tell
      pre-whitened correlation    3         first lag outside the band; noise makes it late
      raw correlation             6         late by about the clock of u
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    low, high = checked_range(nk)
    if rec.r is not None:
        low, high = max(low, 1), max(high, 1)
    return _value(_core.delay_evidence(rec, input, (low, high), limits), rec, input, limits)


def _value(d: Mapping[str, Any], rec: Record, input: int, limits: Limits) -> DelayEvidence:
    oe = {**d["oe"], **{name: np.array(d["oe"][name]) for name in ("candidates", "orders")}}
    return DelayEvidence(
        nk=d["nk"],
        weight=d["weight"],
        likely=tuple(d["likely"]),
        trusted=d["trusted"],
        correlation=correlation_from_core(d["correlation"], rec, limits),
        arx=scan_from_core(d["arx"], rec, limits),
        oe=OEScan(**oe),
        impulse=impulse_from_core(d["impulse"], rec, 0, "tc", limits),
        input=input,
        feedback=d["feedback"],
        notes=(*notes_from_core(d["notes"]), *limits.changes()),
        source=rec.source,
    )
