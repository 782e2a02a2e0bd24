"""One model of a record of loops: the kind that the loops ask for, and how good it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from plantune.errors import PlantuneError, refusal
from plantune.hysteresis.cycles import Repeatability, repeatability
from plantune.hysteresis.direction import LoopDirection, loop_direction
from plantune.models.hysteresis import MaxwellSlip, PlayStack, Preisach, SeriesSlip
from plantune.models.hysteresis.base import HysteresisModel, Identified, column
from plantune.notes import Note
from plantune.text import number

KINDS = ("auto", "plays", "asymmetric", "even", "slip", "series", "preisach")
"""What can be asked for."""

_BETTER = 0.9  # of the error of plain plays must an asymmetric stack leave less


@dataclass(frozen=True, slots=True, eq=False)
class Loops:
    """A model of a record of loops.

    Attributes
    ----------
    model : HysteresisModel
        With how it was found in `.identified`.
    kind : str
        Of `KINDS`.
    direction : LoopDirection
        How the loops turn.
    repeatability : Repeatability or None
        How far its cycles differ; None where the input has no two whole ones.
    notes : tuple of Note
        Doubts.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> x = 50 - 50 * np.cos(np.linspace(0, 4 * np.pi, 800))
    >>> y = pt.hysteresis.PlayStack(r=[0, 10, 20], w=[0.4, 0.1, 0.1]).simulate(x)
    >>> print(pt.hysteresis.identify(x, y, n=5))
    y = offset + sum w z,  z(t) = max(x - r, min(x + r, z(t-1)))
          r                 w
      0   0  0.44825 ± 0.0005
      1  20  0.1581 ± 0.00064
      2  40                 0
      3  60                 0
      4  80                 0
      offset -0.27369 ± 0.017
    loops counter-clockwise, kind plays
    error rms 0.2391, largest 0.8394, 0.67 % of y, on 800 rows
    2 cycles differ by 3 at most, rms 0.952 (rising 3, 1.35; falling 0.0104, 0.000866)
      H01 at zero: w2 w3 w4
    """

    model: HysteresisModel
    kind: str
    direction: LoopDirection
    repeatability: Repeatability | None

    @property
    def notes(self) -> tuple[Note, ...]:
        """Doubts."""
        return self.model.notes

    def __str__(self) -> str:
        found = self.model.identified
        lines = [str(self.model), f"loops {self.direction.direction}, kind {self.kind}"]
        if found is not None:
            lines.append(
                f"error rms {number(found.rms)}, largest {number(found.worst)}, "
                f"{number(100 * found.relative, 3)} % of y, on {found.N} rows"
            )
        if self.repeatability is not None:
            lines.append(str(self.repeatability))
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def identify(
    x: ArrayLike,
    y: ArrayLike,
    kind: str = "auto",
    *,
    n: int | str = "auto",
    threshold: float | None = None,
    skip: int = 0,
) -> Loops:
    """Identify a model of the kind that the loops ask for, and say how good it is.

    Parameters
    ----------
    x, y : array (N,)
        Input and output, from a state at rest.
    kind : str
        "plays", "asymmetric" and "even" stacks of plays, "slip" (Maxwell), "series" (source 002),
        "preisach"; "auto" takes stops for clockwise loops, plays on x and |x| for butterflies, and
        for others plain plays, or asymmetric ones where these leave clearly less.
    n : int or "auto"
        Number of elements; by rows not used.
    threshold : float, optional
        Of "series", units of y; half of the repeatability by default, or 1 % of the range.
    skip : int
        Rows at the beginning that plays are not fitted to, until the unknown past is wiped out.

    Returns
    -------
    Loops

    Raises
    ------
    NotIdentifiable
        No loops, loops of another kind, or what the kind refuses.
    UsageError
        An unknown kind.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.piezo_stage(cycles=2)
    >>> found = pt.hysteresis.identify(rec.u[:, 0], rec.y[:, 0], "series")
    >>> len(found.model.up), len(found.model.down)
    (4, 3)
    """
    if kind not in KINDS:
        raise refusal(
            "U01", f"`kind` is {kind!r}, must be one of {', '.join(KINDS)}", remedy=KINDS[0]
        )
    x, y = column(x, "x"), column(y, "y")
    direction, cycles = loop_direction(x, y), _repeatability(x, y)
    plays: dict[str, Any] = {"n": n, "skip": skip}
    even: dict[str, Any] = {"n": None if n == "auto" else n, "skip": skip}  # chosen one by one
    ways: dict[str, Callable[[], HysteresisModel]] = {
        "plays": lambda: PlayStack.identify(x, y, **plays),
        "asymmetric": lambda: PlayStack.identify(x, y, asymmetric=True, **plays),
        "even": lambda: PlayStack.identify(x, y, even=True, **even),
        "slip": lambda: MaxwellSlip.identify(x, y, n),
        "series": lambda: SeriesSlip.identify(x, y, _threshold(threshold, cycles, y)),
        "preisach": lambda: Preisach.identify(x, y, levels=20 if n == "auto" else n),
    }
    if kind != "auto":
        return Loops(ways[kind](), kind, direction, cycles)
    asked = {"clockwise": "slip", "butterfly": "even"}.get(direction.direction, "plays")
    model = ways[asked]()
    if asked == "plays":
        curved = ways["asymmetric"]()
        if _rms(curved) < _BETTER * _rms(model):
            asked, model = "asymmetric", curved
    return Loops(model, asked, direction, cycles)


def _rms(model: HysteresisModel) -> float:
    found: Identified | None = model.identified
    return float("inf") if found is None else found.rms


def _repeatability(x: Any, y: Any) -> Repeatability | None:
    try:
        return repeatability(x, y)
    except PlantuneError:
        return None


def _threshold(threshold: float | None, cycles: Repeatability | None, y: Any) -> float:
    if threshold is not None:
        return threshold
    return cycles.largest / 2 if cycles is not None else 0.01 * float(np.ptp(y))
