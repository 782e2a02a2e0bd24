"""Refined Ziegler-Nichols tuning."""

from __future__ import annotations

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.notes import Limits
from plantune.tune.judge import Plant, tuned
from plantune.tune.tuning import Tuning


def refined_ziegler_nichols(
    model: Plant | Fit,
    *,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return the PI settings of Hang, Astrom and Ho from K_u = T / (K L), T_u = 4 L.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        One lag; others that settle are reduced to that by `half_rule`.  Of a fit
        the margins come with bands over its uncertainty.
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
    NotIdentifiable
        The model is none, or has no dead time (M12), integrates (M01) or is unstable (M02), or the
        sign of its gain is open (X12).

    Notes
    -----
    `Kp = 5/6 K_u (12 + K_u K) / (15 + 14 K_u K)`, `Ti = T_u/5 (4/15 K_u K + 1)`; source 001,
    (3.6-71), (3.6-72) and table 3.6-1.  Cautious in gain, fast in integration; `simc` is the
    better choice where a rule is wanted.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> tuning = refined_ziegler_nichols(ProcessModel(K=5.939, T=0.1491, L=0.1))
    >>> print(tuning.rule, "->", tuning.controller)
    refined Ziegler-Nichols -> PI: Kp = 0.0786769, Ti = 0.111808 s
    >>> round(tuning.margins.gain_db, 2)
    12.75
    """
    return tuned(
        "refined Ziegler-Nichols",
        model,
        _core.refined_ziegler_nichols,
        delay_at_least,
        limits,
    )
