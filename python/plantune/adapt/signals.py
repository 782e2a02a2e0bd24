"""Signals of which some are not known at some samples, as a record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan

import numpy as np
from numpy.typing import NDArray

from plantune.adapt.decision import Sample
from plantune.errors import refusal
from plantune.record import Floats, Record


def signal(samples: Sequence[Sample], name: str) -> Floats:
    """Return `t`, `r`, `u` or `y` of the samples, NaN where it was not read.

    Examples
    --------
    >>> signal([Sample(0.0, u=1.0), Sample(0.1)], "u")
    array([ 1., nan])
    """
    values = (getattr(sample, name) for sample in samples)
    return np.array([nan if x is None else x for x in values], float)


def starts_of(t: Floats, Ts: float) -> NDArray[np.int64]:
    """Return the first row of each stretch of samples that follow each other, as the core has it.

    Examples
    --------
    >>> starts_of(np.array([0.0, 0.1, 0.5, 0.6]), 0.1).tolist()
    [0, 2]
    """
    breaks = np.abs(np.diff(t) - Ts) > 0.5 * Ts
    starts: NDArray[np.int64] = np.r_[0, np.flatnonzero(breaks) + 1]
    return starts


def record_of(
    signals: tuple[Floats, Floats, Floats, Floats],
    Ts: float,
    starts: NDArray[np.int64],
    aux: Mapping[str, Floats],
    needed: Sequence[Floats] = (),
) -> Record:
    """Return `t`, `r`, `u`, `y` as a record: what is not known is left out, never a number.

    A row without u, or without one of the `needed`, is left out, and a new segment begins behind
    it; a y that is not known does not count; r and `aux` must be known in every row that is left.

    Raises
    ------
    DataError
        No row is left (D07).
    """
    t, r, u, y = signals
    keep = np.all(np.isfinite([u, *needed]), axis=0)
    if not keep.any():
        what = "an estimate of the plant" if needed else "u"
        raise refusal(
            "D07",
            f"no sample has {what}",
            where=("u", None, None),
            count=len(u),
            remedy="look at what is read; a log without estimates is a record all the same"
            if needed
            else "read u, or have it simulated",
        )
    segment = np.cumsum(np.isin(np.arange(len(t)), starts)) + np.cumsum(~keep)
    rows = np.round((t - t[0]) / Ts).astype(np.int64)
    off_grid = np.abs(t - (t[0] + rows * Ts)) > 1e-6 * Ts
    on_grid = not off_grid.any() and bool((np.diff(rows) > 0).all())
    told = {**aux, "r": r}
    known = {name: x[keep] for name, x in told.items() if np.isfinite(x[keep]).all()}
    return Record(
        u=u[keep],
        y=y[keep],
        Ts=Ts,
        r=known.pop("r", None),
        aux=known,
        t0=float(t[keep][0]),
        t=None if on_grid else t[keep],
        valid=np.isfinite(y[keep]),
        starts=np.flatnonzero(np.diff(segment[keep], prepend=-1)),
        rows=rows[keep] if on_grid else np.flatnonzero(keep),
    )
