"""Remove the mean, the line or the steps of each input and output."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from plantune import _core
from plantune.errors import refusal
from plantune.record import Floats, Record


def detrend(rec: Record, by: Literal["mean", "line", "steps"] = "mean") -> Record:
    """Remove from each input and output its mean, or its line, over the rows that count.

    An output's mean is taken over its own valid rows, an input's over the rows at which any
    output is valid.  The reference moves with its output, so that `r - y` stays what it was.

    Parameters
    ----------
    rec : Record
        Several segments share one mean, one line.
    by : "mean", "line" or "steps"
        A line of least squares over time; or, of outputs, the levels between the steps that
        `analyze.offset_steps` finds, and of inputs the mean.

    Returns
    -------
    Record
        Same rows, segments and `source`; what was removed stands in the log.

    Raises
    ------
    UsageError
        Another word (U01).

    Notes
    -----
    An estimator with an offset does not need the mean removed; that serves comparisons with
    methods without.  A line removed from both sides leaves a linear plant as it is but for the
    plant's lag, `slope (T + L)`, which is part of the offset.  Steps are for an input that rests:
    what it moves is no load.  Elsewhere estimate both: `process(rec, offset="steps")`.

    Examples
    --------
    >>> from plantune.record import Record
    >>> rec = detrend(Record(u=[0.0, 2.0, 4.0], y=[5.0, 5.0, 8.0], Ts=1.0))
    >>> rec.u[:, 0].tolist(), rec.y[:, 0].tolist()
    ([-2.0, 0.0, 2.0], [-1.0, -1.0, 2.0])
    >>> rec.log
    ('removed means: u 2, y 6',)
    >>> detrend(Record(u=[0.0, 1.0, 0.0], y=[1.0, 3.0, 5.0], Ts=1.0), by="line").y[:, 0].tolist()
    [0.0, 0.0, 0.0]
    """
    if by not in ("mean", "line", "steps"):
        raise refusal(
            "U01",
            f"`by` is {by!r}, must be 'mean', 'line' or 'steps'",
            where=("by", None, None),
            remedy="by='line'",
        )
    counts = np.repeat(rec.valid.any(axis=1, keepdims=True), rec.nu, axis=1)
    if by == "line":
        return _without_lines(rec, counts)
    u, u_means = _core.remove_means(rec.u, counts)
    if by == "steps":
        return _without_steps(rec, u, u_means)
    y, y_means = _core.remove_means(rec.y, rec.valid)
    levels = zip((*rec.u_names, *rec.y_names), (*u_means, *y_means), strict=True)
    said = "removed means: " + ", ".join(f"{name} {mean:.6g}" for name, mean in levels)
    r = None if rec.r is None else _core.without_levels(rec.r, y_means)
    return replace(rec, u=u, y=y, r=r, log=(*rec.log, said))


def _without_lines(rec: Record, counts: np.ndarray) -> Record:
    t = np.ascontiguousarray(rec.time)
    u, u_lines = _core.remove_lines(rec.u, t, counts)
    y, y_lines = _core.remove_lines(rec.y, t, rec.valid)
    named = zip((*rec.u_names, *rec.y_names), (*u_lines, *y_lines), strict=True)
    each = (f"{name} {level:.6g} and {slope:.4g} a second" for name, (level, slope, _) in named)
    r = None if rec.r is None else _core.without_lines(rec.r, t, y_lines)
    return replace(rec, u=u, y=y, r=r, log=(*rec.log, "removed lines: " + ", ".join(each)))


def _without_steps(rec: Record, u: Floats, u_means: list[float]) -> Record:
    y, r = rec.y.copy(), None if rec.r is None else rec.r.copy()
    said = [f"{name} {mean:.6g}" for name, mean in zip(rec.u_names, u_means, strict=True)]
    for i, name in enumerate(rec.y_names):
        rows = np.flatnonzero(rec.valid[:, i])
        found = _core.offset_steps(np.ascontiguousarray(rec.y[rows, i]))
        # The first level is a step as well: from row 0 on.
        at, sizes = [0, *rows[found["at"]].tolist()], [found["levels"][0], *found["sizes"]]
        y[:, i] = _core.without_steps(np.ascontiguousarray(rec.y[:, i]), at, sizes)
        if r is not None:
            r[:, i] = _core.without_steps(np.ascontiguousarray(r[:, i]), at, sizes)
        steps = "".join(
            f", {h:+.6g} at row {rec.rows[k]}" for k, h in zip(at[1:], sizes[1:], strict=True)
        )
        said.append(f"{name} {sizes[0]:.6g}{steps}")
    log = (*rec.log, "removed levels between steps: " + "; ".join(said))
    return replace(rec, u=u, y=y, r=r, log=log)
