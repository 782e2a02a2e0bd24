"""Internal model control."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit
from plantune.models import ProcessModel, TransferFunction
from plantune.tune.judge import Plant, plant_of

_PARTS = ("invertible", "non_invertible", "filter", "controller", "closed_loop")


@dataclass(frozen=True, slots=True, eq=False)
class IMC:
    """An internal-model controller and the loop it gives.

    Attributes
    ----------
    model : ProcessModel or TransferFunction
        The internal model `G`, dead time exact.
    tau_c, order : float, int
        Closed-loop time constant, seconds, and order `n` of the filter.
    delay : str
        What became of the dead time: "exact", "taylor" or "pade".
    invertible, non_invertible : TransferFunction
        `G_-` and `G_+`, of which the product is `G`, or its approximation; `G_+` has gain 1.
    filter, controller : TransferFunction
        `C_F`, and `C_imc = C_F / G_-`.
    classic : TransferFunction or None
        `C = C_imc / (1 - C_imc G_- G_+)`, a controller in a usual loop; None with an exact dead
        time, where it has the dead time in its denominator: see `classic_freqresp`.
    closed_loop : TransferFunction
        `y / r = C_F G_+`, where the plant is the model.

    Examples
    --------
    >>> design = imc(ProcessModel(K=2.0, T=(3.0, 1.0), L=0.5, Tz=-0.4), tau_c=0.6)
    >>> print(design)
    internal model control, tau_c = 0.6 s, order 2, delay exact
      invertible      G(s) = 2 / (3 s^2 + 4 s + 1)
      non-invertible  G(s) = (-0.4 s + 1) e^(-0.5 s)
      controller      G(s) = (3 s^2 + 4 s + 1) / (0.72 s^2 + 2.4 s + 2)
      closed loop     G(s) = (-0.4 s + 1) e^(-0.5 s) / (0.36 s^2 + 1.2 s + 1)
    """

    model: Plant
    tau_c: float
    order: int
    delay: str
    invertible: TransferFunction
    non_invertible: TransferFunction
    filter: TransferFunction
    controller: TransferFunction
    classic: TransferFunction | None
    closed_loop: TransferFunction

    @property
    def proper(self) -> bool:
        """Whether `C_imc` can be built: its numerator is not the longer one."""
        return len(self.controller.num) <= len(self.controller.den)

    def classic_freqresp(self, w: ArrayLike) -> NDArray[np.complex128]:
        """Return `C_imc / (1 - C_imc G)` at `w` rad/s, the dead time of the model exact.

        Examples
        --------
        >>> design = imc(ProcessModel(K=2.0, T=3.0, L=0.5), tau_c=0.6)
        >>> abs(design.classic_freqresp([1e-3])).round(1)  # integral action, 1 / (K (tau_c + L) w)
        array([454.5])
        """
        w = np.ascontiguousarray(np.atleast_1d(w), float)
        return _core.imc_classic(self.controller, self.model, w)

    def __str__(self) -> str:
        rows = [
            ("invertible", self.invertible),
            ("non-invertible", self.non_invertible),
            ("controller", self.controller),
            ("closed loop", self.closed_loop),
        ]
        if self.classic is not None:
            rows.insert(3, ("classic", self.classic))
        head = f"tau_c = {self.tau_c:g} s, order {self.order}, delay {self.delay}"
        return "\n".join(
            [f"internal model control, {head}", *(f"  {name:<15} {G}" for name, G in rows)]
        )


def imc(
    model: Plant | Fit,
    tau_c: float,
    *,
    order: int | None = None,
    delay: str = "exact",
    mirror: bool = False,
) -> IMC:
    """Design C_imc = 1 / (G_- (tau_c s + 1)^n), for the loop y / r = G_+ / (tau_c s + 1)^n.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        Stable, or with one integrator.
    tau_c : float
        Closed-loop time constant, seconds, > 0.
    order : int, optional
        Order `n` of the filter, >= 1; by default the least that makes `C_imc` proper.
    delay : "exact", "taylor" or "pade"
        The dead time as it is, as `1 - L s`, or as `(1 - L s/2) / (1 + L s/2)`.
    mirror : bool
        Puts the zeros to the right over their mirror images, `(1 - s/z) / (1 + s/z)`: the least
        integral of the squared error for steps.

    Returns
    -------
    IMC

    Raises
    ------
    UsageError
        `tau_c`, `order` or `delay` is out of its range (U01).
    NotIdentifiable
        The plant is unstable (M02), has two integrators (M01), or is none (M12).

    Notes
    -----
    Source 001, (3.6-1) to (3.6-17), (3.6-20), as corrected.  With "taylor" and order 1 the classic
    controller of one lag is `imc_pi`, with "pade" and order 1 `imc_pid`.  Of an integrating plant
    the filter has a zero, so that the classic controller has integral action beside the plant's:
    Morari and Zafiriou 1989; with "taylor" it is `lambda_`.

    Examples
    --------
    >>> print(imc(ProcessModel(K=2.0, T=3.0, L=0.5), 0.6, order=1, delay="taylor").classic)
    G(s) = (3 s + 1) / (2.2 s)
    """
    plant = plant_of(model)
    if order is not None and (order != int(order) or order < 1):
        raise refusal("U01", f"`order` is {order!r}, must be 1 or more", remedy="leave it out")
    parts = _core.imc(plant, float(tau_c), order, delay, mirror)
    classic = parts["classic"]
    return IMC(
        model=plant,
        tau_c=float(tau_c),
        order=parts["order"],
        delay=delay,
        classic=None if classic is None else TransferFunction(**classic),
        **{name: TransferFunction(**parts[name]) for name in _PARTS},
    )


@dataclass(frozen=True, slots=True)
class Costs:
    """Integrals of the error to a unit step of the set point.

    Attributes
    ----------
    ise, iae : float
        Of `e^2` and `|e|`, seconds.
    itae : float
        Of `t |e|`, seconds squared.

    Examples
    --------
    >>> imc_costs(ProcessModel(K=1.0, T=5.0, L=1.0), tau_c=2.0, loop="ideal")
    Costs(ise=2.0, iae=3.0, itae=6.5)
    """

    ise: float
    iae: float
    itae: float


def imc_costs(model: ProcessModel | Fit, tau_c: float, *, loop: str = "pi") -> Costs:
    """Return ISE, IAE and ITAE of IMC on one lag with dead time, exactly.

    Parameters
    ----------
    model : ProcessModel or Fit
        Only its dead time counts: gain and time constant cancel.
    tau_c : float
        Closed-loop time constant, seconds, >= 0, such as `imc_pi(model, gain_margin=3).tau_c`.
    loop : "pi" or "ideal"
        IMC-PI with the exact dead time, or the loop IMC aims at, `e^(-L s) / (tau_c s + 1)`, which
        takes a dead-time compensator.

    Returns
    -------
    Costs

    Raises
    ------
    UsageError
        `tau_c` or `loop` is out of its range (U01).

    Notes
    -----
    Source 001, (3.6-60) to (3.6-70) as corrected: it gives those of the ideal loop for the PI.  Of
    any other loop see the indices of `simulate.step`.

    Examples
    --------
    >>> model = ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> from plantune.tune import imc_pi
    >>> costs = imc_costs(model, imc_pi(model, gain_margin=3).tau_c)
    >>> round(costs.ise, 7), round(costs.iae, 7), round(costs.itae, 6)
    (1.6539867, 2.1378556, 2.855654)
    """
    plant = plant_of(model)
    if not (isinstance(plant, ProcessModel) and plant.is_first_order):
        raise refusal(
            "U01", "`model` is not of first order", remedy="half_rule(model) gives one that is"
        )
    return Costs(*_core.imc_costs(plant.L, float(tau_c), loop))


def tracking_cost(y_N: ArrayLike, y: ArrayLike, Ts: float, T_J: float = inf) -> float:
    """Return the integrated squared distance of a response from its nominal trajectory.

    Parameters
    ----------
    y_N, y : array (N,)
        Nominal and actual response; the set point serves as the nominal one where no other is
        known.
    Ts : float
        Seconds from row to row.
    T_J : float
        Seconds that count; by default all.

    Returns
    -------
    float
        `J = Ts sum (y_N(n) - y(n))^2`, n from 1 to `T_J / Ts`.

    Raises
    ------
    UsageError
        Lengths that differ, or times that are not positive (U01).

    Notes
    -----
    Source 001, (3.6-54) to (3.6-60), the sum times `Ts`.  True integrals of a simulated loop are
    in `Response.indices`.

    Examples
    --------
    >>> tracking_cost([1.0, 1.0, 1.0, 1.0], [0.0, 0.5, 1.0, 1.0], Ts=0.1)
    0.025
    """
    nominal, actual = (np.ascontiguousarray(np.atleast_1d(x), float) for x in (y_N, y))
    return _core.tracking_cost(nominal, actual, float(Ts), float(T_J))
