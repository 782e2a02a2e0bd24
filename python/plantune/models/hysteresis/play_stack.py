"""Weighted plays, and what a record says of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models.hysteresis.asymmetric_stack import AsymmetricStack
from plantune.models.hysteresis.base import HysteresisModel, Identified, column, freeze, frozen
from plantune.models.hysteresis.even_stack import EvenStack
from plantune.models.hysteresis.printed import elements
from plantune.notes import notes_from_core
from plantune.record import Floats

_TRIED = {
    "symmetric": (2, 3, 5, 8, 12, 20, 30, 50),
    "asymmetric": (5, 8, 12, 20, 30),
    "even": (2, 4, 6, 8, 10, 15, 20),
}
"""Numbers of plays from which rows not used choose."""

_USUAL = {"symmetric": _TRIED["symmetric"], "asymmetric": (30,), "even": (10,)}


@dataclass(frozen=True, slots=True, eq=False)
class PlayStack(HysteresisModel):
    """`y = offset + sum w_i z_i` over plays `z_i` of half width `r_i` (Prandtl-Ishlinskii).

    Parameters
    ----------
    r : array (n,)
        Half widths, ascending, in units of the input.
    w : array (n,)
        Weights, y/x.
    offset : float
        Added to the sum, in units of y.
    z0 : array (n,), optional
        Where the plays begin; at 0, the virgin state, by default.
    identified : Identified, optional
        How it was found; names `w0 ... offset`.

    Raises
    ------
    UsageError
        Lengths that do not match, or widths out of order (U01).

    Notes
    -----
    `inverse` is exact, from any state on, and asks for a first width of 0 and for partial sums of
    the weights that stay positive.  Krejci and Kuhnen, IEE Proc. Control Theory Appl. 148, 2001.

    Examples
    --------
    >>> import plantune as pt
    >>> stack = pt.hysteresis.PlayStack(r=[0, 1], w=[1, 0.5], offset=-2)
    >>> stack.inverse().w, stack.inverse().offset
    (array([ 1.        , -0.33333333]), 1.3333333333333333)
    """

    kind: ClassVar[str] = "play_stack"

    r: Floats
    w: Floats
    offset: float = 0.0
    z0: Floats = None  # type: ignore[assignment]
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        freeze(self, "r", "w", z0="r")
        _core.hysteresis_check(self)

    @classmethod
    def identify(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        n: int | Sequence[int] | str | None = None,
        *,
        asymmetric: bool = False,
        even: bool = False,
        r: ArrayLike | None = None,
        segments: int = 16,
        offset: bool = True,
        skip: int = 0,
    ) -> PlayStack | AsymmetricStack | EvenStack:
        """Fit a stack to a record that begins in the virgin state: one convex problem.

        Parameters
        ----------
        x, y : array (N,)
            Input and output, at least 20 rows.
        n : int, sequence of int or "auto", optional
            Number of plays, on evenly spaced half widths `i max|x| / n`; of several, rows not used
            choose.  By default "auto"; 30 with `asymmetric`, 10 on each side with `even`.
        asymmetric : bool
            Fit `S(H[x])`, for branches that differ in shape.
        even : bool
            Add plays on |x|, for butterfly loops; both sides are chosen from 40 half widths one by
            one, each time the one that lowers the error most.
        r : array (n,), optional
            Half widths in place of even ones; with `even` those to choose from.
        segments : int
            Pieces of S over the range of y, with `asymmetric`.
        offset : bool
            Whether an offset is fitted.
        skip : int
            First rows that move the plays and are not fitted: those before x has been at both ends
            of its range, if the record does not begin in the virgin state.  Half widths reach half
            the range of x then.

        Returns
        -------
        PlayStack, AsymmetricStack with `asymmetric`, or EvenStack with `even`
            Weights are not negative, but for `even`.  `identified.tried` holds the rms error of
            each number of plays over ten parts of the rows, each predicted by the fit to the nine
            others; the fewest plays that come within 5 % of the best are taken.  Notes: H01 weights
            at zero, H02 the loop runs clockwise (`MaxwellSlip`), H03 too few turning points, H05
            segments without a slope of their own, H06 the record does not begin in the virgin
            state.  Where x later goes beyond what was fitted, `check_range` says so.

        Raises
        ------
        UsageError
            An argument out of its range (U01).
        DataError
            x and y of different lengths (D09).
        NotIdentifiable
            x does not move (X01) or too little to tell the plays apart (X02); too few rows (X03);
            half of the rows not used are predicted no better than by a constant (X04).

        Notes
        -----
        Non-negative least squares on the outputs of the plays; METHODS 4.  For loops that small and
        large ones do not share, take `Preisach`; for elements per direction, `SeriesSlip`.

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> t = np.linspace(0, 1, 600)
        >>> x = 5 * t * np.sin(40 * t)
        >>> y = pt.hysteresis.PlayStack(r=[0, 1, 2], w=[1, 0.5, 0.3], offset=7).simulate(x)
        >>> pt.hysteresis.PlayStack.identify(x, y, r=[0, 1, 2, 3]).w.round(6)
        array([1. , 0.5, 0.3, 0. ])
        """
        if asymmetric and even:
            raise refusal(
                "U01", "`asymmetric` and `even` are both True", remedy="choose one of them"
            )
        form = "asymmetric" if asymmetric else "even" if even else "symmetric"
        settings: dict[str, Any] = {
            "form": form,
            "counts": _counts(n, form),
            "grid": 40 if even else int(segments),
            "r": None if r is None else frozen(r, "r").tolist(),
            "offset": bool(offset),
            "skip": int(skip),
        }
        u = column(x, "x")
        model, found, names, notes = _core.plays_identify(u, column(y, "y"), settings)
        how = Identified(
            **found,
            names=tuple(names),
            notes=notes_from_core(notes),
            x_range=(float(u.min()), float(u.max())),
        )
        if asymmetric:
            return AsymmetricStack(**model, identified=how)
        return EvenStack(**model, identified=how) if even else cls(**model, identified=how)

    def __str__(self) -> str:
        equation = "y = offset + sum w z,  z(t) = max(x - r, min(x + r, z(t-1)))"
        return elements(self, equation, ("r", "w"))


def _counts(n: int | Sequence[int] | str | None, form: str) -> list[int]:
    """Return the numbers of plays to try."""
    if n is None:
        return list(_USUAL[form])
    if isinstance(n, str):
        if n != "auto":
            raise refusal("U01", f"`n` is {n!r}", remedy='pass a number, several, or "auto"')
        return list(_TRIED[form])
    counts = [int(k) for k in np.atleast_1d(n)]
    if not counts or min(counts) < 1:
        raise refusal("U01", f"`n` is {n!r}, must be 1 or more", remedy="pass a number of plays")
    return counts
