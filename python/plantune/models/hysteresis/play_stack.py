"""Weighted plays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from plantune import _core
from plantune.models.hysteresis.base import HysteresisModel, Identified, frozen
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class PlayStack(HysteresisModel):
    """`y = offset + sum w_i z_i` over plays `z_i` of half width `r_i` (Prandtl-Ishlinskii).

    Parameters
    ----------
    r : array (n,)
        Half widths, ascending, in units of the input.
    w : array (n,)
        Weights, y/x.
    offset : float
        Added to the sum, in units of y.

    Examples
    --------
    >>> import plantune as pt
    >>> stack = pt.hysteresis.PlayStack(r=[0, 1], w=[1, 0.5])
    >>> stack.inverse()
    PlayStack(r=array([0., 1.]), w=array([ 1.        , -0.33333333]), offset=0.0)
    """

    kind: ClassVar[str] = "play_stack"

    r: Floats
    w: Floats
    offset: float = 0.0
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "r", frozen(self.r, "r"))
        object.__setattr__(self, "w", frozen(self.w, "w"))
        object.__setattr__(self, "offset", float(self.offset))
        _core.hysteresis_check(self)
