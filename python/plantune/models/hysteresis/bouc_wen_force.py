"""The force of Bouc and Wen over a displacement."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from numpy.typing import ArrayLike

from plantune import _core
from plantune.models.hysteresis.base import HysteresisModel, Identified, column
from plantune.notes import notes_from_core

_PARAMETERS = ("k", "alpha", "g", "d", "nu", "offset")


@dataclass(frozen=True, slots=True, eq=False)
class BoucWenForce(HysteresisModel):
    """`y = offset + k x + alpha zeta`, zeta of Bouc and Wen over x.

    `d zeta / d x = 1 - |zeta|^nu (g sgn(zeta dx) + d)`: no time in it.  With `z = alpha zeta` the
    letters of `BoucWen` are `bg = g alpha^(1 - nu)` and `bd = d alpha^(1 - nu)`.

    Parameters
    ----------
    k, alpha : float
        Stiffness beside the force with memory, and of that force where it is 0, y/x.
    g, d : float
        What zeta loses of its growth, both ways and by the way, 1/x^nu.
    nu : float
        How sharply it yields, > 0.
    offset : float
        Added, in units of y.

    Raises
    ------
    UsageError
        A number that is not finite, or `nu` not positive (U01).

    Examples
    --------
    >>> import plantune as pt
    >>> force = pt.hysteresis.BoucWenForce(k=0.1, alpha=1, g=1.5, d=0.5)
    >>> force.simulate([0.0, 5.0, 0.0, -5.0, 0.0]).round(2)
    array([ 0. ,  1. , -0.5, -1. ,  0.5])
    """

    kind: ClassVar[str] = "bouc_wen_force"

    k: float
    alpha: float
    g: float
    d: float
    nu: float = 1.0
    offset: float = 0.0
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in _PARAMETERS:
            object.__setattr__(self, name, float(getattr(self, name)))
        _core.hysteresis_check(self)

    @classmethod
    def identify(cls, x: ArrayLike, y: ArrayLike, *, nu: float | None = None) -> BoucWenForce:
        """Fit the model to a displacement and the force over it, from the virgin state on.

        Variable projection: offset, `k` and `alpha` are solved for, and the search over `g`, `d`
        and `nu` begins at several points.

        Parameters
        ----------
        x, y : array (N,)
            Displacement and force.
        nu : float, optional
            How sharply it yields, where it is known.

        Returns
        -------
        BoucWenForce
            `identified.sd` are those of `k alpha g d nu offset`, for white noise on y.  Notes: X02
            nu is open, N05 the search did not converge.

        Raises
        ------
        DataError
            x and y of different lengths (D09).
        NotIdentifiable
            x stands still (X01), a parameter depends on the others (X02), too few rows (X03).
        NumericsError
            No parameters reproduce the record (N05).

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> x = np.linspace(0, 3, 600) * np.sin(np.linspace(0, 40, 600))
        >>> y = pt.hysteresis.BoucWenForce(k=0.1, alpha=1, g=1.5, d=0.5).simulate(x)
        >>> pt.hysteresis.BoucWenForce.identify(x, y).g
        1.50
        """
        model, how, notes = _core.bouc_wen_force_identify(column(x, "x"), column(y, "y"), nu)
        identified = Identified(
            **{**how, "tried": ()}, names=_PARAMETERS, notes=notes_from_core(notes)
        )
        return cls(**model, identified=identified)

    def __str__(self) -> str:
        lines = ["y = offset + k x + alpha zeta", "dzeta/dx = 1 - |zeta|^nu (g sgn(zeta dx) + d)"]
        sd = self.identified.sd if self.identified else [0.0] * len(_PARAMETERS)
        for name, own in zip(_PARAMETERS, sd, strict=True):
            spread = f" ± {own:.2g}" if own > 0 else ""
            lines.append(f"{name:6} = {getattr(self, name):.6g}{spread}")
        return "\n".join(lines)
