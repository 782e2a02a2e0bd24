"""Ziegler-Nichols tuning from the step response."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def ziegler_nichols(
    model: Plant | Fit,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = 0.9 T / (K L), Ti = 3 L.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag, or an integrator; others are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    controller : "PI" or "PID"
        The PID has `Kp = 1.2 T / (K L)`, `Ti = 2 L`, `Td = L / 2`, and the filter `Tf = Td / 10`.
    delay_at_least : float
        Seconds of dead time that the loop has at least; see `imc_pi`.
    limits : Limits, optional
        Thresholds; a margin below `C07` or `C07_phase` leaves a note.

    Returns
    -------
    Tuning
        `Kp` has the sign of `K`; `tau_c` is NaN.

    Raises
    ------
    UsageError
        `controller` is another word (U01).
    NotIdentifiable
        The model is none, or has no dead time (M12), or is unstable (M02), or the sign of its gain
        is open (X12).

    Notes
    -----
    Source 001, table 3.6-1.  The rule knows the reaction rate `K / T` and `L` alone; of an
    integrating plant the rate is `K`.  Its loops ring on slow plants: take it as the yardstick it
    is in the literature, and `simc` or `imc_pi` for the plant.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = ziegler_nichols(ProcessModel(K=5.939, T=0.1491, L=0.1))
    >>> print(tuning.rule, "->", tuning.controller)
    Ziegler-Nichols -> PI: Kp = 0.225947, Ti = 0.3 s
    >>> round(tuning.margins.gain_db, 2)
    6.21
    """
    return tuned(
        "Ziegler-Nichols" + (" PID" if controller == "PID" else ""),
        model,
        lambda plant: _core.ziegler_nichols(plant, controller),
        delay_at_least,
        limits,
    )
