"""A first-order plant whose parameters change from row to row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class VaryingPlant:
    """`y_D(k) = a1 y_D(k-1) + K (1 - a1) u(k - 1 - L/Ts)`, `y = y_D + offset`, all of row k.

    Parameters
    ----------
    K, T, L, offset : float or array (N,)
        Static gain, time constant and dead time in seconds, output offset; a number for all rows,
        or one value per row, such as `Table.at` gives.

    Raises
    ------
    NotIdentifiable
        A row that is no plant (M12), once it is simulated.

    Notes
    -----
    `a1 = e^(-Ts/T)`.  Source 001, (3.7-20) to (3.7-23), with the delay as the errata have it; any
    fraction of a sample is exact, so that constant parameters are those of a ProcessModel.

    Examples
    --------
    >>> plant = VaryingPlant(K=[2.0, 2.0, 4.0, 4.0], T=1.0, offset=[0.0, 0.0, 0.0, 10.0])
    >>> plant.simulate([1.0, 1.0, 1.0, 1.0], Ts=1.0)
    array([ 0.        ,  1.26424112,  2.99357055, 13.6297553 ])
    """

    kind: ClassVar[str] = "varying"

    K: Floats
    T: Floats
    L: Floats | float = 0.0
    offset: Floats | float = 0.0

    def __post_init__(self) -> None:
        for name in ("K", "T", "L", "offset"):
            x = np.array(np.atleast_1d(np.asarray(getattr(self, name), float)))
            x.flags.writeable = False
            object.__setattr__(self, name, x)

    def simulate(self, u: ArrayLike, Ts: float, u0: float = 0.0) -> Floats:
        """Return the output for the input `u`.

        Parameters
        ----------
        u : array (N,)
            Each value holds for `Ts` seconds.
        Ts : float
            Seconds.
        u0 : float
            Input before row 0, at which the plant of row 0 is at rest.

        Returns
        -------
        array (N,)

        Examples
        --------
        >>> VaryingPlant(K=2.0, T=1.0).simulate([3.0, 3.0], Ts=0.5, u0=3.0)
        array([6., 6.])
        """
        return _core.simulate_varying(self, np.ascontiguousarray(np.atleast_1d(u), float), Ts, u0)
