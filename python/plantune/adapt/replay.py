"""The auto-tuner over a record."""

from __future__ import annotations

import numpy as np

from plantune import _core
from plantune.adapt.log import AdaptLog, log_of
from plantune.adapt.settings import Settings
from plantune.errors import refusal
from plantune.record import Record


def replay(rec: Record, settings: Settings) -> AdaptLog:
    """Run the auto-tuner over a record: its `step` in a loop, to the last bit.

    What it decides is not written anywhere: the record stays as it was.

    Parameters
    ----------
    rec : Record
        One input and one output, uniformly sampled; gaps are honoured.
    settings : Settings
        `Ts` is the record's.

    Returns
    -------
    AdaptLog

    Raises
    ------
    UsageError
        Another sample time than the record's, several inputs or outputs, or an operating-point
        signal that the record lacks (U01).

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5, seed=3, t_end=10.0)
    >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    >>> log = replay(rec, Settings(Ts=0.02, nk=(3, 11), controller=pid))
    >>> bool(abs(log.K[-1] / pt.datasets.ENGINE_LOOP.K - 1) < 0.02)
    True
    """
    if rec.nu != 1 or rec.ny != 1:
        raise refusal(
            "U01",
            f"`rec` has {rec.nu} inputs and {rec.ny} outputs, must have one of each",
            remedy="take the columns of one loop",
        )
    if abs(rec.Ts - settings.Ts) > 1e-9 * settings.Ts:
        raise refusal(
            "U01",
            f"`Ts` is {settings.Ts:g} s in the settings and {rec.Ts:g} s in the record",
            remedy=f"Ts={rec.Ts:g}",
        )
    if missing := [name for name in settings.signals if name not in rec.aux]:
        raise refusal(
            "U01",
            f"`rec` lacks the operating-point signals {missing}",
            remedy="read them as further signals: aux=",
        )
    N = len(rec.u)
    u, y = rec.u[:, 0].copy(), np.where(rec.valid[:, 0], rec.y[:, 0], np.nan)
    r = np.full(N, np.nan) if rec.r is None else rec.r[:, 0].copy()
    aux = np.empty((N, len(settings.signals)))
    for i, name in enumerate(settings.signals):
        aux[:, i] = rec.aux[name]
    out = _core.AutoTuner(settings).run(rec.time, r, u, y, aux, rec.starts.tolist())
    return log_of(out, r, rec, settings)
