"""First order plus dead time from areas under a step response."""

from __future__ import annotations

from plantune import _core
from plantune.models import ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def areas(
    rec: Record, *, step_at: float | None = None, limits: Limits | None = None
) -> ProcessModel:
    """Return K, T, L of int_0^t (y - y0) = -T (y - y0) + K (t - L), at once.

    A quick answer without deviations: `process` has those, and `idt` finds further modes.

    Parameters
    ----------
    rec : Record
        One input, one output, at rest before a step.
    step_at : float, optional
        Time of the step, seconds on the record's clock; found in the input by default.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    ProcessModel

    Raises
    ------
    NotIdentifiable
        No step (X01), no rest before it (X07), no response, or none of a first order (X04).

    Notes
    -----
    Linear least squares on the rows after the delay, then three passes with instruments.
    Bi et al., Control Engineering Practice 7, 1999.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> u = np.repeat([0.0, 1.0], [20, 2000])
    >>> y = pt.models.ProcessModel(K=2.0, T=4.0, L=1.0).simulate(u, Ts=0.02)
    >>> print(pt.estimate.areas(pt.Record(u=u, y=y, Ts=0.02)))
    G(s) = 2 e^(-1.00001 s) / (4 s + 1)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    K, T, L = _core.areas(rec, step_at, limits)
    return ProcessModel(K=K, T=T, L=L)
