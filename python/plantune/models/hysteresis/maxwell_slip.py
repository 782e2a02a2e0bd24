"""Springs in parallel whose blocks slip."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.models.hysteresis.base import HysteresisModel, Identified, column, frozen
from plantune.models.hysteresis.play_stack import PlayStack
from plantune.models.hysteresis.printed import elements
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class MaxwellSlip(HysteresisModel):
    """`y = offset + spring x + sum F_i`, F_i of a spring `k_i` whose block slips at `f_i`.

    Parameters
    ----------
    k : array (n,)
        Stiffness of each element, y/x, > 0.
    f : array (n,)
        Force at which its block slips, in units of y, > 0; it does so at `r = f / k`.
    spring : float
        Stiffness of a spring without a block, >= 0; without it there is no inverse.
    offset : float
        Added to the sum, in units of y.

    Raises
    ------
    UsageError
        Numbers out of their range, or `k` and `f` of different lengths (U01).

    Notes
    -----
    Loops run clockwise, as friction's do: y leads x.  Loops that lag are those of `PlayStack`.
    Source 002, (7a) and (7b).

    Examples
    --------
    >>> import plantune as pt
    >>> model = pt.hysteresis.MaxwellSlip(k=[2, 1], f=[1, 2], spring=0.5)
    >>> y = model.simulate([0.0, 1.0, 4.0, 3.0, -4.0])
    >>> y
    array([ 0. ,  2.5,  5. ,  1.5, -5. ])
    >>> model.inverse().simulate(y)
    array([ 0.,  1.,  4.,  3., -4.])
    """

    kind: ClassVar[str] = "maxwell_slip"

    k: Floats
    f: Floats
    spring: float = 0.0
    offset: float = 0.0
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "k", frozen(self.k, "k"))
        object.__setattr__(self, "f", frozen(self.f, "f"))
        object.__setattr__(self, "spring", float(self.spring))
        object.__setattr__(self, "offset", float(self.offset))
        _core.hysteresis_check(self)

    @property
    def r(self) -> Floats:
        """Displacement at which each block slips (n,), in units of x."""
        return self.f / self.k

    def inverse(self) -> PlayStack:  # type: ignore[override]
        """Return the stack of plays that finds x from y.

        Raises
        ------
        UsageError
            No spring: where all blocks slip, no force tells where (U01).

        Examples
        --------
        >>> import plantune as pt
        >>> print(pt.hysteresis.MaxwellSlip(k=[1], f=[1], spring=1).inverse())
        y = offset + sum w z,  z(t) = max(x - r, min(x + r, z(t-1)))
             r    w
          0  0  0.5
          1  2  0.5
        """
        return PlayStack(**_core.hysteresis_inverse(self))

    @classmethod
    def identify(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        n: int | str = "auto",
        *,
        r: ArrayLike | None = None,
        offset: bool = True,
    ) -> MaxwellSlip:
        """Fit spring and elements by least squares, none of them negative.

        The record begins in the virgin state, the blocks at x = 0.

        Parameters
        ----------
        x, y : array (N,)
            Displacement and force, with clockwise loops.
        n : int or "auto"
            Number of thresholds; "auto" takes the fewest that come within 5 % of the best on every
            other tenth of the record, the fit being on the others.
        r : array (n,), optional
            Thresholds, ascending, in units of x.  By default evenly spaced below max|x|; evenly in
            log r where the smallest turning point is below a tenth of the largest.
        offset : bool
            Whether the offset is fitted.

        Returns
        -------
        MaxwellSlip
            Without the elements that ended at zero.  `identified.sd` are those of `k`, spring and
            offset, for white noise on y; `tried` the numbers of thresholds.

        Raises
        ------
        UsageError
            An argument out of its range (U01).
        DataError
            x and y of different lengths (D09).
        NotIdentifiable
            x does not come back (X01), too few rows (X03), the loop is counter-clockwise or a
            butterfly (M06).

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> x = np.linspace(0, 3, 600) * np.sin(np.linspace(0, 40, 600))
        >>> y = pt.hysteresis.MaxwellSlip(k=[2, 1], f=[1, 2], spring=0.5).simulate(x)
        >>> model = pt.hysteresis.MaxwellSlip.identify(x, y, r=[0.5, 1, 2])
        >>> model.k, model.f, model.spring
        (array([2., 1.]), array([1., 2.]), 0.50)
        """
        count = None if n == "auto" else int(n)
        thresholds = None if r is None else np.array(r, float).reshape(-1).tolist()
        model, how = _core.maxwell_identify(
            column(x, "x"), column(y, "y"), count, thresholds, bool(offset)
        )
        names = (*(f"k{i}" for i in range(len(model["k"]))), "spring", "offset")
        tried = tuple(how.pop("tried"))
        return cls(**model, identified=Identified(**how, tried=tried, names=names))

    def __str__(self) -> str:
        equation = "y = offset + spring x + sum F,  F = k (x - x_b) within ±f"
        return elements(self, equation, ("k", "f"))
