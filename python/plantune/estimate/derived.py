"""What a person acts on, with its standard deviation: the delta rule from a fit's covariance.

::

    var g(theta) = J P J',   J = dg/dtheta

K = B(1)/(A(1) F(1)), T = -Ts/ln z of a real pole z, w_n and zeta of a pair.  METHODS 2.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.record import Floats
from plantune.text import number

if TYPE_CHECKING:
    from plantune.estimate.fit import Fit


class Curve(NamedTuple):
    """Values and their standard deviations, point by point.

    Examples
    --------
    >>> import plantune as pt
    >>> pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3).step([2.0]).sd.round(3)
    array([0.004])
    """

    value: Floats
    sd: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Derived:
    """Numbers that follow from the parameters, with their standard deviations.

    Attributes
    ----------
    names : tuple of str
        `K`, `T`, `L`, `Tz`, `w_n` (rad/s), `zeta`; `K1 K2` with several inputs, `T1 T2` with
        several real poles, the slowest first.  Where the plant cannot be told from an integrating
        one (M01), `slope`, y/(u s), takes the place of `K`.
    values, sd : array (n,)
        An `sd` that is NaN belongs to a number that was chosen and not estimated.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.estimate.arx(pt.datasets.engine_loop(noise_var=1.5), 1, 1, 6).derived())
    K     -5.872 ± 0.0453
    T     0.1393 ± 0.00273
    L        0.1
    """

    names: tuple[str, ...]
    values: Floats
    sd: Floats

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Return value and standard deviation of a name."""
        k = self.names.index(name)
        return float(self.values[k]), float(self.sd[k])

    def __str__(self) -> str:
        width = max(map(len, self.names), default=0)
        rows = zip(self.names, self.values, self.sd, strict=True)
        return "\n".join(
            f"{name:<{width}} {number(value):>10}" + ("" if np.isnan(sd) else f" ± {sd:.3g}")
            for name, value, sd in rows
        )


class Root(NamedTuple):
    """A pole or zero, with the covariance of its real and imaginary part.

    Examples
    --------
    >>> import plantune as pt
    >>> pole = pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3).poles()[0]
    >>> round(pole.value.real, 3), round(pole.sd_real, 4)
    (0.73, 0.0094)
    """

    value: complex
    P: Floats

    @property
    def sd_real(self) -> float:
        """Standard deviation of the real part."""
        return float(np.sqrt(self.P[0, 0]))

    @property
    def sd_imag(self) -> float:
        """Standard deviation of the imaginary part."""
        return float(np.sqrt(self.P[1, 1]))

    def __str__(self) -> str:
        z = self.value
        if z.imag == 0:
            return f"{number(z.real)} ± {self.sd_real:.3g}"
        sign = "+" if z.imag > 0 else "-"
        return (
            f"{number(z.real)} ± {self.sd_real:.3g} "
            f"{sign} ({number(abs(z.imag))} ± {self.sd_imag:.3g})j"
        )


def derived(fit: Fit) -> Derived:
    """Return gain, time constants and dampings of a fit."""
    rows = _core.derived_quantities(fit.model, fit.flat_P)
    names, values, sd = zip(*rows, strict=True) if rows else ((), (), ())
    return Derived(tuple(names), np.array(values), np.array(sd))


def roots(fit: Fit, zeros_from: int | None) -> tuple[Root, ...]:
    """Return the poles, or the zeros from an input."""
    found = _core.roots_with_sd(fit.model, fit.flat_P, zeros_from)
    return tuple(Root(complex(re, im), np.reshape(P, (2, 2))) for re, im, P in found)


def step(fit: Fit, t: ArrayLike, input: int) -> Curve:
    """Return the unit step response."""
    return Curve(*_core.step_with_sd(fit.model, fit.flat_P, input, grid(t)))


def bode(fit: Fit, w: ArrayLike, input: int) -> tuple[Curve, Curve]:
    """Return magnitude and phase in degrees."""
    magnitude, phase = _core.bode_with_sd(fit.model, fit.flat_P, input, grid(w))
    return Curve(*magnitude), Curve(*phase)


def grid(x: ArrayLike) -> Floats:
    """Return times or frequencies as the core reads them."""
    return np.ascontiguousarray(np.atleast_1d(x), float)
