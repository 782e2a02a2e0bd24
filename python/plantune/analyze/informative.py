"""Which stretches of a long record say something about the plant."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.models import ProcessModel
from plantune.models.convert import from_core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True)
class InformativeStretch:
    """A stretch in which the input drives the output, and what its rows say of K, T and L.

    Attributes
    ----------
    rows : slice
        Rows of the record.
    start, end : float
        Time of its first and its last row, seconds.
    F, p : float
        Largest F statistic of its windows, and the chance of one as large where u drives nothing.
    feedback : bool
        Whether the input answers the output as well: the loop is closed.
    K : float
        Gain that these rows ask for, T and L being free.
    sd : tuple of float
        Standard deviations that these rows give K, T (s) and L (s), for a fit with a noise model.
    fit : float
        Share of the output that the input explains in simulation, %.
    score : float
        Largest of `sd K / |K|`, `sd T / T` and `sd L / (T + L)`; infinite where nothing is told.
    agrees : bool
        Whether `K` is that of the rough plant, within a quarter of it or three deviations.
    identifiable : bool
        Whether gain, time constant and delay can be identified: a score below 0.25, and `agrees`.

    Examples
    --------
    >>> import plantune as pt
    >>> best = pt.analyze.informative(pt.datasets.engine_loop(noise_var=1.5)).best
    >>> best.identifiable, best.sd[1] < 0.01
    (True, True)
    """

    rows: slice
    start: float
    end: float
    F: float
    p: float
    feedback: bool
    K: float
    sd: tuple[float, float, float]
    fit: float
    score: float
    agrees: bool
    identifiable: bool

    def __str__(self) -> str:
        said = "can be identified" if self.identifiable else "says too little"
        if self.score < float("inf") and not self.agrees:
            said = "asks for another gain"
        K, T, L = self.sd
        told = f"K {self.K:.4g} ± {K:.2g}, sd of T {T:.2g} s, of L {L:.2g} s"
        size = f"{self.rows.stop - self.rows.start} rows, {self.fit:.0f} % explained"
        return f"{self.start:g} to {self.end:g} s, {size}: {told}: {said}"


@dataclass(frozen=True, slots=True, eq=False)
class Informative:
    """The stretches of a record that say something about the plant, the best first.

    Attributes
    ----------
    stretches : tuple of InformativeStretch
        Ranked by `score`; those that can be identified and those that cannot.
    plant : ProcessModel or None
        The rough plant that the standard deviations are for; None where no stretch could be
        fitted.
    firsts, stops : array (k,) of int
        First row of every window that was tested, and the row after its last.
    condition, F, p : array (k,)
        Condition number of its regressor, and the F test of u driving y.
    notes : tuple of Note
        Nothing found (X02), sampled coarsely (M09), a closed loop (X09).
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.analyze.informative(pt.datasets.hair_dryer())
    >>> found.best.identifiable, len(found.firsts)
    (True, 17)
    """

    stretches: tuple[InformativeStretch, ...]
    plant: ProcessModel | None
    firsts: NDArray[np.int64]
    stops: NDArray[np.int64]
    condition: Floats
    F: Floats
    p: Floats
    notes: tuple[Note, ...]
    source: str
    of: Record = field(repr=False)

    @property
    def best(self) -> InformativeStretch | None:
        """The stretch that says most; None where there is none."""
        return self.stretches[0] if self.stretches else None

    @property
    def identifiable(self) -> tuple[InformativeStretch, ...]:
        """Those from which gain, time constant and delay can be identified."""
        return tuple(s for s in self.stretches if s.identifiable)

    def record(self, i: int = 0) -> Record:
        """Return the rows of stretch `i` as a record to fit.

        Examples
        --------
        >>> import plantune as pt
        >>> found = pt.analyze.informative(pt.datasets.hair_dryer())
        >>> found.record(0).N == found.best.rows.stop - found.best.rows.start
        True
        """
        if not -len(self.stretches) <= i < len(self.stretches):
            raise refusal(
                "U01",
                f"`i` is {i}, there are {len(self.stretches)} stretches",
                where=("i", None, None),
                remedy="record(0) is the best",
            )
        return self.of.take(self.stretches[i].rows)

    def joined(self) -> Record:
        """Return all that can be identified as segments of one record, in the order of time.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.analyze.informative(pt.datasets.hair_dryer()).joined().starts.tolist()
        [0]
        """
        rows = sorted((s.rows for s in self.identifiable), key=lambda rows: rows.start)
        if not rows:
            raise refusal(
                "X02",
                "no stretch can be identified",
                remedy="record a few steps of the set point, or of the input in manual",
            )
        return Record.join([self.of.take(part) for part in rows])

    def __str__(self) -> str:
        can = len(self.identifiable)
        head = f"{len(self.stretches)} stretches in which u drives y, {can} can be identified"
        return "\n".join(
            [head, *(f"  {s}" for s in self.stretches), *(f"  {n}" for n in self.notes)]
        )


def informative(
    rec: Record,
    window: int = 200,
    *,
    input: int = 0,
    output: int = 0,
    limits: Limits | None = None,
) -> Informative:
    """Find the stretches of a long record that say something about the plant, and rank them.

    Windows are tested for u driving y; those that do are merged into stretches, and each is ranked
    by the standard deviations of K, T and L that its rows give.

    Parameters
    ----------
    rec : Record
        Months of it, if need be: 10 000 rows take a tenth of a second.  Segments are searched one
        by one.
    window : int
        Rows of a window, at least 42: some ten time constants.  The windows are a quarter of it
        apart.
    input, output : int
        Which of them.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Informative

    Raises
    ------
    NotIdentifiable
        No stretch without a gap has 42 rows (X03).
    UsageError
        A window too short, or no such input or output (U01).

    Notes
    -----
    The F test of six Laguerre filters of u, after the past of y; no delay need be known.  It only
    finds candidates: the standard deviations decide.  They are those of a first order with a delay
    and coloured noise, linearised at the rough plant, itself the best of six fits.  Bittencourt,
    Isaksson, Peretzki and Forsman, Processes 2015, 3:357.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5)
    >>> found = pt.analyze.informative(rec)
    >>> len(found.stretches), found.best.identifiable
    (1, True)
    >>> fit = pt.estimate.process(found.record(0), "P1D")
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    for name, value, most in (("input", input, rec.nu), ("output", output, rec.ny)):
        if not 0 <= value < most:
            raise refusal(
                "U01",
                f"`{name}` is {value}, must lie from 0 to {most - 1}",
                where=(name, None, None),
                remedy=f"{name}=0",
            )
    d = _core.informative(rec, window, input, output, limits)
    plant, time = d.pop("plant"), rec.time
    return Informative(
        stretches=tuple(
            InformativeStretch(
                rows=slice(first := s.pop("first"), stop := s.pop("stop")),
                start=float(time[first]),
                end=float(time[stop - 1]),
                **{**s, "sd": tuple(s["sd"])},
            )
            for s in d.pop("stretches")
        ),
        plant=None if plant is None else cast("ProcessModel", from_core(plant)),
        firsts=np.array(d.pop("firsts"), np.int64),
        stops=np.array(d.pop("stops"), np.int64),
        notes=(*notes_from_core(d.pop("notes")), *limits.changes()),
        **d,
        source=rec.source,
        of=rec,
    )
