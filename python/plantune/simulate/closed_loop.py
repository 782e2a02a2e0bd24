"""A process model in a loop with a PID controller."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models import PID, ProcessModel
from plantune.record import Floats


@dataclass(frozen=True, slots=True)
class Indices:
    """Time-domain indices from true integrals; NaN where the response defines none.

    Attributes
    ----------
    rise, settling : float
        Seconds from 10 to 90 %, and into 2 % for good, interpolated.
    overshoot, control_overshoot : float
        Percent of the move of y and of u.
    ise, iae, itae : float
        Integrals of `e^2`, `|e|`, `t |e|` with `e = r - y`.
    control_energy, total_variation : float
        Integral of `u^2`; sum of all moves of u.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> slow = pt.simulate.step(plant, pt.models.PID(Kp=1.0, Ti=5.0)).indices
    >>> fast = pt.simulate.step(plant, pt.models.PID(Kp=1.5, Ti=5.0)).indices
    >>> round(slow.overshoot, 1), round(fast.overshoot, 1)
    (0.1, 11.6)
    >>> slow.total_variation < fast.total_variation
    True
    """

    rise: float
    settling: float
    overshoot: float
    ise: float
    iae: float
    itae: float
    control_overshoot: float
    control_energy: float
    total_variation: float


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Signals of a loop over time, and the indices computed from them.

    Attributes
    ----------
    t : array (N + 1,)
        Seconds.
    r, y, u : array (N + 1,)
        Set point; output without noise; controller output, from each time on.
    indices : Indices
        Rise, settling, overshoot, integrals of the error.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> response = pt.simulate.step(plant, pt.models.PID(Kp=1.0, Ti=5.0), t_end=20.0)
    >>> float(response.t[-1]), round(float(response.y[-1]), 3)
    (20.0, 1.0)
    >>> round(response.indices.settling, 2)
    5.45
    """

    t: Floats
    r: Floats
    y: Floats
    u: Floats
    indices: Indices


def step(model: ProcessModel, pid: PID, t_end: float | None = None) -> Response:
    """Return the response of the loop to a unit step of the set point at time 0.

    Parameters
    ----------
    model : ProcessModel
        The plant, exact delay.
    pid : PID
        Continuous, or sampled with its own `Ts`.
    t_end : float, optional
        Seconds; by default until the loop has settled many times over.

    Returns
    -------
    Response
        At 1000 steps, or at every sample of a sampled controller.

    Notes
    -----
    Source 001, tables 3.6-2 and 3.6-4, with true integrals.

    Examples
    --------
    >>> plant = ProcessModel(K=5.939, T=0.1491, L=0.1)
    >>> response = step(plant, PID(Kp=0.131451, Ti=0.1491), t_end=3.0)
    >>> round(response.indices.overshoot, 3), round(response.indices.iae, 4)
    (5.643, 0.2138)
    """
    if t_end is None:
        t_end = _core.default_horizon(model, pid)
    steps, dt = _grid(pid, t_end)
    return closed_loop(model, pid, r=np.ones(steps), Ts=dt)


def load_step(model: ProcessModel, pid: PID, t_end: float | None = None) -> Response:
    """Return the response of the loop to a unit step added to the plant input at time 0.

    Parameters
    ----------
    model : ProcessModel
        The plant, exact delay.
    pid : PID
        Continuous, or sampled with its own `Ts`.
    t_end : float, optional
        Seconds; by default until the load has died out, within reason.

    Returns
    -------
    Response
        At 1000 steps, or at every sample of a sampled controller; the set point stays at 0, so
        `rise`, `settling` and `overshoot` are NaN.

    Examples
    --------
    >>> plant = ProcessModel(K=5.939, T=0.1491, L=0.1)
    >>> response = load_step(plant, PID(Kp=0.131451, Ti=0.1491))
    >>> round(float(response.u[-1]), 3), round(response.indices.iae, 2)
    (-1.0, 1.13)
    """
    if t_end is None:
        t_end = _core.load_horizon(model, pid)
    steps, dt = _grid(pid, t_end)
    return closed_loop(model, pid, r=np.zeros(steps), d=np.ones(steps), Ts=dt)


def _grid(pid: PID, t_end: float) -> tuple[int, float]:
    """Return the number of steps and their length in seconds."""
    if not 0 < t_end < inf:
        raise refusal(
            "U01", f"`t_end` is {t_end}, must be positive and finite", remedy="t_end=10.0"
        )
    dt = pid.Ts or t_end / 1000
    return max(1, round(t_end / dt)), dt


def closed_loop(
    model: ProcessModel,
    pid: PID,
    r: ArrayLike,
    *,
    d: ArrayLike | None = None,
    noise: ArrayLike | None = None,
    Ts: float | None = None,
    offset: float = 0.0,
    u0: float = 0.0,
) -> Response:
    """Simulate a loop, the delay exact, fraction included.

    Parameters
    ----------
    model : ProcessModel
        The plant.
    pid : PID
        Continuous, or sampled with its own `Ts`.
    r, d, noise : array (N,)
        Set point; disturbance added to the plant input; noise added to what a sampled
        controller reads.  Each value holds for `Ts` seconds.
    Ts : float, optional
        Seconds; the controller's own if it is sampled.
    offset : float
        `O` in `y = G u + O`.
    u0 : float
        Input before time 0, at which the loop is in equilibrium.

    Returns
    -------
    Response
        N + 1 rows, `y` without the noise.

    Raises
    ------
    UsageError
        Lengths that differ, noise for a continuous controller, an unfiltered derivative (U01).

    Examples
    --------
    >>> plant, pid = ProcessModel(K=2.0, T=1.0, L=0.3), PID(Kp=0.5, Ti=1.0, Ts=0.1)
    >>> response = closed_loop(plant, pid, r=[1.0] * 100)
    >>> round(float(response.y[-1]), 3)
    1.0
    """
    r = np.ascontiguousarray(np.atleast_1d(r), float)
    zero = np.zeros(len(r))
    d, noise = (zero if x is None else np.ascontiguousarray(x, float) for x in (d, noise))
    dt = Ts if Ts is not None else pid.Ts
    if dt is None:
        raise refusal("U01", "`Ts` is missing", remedy="pass Ts=, the seconds each r holds")
    out = _core.closed_loop(model, pid, dt, r, d, noise, offset, u0)
    return Response(**{**out, "indices": Indices(**out["indices"])})
