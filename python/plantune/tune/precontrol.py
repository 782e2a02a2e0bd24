"""Steady-state feed-forward."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.models import PolyModel
from plantune.models.base import LinearModel


def precontrol(
    model: LinearModel | Fit, r: float = 0.0, *, load: float = 0.0, ramp: float = 0.0
) -> float:
    """Return the input p = r / K - load that holds the plant at r.

    Parameters
    ----------
    model : ProcessModel, TransferFunction, PolyModel or Fit
        Of one input.  The offset of a fit is taken from `r`, `p = (r - O) / K - load`; of an
        integrating fit it is the drift and is taken from `ramp`.
    r : float
        Set point; an integrating plant needs no input to stay there.
    load : float
        Known load at the plant input, in units of u.
    ramp : float
        Slope of the set point, y/s, which an integrating plant follows on `ramp / K`.

    Returns
    -------
    float
        To be added to the output of the controller, which then ends where it began.

    Raises
    ------
    UsageError
        A number is not finite, or `ramp` is given for a plant that settles (U01).
    NotIdentifiable
        The static gain is zero (M12), or the plant has two integrators (M01).

    Notes
    -----
    Source 001, (3.4-46) to (3.4-53): with integral action the controller ends at `r / K`, whatever
    its settings.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> precontrol(ProcessModel(K=-5.0, T=2.0, L=1.0), 10.0, load=0.5)
    -2.5
    >>> precontrol(ProcessModel(K=0.25, T=(), L=1.0, integrating=True), 10.0, ramp=2.0)
    8.0
    """
    if not isinstance(model, Fit):
        return _core.precontrol(model, r, load, ramp)
    plant, offset = model.model, float(model.offset[0])
    integrates = not isinstance(plant, PolyModel) and getattr(plant, "integrating", False)
    return _core.precontrol(
        plant, r - (0.0 if integrates else offset), load, ramp - (offset if integrates else 0.0)
    )
