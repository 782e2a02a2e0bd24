"""Remove the mean of each input and output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from plantune import _core
from plantune.record import Record


def detrend(rec: Record) -> Record:
    """Remove from each input and output its mean over the rows that count.

    An output's mean is taken over its own valid rows, an input's over the rows at which any
    output is valid.  The reference moves with its output, so that `r - y` stays what it was.

    Parameters
    ----------
    rec : Record
        Several segments share one mean.

    Returns
    -------
    Record
        Same rows, segments and `source`; the means stand in the log.

    Notes
    -----
    An estimator with an offset does not need this; it serves comparisons with methods without.

    Examples
    --------
    >>> from plantune.record import Record
    >>> rec = detrend(Record(u=[0.0, 2.0, 4.0], y=[5.0, 5.0, 8.0], Ts=1.0))
    >>> rec.u[:, 0].tolist(), rec.y[:, 0].tolist()
    ([-2.0, 0.0, 2.0], [-1.0, -1.0, 2.0])
    >>> rec.log
    ('removed means: u 2, y 6',)
    """
    counts = np.repeat(rec.valid.any(axis=1, keepdims=True), rec.nu, axis=1)
    u, u_means = _core.remove_means(rec.u, counts)
    y, y_means = _core.remove_means(rec.y, rec.valid)
    levels = zip((*rec.u_names, *rec.y_names), (*u_means, *y_means), strict=True)
    said = "removed means: " + ", ".join(f"{name} {mean:.6g}" for name, mean in levels)
    r = None if rec.r is None else _core.without_levels(rec.r, y_means)
    return replace(rec, u=u, y=y, r=r, log=(*rec.log, said))
