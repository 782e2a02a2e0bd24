"""Elements in series, one group for a rising and one for a falling input."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models.hysteresis.base import HysteresisModel, Identified, column, frozen
from plantune.notes import notes_from_core
from plantune.record import Floats

_WAYS = {"up": 1.0, "down": -1.0}


@dataclass(frozen=True, slots=True, eq=False)
class SeriesSlip(HysteresisModel):
    """`y = y_b + slope (x - x_b)` of the last breakpoint passed this way.

    The improved Maxwell slip model of source 002.  Before the first breakpoint of a direction the
    output holds.

    Parameters
    ----------
    up, down : array (n, 3)
        Rows `(x_b, y_b, slope)`: breakpoint, output there, slope; for a rising input with `x_b`
        ascending, for a falling one descending.  One of the two may be empty.
    identified : Identified, optional
        How it was found; `sd` are those of the slopes, in the order of the table.

    Raises
    ------
    UsageError
        Rows of another shape, not finite, or breakpoints out of order (U01).

    Notes
    -----
    Breakpoints are absolute, so nothing remembers a minor loop: where the input turns, the output
    jumps to the other group, with table 4.1 by 5.6 um at 50 V.  `PlayStack` has that memory.
    Anchored at measured positions, no loop drifts.  `print` gives table 4.1, whose row `F_i` holds
    `y_b`.  Source 002, chapter 4, (8a) and (8b), as corrected.

    Examples
    --------
    >>> import plantune as pt
    >>> model = pt.hysteresis.SeriesSlip(
    ...     up=[(0, 1.205, 0.3547), (9.1877, 3.9765, 0.3547), (19.538, 8.3145, 0.44513)],
    ...     down=[(97.908, 43.862, 0.2777), (65.378, 33.981, 0.42597), (21.593, 14.46, 0.59484)],
    ... )
    >>> print(model)
    element  input       x_b     F_i        k
          1  rising        0   1.205   0.3547
          2  rising   9.1877  3.9765   0.3547
          3  rising   19.538  8.3145  0.44513
          4  falling  97.908  43.862   0.2777
          5  falling  65.378  33.981  0.42597
          6  falling  21.593   14.46  0.59484
    >>> model.simulate([0, 50, 100, 50]).round(2)
    array([ 1.2 , 21.87, 44.13, 27.43])
    """

    kind: ClassVar[str] = "series_slip"

    up: Floats = ()  # type: ignore[assignment]
    down: Floats = ()  # type: ignore[assignment]
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in _WAYS:
            object.__setattr__(self, name, _rows(getattr(self, name), name))
        _core.hysteresis_check(self)

    @classmethod
    def identify(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        threshold: float = 0.5,
        consecutive: int | None = None,
        *,
        P0: float = 100.0,
        noise_sd: float | None = None,
        band: float = 0.0,
    ) -> SeriesSlip:
        """Learn the elements from a record that holds a whole cycle at least.

        The record runs through `SeriesSlipLearner`, sample by sample; of several cycles the last
        one counts.

        Parameters
        ----------
        x, y : array (N,)
            Input and output.
        threshold : float
            Error beyond which a new element begins, in units of y.
        consecutive : int, optional
            Samples in a row that must be beyond it.  By default 1 where the threshold has eight
            standard deviations of the noise, else 3.
        P0 : float
            Variance of a new element's slope in units of the noise variance, 1/x^2.
        noise_sd : float, optional
            Standard deviation of the noise of y; by default that of its fourth differences.
        band : float
            How far the input must come back to have turned, in units of x: its noise.

        Returns
        -------
        SeriesSlip
            `identified` speaks of the cycle that the elements were learnt from.  Notes: S01 the
            threshold is below eight standard deviations and one sample is enough, S02 it is below
            the steps of y, S03 more elements than a smooth loop asks for, S04 no whole cycle.

        Raises
        ------
        UsageError
            An argument out of its range (U01).
        DataError
            x and y of different lengths (D09).
        NotIdentifiable
            The input does not move (X01).

        Examples
        --------
        >>> import plantune as pt
        >>> stage = pt.datasets.piezo_stage(cycles=1)
        >>> model = pt.hysteresis.SeriesSlip.identify(stage.u[:, 0], stage.y[:, 0], threshold=0.5)
        >>> len(model.up), len(model.down), model.notes
        (3, 3, ())
        >>> model.identified.worst < 0.53
        True
        """
        settings = {
            "threshold": float(threshold),
            "consecutive": consecutive,
            "P0": float(P0),
            "noise_sd": float(noise_sd or 0.0),
            "band": float(band),
        }
        found = _core.series_slip_identify(column(x, "x"), column(y, "y"), settings)
        model, notes = found.pop("model"), notes_from_core(found.pop("notes"))
        names = tuple(f"k{i + 1}" for i in range(len(found["sd"])))
        return cls(**model, identified=Identified(**found, names=names, notes=notes))

    def closed(self) -> SeriesSlip:
        """Return the loop whose elements meet: chords from each breakpoint to the next.

        The last element of a group leads to the first breakpoint of the other one.  No jump and no
        gap is left, and both groups travel the same from end to end.

        Raises
        ------
        UsageError
            A group is empty, or ends beyond the first breakpoint of the other one (U01).

        Examples
        --------
        >>> import plantune as pt
        >>> loop = pt.hysteresis.SeriesSlip(up=[(0, 0, 1), (1, 2, 1)], down=[(2, 4, 1)]).closed()
        >>> loop.up[:, 2], loop.down[:, 2]
        (array([2., 2.]), array([2.]))
        """
        return SeriesSlip(**_core.series_slip_closed(self))

    def through(self, x: float, y: float, direction: str = "up") -> SeriesSlip:
        """Return the model moved by one constant, its branch through (x, y).

        A second cycle starts where drift and creep have left the first one.

        Parameters
        ----------
        x, y : float
            A measured point.
        direction : "up" or "down"
            Of the input there.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.hysteresis.SeriesSlip(up=[(0, 1, 0.5)]).through(2.0, 2.3).simulate([0, 2])
        array([1.3, 2.3])
        """
        if direction not in _WAYS:
            raise refusal("U01", f"`direction` is {direction!r}", remedy='pass "up" or "down"')
        return SeriesSlip(**_core.series_slip_through(self, x, y, _WAYS[direction]))

    def inverse(self) -> SeriesSlip:
        """Return the branches with their axes exchanged, elements in series again.

        Inside the elements the round trip is exact.  Where an element ends below the next
        breakpoint, the inverse stays at that breakpoint while its input crosses the gap, and the
        model jumps across it there: the round trip is off by the gap at most.  Where it ends above,
        the inverse leaves the element at its end only and skips a piece of the next one.  `closed`
        has neither.

        Raises
        ------
        UsageError
            A slope that is not positive (U01).

        Examples
        --------
        >>> import plantune as pt
        >>> model = pt.hysteresis.SeriesSlip(up=[(0, 0, 1), (2, 3, 2)])
        >>> model.inverse().simulate([1.0, 2.0, 2.5, 3.0, 4.0])
        array([1. , 2. , 2. , 2. , 2.5])
        """
        return SeriesSlip(**_core.hysteresis_inverse(self))

    def __str__(self) -> str:
        ways = ["rising"] * len(self.up) + ["falling"] * len(self.down)
        elements = enumerate(zip(ways, [*self.up.tolist(), *self.down.tolist()], strict=True), 1)
        rows = [(str(i), way, *(f"{v:.5g}" for v in values)) for i, (way, values) in elements]
        table = [("element", "input", "x_b", "F_i", "k"), *rows]
        i, way, x_b, y_b, k = (max(map(len, cells)) for cells in zip(*table, strict=True))
        return "\n".join(
            f"{row[0]:>{i}}  {row[1]:{way}}  {row[2]:>{x_b}}  {row[3]:>{y_b}}  {row[4]:>{k}}"
            for row in table
        )


def _rows(group: Any, name: str) -> Floats:
    """Return a group (n, 3) that cannot be written."""
    rows = np.array(group, float)
    if rows.size and (rows.ndim != 2 or rows.shape[1] != 3):
        raise refusal(
            "U01",
            f"`{name}` has shape {rows.shape}, must be (n, 3)",
            remedy="pass rows (x_b, y_b, slope)",
        )
    rows = frozen(rows, name).reshape(-1, 3)
    rows.flags.writeable = False
    return rows
