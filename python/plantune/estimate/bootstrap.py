"""Uncertainty from records that could have been."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from plantune import _core
from plantune.estimate.fit import Fit, known_process, refit_arguments
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.record import Floats, Record
from plantune.text import number


@dataclass(frozen=True, slots=True, eq=False)
class Bootstrap:
    """Estimates from drawn records.

    Attributes
    ----------
    fit : Fit
        The fit, `P` and `sd` the spread of the estimates.
    estimates : array (runs, m)
        `theta`, then the offset where it was estimated; records that could not be fitted are left
        out.
    low, high : array (m,)
        2.5 % and 97.5 % quantiles.
    names : tuple of str
        Of the columns.
    block : int
        Residuals in a block.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> drawn = pt.estimate.bootstrap(rec, pt.estimate.oe(rec, 2, 2, 3), runs=20)
    >>> drawn.estimates.shape, drawn.block
    ((20, 5), 57)
    """

    fit: Fit
    estimates: Floats
    low: Floats
    high: Floats
    names: tuple[str, ...]
    block: int

    def __str__(self) -> str:
        width = max(map(len, self.names))
        head = f"{len(self.estimates)} records, blocks of {self.block}, 95 % of the estimates:"
        rows = zip(self.names, self.low, self.high, strict=True)
        lines = [f"  {name:<{width}} {number(a)} to {number(b)}" for name, a, b in rows]
        return "\n".join([head, *lines])


def bootstrap(
    rec: Record,
    fit: Fit,
    *,
    runs: int = 200,
    block: int | None = None,
    seed: int = 0,
    limits: Limits | None = None,
) -> Bootstrap:
    """Fit `runs` records whose residuals are drawn in blocks from those of the fit.

    Parameters
    ----------
    rec : Record
        The record of the fit.
    fit : Fit
        Of a polynomial or a process model.
    runs : int
        Records drawn, >= 2; 200 give a standard deviation to 5 %.
    block : int, optional
        Residuals in a block, 1 to N; by default `(sqrt(6) r/(1 - r^2))^(2/3) N^(1/3)` with `r` the
        correlation of neighbouring residuals: 1 where they are white.
    seed : int
        Seed of the draws, >= 0; the same seed gives the same numbers.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Bootstrap
        `.fit` carries the spread as its covariance, and a note (V12).

    Raises
    ------
    UsageError
        Another record than that of the fit, a model that is neither, or a block longer than it
        (U01).
    NumericsError
        Most of the drawn records could not be fitted (N05).

    Notes
    -----
    `y* = y + H(q) (e* - e)`, `H = C/(D A)`: the answer to the input, the offset and the initial
    state stay.  Each search begins at the fit.  Künsch 1989.
    Quantiles that lie to one side of the estimate show that such noise moves it, as it does ARX:
    take a noise model.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> fit = pt.estimate.oe(rec, 2, 2, 3)
    >>> print(pt.estimate.bootstrap(rec, fit))
    200 records, blocks of 57, 95 % of the estimates:
      b1     0.064 to 0.07383
      b2     0.03567 to 0.05139
      f1     -1.317 to -1.252
      f2     0.3756 to 0.4341
      offset 0.06542 to 0.3627
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    known = known_process(rec, fit)
    if known is None:
        d = _core.bootstrap(rec, *refit_arguments(rec, fit), runs, block, seed, limits)
    else:
        d = _core.process_bootstrap(rec, known, (runs, block, seed), limits)
    drawn = len(d["estimates"])
    note = Note(
        code="V12",
        severity="info",
        text=f"standard deviations are the spread over {drawn} drawn records, "
        f"residuals in blocks of {d['block']}",
        count=drawn,
    )
    wide = replace(
        fit, P=d.pop("P"), sd=d.pop("sd"), intervals=_quantiles(fit, d), notes=(*fit.notes, note)
    )
    offset = ("offset",) if len(fit.P) > len(fit.theta) else ()
    return Bootstrap(fit=wide, names=(*fit.names, *offset), **d)


def _quantiles(fit: Fit, d: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Return the quantiles of the parameters that have an interval of their own."""
    places = {name: fit.names.index(name) for name in fit.intervals}
    return {name: (float(d["low"][i]), float(d["high"][i])) for name, i in places.items()}
