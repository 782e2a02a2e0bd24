"""First-order reversal curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.models.hysteresis.base import column
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Forc:
    """What first-order reversal curves (FORC) say of the relays.

    Attributes
    ----------
    levels : array (n + 1,)
        The input at saturation, and at each turn.
    everett : array (n + 1, n + 1)
        `E(alpha, beta)`, half of what the output falls by from the turn `alpha` to `beta`.
    mu : array (n, n)
        Weights of the cells, in units of y; noise may make them negative.
    offset : float
        Output halfway between both saturations.
    rising : bool
        Whether the curves rise, from turns on the way down from positive saturation.
    curves : tuple of (x, y)
        Each curve, from its turn on.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> x = np.concatenate([[-1, a, -1] for a in np.linspace(-0.8, 1, 10)])
    >>> x = np.interp(np.arange(1450) / 50, np.arange(30), x)
    >>> y = pt.hysteresis.PlayStack(r=[0, 0.3], w=[1, 2]).simulate(x)
    >>> forc = pt.hysteresis.forc(x, y)
    >>> len(forc.curves), forc.levels.round(1)[:4]
    (10, array([-1. , -0.8, -0.6, -0.4]))
    """

    levels: Floats
    everett: Floats
    mu: Floats
    offset: float
    rising: bool
    curves: tuple[tuple[Floats, Floats], ...]


def forc(x: ArrayLike, y: ArrayLike) -> Forc:
    """Cut a record into reversal curves, and read the weights of the relays off them.

    Parameters
    ----------
    x : array (N,)
        Input: from one and the same saturation to a turn and back, again and again, with another
        turn each time; two turns or more, in any order.
    y : array (N,)
        Output.

    Returns
    -------
    Forc
        For `Preisach.from_forc` and `plot.forc`.

    Raises
    ------
    NotIdentifiable
        The turns are no such family (X04).
    UsageError
        Signals that are not finite, or differ in length (U01).

    Notes
    -----
    `E(alpha, beta) = (f_alpha - f_alpha,beta)/2`, and mu its mixed difference: noise on y counts
    twice in every cell.  `Preisach.identify` takes the same record, or any other, and keeps
    `mu >= 0`.  Source 002, (2) to (4); Mayergoyz, Mathematical Models of Hysteresis and Their
    Applications, 2003.

    Examples
    --------
    >>> import plantune as pt
    >>> relays = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
    >>> x = [-1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0]
    >>> pt.hysteresis.forc(x, relays.simulate(x)).mu
    array([[1., 0.],
           [2., 1.]])
    """
    x, y = column(x, "x"), column(y, "y")
    fields = _core.hysteresis_forc(x, y)
    curves = tuple((_kept(x[a:b]), _kept(y[a:b])) for a, b in fields["curves"])
    n = len(fields["levels"]) - 1
    tables = {
        "everett": fields["everett"].reshape(n + 1, n + 1),
        "mu": fields["mu"].reshape(n, n),
    }
    return Forc(**{**fields, **tables, "curves": curves})


def _kept(x: Floats) -> Floats:
    own = np.array(x)
    own.flags.writeable = False
    return own
