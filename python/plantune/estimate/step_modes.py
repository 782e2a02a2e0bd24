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
    numerator, numerator_sd : array (zeros + 1,) or None
        Of the plant, descending powers of s, the last coefficient 1.
    zeros : array of complex or None
        Those that the data support, 1/s: the fewest with which the curve leaves the rest.
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
    curve_band : (low, high)
        95 % of the curve.
    parts_t, parts : array (points,), (modes, points)
        What each mode adds to the (first) response, in units of y; empty where modes coincide.
    parts_band : (low, high)
        95 % of them.
    rows : array (k, 2)
        First and last original row of each stretch of the record.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=(3.0, 10.0), L=4.0)
    >>> u = np.repeat([0.0, 4.0], [50, 650])
    >>> y = 20 + plant.simulate(u, Ts=0.1) + 0.005 * np.random.default_rng(0).normal(size=700)
    >>> found = pt.estimate.idt(pt.Record(u=u, y=y, Ts=0.1))
    >>> print(found)
    step response: order 2 of 4 tried, 609 rows, loss 2.501e-05
                                               95 %
      T1     3.0015 ± 0.0094 s  lag   2.983 to 3.02
      T2     10.001 ± 0.0067 s  lag  9.988 to 10.01
      gain    1.9999 ± 0.00025
      level       28 ± 0.00045
      delay  4.0016 ± 0.0048 s
      The data support two time constants, told apart: 3.002 and 10 s.
      Order 3 is refused: BIC is higher by 9.5 than that of order 2.
    >>> print(found.to_model())
    G(s) = 1.99986 e^(-4.0016 s) / ((3.00152 s + 1) (10.0013 s + 1))
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
    curve_band: tuple[Floats, Floats]
    parts_t: Floats
    parts: Floats
    parts_band: tuple[Floats, Floats]
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

    @property
    def said(self) -> tuple[str, ...]:
        """What the data support and what is refused, in sentences."""
        refused = [t for t in self.tried if t.order > self.order and t.why.startswith("refused")]
        more = [f"Order {t.order} {t.why.replace('refused:', 'is refused:')}." for t in refused[:1]]
        return (_supported(self), *map(_of_pair, self._pairs), *more)

    @property
    def _pairs(self) -> tuple[Mode, ...]:
        return tuple(mode for mode in self.modes if mode.zeta is not None)

    def to_model(self) -> ProcessModel | TransferFunction:
        """Return the plant: a process model up to two poles and one zero, else a transfer function.

        A record that starts on its step shows neither delay nor zeros, and its model has none.

        Raises
        ------
        UsageError
            The gain is not known.

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> y = 3.0 * (1 - np.exp(-np.arange(200) * 0.1 / 2.5))
        >>> rec = pt.Record(u=np.ones(200), y=y, Ts=0.1)
        >>> print(pt.estimate.idt(rec, gain=3.0).to_model())
        G(s) = 3 / (2.5 s + 1)
        """
        if self.model is None:
            raise refusal(
                "U01",
                "no gain, no model: gain and initial state are not separable in this record",
                remedy="idt(rec, gain=K), or record some rows at rest before the step",
            )
        return self.model

    def __str__(self) -> str:
        rows = [["", "", "", "95 %"], *_lines(self)]
        tried = f"order {self.order} of {len(self.tried) - 1} tried"
        lines = [
            f"step response: {tried}, {self.N} rows, loss {self.loss:.4g}",
            *("  " + line.rstrip() for line in table(rows)),
            *("  " + text for text in self.said),
            *(f"  {note}" for note in self.notes),
        ]
        return "\n".join(lines)


def _lines(found: StepModes) -> list[list[str]]:
    """Return name, value with deviation, kind and interval of everything that was found."""
    rows = []
    for i, mode in enumerate(found.modes, start=1):
        low, high = (number(x) for x in mode.T_interval)
        name = f"T{i}" if mode.zeta is None else f"1/w{i}"
        rows.append([name, _with(mode.T, mode.T_sd) + " s", mode.kind, f"{low} to {high}"])
        if mode.zeta is not None and mode.zeta_sd is not None:
            rows.append([f"zeta{i}", _with(mode.zeta, mode.zeta_sd), "", ""])
    for name, value, sd, unit in (
        ("gain", found.gain, found.gain_sd, ""),
        ("level", found.level, found.level_sd, ""),
        ("delay", found.delay, found.delay_sd, " s"),
    ):
        if value is not None and sd is not None:
            rows.append([name, _with(value, sd) + unit, "", ""])
    if found.zeros is not None and len(found.zeros):
        rows.append(["zeros", ", ".join(_complex(z) for z in found.zeros) + " 1/s", "", ""])
    return rows


