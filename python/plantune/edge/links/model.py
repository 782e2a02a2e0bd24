"""A simulated plant under its own PI controller."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.adapt import Sample
from plantune.edge.links.link import Capabilities, asked_for, unwritable
from plantune.errors import refusal
from plantune.models import PID
from plantune.record import Floats
from plantune.simulate import Actuator


class SimulatedPlant:
    """`y = K e^(-L s) / (T s + 1) u + offset + noise` under its own controller, sample by sample.

    Parameters
    ----------
    r : array (N,)
        Set point; as long as the simulation.
    controller : PID
        Its settings to begin with; they can be written, without a bump.
    K, T, L, offset : float or array (N,)
        Static gain, time constant and dead time in seconds, output offset; a number for all rows,
        or one value per row.
    Ts : float
        Sample time, seconds.
    noise_sd : float
        Standard deviation of the white noise on the y that is read, >= 0.
    seed : int
        Of the noise.
    u0 : float, optional
        Input at which the loop begins in equilibrium; by default the one that holds `r[0]`.
    actuator : Actuator, optional
        Limits of u, its rate, and what a valve does.
    y_step : float
        Step of the y that is read; 0 for none.
    aux : mapping of name to array (N,)
        Further signals, for instance those of the operating point.

    Attributes
    ----------
    Ts, capabilities, controller : float, Capabilities, PID
        As every `Link` has them.

    Raises
    ------
    UsageError
        An argument out of its range or of another length (U01).
    NotIdentifiable
        Parameters that are no plant (M12).

    Notes
    -----
    Source 001, 3.7.6, with (3.7-22) and (3.7-25) as the errata have them.  The noise of a row is
    the same whatever is written.
    `plantune.edge.record` reads it to a `Record`.

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=0.5, Ti=1.0)
    >>> plant = SimulatedPlant([1.0, 3.0, 3.0], pid, K=2.0, T=1.0, L=0.1, Ts=0.1)
    >>> plant.read(), plant.read().u
    (Sample(t=0.0, r=1.0, u=0.5, y=1.0, aux={}, controller=None), 1.6)
    >>> plant.write(pt.models.PID(Kp=1.0, Ti=1.0))
    >>> plant.read().t, plant.read()
    (0.2, None)
    """

    def __init__(
        self,
        r: ArrayLike,
        controller: PID,
        *,
        K: ArrayLike,
        T: ArrayLike,
        L: ArrayLike = 0.0,
        offset: ArrayLike = 0.0,
        Ts: float,
        noise_sd: float = 0.0,
        seed: int = 0,
        u0: float | None = None,
        actuator: Actuator | None = None,
        y_step: float = 0.0,
        aux: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        self._r = np.atleast_1d(np.array(r, float))
        N = len(self._r)
        if not noise_sd >= 0:
            text = f"`noise_sd` is {noise_sd}, must be zero or positive"
            raise refusal("U01", text, remedy="noise_sd=0")
        named = {"K": K, "T": T, "L": L, "offset": offset}
        parameters = [_per_row(x, N, name) for name, x in named.items()]
        self._varies = any(np.ndim(x) > 0 for x in named.values())
        self._parameters = np.stack(parameters, axis=1)
        self._aux = {name: _per_row(x, N, name) for name, x in (aux or {}).items()}
        self._noise = np.random.default_rng(seed).normal(0.0, noise_sd, N)
        self._row = 0
        self._wished_r: float | None = None
        self._u: float | None = None
        K0, T0, L0, offset0 = self._parameters[0].tolist()
        self._loop = _core.LoopSimulator(
            K0,
            T0,
            L0,
            Ts,
            controller,
            offset=offset0,
            u0=(self._r[0] - offset0) / K0 if u0 is None else u0,
            longest=float(parameters[2].max()),
            actuator=actuator,
            y_step=y_step,
        )
        self.Ts = float(Ts)

    @property
    def capabilities(self) -> Capabilities:
        """All can be read, and set point, input and controller written."""
        return Capabilities(write=frozenset({"r", "u", "Kp", "Ti", "Td"}))

    @property
    def controller(self) -> PID:
        """The settings at work."""
        return self._loop.pid

    @property
    def truth(self) -> tuple[float, float, float, float]:
        """`K, T, L, offset` of the plant now."""
        return self._loop.plant

    def read(self) -> Sample | None:
        """Go to the next sample and return it; None at the end."""
        k = self._row
        if k == len(self._r):
            return None
        if self._varies:
            self._loop.set_plant(*self._parameters[k].tolist())
        r = float(self._r[k]) if self._wished_r is None else self._wished_r
        noise = float(self._noise[k])
        if self._u is None:
            u, y = self._loop.step(r, noise)
        else:
            u, y = self._loop.hold(r, self._u, noise)
        self._row = k + 1
        aux = {name: float(x[k]) for name, x in self._aux.items()}
        return Sample(t=k * self.Ts, r=r, u=u, y=y, aux=aux)

    def write(
        self, controller: PID | None = None, *, r: float | None = None, u: float | None = None
    ) -> None:
        """Write settings, a set point or an input: at work from the next sample on.

        A set point stays until another one is written.  An input puts the controller in manual,
        and settings put it back in automatic.
        """
        if unknown := asked_for(controller, r, u) - self.capabilities.write:
            raise unwritable(unknown, "the simulated plant")
        if controller is not None:
            self._loop.set(controller)
            self._u = None
        if r is not None:
            self._wished_r = float(r)
        if u is not None:
            self._u = float(u)


def _per_row(x: ArrayLike, N: int, name: str) -> Floats:
    """Return one value per row."""
    values = np.array(x, float)
    if values.ndim == 0:
        return np.full(N, float(values))
    if values.shape != (N,):
        raise refusal(
            "U01",
            f"`{name}` has the shape {values.shape}, must be a number or ({N},) like r",
            remedy="give one value per row of r",
        )
    return values
