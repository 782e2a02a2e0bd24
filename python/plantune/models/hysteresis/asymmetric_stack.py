"""Weighted plays seen through a monotone curve, and what undoes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from plantune import _core
from plantune.models.hysteresis.base import HysteresisModel, Identified, freeze
from plantune.models.hysteresis.printed import elements
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class AsymmetricStack(HysteresisModel):
    """`y = S(H[x])`: a stack of plays seen through a rising curve.

    The modified Prandtl-Ishlinskii model, whose rising and falling branches differ in shape.

    Parameters
    ----------
    r, w : array (n,)
        Half widths of the plays, ascending from 0 on, and their weights: H.
    knots : array (m - 1,)
        Where the slope of S changes, ascending, in units of H.
    slopes : array (m,)
        Slopes of S below, between and above the knots, positive.
    offset : float
        `S(0)`, in units of y.
    z0 : array (n,), optional
        Where the plays begin; at 0, the virgin state, by default.
    identified : Identified, optional
        How it was found; names `w0 ... slope0 ... offset`.  One slope sets the scale of H and has
        the standard deviation 0.

    Raises
    ------
    UsageError
        Lengths that do not match, widths or knots out of order, a slope not positive (U01).

    Notes
    -----
    S superposes dead zones of one side each: `slopes` change by their weights at `knots`.  Kuhnen,
    European Journal of Control 9, 2003.  `PlayStack.identify(..., asymmetric=True)` finds one.

    Examples
    --------
    >>> import plantune as pt
    >>> stack = pt.hysteresis.AsymmetricStack(r=[0, 1], w=[1, 1], knots=[0], slopes=[1, 2])
    >>> y = stack.simulate([3.0, 2.0, -3.0])
    >>> y, stack.inverse().simulate(y)
    (array([10.,  8., -5.]), array([ 3.,  2., -3.]))
    """

    kind: ClassVar[str] = "asymmetric_stack"

    r: Floats
    w: Floats
    knots: Floats
    slopes: Floats
    offset: float = 0.0
    z0: Floats = None  # type: ignore[assignment]
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze(self, "r", "w", "knots", "slopes", z0="r")
        _core.hysteresis_check(self)

    def inverse(self) -> AsymmetricInverse:  # type: ignore[override]
        """Return the curve's inverse with the stack's behind it: `x = H'[S'(y)]`, exactly.

        Raises
        ------
        UsageError
            A partial sum of the weights is not positive, or the first play has a width (U01).

        Examples
        --------
        >>> import plantune as pt
        >>> stack = pt.hysteresis.AsymmetricStack(r=[0], w=[2], knots=[], slopes=[1], offset=1)
        >>> stack.inverse().simulate([1.0, 3.0])
        array([0., 1.])
        """
        return AsymmetricInverse(**_core.hysteresis_inverse(self))

    def __str__(self) -> str:
        equation = "y = offset + S(sum w z),  z plays of x,  S by slopes between knots"
        return elements(self, equation, ("r", "w"), ("knots", "slopes"))


@dataclass(frozen=True, slots=True, eq=False)
class AsymmetricInverse(HysteresisModel):
    """`x = H[S(y)]`: a rising curve with a stack of plays behind it.

    What undoes an `AsymmetricStack`, for feed-forward.

    Parameters
    ----------
    r, w, knots, slopes, offset, z0
        As of `AsymmetricStack`; knots in units of the input of the curve.

    Examples
    --------
    >>> import plantune as pt
    >>> stack = pt.hysteresis.AsymmetricStack(r=[0, 1], w=[1, 1], knots=[0], slopes=[1, 2])
    >>> stack.inverse().inverse().same_as(stack)
    True
    """

    kind: ClassVar[str] = "asymmetric_inverse"

    r: Floats
    w: Floats
    knots: Floats
    slopes: Floats
    offset: float = 0.0
    z0: Floats = None  # type: ignore[assignment]
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze(self, "r", "w", "knots", "slopes", z0="r")
        _core.hysteresis_check(self)

    def inverse(self) -> AsymmetricStack:  # type: ignore[override]
        """Return the stack that this undoes."""
        return AsymmetricStack(**_core.hysteresis_inverse(self))

    def __str__(self) -> str:
        equation = "x = offset + sum w z,  z plays of S(y),  S by slopes between knots"
        return elements(self, equation, ("r", "w"), ("knots", "slopes"))
