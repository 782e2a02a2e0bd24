"""Cohen-Coon tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, outside, tuned
from plantune.tune.tuning import Tuning


def cohen_coon(
    model: Plant | Fit,
    *,
    controller: str = "PI",
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = (0.9 T / L + 1/12) / K, Ti = L (30 + 3 r) / (9 + 20 r).

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag; others that settle are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
    controller : "PI" or "PID"
        The PID has `Kp = (4/3 T / L + 1/4) / K`, and the filter `Tf = Td / 10`.
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
        The model is none, or has no dead time (M12), integrates (M01) or is unstable (M02), or the
        sign of its gain is open (X12).

    Notes
    -----
    `r = L / T`; of the PID `Ti = L (32 + 6 r) / (13 + 8 r)` and `Td = 4 L / (11 + 2 r)`.  Cohen and
    Coon 1953.  Made for loads that decay by three quarters each period, and for `r` from 0.1 to 1;
    outside a note says so (T02).  Such loops are weak (C07), with `Ms` from 2.6 to 4.7: take it as
    a yardstick, and `simc` or `amigo` for the plant.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = cohen_coon(ProcessModel(K=1.0, T=2.0, L=1.0))
    >>> print(tuning.rule, "->", tuning.controller)
    Cohen-Coon -> PI: Kp = 1.88333, Ti = 1.65789 s
    >>> round(tuning.margins.gain, 2)
    1.57
    """
    return tuned(
        "Cohen-Coon" + (" PID" if controller == "PID" else ""),
        model,
        lambda plant: _core.cohen_coon(plant, controller),
        delay_at_least,
        limits,
        lambda plant, _: outside("L / T", plant.L / plant.times[0], 0.1, 1.0),
    )
