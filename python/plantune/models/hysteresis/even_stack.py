"""Weighted plays on the input and on its magnitude."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NoReturn

from plantune import _core
from plantune.models.hysteresis.base import HysteresisModel, Identified, freeze
from plantune.models.hysteresis.printed import elements
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class EvenStack(HysteresisModel):
    """`y = offset + sum w_i play(x; r_i) + sum v_j play(|x|; s_j)`: butterfly loops.

    Parameters
    ----------
    r, w : array (n,)
        Half widths of the plays on x, ascending, and their weights, of either sign.
    s, v : array (m,)
        Those of the plays on |x|.
    offset : float
        Added to the sums, in units of y.
    identified : Identified, optional
        How it was found.

    Raises
    ------
    UsageError
        Lengths that do not match, or widths out of order (U01).

    Notes
    -----
    The strain of a piezo that is driven beyond its coercive field falls and then rises on each
    branch.  `PlayStack.identify(..., even=True)` finds such a stack.

    Examples
    --------
    >>> import plantune as pt
    >>> pt.hysteresis.EvenStack(r=[0], w=[1], s=[0, 1], v=[1, 1]).simulate([2.0, 1.0, -1.0, -3.0])
    array([5., 3., 1., 2.])
    """

    kind: ClassVar[str] = "even_stack"

    r: Floats
    w: Floats
    s: Floats
    v: Floats
    offset: float = 0.0
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze(self, "r", "w", "s", "v")
        _core.hysteresis_check(self)

    def inverse(self) -> NoReturn:
        """Refuse: on a butterfly loop two inputs give one output.

        Raises
        ------
        UsageError
            Always (U01).
        """
        _core.hysteresis_inverse(self)
        raise AssertionError("the core refuses")

    def __str__(self) -> str:
        equation = "y = offset + sum w z + sum v u,  z plays of x, u plays of |x|"
        return elements(self, equation, ("r", "w"), ("s", "v"))
