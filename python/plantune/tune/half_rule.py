"""Models of first and second order in place of others."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.models import ProcessModel
from plantune.tune.judge import Plant, plant_of


def half_rule(model: Plant | Fit, order: int = 1, *, tau_c: float | None = None) -> ProcessModel:
    """Return a model of first or second order whose dead time stands for the rest.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        With real poles, but for one damped pair, and real zeros.
    order : 1 or 2
        Of an integrating plant the integrator counts.
    tau_c : float, optional
        Closed-loop time constant that decides what a zero to the left counts for, seconds; by
        default the dead time that comes out.

    Returns
    -------
    ProcessModel
        The largest lags; half of the next one is added to the last of them and half to the dead
        time, which takes all lags beyond and the zeros to the right (inverse responses) whole.

    Raises
    ------
    UsageError
        `order` is another number, or the model a PolyModel (U01).
    NotIdentifiable
        The plant is unstable (M02), has two integrators (M01), or poles or zeros that this rule
        does not know, such as a damped pair where one lag is asked for (M12).

    Notes
    -----
    Skogestad 2003, with his rules T1 to T3 for zeros to the left.  A damped pair is kept where it
    is the slowest, and counts as a delay of `2 zeta T` where it is not; that part is ours.

    Examples
    --------
    >>> G = ProcessModel(K=1.0, T=(1.0, 1.0, 1.0, 1.0))
    >>> print(half_rule(G))
    G(s) = 1 e^(-2.5 s) / (1.5 s + 1)
    >>> print(half_rule(G, order=2))
    G(s) = 1 e^(-1.5 s) / ((1.5 s + 1) (1 s + 1))
    """
    return ProcessModel(**_core.half_rule(plant_of(model), order, tau_c))


def controllability_ratio(model: Plant | Fit) -> float:
    """Return L / (T + L), how much of the plant is dead time.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        Of more than one lag the first-order model of `half_rule` counts.

    Returns
    -------
    float
        0 for a lag alone or an integrator, 1 for a dead time alone; easy to control below 0.3, and
        beyond 0.7 a dead-time compensator may pay.

    Raises
    ------
    NotIdentifiable
        As of `half_rule`.

    Notes
    -----
    Source 001, (3.4-2).

    Examples
    --------
    >>> controllability_ratio(ProcessModel(K=2.0, T=3.0, L=1.0))
    0.25
    """
    return _core.controllability_ratio(plant_of(model))
