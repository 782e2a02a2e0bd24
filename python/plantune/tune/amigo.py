"""AMIGO tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def amigo(
    model: Plant | Fit,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = (0.15 + (0.35 - L T / (L + T)^2) T / L) / K and its Ti.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag, or an integrator; others are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    controller : "PI" or "PID"
        The PID has `Kp = (0.2 + 0.45 T / L) / K`, and the filter `Tf = Td / 10`.
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
    `Ti = 0.35 L + 13 L T^2 / (T^2 + 12 L T + 7 L^2)`; of the PID `Ti = L (0.4 L + 0.8 T) /
    (L + 0.1 T)` and `Td = 0.5 L T / (0.3 L + T)`.  Of an integrator `Kp = 0.35 / (K L)` and `Ti =
    13.35 L`, of the PID `Kp = 0.45 / (K L)`, `Ti = 8 L`, `Td = L / 2`.  Astrom and Hagglund 2004
    and 2006, chapter 7; fitted to many plants for `Ms` and `Mt` of 1.4, and serves every dead time
    but none: on the model itself `Ms` stays within 1.2 and 1.5.  The PI is cautious where `L` and
    `T` are alike; take the PID there, or `simc`.  The set-point weight of the source is left at 1.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = amigo(ProcessModel(K=-2.0, T=20.0, L=1.0), controller="PID")
    >>> print(tuning.rule, "->", tuning.controller)
    AMIGO PID -> PID: Kp = -4.6, Ti = 5.46667 s, Td = 0.492611 s, Tf = 0.0492611 s
    >>> round(tuning.margins.Ms, 2)
    1.45
    """
    return tuned(
        "AMIGO" + (" PID" if controller == "PID" else ""),
        model,
        lambda plant: _core.amigo(plant, controller),
        delay_at_least,
        limits,
    )
