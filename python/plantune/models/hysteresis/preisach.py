"""Weighted relays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models.hysteresis.base import HysteresisModel, Identified, column, frozen
from plantune.record import Floats

AUTO = (5, 10, 15, 20, 25)
"""Numbers of cells that `levels="auto"` tries."""


@dataclass(frozen=True, slots=True, eq=False)
class _Relays(HysteresisModel):
    """Levels and weights of relays, for the model and for its inverse."""

    kind: ClassVar[str] = ""

    levels: Floats
    mu: Floats | None = None
    offset: float = 0.0
    start: str = "virgin"
    everett: Floats | None = field(default=None, repr=False)
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if (self.mu is None) == (self.everett is None):
            given = "neither" if self.mu is None else "both"
            raise refusal("U01", f"`mu` and `everett`: {given} given", remedy="pass one of them")
        object.__setattr__(self, "levels", frozen(self.levels, "levels"))
        object.__setattr__(self, "offset", float(self.offset))
        n = len(self.levels) - 1
        if self.mu is None:
            mu = _core.preisach_mu(_square(self.everett, n + 1, "everett"))
        else:
            mu = _square(self.mu, n, "mu")
        object.__setattr__(self, "mu", _kept(mu))
        _core.hysteresis_check(self)
        object.__setattr__(self, "everett", _kept(_core.preisach_everett(mu)))


@dataclass(frozen=True, slots=True, eq=False)
class Preisach(_Relays):
    """`y = offset + sum mu_ij f_ij` over relays that go up at alpha and down at beta.

    Parameters
    ----------
    levels : array (n + 1,)
        Ascending, in units of the input; beyond them the output is saturated.
    mu : array (n, n), optional
        Weights in units of y: row i for `alpha` in `[levels[i], levels[i+1]]`, column j <= i for
        `beta`; 0 above the diagonal.
    offset : float
        Output halfway between both saturations.
    start : "virgin" or "negative"
        Before the first sample: relays of `alpha + beta < 0` up, as plays at 0 and as a
        demagnetised sample; or all down.
    everett : array (n + 1, n + 1), optional
        In place of `mu`: `E(alpha, beta)`, half of what the output falls by from `alpha`, on the
        way up from negative saturation, to `beta`.  Row a is that of `levels[a]`.

    Raises
    ------
    UsageError
        Levels that do not ascend, tables of another size, both tables or none (U01).

    Notes
    -----
    A sample costs one look into the Everett table, whatever the grid: only the extremes of the
    input that are not wiped out are kept.  Straight lines between levels leave no staircase.
    Source 002, (2) to (4) as corrected.

    Examples
    --------
    >>> import plantune as pt
    >>> relays = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]], start="negative")
    >>> relays.simulate([-1.0, 0.0, 1.0, 0.0, -1.0])
    array([-4., -2.,  4.,  2., -4.])
    >>> relays.everett
    array([[0., 0., 0.],
           [1., 0., 0.],
           [4., 1., 0.]])
    """

    kind: ClassVar[str] = "preisach"

    def inverse(self) -> PreisachInverse:  # type: ignore[override]
        """Return the model whose output is this one's input.

        Sample by sample the way to the output is sought in the Everett table: exact to rounding
        within saturation, and the end of the range beyond it.

        Raises
        ------
        UsageError
            A negative weight: the output may fall while the input rises (U01).

        Examples
        --------
        >>> import plantune as pt
        >>> relays = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
        >>> relays.inverse().simulate(relays.simulate([0.5, -0.25, 0.75])).round(12)
        array([ 0.5 , -0.25,  0.75])
        """
        return PreisachInverse(**_core.hysteresis_inverse(self))

    @staticmethod
    def identify(
        x: ArrayLike,
        y: ArrayLike,
        *,
        levels: int | str | ArrayLike = 20,
        ridge: float = 1e-2,
        smooth: float = 10.0,
        start: str = "virgin",
        offset: bool = True,
    ) -> Preisach:
        """Fit weights `mu >= 0` to any record, by regularised least squares.

        Parameters
        ----------
        x, y : array (N,)
            Input and output; the record begins in the state `start`.
        levels : int, "auto" or array
            Number of cells per side, evenly over the range of `x`; the one of 5, 10, 15, 20, 25
            that is best on the last third of the rows, fitted on the others; or the levels.
        ridge : float
            Weight of `sum mu^2`, positive.
        smooth : float
            Weight of the squared differences of `mu` along the diagonals, where the weights of
            plays are the same, >= 0: it fills cells that the record did not switch.
        start : "virgin" or "negative"
            As of `Preisach`; a record that begins demagnetised has 0 within its levels.
        offset : bool
            Whether the offset is fitted.

        Returns
        -------
        Preisach
            `.identified` has the errors, and standard deviations of `mu`, row by row, and offset.

        Raises
        ------
        NotIdentifiable
            An input that stands still (X01).
        UsageError
            Rows that differ in number, a ridge or levels that are none (U01).

        Examples
        --------
        >>> import numpy as np, plantune as pt
        >>> x = np.sin(np.arange(600) / 20) * np.linspace(0.1, 1.0, 600)
        >>> y = pt.hysteresis.PlayStack(r=[0, 0.2, 0.5], w=[1, 0.5, 0.5], offset=3.0).simulate(x)
        >>> model = pt.hysteresis.Preisach.identify(x, y, levels=10)
        >>> print(f"{100 * model.identified.relative:.2f} %")
        0.10 %
        """
        given = None if isinstance(levels, (int, str, np.integer)) else frozen(levels, "levels")
        if isinstance(levels, str) and levels != "auto":
            raise refusal("U01", f"`levels` is {levels!r}", remedy="a number, 'auto' or the levels")
        counts = AUTO if isinstance(levels, str) else (levels,) if given is None else ()
        fields, how = _core.preisach_identify(
            column(x, "x"),
            column(y, "y"),
            given,
            [max(0, int(n)) for n in counts],  # type: ignore[arg-type]
            ridge,
            smooth,
            start,
            offset,
        )
        n = len(fields["levels"]) - 1
        names = [f"mu[{i},{j}]" for i in range(n) for j in range(n)]
        return Preisach(**fields, identified=Identified(**how, names=(*names, "offset")))

    @staticmethod
    def from_forc(forc: Any, *, start: str = "virgin") -> Preisach:
        """Return the model that has these first-order reversal curves.

        Parameters
        ----------
        forc : Forc
            From `hysteresis.forc`.
        start : "virgin" or "negative"
            Before the first sample.

        Examples
        --------
        >>> import numpy as np, plantune as pt
        >>> relays = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
        >>> x = np.array([-1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0])
        >>> forc = pt.hysteresis.forc(x, relays.simulate(x))
        >>> pt.hysteresis.Preisach.from_forc(forc).same_as(relays)
        True
        """
        return Preisach(levels=forc.levels, mu=forc.mu, offset=forc.offset, start=start)


@dataclass(frozen=True, slots=True, eq=False)
class PreisachInverse(_Relays):
    """What finds the input of a `Preisach` model, sample by sample; from `Preisach.inverse`.

    Attributes
    ----------
    levels, mu, offset, start, everett
        Of the model whose inverse it is.

    Examples
    --------
    >>> import plantune as pt
    >>> relays = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
    >>> inverse = relays.inverse().stream()
    >>> relays.simulate([inverse.step(1.0), inverse.step(-1.5)]).round(12)
    array([ 1. , -1.5])
    """

    kind: ClassVar[str] = "preisach_inverse"

    def inverse(self) -> Preisach:  # type: ignore[override]
        """Return the model itself."""
        return Preisach(**_core.hysteresis_inverse(self))


def _square(table: Any, n: int, name: str) -> Floats:
    """Return a table (n, n), given as such or flat."""
    rows = np.ascontiguousarray(table, float)
    if rows.size != n * n or rows.shape not in ((n, n), (n * n,)):
        needed = f"({n}, {n}) beside {n + (name == 'mu')} levels"
        raise refusal("U01", f"`{name}` has shape {rows.shape}", remedy=f"pass {needed}")
    return rows.reshape(n, n)


def _kept(table: Floats) -> Floats:
    own = np.array(table)
    own.flags.writeable = False
    return own
