"""Models and controllers as objects of python-control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal

if TYPE_CHECKING:
    from plantune.models.matrix_poly import MatrixPolyModel
    from plantune.models.pid import PID
    from plantune.models.poly import PolyModel
    from plantune.models.process import ProcessModel
    from plantune.models.state_space import StateSpace
    from plantune.models.transfer import TransferFunction

_KINDS = ("process", "transfer", "poly", "matrix_poly", "state_space", "pid")
_MOST_ORDER = 10  # the coefficients of a higher Padé form no longer fit in 16 digits


def to_control(
    model: ProcessModel | TransferFunction | PolyModel | MatrixPolyModel | StateSpace | PID,
    delay: Literal["pade", "frd"] = "pade",
    order: int = 3,
    w: ArrayLike | None = None,
) -> Any:
    """Return a model or controller as `plantune.export.to_control` does, which says how.

    It is here because `model.to_control()` calls it; fits and tunings are taken there only.

    Examples
    --------
    >>> from plantune.models import PolyModel, ProcessModel
    >>> print(to_control(PolyModel(A=[1, -0.5], B=[2], nk=2, Ts=0.1)).poles().real)
    [0.5 0. ]
    >>> plant = ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> exact = to_control(plant, delay="frd", w=[0.1, 1.0])
    >>> error = to_control(plant, order=3)([0.1j, 1.0j]) - exact.complex
    >>> bool(abs(error).max() < 1e-5)
    True
    """
    control = _library()
    if getattr(model, "kind", None) not in _KINDS:
        raise refusal(
            "U01",
            f"a {type(model).__name__} has no form in python-control",
            remedy="pass a model of plantune.models",
        )
    if delay == "pade":
        return _transfer_function(control, model, _order(order))
    if delay != "frd":
        raise refusal(
            "U01", f"`delay` is {delay!r}, must be 'pade' or 'frd'", remedy="delay='pade'"
        )
    if w is None:
        raise refusal("U01", "`w` is missing", remedy="pass w=, the frequencies in rad/s")
    w = np.ascontiguousarray(np.atleast_1d(w), float)
    if model.kind == "pid":
        return control.frd(_transfer_function(control, model, 1), w)
    if model.kind in ("matrix_poly", "state_space"):
        dt = 0 if model.Ts is None else model.Ts  # type: ignore[union-attr]
        return control.frd(np.moveaxis(model.freqresp(w), 0, 2), w, dt=dt)  # type: ignore[union-attr]
    inputs = len(_core.dc_gain(model))  # type: ignore[arg-type]
    response = np.array([[_core.freqresp(model, i, w) for i in range(inputs)]])  # type: ignore[arg-type]
    sampled = {"dt": model.Ts} if model.kind == "poly" else {}  # type: ignore[union-attr]
    return control.frd(response, w, **sampled)


def _library() -> Any:
    try:
        import control
    except ImportError:
        raise refusal(
            "U01", "python-control is not installed", remedy="pip install plantune[control]"
        ) from None
    return control


def _order(order: int) -> int:
    if order not in range(1, _MOST_ORDER + 1):
        raise refusal(
            "U01",
            f"`order` is {order}, must be a whole number from 1 to {_MOST_ORDER}",
            remedy="order=3, or delay='frd' for the exact delay",
        )
    return order


def _transfer_function(control: Any, model: Any, order: int) -> Any:
    if model.kind == "pid":
        return control.tf(*_core.pid_transfer(model), 0 if model.Ts is None else model.Ts)
    if model.kind == "matrix_poly":
        d = _core.matrix_state_space(model)
        n, ny, nu = d["n"], d["ny"], d["nu"]
        shapes = {"A": (n, n), "B": (n, nu), "C": (ny, n), "D": (ny, nu)}
        return control.ss(*(d[name].reshape(shape) for name, shape in shapes.items()), model.Ts)
    if model.kind == "state_space":
        return control.ss(model.A, model.B, model.C, model.D, 0 if model.Ts is None else model.Ts)
    if model.kind != "poly":
        G = model if model.kind == "transfer" else model.transfer()
        rational = control.tf(G.num, G.den)
        return rational * control.tf(*control.pade(G.L, order)) if G.L > 0 else rational
    columns = [_core.pulse_transfer(model, i) for i in range(len(_core.dc_gain(model)))]
    num, den = zip(*columns, strict=True)
    return control.tf([list(num)], [list(den)], model.Ts)
