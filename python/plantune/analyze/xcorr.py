"""Correlation of an output with an input, raw and pre-whitened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.analyze.impulse import output_number
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True, eq=False)
class Correlation:
    """How y follows u, lag by lag; at a positive lag y is the later one.

    Attributes
    ----------
    lags : array (2 M + 1,)
        `-M … M` samples.
    raw, raw_band : array (2 M + 1,), float
        Correlation of the signals as they are; half width of the band of no relation, 3 standard
        deviations.
    prewhitened, band : array (2 M + 1,), float
        The same after both passed the filter that makes u white.
    A : array (p + 1,)
        That filter, an autoregression of u.  `[1]`: u is white as it is.
    peak : int
        Lag of the largest raw correlation, from 0 on.  Late by about the time u is held.
    first : int or None
        First lag, from 0 on, at which the pre-whitened one leaves its band: the delay.
    feedback : int or None
        A lag below 0 at which it stands out by 4 standard deviations: u follows y.
    N : int
        Rows used.
    notes : tuple of Note
        X09 where there is feedback.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> r = pt.analyze.xcorr(pt.datasets.hair_dryer())
    >>> r.first, r.peak, r.feedback
    (3, 6, None)
    """

    lags: NDArray[np.int64]
    raw: Floats
    raw_band: float
    prewhitened: Floats
    band: float
    A: Floats
    peak: int
    first: int | None
    feedback: int | None
    N: int
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        first = "none" if self.first is None else f"{self.first}"
        return f"first lag outside the band {first} (raw peak {self.peak})"


def xcorr(
    rec: Record,
    lags: int = 40,
    *,
    input: int = 0,
    output: str | None = None,
    limits: Limits | None = None,
) -> Correlation:
    """Correlate `y(t)` with `u(t - lag)`, both ways, as they are and with u made white.

    Parameters
    ----------
    rec : Record
        Segments are honoured.
    lags : int
        Most lags to each side, fewer than a third of the longest segment.
    input : int
        Which input.
    output : str, optional
        Which, of several outputs.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Correlation
        With note X09 where u follows y.

    Raises
    ------
    NotIdentifiable
        More lags than the record has rows for (X03); the input stands still (X01).

    Notes
    -----
    For a delay read the pre-whitened one, or better `delay_evidence`: noise hides a first lag that
    is small.  Source 001, (3.5-35); Box and Jenkins 1970, 11.2.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.xcorr(pt.datasets.hair_dryer(), 20))
    first lag outside the band 3 (raw peak 6)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    if not (isinstance(lags, int) and 1 <= lags < 2**31):
        raise refusal(
            "U01",
            f"`lags` is {lags!r}, must be a whole number, at least 1",
            where=("lags", None, None),
            remedy="lags=40",
        )
    d = _core.xcorr(rec, (input, output_number(rec, output)), lags, limits)
    return correlation_from_core(d, rec, limits)


def correlation_from_core(d: Mapping[str, Any], rec: Record, limits: Limits) -> Correlation:
    """Return the fields that the core sends as a value."""
    return Correlation(
        **{
            **d,
            "lags": np.array(d["lags"]),
            "notes": (*notes_from_core(d["notes"]), *limits.changes()),
        },
        source=rec.source,
    )
