"""Source 003 as it is written: poles of a step response by criterion (15)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.estimate.orders import whole
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record
from plantune.text import number, table


class Rise(NamedTuple):
    """One order: the lag that served best and what it left of y; None where no root settles."""

    order: int
    lag: int | None
    rms: float | None


@dataclass(frozen=True, slots=True, eq=False)
class IdtCriterion:
    """Poles, zeros and gain of a clean step response, by criterion (15).

    Attributes
    ----------
    order, lag : int
        Number of poles; samples between the values of one row.
    poles : array (order,) of complex
        1/s.
    zeros : array of complex or None
        1/s; None where the record does not begin at rest, or after a delay.
    numerator : array (order + 1,) or None
        Of the plant, descending powers of s, the last coefficient 1.
    gain : float or None
        Static gain y/u, as given or from the level; None where the start is not known.
    level, rms : float
        What y ends at, and what is left of it, units of y.
    digits : float
        Decimal digits of the poles that noise leaves, its bias and its scatter.
    tried : tuple of Rise
        The orders, rising.
    rows : (first, last)
        Original rows used.
    notes : tuple of Note
        Doubts: more left than `eps` (N04), a start that is not known (X01, X07).
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> y = 1 - 3 * np.exp(-0.1 * np.arange(200) / 2.5) + np.exp(-0.1 * np.arange(200))
    >>> found = pt.estimate.idt_criterion(pt.Record(u=np.ones(200), y=y, Ts=0.1))
    >>> found.T.round(9), found.order
    (array([1. , 2.5]), 2)
    """

    order: int
    lag: int
    poles: NDArray[np.complex128]
    zeros: NDArray[np.complex128] | None
    numerator: Floats | None
    gain: float | None
    level: float
    rms: float
    digits: float
    tried: tuple[Rise, ...]
    rows: tuple[int, int]
    notes: tuple[Note, ...]
    source: str

    @property
    def T(self) -> Floats:
        """Time constants of the real poles, seconds, rising."""
        return np.sort(-1.0 / self.poles[self.poles.imag == 0].real)

    def operator(self, Ts: float) -> _core.InverseTransform:
        """Return the operator that gives the input back, of the same lag, for samples every `Ts`.

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> y = 2 * (1 - np.exp(-0.1 * np.arange(100) / 2.5))
        >>> found = pt.estimate.idt_criterion(pt.Record(u=np.ones(100), y=y, Ts=0.1), gain=2.0)
        >>> found.operator(0.1).run(y)[-3:].round(9)
        array([1., 1., 1.])
        """
        gain = 1.0 if self.gain is None else self.gain
        return _core.InverseTransform(self.poles, Ts, gain=gain, lag=self.lag)

    def __str__(self) -> str:
        rows = [["order", "lag", "left of y"], *(_line(rise) for rise in self.tried)]
        poles = ", ".join(_complex(p) for p in self.poles)
        said = [f"criterion (15): order {self.order}, {self.digits:.0f} digits", *table(rows)]
        said += [f"poles {poles} 1/s"]
        if self.zeros is not None and len(self.zeros):
            said += [f"zeros {', '.join(_complex(z) for z in self.zeros)} 1/s"]
        if self.gain is not None:
            said += [f"gain {self.gain:.6g}"]
        said += [str(note) for note in self.notes]
        return "\n  ".join(line.rstrip() for line in said)


def _line(rise: Rise) -> list[str]:
    if rise.lag is None or rise.rms is None:
        return [str(rise.order), "-", "no root settles"]
    return [str(rise.order), str(rise.lag), number(rise.rms)]


def _complex(z: complex) -> str:
    return f"{z.real:.6g}" if z.imag == 0 else f"{z.real:.6g}{z.imag:+.6g}j"


def idt_criterion(
    rec: Record,
    order: int | str = "auto",
    *,
    gain: float | None = None,
    lag: int | None = None,
    eps: float = 1e-9,
    step_at: float | None = None,
    max_order: int = 6,
    limits: Limits | None = None,
) -> IdtCriterion:
    """Find the poles of a clean step response as source 003 does, its order rising.

    The transform whose roots match the plant turns the response into the constant gain; the roots
    follow from one linear problem per order and lag.  The initial state does not matter.  Noise
    does: it moves every time constant towards zero, so this serves simulated or very clean records
    and is refused on others; `idt` serves them all.

    How far noise moves the poles is measured: what is left of y is taken for white noise, as much
    is added again to the squares, and each row of the triangle is shaken by its size.  `digits`
    counts the move and twice the scatter together; fewer than two are refused.

    Parameters
    ----------
    rec : Record
        One input with a step, or at its level from the start; one output; uniform samples.
    order : "auto" or int
        Number of poles, 1 to 6; "auto" raises it until less than `eps` is left.
    gain : float, optional
        Static gain y/u where it is known; free by default.
    lag : int, optional
        Samples between the values that are combined; the best of 1, 2, 4, ... by default.
    eps : float
        Share of the travel of y that may be left.
    step_at : float, optional
        Time of the step, seconds on the record's clock; found by default.
    max_order : int
        Highest order of "auto".
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    IdtCriterion

    Raises
    ------
    NumericsError
        Noise leaves less than two digits of a pole (N04).
    NotIdentifiable
        No step (X01), no response (X04), too few rows (X03), no order with roots of a response
        that settles (X02).

    Notes
    -----
    Source 003, (4) to (8), (11) and (15), as corrected.  (15) with normalised coefficients is a
    linear problem in differences of y; its roots are those of Prony's method.

    Examples
    --------
    Example iii, two complex poles and a gain of 20 that nobody told:

    >>> import numpy as np
    >>> import plantune as pt
    >>> plant = pt.models.TransferFunction([20.0], [0.01, 0.04, 1.0])
    >>> u = np.r_[np.zeros(10), np.ones(400)]
    >>> y = np.r_[np.zeros(10), plant.step(0.01 * np.arange(400))]
    >>> found = pt.estimate.idt_criterion(pt.Record(u=u, y=y, Ts=0.01))
    >>> found.poles.round(6), round(found.gain, 9)
    (array([-2.-9.797959j, -2.+9.797959j]), 20.0)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    asked = None if isinstance(order, str) and order == "auto" else whole("order", order)
    lag = None if lag is None else whole("lag", lag)
    most = whole("max_order", max_order)
    d = _core.idt_criterion(rec, asked, most, step_at, gain, lag, eps, limits)
    tried = tuple(Rise(k, *(best or (None, None))) for k, best in d["tried"])
    notes = (*notes_from_core(d["notes"]), *limits.changes())
    return IdtCriterion(**{**d, "tried": tried, "notes": notes}, source=rec.source)
