"""SIMC-PI tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.models import ProcessModel
from plantune.notes import Limits
from plantune.tune.judge import tuned
from plantune.tune.tuning import Tuning


def simc(
    model: ProcessModel | Fit,
    tau_c: float | None = None,
    *,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = T / (K (tau_c + L)), Ti = min(T, 4 (tau_c + L)).

    Parameters
    ----------
    model : ProcessModel or Fit
        Of a fit the margins come with bands over its uncertainty.
    tau_c : float, optional
        Closed-loop time constant, seconds, >= 0; by default the dead time `L`.
    delay_at_least : float
        Seconds of dead time that the loop has at least; see `imc_pi`.
    limits : Limits, optional
        Thresholds; a margin below `C07` or `C07_phase` leaves a note.

    Returns
    -------
    Tuning
        `Kp` has the sign of `K`.

    Raises
    ------
    UsageError
        `tau_c` is out of its range (U01).
    NotIdentifiable
        The model is none, or has no dead time to take as `tau_c` (M12), or the sign of its
        gain is open (X12).

    Notes
    -----
    Skogestad 2003.  The gain of IMC-PI; on a slow plant, `T` above `4 (tau_c + L)`, the shorter
    integral time makes loads die out faster.  For margins that are met exactly use `imc_pi`.

    Examples
    --------
    >>> tuning = simc(ProcessModel(K=-2.0, T=20.0, L=1.0))
    >>> print(tuning.rule, "->", tuning.controller)
    SIMC, tau_c = L -> PI: Kp = -5, Ti = 8 s
    >>> round(tuning.margins.Ms, 2)
    1.7
    """
    wish = "L" if tau_c is None else f"{tau_c:g}"
    return tuned(
        f"SIMC, tau_c = {wish}",
        model,
        lambda plant: _core.simc(plant, tau_c),
        delay_at_least,
        limits,
    )
