"""A plant with hysteresis made to follow a reference."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune._core import Cmac
from plantune.errors import refusal
from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.models.hysteresis.base import HysteresisModel, column
from plantune.notes import Note, notes_from_core
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Tracking:
    """How a plant with hysteresis followed a reference.

    Attributes
    ----------
    t : array (N,)
        Seconds.
    r, y, u : array (N,)
        Reference; output without noise; input.
    ahead : array (N,)
        Share of u that waited for no error: inverse and CMAC.
    pass_rms : array (passes,)
        Root mean square of `r - y` in each pass.
    rms, worst : float
        Of all rows: root mean square and largest magnitude of `r - y`.
    relative : float
        `rms` over the range of r.
    notes : tuple of Note
        A loop that runs away, or may: M02; the signals end there.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> plant = pt.hysteresis.PlayStack(r=[0, 0.5], w=[1, 1])
    >>> run = pt.hysteresis.track(plant, np.sin(np.arange(100) / 10), 0.1)
    >>> run.y.shape, round(run.relative, 2)
    ((100,), 0.34)
    """

    t: Floats
    r: Floats
    y: Floats
    u: Floats
    ahead: Floats
    pass_rms: Floats
    rms: float
    worst: float
    relative: float
    notes: tuple[Note, ...] = ()


def track(
    plant: HysteresisModel,
    r: ArrayLike,
    Ts: float,
    *,
    inverse: HysteresisModel | None = None,
    pid: PID | None = None,
    cmac: Cmac | None = None,
    dynamics: LinearModel | None = None,
    limits: tuple[float, float] = (-inf, inf),
    noise_sd: float = 0.0,
    seed: int = 0,
    passes: int = 1,
) -> Tracking:
    """Simulate `u(t) = u_ff(r(t)) + u_cmac(r(t)) + u_pid(r(t-1) - y(t-1))` on a plant.

    Without `inverse`, `pid` and `cmac` the input is 0; with `inverse=None` no model is inverted.

    Parameters
    ----------
    plant : HysteresisModel
        From its virgin state.
    r : array (N,)
        Reference.
    Ts : float
        Sample time, seconds.
    inverse : HysteresisModel, optional
        Feed-forward, such as `model.inverse()` of an identified model; also a `PlayStack` of one
        weight for a mere gain.
    pid : PID, optional
        Feedback, sampled at Ts.
    cmac : Cmac, optional
        Learns the whole of u while it runs, and goes on learning in a further call.
    dynamics : ProcessModel, TransferFunction or PolyModel, optional
        Behind the hysteresis, at rest at 0; y is then read at the end of the sample.
    limits : (float, float)
        Of u, with 0 between them.
    noise_sd : float
        Standard deviation of the white noise on the y that the controller reads.
    seed : int
        Of the noise.
    passes : int
        How often the reference is run, one pass after the other.

    Returns
    -------
    Tracking
        Rows of all passes.

    Raises
    ------
    UsageError
        A reference that stands still; a CMAC with `beta` = 1 and no dead zone beside integral
        action, which run away together (U01).

    Notes
    -----
    y(t) is the answer to u(t), so the controller knows the error of the sample before, both of its
    signals: with `r(t) - y(t-1)` it would fight a feed-forward that is right.  Source 002, figures
    3.3 and 5.1.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> plant = pt.hysteresis.PlayStack(r=[0, 0.5], w=[1, 1])
    >>> r = np.sin(np.arange(500) / 20)
    >>> gain = pt.hysteresis.PlayStack(r=[0], w=[0.5])
    >>> pid = pt.models.PID.integral(2.0)
    >>> for ahead in (gain, plant.inverse()):
    ...     run = pt.hysteresis.track(plant, r, 0.1, inverse=ahead, pid=pid)
    ...     print(f"{100 * run.relative:.3f} %")
    2.990 %
    0.000 %
    """
    once = column(r, "r")
    if passes < 1 or not noise_sd >= 0:
        text = f"`passes` is {passes}, `noise_sd` {noise_sd}"
        raise refusal("U01", text, remedy="one pass or more, noise of 0 or more")
    r = np.tile(once, passes)
    noise = noise_sd * np.random.default_rng(seed).standard_normal(len(r))
    fields = _core.hysteresis_track(
        plant,
        r,
        len(once),
        Ts,
        noise,
        limits,
        dynamics=dynamics,
        inverse=inverse,
        pid=pid,
        cmac=cmac,
    )
    N = len(fields["y"])
    t = Ts * np.arange(N, dtype=float)
    r = r[:N]
    for signal in (t, r):
        signal.flags.writeable = False
    return Tracking(t=t, r=r, **{**fields, "notes": notes_from_core(fields["notes"])})
