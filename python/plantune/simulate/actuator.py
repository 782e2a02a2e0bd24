"""What stands between controller and plant."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True, slots=True)
class Actuator:
    """Limits of u, and a valve that does not follow every command.

    The controller keeps its output, and by anti-windup its integral, within limits and rate; of
    dead band and step it knows nothing.

    Parameters
    ----------
    low, high : float
        Limits of u, units of u.
    rate : float
        Fastest change of u, units of u per second.
    dead_band : float
        The valve moves only if the command differs from its position by more, then goes there.
    step : float
        Smallest step of u, as of a converter; 0 for none.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> pid = pt.models.PID(Kp=1.5, Ti=4.0, Ts=0.1)
    >>> response = pt.simulate.step(plant, pid, actuator=Actuator(low=0.0, high=0.8))
    >>> float(response.u.max()), round(float(response.y[-1]), 3)
    (0.8, 1.0)
    """

    low: float = -inf
    high: float = inf
    rate: float = inf
    dead_band: float = 0.0
    step: float = 0.0
