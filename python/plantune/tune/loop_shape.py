"""Settings for a given crossover and phase margin."""

from __future__ import annotations

from typing import Any

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.notes import Limits
from plantune.tune.judge import judged
from plantune.tune.tuning import Tuning


def loop_shape(
    model: LinearModel | Fit,
    *,
    w_c: float,
    phase_margin: float,
    controller: str = "PI",
    Ts: float | None = None,
    limits: Limits | None = None,
) -> Tuning:
    """Return the controller whose loop crosses over at `w_c` with a given phase margin.

    Parameters
    ----------
    model : ProcessModel, TransferFunction, PolyModel or Fit
        Any plant; of a fit the margins come with bands over its uncertainty.
    w_c : float
        Gain crossover, rad/s.
    phase_margin : float
        Degrees.
    controller : "PI" or "PID"
        The PID has `Td = Ti / 4` and the filter `Tf = Td / 10` on D.
    Ts : float, optional
        Sample time of a sampled controller, seconds; that of a polynomial model by default.
    limits : Limits, optional
        Thresholds; a margin below `C07` or `C07_phase` leaves a note.

    Returns
    -------
    Tuning
        `Kp` has the sign of the process; `tau_c` is NaN.  Where the loop crosses over again, its
        margins are those of the worst crossover.

    Raises
    ------
    UsageError
        `w_c` or `phase_margin` out of its range (U01).
    NotIdentifiable
        The controller cannot turn the phase so far at `w_c` (M12): says how far it can.

    Notes
    -----
    `C(j w_c) G(j w_c) = e^(j (phi_M - pi))`: two equations for `Kp` and `Ki`.  Astrom and Hagglund
    1995, chapter 4.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> plant = ProcessModel(K=1.0, T=(1.0, 1.0, 1.0))
    >>> pi = loop_shape(plant, w_c=0.5205, phase_margin=60.0).controller
    >>> round(pi.Kp, 2), round(pi.Ki, 3)
    (1.14, 0.454)
    >>> loop_shape(plant, w_c=1.0, phase_margin=60.0)
    Traceback (most recent call last):
    plantune.errors.NotIdentifiable: M12: no PI gives 60 degrees at 1 rad/s: there it reaches from
    -45 to 45 degrees
    measured 60, limit 45
    do: lower w_c, or ask for controller="PID"
    """
    plant: Any = model.model if isinstance(model, Fit) else model
    Ts = getattr(plant, "Ts", None) if Ts is None else Ts
    pid = PID(**_core.loop_shape(plant, float(w_c), float(phase_margin), controller, Ts))
    rule = f"{controller} for w_c = {w_c:g}, phase_margin = {phase_margin:g}"
    return judged(rule, model, plant, pid, limits=limits)
