"""Objects of python-control."""

from __future__ import annotations

from typing import Any, Literal

from numpy.typing import ArrayLike

from plantune.estimate import Fit
from plantune.models import (
    PID,
    MatrixPolyModel,
    PolyModel,
    ProcessModel,
    StateSpace,
    TransferFunction,
)
from plantune.models import control as of_models
from plantune.tune import Tuning


def to_control(
    what: ProcessModel
    | TransferFunction
    | PolyModel
    | MatrixPolyModel
    | StateSpace
    | PID
    | Fit
    | Tuning,
    delay: Literal["pade", "frd"] = "pade",
    order: int = 3,
    w: ArrayLike | None = None,
) -> Any:
    """Return a model or controller as an object of python-control.

    Parameters
    ----------
    what : a model of plantune.models, PID, Fit or Tuning
        Of a fit its model, of a tuning its controller.  A controller is its transfer function
        from the error, `b = c = 1`.
    delay : "pade" or "frd"
        A transfer function, the dead time of a process model in Padé form; or frequency data,
        with the exact delay.
    order : int
        Of the Padé form, 1 to 10: within 8 % up to `w = order / L`.
    w : array (m,), optional
        Frequencies of the data, rad/s; needed for "frd".

    Returns
    -------
    control.TransferFunction or control.FrequencyResponseData
        Of a sampled model or controller in z, its `dt` being `Ts`; a PolyModel with its whole
        delay, exact, one column per input; a MatrixPolyModel or
        StateSpace as `control.StateSpace`.

    Raises
    ------
    UsageError
        python-control is not installed, or an argument is out of its range (U01).

    Notes
    -----
    `model.to_control(...)` is the same.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> tuning = pt.tune.simc(plant)
    >>> loop = pt.export.to_control(plant, order=5) * pt.export.to_control(tuning)
    >>> import control
    >>> gain_margin, phase_margin, _, _ = control.margin(loop)
    >>> float(gain_margin), float(phase_margin)
    (3.142, 61.35)
    >>> tuning.margins.gain, tuning.margins.phase_deg
    (3.142, 61.35)
    """
    if isinstance(what, Tuning):
        what = what.controller
    elif isinstance(what, Fit) and what.model is not None:
        what = what.model
    return of_models.to_control(what, delay, order, w)  # type: ignore[arg-type]
