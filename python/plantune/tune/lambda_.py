"""Lambda tuning."""

from __future__ import annotations

from math import inf

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, outside, plant_of, tuned
from plantune.tune.tuning import Tuning


def lambda_(
    model: Plant | Fit,
    tau_c: float | None = None,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = T / (K (tau_c + L)), Ti = T.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag, an integrator, of the PID two lags; others are reduced by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    tau_c : float, optional
        Closed-loop time constant, the lambda of the name, seconds, >= 0; by default three times the
        slowest time constant, or the dead time of an integrating plant.
    controller : "PI" or "PID"
        The PID has `Kp = (T + L / 2) / (K (tau_c + L / 2))`, and the filter `Tf = Td / 10`; it
        cancels a second lag.
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
        The model is none (M12), or is unstable (M02), or the sign of its gain is open (X12).

    Notes
    -----
    Dahlin 1968: the PI is `imc_pi` with `tau_c`, whose margins are closed forms.  The PID, with
    `Ti = T + L / 2` and `Td = T L / (2 T + L)`, is that of Rivera, Morari and Skogestad 1986, made
    for `tau_c` above `0.8 L`; below a note says so (T02).  Two lags are cancelled, with `Kp = (T1 +
    T2) / (K (tau_c + L))`.  Integrating, Chien and Fruehauf 1990: `Kp = Ti / (K (tau_c + L)^2)` and
    `Ti = 2 tau_c + L`, of the PID the lag `T` more, so that a load is arrested within `tau_c`.
    With `3 T` the loop is slow where the plant is, and weak where the dead time is far longer than
    that; `simc` follows the dead time.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = lambda_(ProcessModel(K=2.0, T=10.0, L=2.0))
    >>> print(tuning.rule, "->", tuning.controller)
    lambda, tau_c = 3 T -> PI: Kp = 0.15625, Ti = 10 s
    >>> round(tuning.margins.gain, 2)
    25.13
    """
    wish = _slowest(model) if tau_c is None else f"{tau_c:g}"
    return tuned(
        f"lambda{' PID' if controller == 'PID' else ''}, tau_c = {wish}",
        model,
        lambda plant: _core.lambda_(plant, tau_c, controller),
        delay_at_least,
        limits,
        lambda plant, found: (
            outside("tau_c / L", found / plant.L if plant.L else inf, 0.8, inf)
            if controller == "PID" and plant.is_first_order
            else ()
        ),
    )


def _slowest(model: Plant | Fit) -> str:
    return "3 L" if getattr(plant_of(model), "integrating", False) else "3 T"
