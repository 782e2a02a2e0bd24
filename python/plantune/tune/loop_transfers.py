"""The closed loop as transfer functions."""

from __future__ import annotations

from dataclasses import dataclass

from plantune import _core
from plantune.models import PID, ProcessModel, TransferFunction


@dataclass(frozen=True, slots=True, eq=False)
class LoopTransfers:
    """From set point, load and output disturbance to output, controller output and error.

    Attributes
    ----------
    y_r, u_r, e_r : TransferFunction
        Set point to output, controller output and error.
    y_p : TransferFunction
        Load at the plant input to output.
    y_d, u_d : TransferFunction
        Disturbance at the plant output to output and controller output.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=1.0, T=2.0)
    >>> print(pt.tune.loop_transfers(plant, pt.models.PID(Kp=4.0, Ti=2.0)).y_r)
    G(s) = (4 s + 2) / (2 s^2 + 5 s + 2)
    """

    y_r: TransferFunction
    u_r: TransferFunction
    e_r: TransferFunction
    y_p: TransferFunction
    y_d: TransferFunction
    u_d: TransferFunction


def loop_transfers(
    model: ProcessModel | TransferFunction, pid: PID, *, delay: str = "pade"
) -> LoopTransfers:
    """Return the closed loop of a continuous controller, the dead time made rational.

    Parameters
    ----------
    model : ProcessModel or TransferFunction
        The plant.
    pid : PID
        Continuous; its weights `b` and `c` apply to the set point.
    delay : "pade" or "taylor"
        `(1 - L s/2) / (1 + L s/2)` or `1 - L s`; "exact" serves only a plant without delay.

    Returns
    -------
    LoopTransfers
        With `b = c = 1` the forms of source 001; `.y_r.step(t)` is the step response (3.4-38) or
        (3.4-45), `.poles()` what the Routh conditions speak of.

    Raises
    ------
    UsageError
        A sampled controller, a polynomial model, a dead time left as it is (U01).

    Notes
    -----
    Source 001, (3.4-9) to (3.4-17), as corrected.  For what the loop truly does take
    `simulate.step` and `tune.sensitivities`, whose dead time is exact.

    Examples
    --------
    >>> plant, pi = ProcessModel(K=5.939, T=0.1491, L=0.1), PID(Kp=0.131451, Ti=0.1491)
    >>> for delay in ("taylor", "pade"):
    ...     print(delay, loop_transfers(plant, pi, delay=delay).y_r.step([0.1, 0.3, 3.0]).round(3))
    taylor [0.301 0.922 1.   ]
    pade [0.083 0.892 1.   ]
    """
    return LoopTransfers(*(TransferFunction(**G) for G in _core.loop_transfers(model, pid, delay)))
