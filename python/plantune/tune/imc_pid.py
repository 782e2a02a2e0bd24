"""IMC-PID tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.imc_pi import one_wish
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def imc_pid(
    model: Plant | Fit,
    *,
    gain_margin: float | None = None,
    phase_margin: float | None = None,
    tau_c: float | None = None,
    N: float | None = None,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = (2 T + L) / (K (2 tau_c + L)), Ti = T + L/2, Td = T L / (2 T + L).

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One or two lags or a damped pair, with or without a zero; others that settle are reduced to
        two lags by `half_rule`.  Of a fit the margins come with bands over its uncertainty.
    gain_margin : float
        As a factor, above 1; of second order above what `tau_c = 0` gives, pi/2 without a zero.
    phase_margin : float
        Degrees, between 0 and 90; of second order above what `tau_c = 0` gives.
    tau_c : float
        Closed-loop time constant, seconds, >= 0.
    N : float, optional
        Filter of the derivative, `Tf = Td / N`; by default none, as in the source.  A margin asked
        for is met with the filter in place, by another `tau_c`.
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
        Not exactly one wish, or one out of its range (U01).
    NotIdentifiable
        The model is none, or a plant without delay is asked for a margin (M12), it integrates (M01)
        or is unstable (M02), or the sign of its gain is open (X12).

    Notes
    -----
    Source 001, (3.6-20) to (3.6-24) and (3.6-46) to (3.6-53): one lag, and the dead time as
    `(1 - L s/2) / (1 + L s/2)`.  A second-order denominator `q s^2 + p s + 1`, a damped pair as
    well, is cancelled: `Kp = p / (K (tau_c + L - Tz))`, `Ti = p`, `Td = q / p`, with `Tz` negative
    for an inverse response, and the loop has the margins of `imc_pi`; a positive `Tz` is cancelled
    by the filter, `Tf = Tz`, where a PID can.  Real controllers and simulations need the filter:
    `N=10`.  Loads drag on where the plant is slow; see `simc`.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = imc_pid(ProcessModel(K=-5.939, T=0.1491, L=0.1), gain_margin=3)
    >>> print(tuning.controller)
    PID: Kp = -0.173378, Ti = 0.1991 s, Td = 0.0374435 s, Tf = 0 s
    >>> round(tuning.tau_c, 5), round(tuning.margins.phase_deg, 1)
    (0.14336, 74.3)
    >>> imc_pid(tuning.model, gain_margin=3, N=10).margins.gain
    3.0
    """
    name, value = one_wish("imc_pid", gain_margin, phase_margin, tau_c)
    return tuned(
        f"IMC-PID, {name} = {value:g}",
        model,
        lambda plant: _core.imc_pid(plant, name, value, N),
        delay_at_least,
        limits,
    )
