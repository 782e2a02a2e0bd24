"""Sign-perturbed sums: regions that are exact for any number of rows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit
from plantune.notes import DEFAULT_LIMITS
from plantune.record import Floats, Record, columns
from plantune.text import number


class SignPerturbed(ABC):
    """What regions by sign-perturbed sums share: `q` of `m` sums leave the truth outside."""

    __slots__ = ()
    m: int
    q: int

    @property
    def confidence(self) -> float:
        """Probability with which the region holds the truth."""
        return 1 - self.q / self.m

    def contains(self, theta: ArrayLike) -> bool | np.ndarray:
        """Return whether `theta` (n,) is inside; of several (k, n) which ones are."""
        inside = self._inside(np.atleast_2d(np.asarray(theta, float)).tolist())
        return inside[0] if np.ndim(theta) == 1 else np.array(inside)

    @abstractmethod
    def _inside(self, rows: list[list[float]]) -> list[bool]:
        """Return which rows of parameters are inside."""


@dataclass(frozen=True, slots=True, eq=False)
class Region(SignPerturbed):
    """A region that holds the true parameters of a regression with probability `1 - q/m`.

    Attributes
    ----------
    theta : array (n,)
        Estimate by least squares; always inside.
    low, high : array (n,)
        Interval of each parameter, that of the ellipsoid around the region; infinite where the
        region is not bounded.
    radius : float
        The ellipsoid is `(theta - theta_hat)' phi' phi (theta - theta_hat) <= radius`.
    phi, y, m, q, seed
        What the region was asked for.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> region = pt.estimate.sps(np.ones(20), np.arange(20.0))
    >>> region.contains(region.theta), region.confidence
    (True, 0.95)
    """

    theta: Floats
    low: Floats
    high: Floats
    radius: float
    phi: Floats
    y: Floats
    m: int
    q: int
    seed: int

    def _inside(self, rows: list[list[float]]) -> list[bool]:
        return _core.sps_contains(self.phi, self.y, rows, (self.m, self.q), self.seed)

    def __str__(self) -> str:
        head = f"{100 * self.confidence:g} % by sign-perturbed sums, {len(self.y)} rows:"
        rows = enumerate(zip(self.theta, self.low, self.high, strict=True), 1)
        lines = (f"  theta{k} {number(x)}  {number(a)} to {number(b)}" for k, (x, a, b) in rows)
        return "\n".join([head, *lines])


def sps(phi: ArrayLike, y: ArrayLike, *, m: int = 100, q: int = 5, seed: int = 0) -> Region:
    """Return the region of y = phi theta + e by sign-perturbed sums.

    Exact for any number of rows where the noise is independent and symmetric about zero, whatever
    its distribution, even from row to row.  The regressors must not depend on the noise: with past
    outputs among them use `sps_arx`.

    Parameters
    ----------
    phi : array (N, n)
        Regressor; a constant is a column of ones.
    y : array (N,)
        Right-hand side.
    m, q : int
        The truth is inside with probability `1 - q/m`; 0 < q < m.
    seed : int
        Seed of the signs, >= 0.

    Returns
    -------
    Region
        `.contains(theta)` is exact; `low` and `high` are those of an ellipsoid around it.

    Raises
    ------
    UsageError
        `q` is not in [1, m - 1] (U01).
    NotIdentifiable
        A column depends on the others (X02), or fewer rows than columns (X03).

    Notes
    -----
    `S_0 = |R^-1/2 sum phi r|^2`, `S_i` the same with random signs on `r`; outside if `S_0` is among
    the `q` largest of `m`.  Csáji, Campi & Weyer 2015; the ellipsoid after Weyer, Campi & Csáji
    2017.  METHODS 2.4.

    Examples
    --------
    Forty rows, noise with heavy tails:

    >>> import numpy as np, plantune as pt
    >>> rng = np.random.default_rng(1)
    >>> phi = np.column_stack([rng.normal(size=40), np.ones(40)])
    >>> y = phi @ [0.7, 2.0] + 0.1 * rng.standard_t(2, size=40)
    >>> region = pt.estimate.sps(phi, y)
    >>> region.contains([0.7, 2.0]), region.contains([1.2, 2.0])
    (True, False)
    >>> bool(region.low[0] < 0.7 < region.high[0])
    True
    """
    table = np.ascontiguousarray(columns(phi, "phi"), np.float64)
    right = np.ascontiguousarray(columns(y, "y")[:, 0])
    if len(table) != len(right):
        raise refusal(
            "D09",
            f"`phi` has {len(table)} rows and `y` has {len(right)}",
            count=abs(len(table) - len(right)),
            remedy="give phi one row per value of y",
        )
    theta, half, radius = _core.sign_perturbed_sums(table, right, (m, q), seed)
    return Region(theta, theta - half, theta + half, radius, table, right, m, q, seed)


@dataclass(frozen=True, slots=True, eq=False)
class ArxRegion(SignPerturbed):
    """A region that holds the true parameters of an ARX model with probability `1 - q/m`.

    Attributes
    ----------
    theta : array (n,)
        Estimate by least squares, always inside: `a`, `b`, then the constant `d` where there is
        one.
    low, high : array (n,)
        Interval of each entry: the box around the region; infinite where it is not bounded.
    names : tuple of str
        Of the entries.
    rec, fit, m, q, seed
        What the region was asked for.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer().between(0, 8)
    >>> region = pt.estimate.sps_arx(rec, pt.estimate.arx(rec, 1, 1, 3), m=20, q=1)
    >>> region.names, region.contains(region.theta), region.confidence
    (('a1', 'b1', 'd'), True, 0.95)
    """

    theta: Floats
    low: Floats
    high: Floats
    names: tuple[str, ...]
    rec: Record
    fit: Fit
    m: int
    q: int
    seed: int

    def _inside(self, rows: list[list[float]]) -> list[bool]:
        limits = self.rec.limits or DEFAULT_LIMITS
        sizes = (self.m, self.q)
        return _core.sps_arx_contains(self.rec, self.fit.model, rows, sizes, self.seed, limits)

    def __str__(self) -> str:
        head = f"{100 * self.confidence:g} % by sign-perturbed sums, {self.fit.N} rows:"
        rows = zip(self.names, self.theta, self.low, self.high, strict=True)
        lines = (f"  {name}  {number(x)}  {number(a)} to {number(b)}" for name, x, a, b in rows)
        return "\n".join([head, *lines])


@overload
def sps_arx(
    rec: Record, fit: Fit, theta: None = None, *, m: int = 100, q: int = 5, seed: int = 0
) -> ArxRegion: ...


@overload
def sps_arx(
    rec: Record, fit: Fit, theta: ArrayLike, *, m: int = 100, q: int = 5, seed: int = 0
) -> bool | np.ndarray: ...


def sps_arx(
    rec: Record,
    fit: Fit,
    theta: ArrayLike | None = None,
    *,
    m: int = 100,
    q: int = 5,
    seed: int = 0,
) -> ArxRegion | bool | np.ndarray:
    """Return the region of an ARX model, or whether parameters are inside.

    Parameters
    ----------
    rec : Record
        One output, every row valid; segments are honoured.
    fit : Fit
        Of ARX on this record, its parameters those of least squares.
    theta : array (n,) or (n + 1,), or (k, n) of several, optional
        `a`, then `b`, then the constant `d` of `A y = B u + d + e` where there is one
        (`d = A(1) O`, with the offset `O` that a fit reports).
    m, q : int
        The truth is inside with probability `1 - q/m`; 0 < q < m.
    seed : int
        Seed of the signs, >= 0.

    Returns
    -------
    ArxRegion
        With an interval per parameter; some 30 times the work of one membership per parameter.
    bool, or array of them
        With `theta`.

    Raises
    ------
    UsageError
        `q` is not in [1, m - 1], rows that do not count, or `theta` of another length (U01).
    NotIdentifiable
        A column of the regressor depends on the others (X02).

    Notes
    -----
    Each set of signs has an output of its own, simulated from `theta` and the residuals it leaves.
    Exact where the noise of the equation is independent and symmetric and the input does not
    depend on it (no feedback).  Csáji, Campi & Weyer 2015, V.
    The ends of an interval are sought along rays from the estimate, to 2 % of a standard deviation:
    a part of the region that no ray meets is not in them.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> rng = np.random.default_rng(1)
    >>> u, e = rng.normal(size=60), 0.1 * rng.standard_t(2, size=60)
    >>> plant = pt.models.PolyModel(A=[1, -0.7], B=[[0.5], [1.0]], nk=[1, 0], Ts=1.0)
    >>> rec = pt.Record(u=u, y=plant.simulate(np.column_stack([u, e])), Ts=1.0)
    >>> fit = pt.estimate.arx(rec, 1, 1, 1, offset=False)
    >>> sps_arx(rec, fit, [-0.7, 0.5]), sps_arx(rec, fit, [-0.2, 0.5])
    (True, False)
    >>> region = sps_arx(rec, fit)
    >>> bool(region.low[0] < -0.7 < region.high[0])
    True
    """
    offset = float(fit.offset[0]) if len(fit.P) > len(fit.theta) else None
    names = (*fit.names, "d") if offset is not None else fit.names
    limits = rec.limits or DEFAULT_LIMITS
    if theta is None:
        ends = _core.sps_arx_box(rec, fit.model, offset, (m, q), seed, limits)
        return ArxRegion(*ends, names, rec, fit, m, q, seed)
    none = np.empty(0)
    asked = ArxRegion(none, none, none, names, rec, fit, m, q, seed)
    return asked.contains(theta)