def _with(value: float, sd: float) -> str:
    return f"{value:.5g} ± {number(sd, 2)}"


def _complex(z: complex) -> str:
    return number(z.real) if z.imag == 0 else f"{z.real:.4g}{z.imag:+.4g}j"


_COUNTS = ("no", "one", "two", "three", "four", "five", "six")


def _supported(found: StepModes) -> str:
    """Say how many time constants there are, and which of them are apart."""
    many = _COUNTS[found.order]
    count = f"{many} time constant{'s' if found.order > 1 else ''}"
    verb = "The data support" if found.tried[found.order].why != "asked for" else "Asked for:"
    lags = [number(mode.T) for mode in found.modes if mode.kind == "lag"]
    if not found._pairs:
        each = f"{', '.join(lags[:-1])} and {lags[-1]}" if len(lags) > 1 else lags[0]
        apart = ", told apart" if len(lags) > 1 else ""
        return f"{verb} {count}{apart}: {each} s."
    own = f": {' and '.join(lags)} s, the others in pairs" if lags else ""
    return f"{verb} {many} poles{own}."


def _of_pair(mode: Mode) -> str:
    """Say what a pair is."""
    assert mode.zeta is not None
    near = f"near {number(mode.T)} s"
    if mode.kind == "pair":
        return f"Two time constants {near} cannot be told apart; they may be one, repeated."
    if mode.zeta < _RINGS:
        return f"Two poles ring with {number(mode.w)} rad/s and damping {number(mode.zeta)}."
    return (
        f"Two poles {near} with damping {number(mode.zeta)} do not ring: several lags together "
        "look like this."
    )


_RINGS = 0.7
"""Damping below which a step response rings."""


def idt(
    rec: Record,
    order: int | str = "auto",
    *,
    step_at: float | None = None,
    gain: float | None = None,
    max_order: int = 4,
    limits: Limits | None = None,
) -> StepModes:
    r"""Find the modes of a step response: y = level + sum_j c_j phi_j(t).

    Parameters
    ----------
    rec : Record
        One input, one output, uneven stamps allowed.  The first rows are at rest before a step, or
        the record starts on it (then the level is found, and no gain).  Several steps share the
        modes; where they contradict each other the first is taken, with note M07.
    order : "auto" or int
        Number of poles, 1 to 6; "auto" takes what the data support.
    step_at : float, optional
        Time of the one step to look at, seconds on the record's clock.
    gain : float, optional
        Static gain y/u where it is known; by default it follows from the level.
    max_order : int
        Highest order tried by "auto".
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    StepModes
        With note X07 where the record ends before y has settled or does not start at rest, X10
        where an order beyond the data is asked for, X03 where rows are few.

    Raises
    ------
    NotIdentifiable
        The input has no step (X01), y does not answer, or no time constant can be told (X04), too
        few rows (X03).

    Notes
    -----
    Variable projection over sections of one or two poles, with free initial states; BIC with a
    margin of 6 and a floor for noise-free data, then down to the first order whose modes are all
    known to a factor of 2.7.  The rows used begin after the delay, which needs no parameter.
    Source 003 in the form of METHODS 5; for the criterion of its text see `idt_criterion`.

    Examples
    --------
    Source 003, (16): three lags, at 0.1 % noise, in a record that starts on its step:

    >>> import numpy as np
    >>> import plantune as pt
    >>> plant = pt.models.TransferFunction([1.0], np.poly([-1 / 1.25, -1 / 3.25, -1 / 5.5]))
    >>> y = plant.step(0.1 * np.arange(401)) / plant.dc_gain()
    >>> y += 0.001 * np.random.default_rng(0).normal(size=401)
    >>> found = pt.estimate.idt(pt.Record(u=np.ones(401), y=y, Ts=0.1))
    >>> print(*found.said, sep="\n")
    The data support three time constants, told apart: 1.311, 3.225 and 5.513 s.
    Order 4 is refused: BIC is higher by 10.4 than that of order 3.
    """
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
