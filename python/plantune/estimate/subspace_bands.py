"""How far a subspace estimate scatters: gain, step and frequency response over drawn records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.derived import Curve
from plantune.estimate.fit import Fit
from plantune.estimate.subspace import options_of
from plantune.models import StateSpace
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Floats, Record
from plantune.text import number


@dataclass(frozen=True, slots=True, eq=False)
class SubspaceBands:
    """Models fitted to records that could have been, and what they say of the fit.

    Attributes
    ----------
    model : StateSpace
        That of the fit.
    models : tuple of StateSpace
        One per drawn record.
    offset, offset_sd : array (ny,)
        `O` of the fit, and its standard deviation.
    block : int
        Residuals in a block.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> bands = pt.estimate.subspace_bands(rec, pt.estimate.subspace(rec, 3), runs=20)
    >>> len(bands.models), bands.step([0.4, 2.0]).sd.shape
    (20, (2, 1))
    """

    model: StateSpace
    models: tuple[StateSpace, ...]
    offset: Floats
    offset_sd: Floats
    block: int
    source: str

    def dc_gain(self) -> Curve:
        """Return the static gains (ny, nu), and their standard deviations."""
        return _curve(self.model.dc_gain(), [model.dc_gain() for model in self.models])

    def step(self, t: ArrayLike, input: int = 0) -> Curve:
        """Return the outputs (len(t), ny) after a unit step of one input at times `t` (s)."""
        return _curve(self.model.step(t, input), [m.step(t, input) for m in self.models])

    def magnitude(self, w: ArrayLike) -> Curve:
        """Return the magnitudes (len(w), ny, nu) at `w` rad/s, and their standard deviations."""
        own, *drawn = (np.abs(m.freqresp(w)) for m in (self.model, *self.models))
        return _curve(own, drawn)

    def phase(self, w: ArrayLike) -> Curve:
        """Return the phases (len(w), ny, nu) in degrees, and their standard deviations.

        Those of the models are counted from that of the fit, so that no turn is taken for scatter.
        """
        own: NDArray[np.complex128] = self.model.freqresp(w)
        value = np.degrees(np.unwrap(np.angle(own), axis=0))
        turned = [np.degrees(np.angle(m.freqresp(w) * own.conj())) for m in self.models]
        return Curve(value, _curve(value, turned).sd)

    def __str__(self) -> str:
        gain = self.dc_gain()
        rows = [
            f"  K[{i + 1},{j + 1}] {number(gain.value[i, j])} ± {gain.sd[i, j]:.3g}"
            for i in range(self.model.ny)
            for j in range(self.model.nu)
        ]
        head = f"{len(self.models)} records, blocks of {self.block}: static gains"
        return "\n".join([head, *rows])


def subspace_bands(
    rec: Record,
    fit: Fit,
    *,
    runs: int = 100,
    block: int | None = None,
    seed: int = 0,
    limits: Limits | None = None,
) -> SubspaceBands:
    """Fit `runs` records whose one-step errors are drawn in blocks from those of the fit.

    Parameters
    ----------
    rec : Record
        The record of the fit.
    fit : Fit
        Of `subspace`; each record is fitted with its settings and its order.
    runs : int
        Records drawn, >= 2; 100 give a standard deviation to 7 %.
    block : int, optional
        Errors in a block, 1 to N; by default 1 where they are white, else
        `(sqrt(6) r/(1 - r^2))^(2/3) N^(1/3)` with `r` the correlation of neighbours.
    seed : int
        Seed of the draws, >= 0; the same seed gives the same numbers.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    SubspaceBands
        The bands hold what noise leaves open.  They do not hold the bias of too low an order or
        of feedback, nor the choice of the order: judge the fit on fresh rows first.

    Raises
    ------
    UsageError
        Another record than that of the fit, or a fit that is not of `subspace` (U01).
    NumericsError
        Most of the drawn records could not be fitted (N05).

    Notes
    -----
    `y* = y + H(q) (e* - e)`, `H = C (q I - A)^-1 K + I`: the answer to the input, the offset and
    the initial state stay.  Künsch 1989.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> bands = pt.estimate.subspace_bands(rec, pt.estimate.subspace(rec, 3))
    >>> gain = bands.dc_gain()
    >>> bool(abs(gain.value[0, 0] - 0.94) < 0.02), bool(gain.sd[0, 0] < 0.02)
    (True, True)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    options = options_of(fit)
    if rec.source != fit.source:
        raise refusal(
            "U01", "`rec` is not the record of the fit", remedy="give the record it was fitted to"
        )
    fitted = (fit.model, fit.offset.tolist())
    models, offsets, block = _core.subspace_bands(rec, fitted, options, (runs, block, seed), limits)
    return SubspaceBands(
        model=fit.model,
        models=tuple(StateSpace.of_core(model) for model in models),
        offset=fit.offset,
        offset_sd=_core.deviations(np.array(offsets)),
        block=block,
        source=rec.source,
    )


def _curve(value: Floats, drawn: list[Floats]) -> Curve:
    """Return values and the standard deviations of those drawn, entry by entry."""
    rows = np.array([x.reshape(-1) for x in drawn], float)
    return Curve(value, _core.deviations(rows).reshape(value.shape))
