"""What every model of hysteresis answers, each in one call of the core."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.notes import Note
from plantune.record import Floats

if TYPE_CHECKING:
    from plantune._core import Stream

Self = TypeVar("Self", bound="HysteresisModel")


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """How a model was found.

    Attributes
    ----------
    N : int
        Rows used.
    rms, worst : float
        Root mean square and largest absolute error over them, in units of y.
    relative : float
        Norm of the error over the norm of y.
    sd : array (d,)
        Standard deviation of each parameter, in the order of `names`.
    names : tuple of str
        Their names.
    tried : tuple of (int, float)
        Numbers of elements tried, and the rms error of each on rows not used.
    notes : tuple of Note
        What the data leave in doubt.
    x_range : (float, float), optional
        Lowest and highest input fitted.
    """

    N: int
    rms: float
    worst: float
    relative: float
    sd: Floats
    names: tuple[str, ...] = ()
    tried: tuple[tuple[int, float], ...] = ()
    notes: tuple[Note, ...] = ()
    x_range: tuple[float, float] | None = None


class HysteresisModel:
    """Base of the models of hysteresis: frozen values of one input and one output."""

    __slots__ = ()
    kind: ClassVar[str]
    identified: Identified | None

    @property
    def notes(self) -> tuple[Note, ...]:
        """What its identification left in doubt."""
        return self.identified.notes if self.identified else ()

    def simulate(self, x: ArrayLike) -> Floats:
        """Return the output for the input `x` (N,), from the virgin state.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.hysteresis.PlayStack(r=[0, 1], w=[1, 1]).simulate([3.0, 2.0, 0.0])
        array([5., 4., 1.])
        """
        return _core.hysteresis_simulate(self, column(x, "x"))

    def check_range(self, x: ArrayLike) -> tuple[Note, ...]:
        """Return a doubt (H04) if the input goes beyond what was fitted.

        Beyond it the outermost slopes are carried on: an asymmetric stack whose record had missed
        one end of the range was 0.9 % off there, where it is 0.04 % off within.

        Parameters
        ----------
        x : array (N,)
            New input.

        Returns
        -------
        tuple of Note
            Empty within the range, and of a model that was not identified.

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> x = 5 * np.sin(np.linspace(0, 20, 200))
        >>> y = pt.hysteresis.PlayStack(r=[0, 1], w=[1, 1]).simulate(x)
        >>> model = pt.hysteresis.PlayStack.identify(x, y, n=5)
        >>> print(*model.check_range([0.0, 8.0]))
        H04 x goes to 8, fitted from -5 to 4.999 - fit a record that reaches as far
        """
        new = column(x, "x")
        if self.identified is None or self.identified.x_range is None or not len(new):
            return ()
        low, high = self.identified.x_range
        furthest = max((float(new.min()), float(new.max())), key=lambda x: max(low - x, x - high))
        if low <= furthest <= high:
            return ()
        text = f"x goes to {furthest:.4g}, fitted from {low:.4g} to {high:.4g}"
        remedy = "fit a record that reaches as far"
        return (Note("H04", "warning", text, measured=furthest, remedy=remedy),)

    def stream(self) -> Stream:
        """Return the model at work, one sample at a time, in its virgin state.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.hysteresis.PlayStack(r=[0, 1], w=[1, 1]).stream().step(3.0)
        5.0
        """
        return _core.Stream(self)

    def inverse(self: Self) -> Self:
        """Return the model whose output is this one's input.

        Raises
        ------
        UsageError
            No inverse exists.

        Examples
        --------
        >>> import plantune as pt
        >>> stack = pt.hysteresis.PlayStack(r=[0, 1], w=[1, 1])
        >>> stack.inverse().simulate(stack.simulate([3.0, 2.0, 0.0]))
        array([3., 2., 0.])
        """
        return type(self)(**_core.hysteresis_inverse(self))

    def same_as(self, other: Any) -> bool:
        """Whether the other model has the same class and numbers.

        Examples
        --------
        >>> import plantune as pt
        >>> stack = pt.hysteresis.PlayStack(r=[0, 1], w=[1, 1])
        >>> stack.same_as(stack.inverse().inverse())
        True
        """
        if type(self) is not type(other):
            return False
        mine, others = _own(self), _own(other)
        return all(np.array_equal(mine[name], others[name]) for name in mine)


def _own(model: HysteresisModel) -> dict[str, Any]:
    """Return the fields that make a model what it is, not how it was found."""
    names = (f.name for f in fields(model) if f.repr)  # type: ignore[arg-type]
    return {name: np.asarray(getattr(model, name)) for name in names}


def column(x: ArrayLike, name: str) -> Floats:
    """Return a signal (N,) of finite numbers."""
    signal = np.ascontiguousarray(x, float)
    if signal.ndim != 1 or not np.isfinite(signal).all():
        shape = f"of shape {signal.shape}" if signal.ndim != 1 else "not finite everywhere"
        raise refusal("U01", f"`{name}` is {shape}", remedy="pass one row of finite numbers (N,)")
    return signal


def frozen(p: ArrayLike, name: str) -> Floats:
    """Return parameters as an array that cannot be written."""
    x = np.array(p, float).reshape(-1)
    if not np.isfinite(x).all():
        raise refusal("U01", f"`{name}` is {p!r}, must be finite", remedy="pass finite numbers")
    x.flags.writeable = False
    return x


def freeze(model: Any, *names: str, **like: str) -> None:
    """Turn fields of a model into arrays that cannot be written, and its offset into a number.

    A field of `like` that is not given becomes zeros, as many as the field it is like.
    """
    for name in names:
        object.__setattr__(model, name, frozen(getattr(model, name), name))
    for name, other in like.items():
        given = getattr(model, name)
        values = np.zeros(len(getattr(model, other))) if given is None else given
        object.__setattr__(model, name, frozen(values, name))
    object.__setattr__(model, "offset", float(model.offset))
