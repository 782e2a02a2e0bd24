"""IMC-PI tuning."""

from __future__ import annotations

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def imc_pi(
    model: Plant | Fit,
    *,
    gain_margin: float | None = None,
    phase_margin: float | None = None,
    tau_c: float | None = None,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = T / (K (tau_c + L)), Ti = T for a first-order plant with dead time.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag; others that settle are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    gain_margin : float
        As a factor, above pi/2; 3 is 9.54 dB and goes with a phase margin of 60 degrees.
    phase_margin : float
        Degrees, between 32.704 and 90.
    tau_c : float
        Closed-loop time constant, seconds, >= 0.
    delay_at_least : float
        Seconds of dead time that the loop has at least, such as the sample time of the controller;
        a shorter one of the model counts as this, and a note says so.
    limits : Limits, optional
        Thresholds; a margin below `C07` or `C07_phase` leaves a note.

    Returns
    -------
    Tuning
        `Kp` has the sign of `K`.

    Raises
    ------
    UsageError
        Not exactly one wish, or one out of its range (U01).
    NotIdentifiable
        The model is none (M12), integrates (M01) or is unstable (M02), its uncertainty leaves the
        sign of the gain open (X12), or its record was sampled too slowly for its time constant
        (M09).

    Notes
    -----
    Source 001, (3.6-18) to (3.6-45).  The margin asked for is met on one lag; on more, see the
    margins, or `imc_pid`.  On a slow plant, `T` above `8 L`, its answer to a load drags on; see
    `simc`.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = imc_pi(ProcessModel(K=-5.939, T=0.1491, L=0.1), gain_margin=3)
    >>> print(tuning.controller)
    PI: Kp = -0.131451, Ti = 0.1491 s
    >>> round(tuning.margins.phase_deg, 3)
    60.0
    """
    name, value = one_wish("imc_pi", gain_margin, phase_margin, tau_c)
    return tuned(
        f"IMC-PI, {name} = {value:g}",
        model,
        lambda plant: _core.imc_pi(plant, name, value),
        delay_at_least,
        limits,
    )


def one_wish(
    rule: str, gain_margin: float | None, phase_margin: float | None, tau_c: float | None
) -> tuple[str, float]:
    """Return the name and the value of the one that is given."""
    wishes = {"gain_margin": gain_margin, "phase_margin": phase_margin, "tau_c": tau_c}
    given = {name: float(value) for name, value in wishes.items() if value is not None}
    if len(given) != 1:
        raise refusal(
            "U01",
            f"{len(given)} of gain_margin, phase_margin and tau_c are given, must be one",
            remedy=f"{rule}(model, gain_margin=3)",
        )
    ((name, value),) = given.items()
    return name, value
