"""Which way a loop turns."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from plantune import _core
from plantune.models.hysteresis.base import column

_ASKS = {
    "clockwise": "MaxwellSlip or BoucWenForce",
    "counter-clockwise": "PlayStack, Preisach or SeriesSlip",
    "butterfly": "PlayStack with even=True",
    "none": "no memory, or too little to see",
}


@dataclass(frozen=True, slots=True, eq=False)
class LoopDirection:
    """How the loops of a record turn, x to the right and y upwards.

    Attributes
    ----------
    direction : str
        "clockwise" as of friction, y ahead of x; "counter-clockwise" as of piezos, y behind;
        "butterfly", its two halves against each other; or "none".
    area, upper, lower : float
        Area of all loops, clockwise positive, and of it what lies above and below the median of x.
    width : float
        Mean half width of the loops, as a share of the range of y; below 0.002 is none.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.hysteresis.loop_direction([0, 1, 0, -1, 0, 1], [0, 1, 1, -1, -1, 1]))
    counter-clockwise: PlayStack, Preisach or SeriesSlip
    """

    direction: str
    area: float
    upper: float
    lower: float
    width: float

    @property
    def asks_for(self) -> str:
        """The models whose loops turn that way."""
        return _ASKS[self.direction]

    def __str__(self) -> str:
        return f"{self.direction}: {self.asks_for}"


def loop_direction(x: ArrayLike, y: ArrayLike) -> LoopDirection:
    """Return which way the loops of y over x turn, and so which models they ask for.

    Parameters
    ----------
    x, y : array (N,)
        Input and output, one whole cycle or more.

    Raises
    ------
    DataError
        x and y of different lengths (D09).
    NotIdentifiable
        x does not come back (X01).

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> x = np.sin(np.arange(200) / 20)
    >>> pt.hysteresis.loop_direction(x, x + 0.1 * np.cos(np.arange(200) / 20)).direction
    'clockwise'
    """
    return LoopDirection(**_core.hysteresis_direction(column(x, "x"), column(y, "y")))
