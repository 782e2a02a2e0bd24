"""The noise of a signal: how large, how distributed, how coloured, how steady."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.analyze.spectrum import Spectrum, column_of, spectrum_from_core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record
from plantune.text import number, table


@dataclass(frozen=True, slots=True, eq=False)
class Histogram:
    """How often the signal takes which values.

    Attributes
    ----------
    edges : array (bins + 1,)
        Ends of the bins, in units of the signal.
    centres : array (bins,)
        Their middles.
    counts : array (bins,) of int
        Rows in each.
    density : array (bins,)
        Share of the rows per unit of the signal: the bars have area one.
    normal : array (bins,)
        Density of a normal law of the same mean and variance, at the middles.
    rule : str
        How the bins were chosen.
    """

    edges: Floats
    centres: Floats
    counts: NDArray[np.int64]
    density: Floats
    normal: Floats
    rule: str


@dataclass(frozen=True, slots=True)
class Part:
    """Level and power of a part; `first` and `last` are rows of the file, both included.

    `N_mean` and `N_var` are the rows of white noise whose mean or variance would be as sure;
    `kurtosis` is `E x^4/var^2 - 1`, 2 of a normal law.
    """

    first: int
    last: int
    N: int
    mean: float
    rms: float
    var: float
    snr: float
    N_mean: float
    N_var: float
    kurtosis: float


@dataclass(frozen=True, slots=True, eq=False)
class NoiseReport:
    """What the noise of one signal is like, and what follows for the model.

    Attributes
    ----------
    signal, unit : str
        Name and unit, the latter empty where nobody gave it.
    N : int
        Rows that count.
    mean, rms, var : float
        Level and power, `var = rms^2 - mean^2`; source 001, (3.5-3) to (3.5-5).
    snr : float
        `10 log10(rms^2/var)`, dB; (3.5-6).
    histogram : Histogram
        With its bin rule.
    lags, R : array (m,)
        Normalised autocorrelation, lags in rows; (3.5-8).
    R_band : float
        Of white noise 95 % of the lags from 1 on lie within it.
    inside : float
        Share of them that do.
    white : float
        p-value of whiteness (Ljung and Box).
    N_mean : float
        Rows of white noise whose mean would be as sure.
    memory : int
        First lag at which R is below 1/e.
    periodogram, spectrum : Spectrum
        Of the longest run, unsmoothed, (3.5-14); and Welch's.
    parseval : float
        Relative error of `sum P dw = mean square` on the periodogram.
    quantum : float or None
        Step in which the signal is read, where it is read in steps.
    parts : tuple of Part
        Segments, or halves.
    p_mean, p_var : float or None
        p-value of equal means and of equal variances of neighbouring parts; None where a part has
        fewer than ten independent rows.
    advice : tuple of str
        What follows from all that.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> e = np.random.default_rng(1).normal(size=1000)
    >>> rec = pt.Record(u=np.zeros(1000), y=20 + e, Ts=0.1)
    >>> print(pt.analyze.noise(rec))
    Noise of y: mean 19.96, rms 19.98, sd 0.9987, SNR 26.02 dB, 1000 rows
    part        mean     rms     var    SNR
    0 to 499   19.94   19.97  0.9793  26.10
    500 to 999 19.97   19.99   1.015  25.96
      advice: white: an output-error or process model with white noise holds
    """

    signal: str
    unit: str
    N: int
    mean: float
    rms: float
    var: float
    snr: float
    histogram: Histogram
    lags: NDArray[np.int64]
    R: Floats
    R_band: float
    inside: float
    white: float
    N_mean: float
    memory: int
    periodogram: Spectrum
    spectrum: Spectrum
    parseval: float
    quantum: float | None
    parts: tuple[Part, ...]
    p_mean: float | None
    p_var: float | None
    advice: tuple[str, ...]
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        lines = [
            f"Noise of {self.signal}: mean {number(self.mean)}{unit}, rms {number(self.rms)}{unit}, "
            f"sd {number(self.var**0.5)}{unit}, SNR {number(self.snr)} dB, {self.N} rows",
            *table([("part", "mean", "rms", "var", "SNR"), *map(_row, self.parts)]),
        ]
        lines += [f"  advice: {line}" for line in self.advice]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def _row(part: Part) -> tuple[str, ...]:
    numbers = (part.mean, part.rms, part.var, part.snr)
    return (f"{part.first} to {part.last}", *(number(x, padded=True) for x in numbers))


def noise(
    rec: Record,
    signal: str | None = None,
    *,
    parts: int | None = None,
    lags: int | None = None,
    n: int | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    limits: Limits | None = None,
) -> NoiseReport:
    """Say how large, how distributed, how coloured and how steady a signal's noise is.

    Parameters
    ----------
    rec : Record
        Of the plant at rest: where an input moves, what an output does is response as well, and
        a note (X04) says so.  Segments and `valid` are honoured.
    signal : str, optional
        Name of an output or input; the first output when absent.
    parts : int, optional
        Equal parts to compare, of at least 16 rows each.  By default the segments where there are
        several, else two halves.
    lags : int, optional
        Longest lag of the autocorrelation; a quarter of the longest run, at most 100, when absent.
    n, overlap, window
        Stretches of the spectrum, as of `analyze.spectrum`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    NoiseReport
        With note M07 where the parts differ, M04 where the steps of reading exceed the standard
        deviation, X03 where the parts are too short to tell.

    Raises
    ------
    DataError
        The signal keeps one value (D18).
    NotIdentifiable
        Fewer than 16 rows, or than a stretch has (X03).

    Notes
    -----
    Deviations are from the mean of each segment; `mean`, `rms`, `var` and `snr` are of all rows.
    The tests of the parts count independent rows: rows that hang together are fewer than they
    look.  Source 001, 3.5.2, whose two parts differ in variance, which is why it takes ARMAX.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5).between(0.0, 0.9)
    >>> report = noise(rec)
    >>> report.signal, report.N, report.parseval < 1e-12
    ('y', 45, True)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    name, column = column_of(rec, signal)
    d = dict(_core.noise(rec, column, parts, lags, (n, overlap, window), limits))
    N, mean, rms, var, snr = d.pop("moments")
    bins = {key: d.pop(key) for key in ("edges", "centres", "counts", "density", "normal", "rule")}
    spectra = {
        key: spectrum_from_core(d.pop(key), name, rec.source) for key in ("periodogram", "spectrum")
    }
    return NoiseReport(
        signal=name,
        unit=rec.units.get(name, ""),
        N=N,
        mean=mean,
        rms=rms,
        var=var,
        snr=snr,
        histogram=Histogram(**{**bins, "counts": np.array(bins["counts"])}),
        lags=np.arange(len(d["R"])),
        R_band=d.pop("band"),
        parts=tuple(map(_part, d.pop("parts"))),
        advice=tuple(d.pop("advice")),
        notes=(*notes_from_core(d.pop("notes")), *limits.changes()),
        source=rec.source,
        **spectra,
        **d,
    )


def _part(d: dict[str, Any]) -> Part:
    N, mean, rms, var, snr = d.pop("moments")
    return Part(N=N, mean=mean, rms=rms, var=var, snr=snr, **d)
