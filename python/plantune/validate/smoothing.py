"""Whether smoothing helps on a record: none, y alone, both signals, and the cure without any."""

from __future__ import annotations

from dataclasses import dataclass

from plantune.estimate.arx import arx
from plantune.estimate.fit import Fit
from plantune.estimate.oe import oe
from plantune.estimate.orders import PerInput
from plantune.notes import DEFAULT_LIMITS, Limits, Note, merged
from plantune.prep.smooth import smooth
from plantune.record import Record
from plantune.text import number, table
from plantune.validate.compare import compare
from plantune.validate.plausible import plausible


@dataclass(frozen=True, slots=True, eq=False)
class Treatment:
    """One way to treat the record, and how its model does on rows it has not seen.

    Attributes
    ----------
    name : str
        "none", "y alone", "both" or "OE".
    fit : Fit
        On the first part of the record, smoothed as `name` says.
    mse : float
        Mean squared simulation error on the other part as it was measured, units of y squared.
    N : int
        Rows judged.
    codes : tuple of str
        What `plausible` doubts of the model, and N05 where its search did not end.

    Examples
    --------
    >>> import plantune as pt
    >>> none = pt.validate.smoothing(pt.datasets.printer_motor(noise_var=1.0), 2, 2).rows[0]
    >>> none.name, round(none.mse, 2), none.codes
    ('none', 1.39, ('V07',))
    """

    name: str
    fit: Fit
    mse: float
    N: int
    codes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Smoothing:
    """Ways to treat a record, side by side; prints as a table with the advice below.

    Attributes
    ----------
    rows : tuple of Treatment
        "none", "y alone" and "both" are ARX models, "OE" an output-error model of the same orders.
    limit : float
        Relative difference of two errors that counts (V09).
    notes : tuple of Note
        Doubts, with the treatment they speak of.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.validate.smoothing(pt.datasets.printer_motor(noise_var=1.0), 2, 2)
    >>> found.best.name
    'OE'
    """

    rows: tuple[Treatment, ...]
    limit: float
    notes: tuple[Note, ...]
    source: str

    @property
    def best(self) -> Treatment:
        """What to use: of those as good as any the least doubtful, the simplest; never y alone.

        An output-error search that did not end (N05) must halve the error to count.
        """
        none, oe, both = (self._row(name) for name in ("none", "OE", "both"))
        others = min(none.mse, both.mse)
        unsure = "N05" in oe.codes and oe.mse > others / 2.0
        rows = [none, both] if unsure else [none, oe, both]
        least = min(row.mse for row in rows)
        close = [row for row in rows if row.mse <= (1.0 + self.limit) * least]
        return min(close, key=lambda row: len(row.codes))

    @property
    def advice(self) -> str:
        """What follows from the errors."""
        none, best, alone = self._row("none"), self.best, self._row("y alone")
        says = {
            "none": "leave the record as it is: smoothing does not help",
            "OE": "fit an output-error model to the record as it is",
            "both": "smooth u and y alike",
        }[best.name]
        if best is not none:
            less = f"error {number(best.mse)} instead of {number(none.mse)}"
            doubts = " and ".join(code for code in none.codes if code not in best.codes)
            even = doubts and none.mse <= (1.0 + self.limit) * best.mse
            says += f": {f'{less}, as good, and no {doubts}' if even else less}"
        if alone.mse < none.mse:
            least = all(alone.mse <= row.mse for row in self.rows)
            says += (
                f"; smoothing y alone leaves {'least' if least else 'less than none'} here, "
                f"{number(alone.mse)}, and is still not for use: it shifts the poles even without "
                "noise"
            )
        return says

    def _row(self, name: str) -> Treatment:
        return next(row for row in self.rows if row.name == name)

    def __str__(self) -> str:
        head = ("smoothed", "mean squared error", "DC gain", "poles", "doubts")
        lines = table([head, *map(_written, self.rows)])
        rows = f"simulation of {self.rows[0].N} rows not used to fit, as measured"
        return "\n".join([rows, *lines, self.advice])


def smoothing(
    rec: Record,
    na: int,
    nb: PerInput,
    nk: PerInput = 1,
    *,
    share: float = 0.5,
    limits: Limits | None = None,
) -> Smoothing:
    """Fit with no, y-only and both-signal smoothing and by OE; judge on the rest of the record.

    Parameters
    ----------
    rec : Record
        One output, nu inputs, as measured.
    na : int
        Number of a coefficients, >= 1; of the output-error model, f coefficients per input.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples.
    share : float
        First part of the rows, to fit; the rest judges.
    limits : Limits, optional
        Thresholds; V09 says which difference of errors counts.

    Returns
    -------
    Smoothing

    Raises
    ------
    NotIdentifiable
        As `arx` and `oe`.
    DataError
        No segment has three rows (D04).
    UsageError
        A `share` outside (0, 1) or orders that do not fit the record (U01).

    Notes
    -----
    Source 000, 2.3 and 3.3.  It smooths y alone.  The true model then has u(t) and a wider
    numerator, so least squares is biased even without noise; y alone is shown and never advised.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.validate.smoothing(pt.datasets.printer_motor(equation_var=1.0), 2, 2).advice)
    leave the record as it is: smoothing does not help
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    est, val = rec.split(share)
    fits = {
        "none": arx(est, na, nb, nk, limits=limits),
        "y alone": arx(smooth(est, "y"), na, nb, nk, limits=limits),
        "both": arx(smooth(est), na, nb, nk, limits=limits),
        "OE": oe(est, nb, na, nk, limits=limits),
    }
    judged = compare(val, *fits.values(), names=list(fits), limits=limits)
    rows = tuple(
        Treatment(
            name=name,
            fit=fit,
            mse=verdict.rmse**2,
            N=verdict.N,
            codes=_codes(fit, limits),
        )
        for (name, fit), verdict in zip(fits.items(), judged.rows, strict=True)
    )
    notes = merged([(name, fit.notes) for name, fit in fits.items()])
    return Smoothing(rows, limits.V09, (*notes, *judged.notes), rec.source)


def _codes(fit: Fit, limits: Limits) -> tuple[str, ...]:
    unfinished = [note for note in fit.notes if note.code == "N05"]
    return tuple(note.code for note in [*plausible(fit, limits=limits), *unfinished])


def _written(row: Treatment) -> list[str]:
    model = row.fit.model
    assert model is not None
    gains = model.dc_gain()
    gain = ", ".join(number(g) for g in (gains if isinstance(gains, list) else [gains]))
    poles = ", ".join(_pole(p) for p in model.poles() if p.imag >= 0)
    return [row.name, f"{row.mse:.4f}", gain, poles, " ".join(row.codes) or "none"]


def _pole(p: complex) -> str:
    return f"{p.real:.3f} ± {p.imag:.3f}j" if p.imag else f"{p.real:.3f}"
