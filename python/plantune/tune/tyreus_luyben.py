"""Tyreus-Luyben tuning from the exact ultimate gain and period."""

from __future__ import annotations

from math import inf

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.models import ProcessModel
from plantune.notes import Limits, Note
from plantune.tune.judge import Plant, outside, tuned
from plantune.tune.tuning import Tuning


def tyreus_luyben(
    model: Plant | Fit,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = K_u / 3.2, Ti = 2.2 T_u.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        Any with an ultimate gain, as it stands.  Of a fit
        the margins come with bands over its uncertainty.
    controller : "PI" or "PID"
        The PID has `Kp = K_u / 2.2`, `Td = T_u / 6.3`, and the filter `Tf = Td / 10`.
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
        The model is none, or has no ultimate gain, as without a dead time (M12), or is unstable
        (M02), or the sign of its gain is open (X12).

    Notes
    -----
    Tyreus and Luyben 1992.  The ultimate gain and period are those of the model, exactly, with any
    number of lags and zeros: of one lag `w L + atan(w T) = pi`, `K_u = sqrt(1 + (w T)^2) / K`, `T_u
    = 2 pi / w`, of an integrator `K_u = pi / (2 K L)`, `T_u = 4 L`.  Made for integrators with dead
    time: on one lag for `L` up to `T`, and beside an integrator for lags up to `L` in all; beyond a
    note says so (T02).  On one lag the PI drags there, and the PID loses its margin and, from `L =
    6.1 T` on, its stability; beside an integrator the PI loses its margin (C07).

    Examples
    --------
    >>> tuning = tyreus_luyben(ProcessModel(K=-2.0, T=20.0, L=1.0))
    >>> print(tuning.rule, "->", tuning.controller)
    Tyreus-Luyben -> PI: Kp = -5.00868, Ti = 8.62861 s
    >>> round(tuning.margins.gain, 2)
    3.04
    """
    return tuned(
        "Tyreus-Luyben" + (" PID" if controller == "PID" else ""),
        model,
        lambda plant: _core.tyreus_luyben(plant, controller),
        delay_at_least,
        limits,
        _range,
    )


def _range(plant: ProcessModel, _: float) -> tuple[Note, ...]:
    lags, L = sum(plant.times), plant.L
    if plant.integrating:
        return outside("T / L", lags / L if L else inf, 0.0, 1.0) if lags else ()
    return outside("L / T", L / lags, 0.0, 1.0) if plant.is_first_order else ()
