"""Power spectral density of one signal, by Welch's way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power per frequency, one-sided, with its 95 % band.

    Attributes
    ----------
    signal : str
        Name.
    w : array (n,)
        Frequencies, rad/s, from 0 to `pi/Ts`.
    P : array (n,)
        Density in squared units per rad/s: `sum P dw` is the mean square about the mean.
    low, high : array (n,)
        Its band, chi-square with `dof` degrees of freedom.
    n : int
        Rows of a stretch.
    averaged : int
        Stretches.
    dof : float
        Degrees of freedom behind each ordinate.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.spectrum(pt.datasets.hair_dryer(), "power"))
    Spectrum of power: 14 stretches of 128 rows, 65 frequencies up to 39.27 rad/s
    """

    signal: str
    w: Floats
    P: Floats
    low: Floats
    high: Floats
    n: int
    averaged: int
    dof: float
    source: str

    def __str__(self) -> str:
        stretches = f"{self.averaged} stretch{'es' if self.averaged > 1 else ''}"
        return (
            f"Spectrum of {self.signal}: {stretches} of {self.n} rows, "
            f"{len(self.w)} frequencies up to {self.w[-1]:.4g} rad/s"
        )


def spectrum(
    rec: Record,
    signal: str | None = None,
    *,
    n: int | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    limits: Limits | None = None,
) -> Spectrum:
    """Estimate the power spectral density of a signal.

    Parameters
    ----------
    rec : Record
        Stretches lie within its segments, and on rows that count.
    signal : str, optional
        Name of an output or input; the first output when absent.
    n : int, optional
        Rows of a stretch, at least 8; the largest power of two up to an eighth of the rows when
        absent.  Longer ones tell nearer frequencies apart, shorter ones have narrower bands.
    overlap : float
        Share of a stretch that the next one repeats, 0 to 0.95.
    window : "hann", "hamming" or "rectangular"
        How a stretch fades in and out; "rectangular" for whole periods only.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Spectrum

    Raises
    ------
    DataError
        The signal keeps one value (D18).
    NotIdentifiable
        Fewer than 16 rows, or than a stretch has (X03).

    Notes
    -----
    The mean of each segment is taken off first.  Source 001, (3.5-10) to (3.5-14); Welch 1967.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> psd = spectrum(rec, "power", n=256)
    >>> power = float((psd.P * psd.w[1]).sum())
    >>> round(power / float(rec.u.var()), 1)
    1.0
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    name, column = column_of(rec, signal)
    d = _core.spectrum(rec, column, (n, overlap, window), limits)
    return spectrum_from_core(d, name, rec.source)


def spectrum_from_core(d: Mapping[str, Any], name: str, source: str) -> Spectrum:
    """Return a density that the core sends."""
    return Spectrum(signal=name, **d, source=source)


def column_of(rec: Record, signal: str | None) -> tuple[str, int]:
    """Return name and number of a signal, inputs counting before outputs."""
    names = (*rec.u_names, *rec.y_names)
    if signal is None:
        return rec.y_names[0], rec.nu
    if signal not in names:
        raise refusal(
            "U01",
            f"`signal` is {signal!r}, must be one of {', '.join(names)}",
            where=("signal", None, None),
            remedy=f"signal={rec.y_names[0]!r}",
        )
    return signal, names.index(signal)
