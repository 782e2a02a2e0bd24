"""Tables over operating-point signals, and controller settings that follow them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Values over a grid of one to three operating-point signals.

    Between the points of the grid the table is multilinear, beyond its edges it stays at the
    value of the edge.

    Parameters
    ----------
    axes : sequence of array
        The ascending points of each signal; one array where there is one signal.
    values : array
        One dimension per signal, as long as its axis.

    Raises
    ------
    UsageError
        Axes that do not ascend or are more than three, values of another shape (U01).

    Notes
    -----
    Source 001, 3.7.6: parameters of plant and controller in three-dimensional tables.

    Examples
    --------
    >>> gain = Table(axes=([1000.0, 3000.0], [0.0, 50.0, 100.0]), values=[[8, 6, 5], [4, 3, 2]])
    >>> gain.at([1000, 2000, 9000], [25, 75, 50])
    array([7., 4., 3.])
    """

    axes: tuple[Floats, ...]
    values: Floats

    def __post_init__(self) -> None:
        single = np.ndim(self.axes[0]) == 0 if len(self.axes) else False
        axes = (self.axes,) if single else self.axes
        object.__setattr__(self, "axes", tuple(_frozen(axis) for axis in axes))
        object.__setattr__(self, "values", _frozen(self.values))
        shape = tuple(len(axis) for axis in self.axes)
        if self.values.shape != shape:
            raise refusal(
                "U01",
                f"`values` has the shape {self.values.shape}, must have that of the axes, {shape}",
                remedy="one value per point of the grid, the last axis along the rows",
            )
        self.at(*(axis[:1] for axis in self.axes))  # the core refuses what is no table

    def at(self, *signals: ArrayLike) -> Floats:
        """Return the values at operating points.

        Parameters
        ----------
        *signals : array (N,)
            One per axis, all of the same length; a number stands for every row.

        Returns
        -------
        array (N,)

        Examples
        --------
        >>> Table(axes=[0.0, 10.0], values=[1.0, 3.0]).at([-5.0, 2.5, 10.0])
        array([1. , 1.5, 3. ])
        """
        columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(x, float)) for x in signals))
        points = np.ascontiguousarray(np.stack(columns, axis=1))
        return _core.table(
            [axis.tolist() for axis in self.axes], self.values.ravel().tolist(), points
        )


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """Controller settings of every row, in place of those of the PID.

    Parameters
    ----------
    Kp, Ti, Ki, Td : array (N,), optional
        Settings from row to row, such as `Table.at` gives; `Ti` or `Ki`, not both.  What is absent
        stays as the PID has it; with `Kp` alone `Ti` stays, and `Ki` follows.

    Notes
    -----
    A change of `Kp` does not make u jump: the integral takes what P leaves.

    Examples
    --------
    >>> import plantune as pt
    >>> speed = np.linspace(1000.0, 3000.0, 200)
    >>> gain = pt.simulate.Table(axes=[1000.0, 3000.0], values=[0.2, 0.6])
    >>> plant, pid = pt.models.ProcessModel(K=2.0, T=1.0, L=0.3), pt.models.PID(0.2, 1.0, Ts=0.1)
    >>> schedule = pt.simulate.Schedule(Kp=gain.at(speed))
    >>> response = pt.simulate.closed_loop(plant, pid, r=np.ones(200), schedule=schedule)
    >>> round(float(response.y[-1]), 3)
    1.0
    """

    Kp: Floats | None = None
    Ti: Floats | None = None
    Ki: Floats | None = None
    Td: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("Kp", "Ti", "Ki", "Td"):
            x = getattr(self, name)
            if x is not None:
                object.__setattr__(self, name, _frozen(np.atleast_1d(np.asarray(x, float))))


def _frozen(x: ArrayLike) -> Floats:
    copy = np.array(x, float, order="C")
    copy.flags.writeable = False
    return copy
