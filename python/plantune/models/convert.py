"""Exact conversion between process models and their sampled form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, overload

from plantune import _core
from plantune.models.matrix_poly import MatrixPolyModel
from plantune.models.poly import PolyModel
from plantune.models.process import ProcessModel
from plantune.models.state_space import StateSpace
from plantune.models.transfer import TransferFunction


@overload
def c2d(model: StateSpace, Ts: float) -> StateSpace: ...
@overload
def c2d(model: ProcessModel | TransferFunction, Ts: float) -> PolyModel: ...
def c2d(model: ProcessModel | TransferFunction | StateSpace, Ts: float) -> PolyModel | StateSpace:
    """Sample a continuous model behind a zero-order hold, exact for any delay.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or StateSpace
        Of any order; `K != 0`, `T > 0`, `L >= 0`.
    Ts : float
        Sample time, seconds.

    Returns
    -------
    PolyModel, or StateSpace of a StateSpace
        Of first order `A = [1, -a]`; `B = [b1]` for a whole delay, else `[b1, b2]`; `nk` one more
        than the whole samples in `L`.

    Raises
    ------
    NotIdentifiable
        The model is none (M12).

    Examples
    --------
    >>> print(c2d(ProcessModel(K=-5.939, T=0.1491, L=0.1), Ts=0.02))
    A(q) y(t) = B(q) u(t - 6) + e(t)
    A(q) = 1 - 0.874469 q^-1
    B(q) = -0.745527
    Ts = 0.02 s
    """
    if isinstance(model, StateSpace):
        return model.c2d(Ts)
    return PolyModel.of_core(_core.c2d(model, Ts))


@overload
def d2c(model: StateSpace) -> StateSpace: ...
@overload
def d2c(model: PolyModel) -> ProcessModel: ...
def d2c(model: PolyModel | StateSpace) -> ProcessModel | StateSpace:
    """Return the process model of which a first-order model is the sampled form.

    The inverse of `c2d`; the fraction of the delay is read from the two b coefficients.

    Parameters
    ----------
    model : PolyModel or StateSpace
        `A = [1, -a]` with `0 < a < 1`; one or two b coefficients.  A StateSpace of any order.

    Returns
    -------
    ProcessModel, or StateSpace of a StateSpace
        `T` and `L` in seconds.

    Raises
    ------
    NotIdentifiable
        A pole at or below 0, on or outside the unit circle, or b coefficients that no delay
        gives (M12).
    UsageError
        Not a first-order model of one input.

    Examples
    --------
    >>> print(d2c(c2d(ProcessModel(K=2.0, T=5.0, L=1.3), Ts=1.0)))
    G(s) = 2 e^(-1.3 s) / (5 s + 1)
    """
    if isinstance(model, StateSpace):
        return model.d2c()
    return ProcessModel(**_core.d2c(model))


def from_core(
    d: Mapping[str, Any],
) -> PolyModel | MatrixPolyModel | ProcessModel | TransferFunction | StateSpace:
    """Return the model that the core sends as a dict."""
    if "n" in d:
        return StateSpace.of_core(d)
    if "ny" in d:
        return MatrixPolyModel.of_core(d)
    if "num" in d:
        return TransferFunction(**d)
    return ProcessModel(**d) if "K" in d else PolyModel.of_core(d)
