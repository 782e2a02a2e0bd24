"""A periodic record cut into cycles, and how well they repeat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from numpy.typing import ArrayLike

from plantune import _core
from plantune.models.hysteresis.base import column
from plantune.record import Floats


@dataclass(frozen=True, slots=True)
class Cycles:
    """Whole cycles of an input, from one lowest point to the next.

    Iterating gives the rows of each whole cycle as a slice, both lowest points included.

    Attributes
    ----------
    turns : tuple of int
        Rows of the turning points.
    whole : tuple of (int, int, int)
        Rows of lowest, highest and next lowest point of each whole cycle.
    first, last : slice
        Rows of the incomplete cycle in front of them and behind them, perhaps none.
    band : float
        How far the input must come back to have turned, in units of x.

    Examples
    --------
    >>> found = cycles([1, 2, 1, 0, 1, 2, 1, 0, 1])
    >>> found.whole, found.first, found.last
    (((3, 5, 7),), slice(0, 3, None), slice(8, 9, None))
    >>> [rows for rows in found]
    [slice(3, 8, None)]
    """

    turns: tuple[int, ...]
    whole: tuple[tuple[int, int, int], ...]
    first: slice
    last: slice
    band: float

    def __len__(self) -> int:
        return len(self.whole)

    def __iter__(self) -> Iterator[slice]:
        return (slice(a, c + 1) for a, _, c in self.whole)


@dataclass(frozen=True, slots=True, eq=False)
class Repeatability:
    """How far the cycles of a loop differ: what no model of one loop can undercut.

    Attributes
    ----------
    largest, rms : float
        Largest difference of any two cycles, and root mean square of all, both directions
        together, in units of y.
    largest_up, rms_up, largest_down, rms_down : float
        The same for a rising and for a falling input.
    x : array (200,)
        Levels of the input, which all cycles pass.
    up, down : array (cycles, 200)
        Output of each cycle there, for a rising and a falling input.

    Examples
    --------
    >>> import plantune as pt
    >>> stage = pt.datasets.piezo_stage(cycles=2)
    >>> print(pt.hysteresis.repeatability(stage.u[:, 0], stage.y[:, 0]))
    2 cycles differ by ... at most, rms ... (rising ..., ...; falling ..., ...)
    """

    largest: float
    rms: float
    largest_up: float
    rms_up: float
    largest_down: float
    rms_down: float
    x: Floats
    up: Floats
    down: Floats

    def __str__(self) -> str:
        return (
            f"{len(self.up)} cycles differ by {self.largest:.3g} at most, rms {self.rms:.3g} "
            f"(rising {self.largest_up:.3g}, {self.rms_up:.3g}; "
            f"falling {self.largest_down:.3g}, {self.rms_down:.3g})"
        )


def cycles(x: ArrayLike, band: float | None = None) -> Cycles:
    """Cut a periodic input at its turning points.

    Parameters
    ----------
    x : array (N,)
        Input.
    band : float, optional
        How far it must come back to have turned: more than its noise, less than its cycles.  5 %
        of its range by default.

    Returns
    -------
    Cycles
        An end of the record counts as a turning point where x is within 5 % of its range from
        its lowest or highest value.

    Raises
    ------
    UsageError
        A band that is negative, x not finite (U01).
    NotIdentifiable
        The input does not move by more than the band (X01).

    Examples
    --------
    >>> import numpy as np
    >>> x = 50 - 50 * np.cos(2 * np.pi * np.arange(250) / 100)
    >>> len(cycles(x)), cycles(x).turns
    (2, (0, 50, 100, 150, 200, 249))
    """
    signal = column(x, "x")
    found = _core.hysteresis_cycles(signal, band)
    return Cycles(
        turns=tuple(found["turns"]),
        whole=tuple((a, b, c) for a, b, c in found["whole"]),
        first=slice(0, found["before"]),
        last=slice(found["behind"], len(signal)),
        band=found["band"],
    )


def repeatability(x: ArrayLike, y: ArrayLike, band: float | None = None) -> Repeatability:
    """Compare the whole cycles of a loop over a grid of inputs that all of them pass.

    Parameters
    ----------
    x, y : array (N,)
        Input and output.
    band : float, optional
        As of `cycles`.

    Raises
    ------
    UsageError
        As of `cycles`.
    DataError
        x and y of different lengths (D09).
    NotIdentifiable
        Fewer than two whole cycles (X03), or the input does not move (X01).

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(201) / 100
    >>> x = 50 - 50 * np.cos(2 * np.pi * t)
    >>> found = repeatability(x, x + 0.3 * t)  # a drift of 0.3 a cycle
    >>> round(found.largest, 6), round(found.rms, 6)
    (0.3, 0.3)
    """
    found = _core.hysteresis_repeatability(column(x, "x"), column(y, "y"), band)
    (up, down, both), n = found.pop("spread"), found.pop("cycles")
    return Repeatability(
        largest=both[0],
        rms=both[1],
        largest_up=up[0],
        rms_up=up[1],
        largest_down=down[0],
        rms_down=down[1],
        x=found["x"],
        up=_matrix(found["up"], n),
        down=_matrix(found["down"], n),
    )


def _matrix(values: Floats, rows: int) -> Floats:
    """Return (rows, n), not to be written either."""
    return values.reshape(rows, -1)
