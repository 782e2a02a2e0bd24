"""Steps of the level: where a load came on, and how large it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import Note
from plantune.record import Floats, Record, columns


@dataclass(frozen=True, slots=True, eq=False)
class OffsetSteps:
    """What the level of a signal does.

    Attributes
    ----------
    at : array (k,) of int
        First row of each new level; `t` its time, seconds (rows of a bare signal).
    sizes, sd : array (k,)
        How much the level changes there, and its standard deviation.
    levels : array (k + 1,)
        The level of each part.
    ratio : float
        Long-run variance over variance of what is left: 1 for white noise.
    slope : float or None
        Change per second, where a straight line explains more than steps; there are none then.
    notes : tuple of Note
        The same in words (M08).
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> found = offset_steps([0.0] * 40 + [2.0] * 60)
    >>> found.at.tolist(), found.sizes.tolist()
    ([40], [2.0])
    """

    at: NDArray[np.int64]
    t: Floats
    sizes: Floats
    sd: Floats
    levels: Floats
    ratio: float
    slope: float | None
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        if self.slope is not None:
            return f"a line of {self.slope:.4g} a second rather than steps"
        if not len(self.at):
            return "no step"
        steps = zip(self.t, self.sizes, self.sd, strict=True)
        return "\n".join(f"{size:+.4g} ± {sd:.2g} from {t:g} s on" for t, size, sd in steps)


def offset_steps(x: Record | ArrayLike, fit: Any = None, *, output: int = 0) -> OffsetSteps:
    """Find the steps of the level of a signal, or say that it drifts along a line.

    Parameters
    ----------
    x : Record, or array (N,)
        The output of a record, its rows that count, all segments in one; or any signal.
    fit : Fit, optional
        What the input explains is taken off first.  Without, the input should rest: each of its
        moves is a step of the output as well.
    output : int
        Which output.

    Returns
    -------
    OffsetSteps

    Raises
    ------
    DataError
        The signal has values that are not finite (D07).

    Notes
    -----
    A step at row c takes `S(c) = (n1 n2/N) (mean2 - mean1)^2 / s2` from the sum of squares; the
    signal is split at the largest S while it is above `2 ln N + 3`, times the long-run ratio of
    coloured noise.  In white noise 1000 rows long, steps of one standard deviation are found in
    94 % of records, of two in all; in noise of correlation 0.95 only four are.  Hinkley 1970;
    Vostrikova 1981.  A fit with load steps is `estimate.process(rec, offset="steps")`.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(1)
    >>> print(offset_steps(rng.normal(size=500) + 3.0 * (np.arange(500) >= 200)))
    +3.06 ± 0.09 from 200 s on
    """
    if not isinstance(x, Record):
        signal = columns(x, "x")[:, 0]
        if not np.isfinite(signal).all():
            raise refusal("D07", "`x` has values that are not finite", remedy="leave them out")
        return _found(signal, np.arange(len(signal)), np.arange(len(signal), dtype=float), 1.0, "")
    y = x.y[:, output]
    if fit is not None:
        y = y - fit.predict(x, None)
    counts = x.valid[:, output] & np.isfinite(y)
    at = np.flatnonzero(counts)
    return _found(np.ascontiguousarray(y[counts]), at, x.time[counts], x.Ts, x.source)


def _found(
    signal: Floats, rows: NDArray[np.int64], t: Floats, Ts: float, source: str
) -> OffsetSteps:
    d = _core.offset_steps(signal)
    at, slope = np.array(d.pop("at"), np.int64), d.pop("slope")
    return OffsetSteps(
        at=rows[at],
        t=t[at],
        slope=None if slope is None else slope / Ts,
        notes=_notes(t[at], slope),
        source=source,
        **d,
    )


def _notes(t: Floats, slope: float | None) -> tuple[Note, ...]:
    if slope is not None:
        text, remedy = "the level drifts along a line", 'prep.detrend(rec, by="line")'
    elif len(t):
        text = f"the level steps {len(t)} times, first at {t[0]:g} s"
        remedy = 'process(rec, offset="steps") estimates the steps with the plant'
    else:
        return ()
    return (Note(code="M08", severity="info", text=text, count=len(t) or None, remedy=remedy),)
