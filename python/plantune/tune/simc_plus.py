"""Improved SIMC tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def simc_plus(
    model: Plant | Fit,
    tau_c: float | None = None,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = (T + L/3) / (K (tau_c + L)), Ti = min(T + L/3, 4 (tau_c + L)).

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag, or an integrator; others are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    tau_c : float, optional
        Closed-loop time constant, seconds, >= 0; by default `L`, of the PID `L / 2`.
    controller : "PI" or "PID"
        The PID is SIMC-PI in series with `1 + s L / 3`, with the filter `Tf = Td / 10`.
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
        `tau_c` is out of its range, or `controller` another word (U01).
    NotIdentifiable
        The model is none, or has no dead time to take as `tau_c` (M12), or is unstable (M02), or
        the sign of its gain is open (X12).

    Notes
    -----
    Grimholt and Skogestad, PI 2012, PID 2018.  Where the dead time dominates, `simc` is nearly an
    integral controller and sluggish; these have a proportional part there, and are close to `simc`
    where `T` is long.  Serves every dead time: `Ms` stays below 1.8 with the default `tau_c`.  In
    standard form the PID has `Kp = Kc (1 + t_D / t_I)`, `Ti = t_I + t_D`, `Td = t_I t_D / Ti`, with
    `Kc` and `t_I` those of `simc` and `t_D = L / 3`.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = simc_plus(ProcessModel(K=2.0, T=1.0, L=3.0))
    >>> print(tuning.rule, "->", tuning.controller)
    SIMC+, tau_c = L -> PI: Kp = 0.166667, Ti = 2 s
    >>> round(tuning.margins.Ms, 2)
    1.6
    """
    half = " / 2" if controller == "PID" else ""
    wish = f"L{half}" if tau_c is None else f"{tau_c:g}"
    return tuned(
        f"SIMC+{' PID' if controller == 'PID' else ''}, tau_c = {wish}",
        model,
        lambda plant: _core.simc_plus(plant, tau_c, controller),
        delay_at_least,
        limits,
    )
