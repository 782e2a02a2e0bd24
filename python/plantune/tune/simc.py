"""SIMC tuning, PI and PID."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def simc(
    model: Plant | Fit,
    tau_c: float | None = None,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = T / (K (tau_c + L)), Ti = min(T, 4 (tau_c + L)).

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag, an integrator, of the PID two lags; others are reduced by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    tau_c : float, optional
        Closed-loop time constant, seconds, >= 0; by default the dead time `L`.
    controller : "PI" or "PID"
        The PID cancels a second lag, with a filter `Tf` of at most `Td / 10`; without one it is
        the PI.
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
    Skogestad 2003.  The gain of IMC-PI; on a slow plant, `T` above `4 (tau_c + L)`, the shorter
    integral time makes loads die out faster.  Of `K e^(-L s) / s`, `Kp = 1 / (K (tau_c + L))` and
    `Ti = 4 (tau_c + L)`.  The PID is that in series with `1 + s t_D`, `t_D` the second lag, or the
    lag of an integrating plant; in standard form `Kp = Kc (1 + t_D / t_I)`, `Ti = t_I + t_D`, `Td =
    t_I t_D / Ti`.  It pays where `t_D` is longer than `L`.  For margins that are met exactly use
    `imc_pi` and `imc_pid`.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = simc(ProcessModel(K=-2.0, T=20.0, L=1.0))
    >>> print(tuning.rule, "->", tuning.controller)
    SIMC, tau_c = L -> PI: Kp = -5, Ti = 8 s
    >>> round(tuning.margins.Ms, 2)
    1.7
    >>> tuning = simc(ProcessModel(K=1.0, T=(1.0, 1.0, 1.0, 1.0)), controller="PID")
    >>> print(tuning.notes[0].text)
    settings are those for G(s) = 1 e^(-1.5 s) / ((1.5 s + 1) (1 s + 1)), by the half rule
    """
    wish = "L" if tau_c is None else f"{tau_c:g}"
    return tuned(
        f"SIMC{' PID' if controller == 'PID' else ''}, tau_c = {wish}",
        model,
        lambda plant: _core.simc(plant, tau_c, controller),
        delay_at_least,
        limits,
    )
