"""A plant in a loop with a PID controller."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, inf
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.notes import Note, notes_from_core
from plantune.record import Floats
from plantune.simulate.actuator import Actuator
from plantune.simulate.schedule import Schedule
from plantune.simulate.varying import VaryingPlant

_MOST_ROWS = 10_000_000


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
    notes : tuple of Note
        A loop that runs away (M02): its response ends there.

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
    notes: tuple[Note, ...] = ()


def step(model: LinearModel, pid: PID, t_end: float | None = None, **loop: Any) -> Response:
    """Return the response of the loop to a unit step of the set point at time 0.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or PolyModel
        The plant, exact delay.
    pid : PID
        Continuous, or sampled with its own `Ts`.
    t_end : float, optional
        Seconds; by default until a sound loop has settled many times over.
    **loop
        Keywords of `closed_loop`, such as `actuator`.

    Returns
    -------
    Response
        At 1000 steps, or at every sample of a sampled controller.

    Notes
    -----
    Source 001, tables 3.6-2 and 3.6-4, with true integrals.

    Examples
    --------
    >>> from plantune.models import PID, ProcessModel
    >>> plant = ProcessModel(K=5.939, T=0.1491, L=0.1)
    >>> response = step(plant, PID(Kp=0.131451, Ti=0.1491), t_end=3.0)
    >>> round(response.indices.overshoot, 3), round(response.indices.iae, 4)
    (5.643, 0.2138)
    >>> third = ProcessModel(K=1.0, T=(1.0, 1.0, 1.0))
    >>> round(step(third, PID(Kp=1.14, Ti=2.511)).indices.overshoot, 1)
    8.2
    """
    if t_end is None:
        t_end = _core.default_horizon(model, pid)
    steps, dt = _grid(pid, t_end)
    return closed_loop(model, pid, r=np.ones(steps), Ts=dt, **loop)


def load_step(model: LinearModel, pid: PID, t_end: float | None = None, **loop: Any) -> Response:
    """Return the response of the loop to a unit step added to the plant input at time 0.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or PolyModel
        The plant, exact delay.
    pid : PID
        Continuous, or sampled with its own `Ts`.
    t_end : float, optional
        Seconds; by default until the load has died out, within reason.
    **loop
        Keywords of `closed_loop`, such as `actuator`.

    Returns
    -------
    Response
        At 1000 steps, or at every sample of a sampled controller; the set point stays at 0, so
        `rise`, `settling` and `overshoot` are NaN.

    Examples
    --------
    >>> from plantune.models import PID, ProcessModel
    >>> plant = ProcessModel(K=5.939, T=0.1491, L=0.1)
    >>> response = load_step(plant, PID(Kp=0.131451, Ti=0.1491))
    >>> round(float(response.u[-1]), 3), round(response.indices.iae, 2)
    (-1.0, 1.13)
    """
    if t_end is None:
        t_end = _core.load_horizon(model, pid)
    steps, dt = _grid(pid, t_end)
    return closed_loop(model, pid, r=np.zeros(steps), d=np.ones(steps), Ts=dt, **loop)


def _grid(pid: PID, t_end: float) -> tuple[int, float]:
    """Return the number of steps and their length in seconds."""
    if not 0 < t_end < inf:
        raise refusal(
            "U01", f"`t_end` is {t_end}, must be positive and finite", remedy="t_end=10.0"
        )
    dt = pid.Ts or t_end / 1000
    if t_end / dt > _MOST_ROWS:
        raise refusal(
            "U01",
            f"`t_end` is {t_end:.6g} s, {t_end / dt:.1e} samples of {dt:g} s",
            measured=t_end / dt,
            limit=_MOST_ROWS,
            remedy=f"t_end={_MOST_ROWS * dt:g} or less",
        )
    return max(1, round(t_end / dt)), dt


def closed_loop(
    model: LinearModel | VaryingPlant,
    pid: PID,
    r: ArrayLike,
    *,
    d: ArrayLike | None = None,
    dy: ArrayLike | None = None,
    noise: ArrayLike | None = None,
    p: ArrayLike | None = None,
    Ts: float | None = None,
    offset: float = 0.0,
    u0: float = 0.0,
    actuator: Actuator | None = None,
    y_step: float = 0.0,
    anti_windup: str | None = "clamping",
    Tt: float | None = None,
    manual: ArrayLike | None = None,
    settings: Sequence[tuple[float, PID]] = (),
    schedule: Schedule | None = None,
) -> Response:
    """Simulate a loop, the delay exact, fraction included.

    Parameters
    ----------
    model : ProcessModel, TransferFunction, PolyModel or VaryingPlant
        The plant; a PolyModel and a VaryingPlant with a sampled controller.
    pid : PID
        Continuous, or sampled with its own `Ts`.
    r : array (N,)
        Set point.  This and the other signals hold for `Ts` seconds in each row.
    d, dy : array (N,), optional
        Disturbances, added to the plant's input and to its output.
    noise : array (N,), optional
        Added to what a sampled controller reads.
    p : array (N,), optional
        Pre-control, added to the controller output; the limits act on the sum.
    Ts : float, optional
        Seconds; the controller's own if it is sampled.
    offset : float
        `O` in `y = G u + O`.
    u0 : float
        Input before time 0, at which the loop is in equilibrium.  An integrating plant rests at
        any u0, with y = offset.
    actuator : Actuator, optional
        Limits, rate, dead band and step of u; the last two with a sampled controller.
    y_step : float
        Smallest step of the y that a sampled controller reads; 0 for none.
    anti_windup : "clamping", "back_calculation" or None
        At a limit the integral waits while it is driven further out; it follows u within `Tt`; or
        it goes on.
    Tt : float, optional
        Tracking time of back-calculation, seconds; `sqrt(Ti Td)` by default, `Ti` without D.
    manual : array (N,), optional
        Controller output in manual; NaN where it is in automatic, which goes on without a bump.
    settings : sequence of (t, PID)
        Settings from a time on, in seconds, without a bump.
    schedule : Schedule, optional
        Settings of every row.

    Returns
    -------
    Response
        N + 1 rows, `y` without the noise; fewer where the loop runs away, with a note (M02).

    Raises
    ------
    UsageError
        Lengths that differ, what a continuous controller cannot do (noise, steps, an unfiltered
        derivative), limits that do not hold u0 (U01).

    Notes
    -----
    A sampled loop is exact, at the samples and between them; a continuous one takes u as a
    straight line between nodes, which costs about 1e-6 of the indices.  Between nodes y is a
    cubic by its slopes, 1e-6 as well.  Source 001, 3.4 and (3.7-20) to (3.7-25).

    Examples
    --------
    >>> from plantune.models import PID, ProcessModel
    >>> plant, pid = ProcessModel(K=2.0, T=1.0, L=0.3), PID(Kp=0.5, Ti=1.0, Ts=0.1)
    >>> response = closed_loop(plant, pid, r=[1.0] * 100)
    >>> round(float(response.y[-1]), 3)
    1.0
    >>> valve = Actuator(low=0.0, high=0.6, rate=0.5)
    >>> response = closed_loop(plant, pid, r=[1.0] * 100, actuator=valve)
    >>> response.u[:4].round(2)
    array([0.05, 0.1 , 0.15, 0.2 ])
    """
    dt = Ts if Ts is not None else pid.Ts
    if dt is None:
        raise refusal("U01", "`Ts` is missing", remedy="pass Ts=, the seconds each r holds")
    if isinstance(model, VaryingPlant) and offset:
        raise refusal("U01", "`offset` is given twice", remedy="give it to the VaryingPlant alone")
    r = _signal(r)
    out = np.empty((4, len(r) + 1))
    run = _core.closed_loop(
        model,
        pid,
        dt,
        r,
        out,
        **{name: _signal(x) for name, x in _given(d=d, dy=dy, noise=noise, p=p, manual=manual)},
        offset=offset,
        u0=u0,
        actuator=actuator,
        y_step=y_step,
        anti_windup="none" if anti_windup is None else anti_windup,
        Tt=Tt,
        settings=[(max(0, ceil(t / dt - 1e-9)), new) for t, new in sorted(settings, key=_time)],
        schedule=schedule,
    )
    out.flags.writeable = False
    t, r, y, u = (row[: run["rows"]] for row in out)
    return Response(t, r, y, u, Indices(**run["indices"]), notes_from_core(run["notes"]))


def _signal(x: ArrayLike) -> Floats:
    return np.ascontiguousarray(np.atleast_1d(x), float)


def _given(**signals: ArrayLike | None) -> Iterator[tuple[str, ArrayLike]]:
    return ((name, x) for name, x in signals.items() if x is not None)


def _time(change: tuple[float, PID]) -> float:
    return change[0]
