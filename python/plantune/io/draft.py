"""A record in the making: what was asked for, and the rows as they go from step to step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from plantune.io.table import Name, Places
from plantune.notes import Limits, Note
from plantune.record import Floats

Names = Name | Sequence[Name] | None


@dataclass(frozen=True, slots=True)
class Choice:
    """What the caller of `read` asked for; see there."""

    u: Names
    y: Names
    Ts: float | None
    r: Names
    aux: Names
    time: Names
    quality: Name | Mapping[Name, Name] | None
    resample: float | None
    missing: str
    sentinels: tuple[float, ...]
    uncertain: str
    sort: bool | str
    ragged: str
    stamps: str
    compressed: str
    units: Mapping[str, str]
    limits: Limits


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Rows on their way from a file to a record."""

    x: Floats  # (N, columns asked for), NaN where missing
    t: Floats | None  # seconds
    places: Places
    names: tuple[str, ...]
    time_name: str
    Ts: float | None
    segment: NDArray[np.int64]  # (N,), grows where a new segment starts
    log: tuple[str, ...]
    notes: tuple[Note, ...] = ()
    causes: tuple[str, ...] = ()  # why values are missing that the file has
    rows_tell_time: bool = True  # not after repeated rows were dropped

    @property
    def N(self) -> int:
        """Number of rows."""
        return len(self.x)

    @property
    def starts(self) -> NDArray[np.int64]:
        """First row of each segment."""
        return np.flatnonzero(np.diff(self.segment, prepend=self.segment[0] - 1))

    @property
    def parts(self) -> list[slice]:
        """Rows of each segment."""
        edges = [*self.starts.tolist(), self.N]
        return [slice(a, b) for a, b in pairwise(edges)]

    def take(self, keep: NDArray[np.bool_] | NDArray[np.int64], said: str) -> Draft:
        """Return the rows to keep, with a line in the log."""
        return replace(
            self,
            x=self.x[keep],
            t=None if self.t is None else self.t[keep],
            places=self.places.take(keep),
            segment=self.segment[keep],
            log=(*self.log, said),
        )

    def where(self, k: int, column: str) -> tuple[str, int, float | None]:
        """Return row `k` of a column as the place in a refusal."""
        row = self.places.row(k)
        if self.t is not None:
            return column, row, float(self.t[k])
        return column, row, None if self.Ts is None else row * self.Ts
