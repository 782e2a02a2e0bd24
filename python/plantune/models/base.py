"""What every linear model answers, each in one call of the core."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS
from plantune.record import Floats, Record, columns


class LinearModel:
    """Base of the models of one output: simulation, prediction, frequency response."""

    __slots__ = ()
    kind: ClassVar[str]

    def simulate(
        self, u: ArrayLike, Ts: float | None = None, x0: float = 0.0, offset: float = 0.0
    ) -> Floats:
        """Return the output for the input `u`, from rest unless `x0` is given.

        Parameters
        ----------
        u : array (N,) or (N, nu)
            Input; before row 0 it is zero.
        Ts : float, optional
            Sample time in seconds; needed where the model has none of its own.
        x0 : float
            Output at row 0 (process models).
        offset : float
            `O` in `y = G u + O`; of an integrating model the drift per second.

        Returns
        -------
        array (N,)

        Raises
        ------
        UsageError
            `Ts` is absent, or not that of the model.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> ProcessModel(K=2.0, T=1.0, L=0.0).simulate([1.0, 1.0, 1.0], Ts=1.0)
        array([0.        , 1.26424112, 1.72932943])
        """
        step = getattr(self, "Ts", None) if Ts is None else Ts
        if step is None:
            raise refusal("U01", "`Ts` is missing", remedy="pass Ts= in seconds")
        return _core.simulate(self, columns(u, "u"), step, x0, offset)

    def predict(self, rec: Record, horizon: int | None = 1, offset: float = 0.0) -> Floats:
        """Return the output predicted `horizon` steps ahead on a record; None simulates.

        The initial state of each segment is estimated.  Rows without history, and rows of
        segments that are too short, are NaN.

        Parameters
        ----------
        rec : Record
            With as many inputs as the model and one output.
        horizon : int or None
            Steps ahead, at least 1.
        offset : float
            `O` in `y = G u + O`.

        Returns
        -------
        array (N,)

        Examples
        --------
        >>> import plantune as pt
        >>> rec = pt.Record(u=[0, 1, 1, 1, 1], y=[0, 0, 0.5, 0.75, 0.875], Ts=1.0)
        >>> model = pt.models.PolyModel(A=[1, -0.5], B=[0.5], nk=1, Ts=1.0)
        >>> model.predict(rec).round(3)
        array([  nan, 0.   , 0.5  , 0.75 , 0.875])
        """
        rows, yhat, _, _ = _core.over_record(
            rec, self, horizon, "estimate", offset, rec.limits or DEFAULT_LIMITS
        )
        full = np.full(rec.N, np.nan)
        full[rows] = yhat
        return full

    def freqresp(self, w: ArrayLike, input: int = 0) -> NDArray[np.complex128]:
        """Return the frequency response at `w` rad/s, with the exact delay.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> ProcessModel(K=2.0, T=1.0, L=0.0).freqresp([1.0])
        array([1.-1.j])
        """
        return _core.freqresp(self, input, np.ascontiguousarray(np.atleast_1d(w), float))

    def step(self, t: ArrayLike, input: int = 0) -> Floats:
        """Return the response at times `t` to a unit step at time 0.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> ProcessModel(K=2.0, T=1.0, L=0.5).step([0.5, 1.5])
        array([0.        , 1.26424112])
        """
        return _core.step_response(self, input, np.ascontiguousarray(np.atleast_1d(t), float))

    def horizon(self) -> float:
        """Return the seconds until a step response is seen whole.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> ProcessModel(K=2.0, T=5.0, L=3.0).horizon()
        43.0
        """
        return _core.horizon(self)

    def poles(self) -> NDArray[np.complex128]:
        """Return the poles: in z for sampled models, in 1/s for process models.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> ProcessModel(K=2.0, T=0.5, L=0.0).poles()
        array([-2.+0.j])
        """
        return _core.poles(self)

    def zeros(self, input: int = 0) -> NDArray[np.complex128]:
        """Return the zeros from one input, in the plane of the poles.

        Examples
        --------
        >>> from plantune.models import PolyModel
        >>> PolyModel(A=[1, -0.5], B=[1, 0.25], nk=1, Ts=1.0).zeros()
        array([-0.25+0.j])
        """
        return _core.zeros(self, input)

    def dc_gain(self) -> Any:
        """Return the static gain, a list with several inputs; infinite for an integrator.

        Examples
        --------
        >>> from plantune.models import PolyModel
        >>> PolyModel(A=[1, -0.5], B=[1], nk=1, Ts=1.0).dc_gain()
        2.0
        """
        gains: Sequence[float] = _core.dc_gain(self)
        return gains[0] if len(gains) == 1 else list(gains)

    def resonance(self, input: int = 0) -> tuple[float, float] | None:
        """Return frequency in rad/s and damping of the poorly damped poles that ring most.

        None where every pole is well damped, from `1/sqrt(2)` on.

        Examples
        --------
        >>> from plantune.models import PolyModel
        >>> w, zeta = PolyModel(A=[1, -1.6, 0.9], B=[1], nk=1, Ts=0.1).resonance()
        >>> round(w, 2), round(zeta, 2)
        (5.71, 0.09)
        """
        return _core.resonance(self, input)

    def to_control(self, **options: Any) -> Any:
        """Return the model as an object of python-control; options as of `pt.export.to_control`.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> print(ProcessModel(K=2.0, T=4.0, L=0.0).to_control().poles().real)
        [-0.25]
        """
        from plantune.models.control import to_control

        return to_control(self, **options)  # type: ignore[arg-type]

    def same_as(self, other: Any) -> bool:
        """Whether the other model has the same class and numbers.

        Examples
        --------
        >>> from plantune.models import ProcessModel
        >>> ProcessModel(K=1, T=1, L=0).same_as(ProcessModel(K=1, T=1, L=0))
        True
        """
        return type(self) is type(other) and repr(self) == repr(other)


def coefficients(p: Any, name: str) -> Floats:
    """Return a polynomial as a frozen array; refuse what is not finite."""
    x = np.array(p, float).reshape(-1)
    if len(x) == 0 or not np.isfinite(x).all():
        raise refusal("U01", f"`{name}` is {p!r}, must be finite", remedy="at least one number")
    x.flags.writeable = False
    return x
