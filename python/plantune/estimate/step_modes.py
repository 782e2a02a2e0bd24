"""Time constants of a step response, and what the data support of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.models import ProcessModel, TransferFunction
from plantune.models.convert import from_core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record
from plantune.text import number, table


class Mode(NamedTuple):
    """One time constant, or two poles that are described together.

    Attributes
    ----------
    kind : "lag", "pair" or "complex"
        A pair has `zeta` = 1 within its deviation: two time constants that the data do not tell
        apart, or one that is repeated.
    T, T_sd : float
        Time constant, seconds; `1/w` of a pair.
    T_interval : (low, high)
        95 %, from the deviation of `ln T`.
    w, w_sd : float
        Rate, rad/s.
    zeta, zeta_sd : float or None
        Damping; None of a lag.
    """

    kind: str
    T: float
    T_sd: float
    T_interval: tuple[float, float]
    w: float
    w_sd: float
    zeta: float | None
    zeta_sd: float | None


class Tried(NamedTuple):
    """One order: its mean squared error, its BIC, and why it was taken or not."""

    order: int
    loss: float
    bic: float
    why: str


@dataclass(frozen=True, slots=True, eq=False)
class StepModes:
    """The modes that a step response supports.

    Attributes
    ----------
    order : int
        Number of poles.
    modes : tuple of Mode
        By rising time constant; a pair counts as one.
    poles : array (order,) of complex
        1/s.
    names, theta, sd, P
        `T1` of a lag, `w1 zeta1` of a pair, numbered by mode; then `K` and `L`, or `level` where
        the gain is not separable.  `P` is their covariance; correlated errors widen it.
    gain, gain_sd : float or None
        Static gain, y/u; None where it is not separable from the initial state.
    level, level_sd : float
        What y ends at after the (first) step.
    rest, rest_sd : float or None
        y at rest before it.
    step_at, step : float or None
        Time of the step in seconds, and the move of the input.
    delay, delay_sd : float or None
        Seconds from the step to the begin of the response.
    numerator, numerator_sd : array (order + 1,) or None
        Of the plant, descending powers of s, the last coefficient 1.
    zeros : array of complex or None
        Those that the data support, 1/s: leading coefficients of the numerator within two
        deviations of 0 are taken as 0.
    tried : tuple of Tried
        Every order, the constant (0) included.
    colour : float
        Correlation of one residual with the next, 0 where it is not clear.
    N : int
        Rows used.
    loss, bic : float
        Mean squared error and the criterion.
    status : str
        How the search ended.
    t, y, curve, curve_sd : array (N,)
        The rows used, the fitted curve and its standard deviation.
    rows : array (k, 2)
        First and last original row of each stretch of the record.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.
    """

    order: int
    modes: tuple[Mode, ...]
    poles: NDArray[np.complex128]
    names: tuple[str, ...]
    theta: Floats
    sd: Floats
    P: Floats
    gain: float | None
    gain_sd: float | None
    level: float
    level_sd: float
    rest: float | None
    rest_sd: float | None
    step_at: float | None
    step: float | None
    delay: float | None
    delay_sd: float | None
    numerator: Floats | None
    numerator_sd: Floats | None
    zeros: NDArray[np.complex128] | None
    model: ProcessModel | TransferFunction | None
    tried: tuple[Tried, ...]
    colour: float
    N: int
    loss: float
    bic: float
    status: str
    t: Floats
    y: Floats
    curve: Floats
    curve_sd: Floats
    rows: NDArray[np.int64]
    notes: tuple[Note, ...]
    source: str

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each mode."""
        return tuple(mode.kind for mode in self.modes)

    @property
    def T(self) -> Floats:
        """Time constant of each mode, seconds."""
        return np.array([mode.T for mode in self.modes])

    @property
    def w(self) -> Floats:
        """Rate of each mode, rad/s."""
        return np.array([mode.w for mode in self.modes])

    @property
    def zeta(self) -> tuple[float | None, ...]:
        """Damping of each mode; None of a lag."""
        return tuple(mode.zeta for mode in self.modes)


def idt(
    rec: Record,
    order: int | str = "auto",
    *,
    step_at: float | None = None,
    gain: float | None = None,
    max_order: int = 4,
    limits: Limits | None = None,
) -> StepModes:
    """Find the modes of a step response."""
    if order != "auto" and not (isinstance(order, int) and not isinstance(order, bool)):
        raise refusal(
            "U01",
            f"`order` is {order!r}, must be 'auto' or a whole number",
            where=("order", None, None),
            remedy='order="auto"',
        )
    limits = limits or rec.limits or DEFAULT_LIMITS
    asked = None if isinstance(order, str) else order
    return _from_core(_core.step_modes(rec, asked, max_order, step_at, gain, limits), rec, limits)


def _from_core(d: dict[str, Any], rec: Record, limits: Limits) -> StepModes:
    return StepModes(
        **{
            **d,
            "modes": tuple(Mode(**mode) for mode in d["modes"]),
            "names": tuple(d["names"]),
            "model": None if d["model"] is None else from_core(d["model"]),
            "tried": tuple(Tried(**tried) for tried in d["tried"]),
            "notes": (*notes_from_core(d["notes"]), *limits.changes()),
        },
        source=rec.source,
    )
