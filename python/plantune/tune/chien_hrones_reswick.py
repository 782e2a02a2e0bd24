"""Chien-Hrones-Reswick tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, outside, tuned
from plantune.tune.tuning import Tuning


def chien_hrones_reswick(
    model: Plant | Fit,
    *,
    step: str = "load",
    overshoot: float = 0.0,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = 0.6 T / (K L), Ti = 4 L, or another row of the table.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag; others that settle are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    step : "load" or "set_point"
        What the loop shall answer well.
    overshoot : 0 or 20
        Percent that the answer may overshoot.
    controller : "PI" or "PID"
        The PID has the filter `Tf = Td / 10`.
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
        `step` or `controller` is another word, `overshoot` another number (U01).
    NotIdentifiable
        The model is none, or has no dead time (M12), integrates (M01) or is unstable (M02), or the
        sign of its gain is open (X12).

    Notes
    -----
    Chien, Hrones and Reswick 1952, with `a = K L / T`:

    ============== ============== ====================== =============== =======================
    overshoot      load PI        load PID               set point PI    set point PID
    ============== ============== ====================== =============== =======================
    0 %            0.6/a, 4 L     0.95/a, 2.4 L, 0.42 L  0.35/a, 1.2 T   0.6/a, T, 0.5 L
    20 %           0.7/a, 2.3 L   1.2/a, 2 L, 0.42 L     0.6/a, T        0.95/a, 1.4 T, 0.47 L
    ============== ============== ====================== =============== =======================

    Made for `L / T` from 1/9 to 1; outside a note says so (T02).  The settings for loads let a set
    point overshoot by far more on slow plants, and leave little margin there (C07); on first order
    plus dead time those for a set point with 20 % give 5 to 12 %,
    and the PID for 0 % up to 9.5 %.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = chien_hrones_reswick(ProcessModel(K=2.0, T=10.0, L=2.0), step="set_point")
    >>> print(tuning.rule, "->", tuning.controller)
    Chien-Hrones-Reswick, set_point, 0 % -> PI: Kp = 0.875, Ti = 12 s
    >>> round(tuning.margins.gain, 2)
    4.56
    """
    return tuned(
        f"Chien-Hrones-Reswick{' PID' if controller == 'PID' else ''}, {step}, {overshoot:g} %",
        model,
        lambda plant: _core.chien_hrones_reswick(plant, step, overshoot, controller),
        delay_at_least,
        limits,
        lambda plant, _: outside("L / T", plant.L / plant.times[0], 1 / 9, 1.0),
    )
