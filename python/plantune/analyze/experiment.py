"""An experiment planned from a rough K, T and L: which input, how large, how long."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.models import ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats
from plantune.text import number, table

_NAMES = ("K", "T", "L")

Shape = Literal["prbs", "gbn", "stairs", "step", "multisine"]
Plant = ProcessModel | tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What an input will tell of K, T and L, before it is run.

    Attributes
    ----------
    sd : dict
        Standard deviations of K, T and L.
    relative : dict
        `sd K / |K|`, `sd T / T`, `sd L / (T + L)`.
    y : array (N,)
        Response without noise, zero at rest.
    model : ProcessModel
        The plant it was computed for.
    notes : tuple of Note
        What to know about the numbers.
    source : str
        Plant and noise, in words.

    Examples
    --------
    >>> import plantune as pt
    >>> u = pt.signals.prbs(300, hold=12, bits=10)
    >>> found = pt.analyze.predicted_sd((2.0, 10.0, 3.37), u, noise_sd=0.1, Ts=1.0)
    >>> print(found)
    K = 2 ± 0.017 (0.87 %), T = 10 ± 0.14 (1.4 %), L = 3.37 ± 0.058 (0.43 % of T + L)
    """

    sd: Mapping[str, float]
    relative: Mapping[str, float]
    y: Floats
    model: ProcessModel
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        return _known(self.model, self.sd, self.relative)


def predicted_sd(
    model: Plant,
    u: ArrayLike,
    noise_sd: float,
    Ts: float,
    *,
    ar: float | Sequence[float] = (),
) -> Prediction:
    """Predict the standard deviations that a fit of K, T and L will have.

    Parameters
    ----------
    model : ProcessModel or (K, T, L)
        A rough one, of first order plus dead time; seconds.
    u : array (N,)
        The input, held from row to row; the plant is at rest before it.
    noise_sd : float
        Standard deviation of the disturbance at the output, units of y.
    Ts : float
        Sample time, seconds.
    ar : float or sequence
        Coefficients of a coloured disturbance, `v(t) = ar[0] v(t-1) + ... + e(t)`; none: white.

    Returns
    -------
    Prediction

    Raises
    ------
    UsageError
        A model of another order, a sample time or noise that is not positive (U01).
    NotIdentifiable
        A parameter would be off by more than 25 % (X07), the input does not tell them apart
        (X02), too few rows (X03).

    Notes
    -----
    `sd^2 (psi'psi)^-1` of the exact derivatives psi of the response, the level and the start being
    estimated as well; for coloured noise `M psi'R psi M`, as `estimate.process(rec, "P1D")` is
    fitted as if it were white.  300 simulated experiments agree within 10 %.  Ljung 1999, 9.4.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> u = np.repeat([0.0, 1.0], [20, 60])
    >>> white = pt.analyze.predicted_sd((2.0, 10.0, 3.4), u, noise_sd=0.1, Ts=1.0)
    >>> slow = pt.analyze.predicted_sd((2.0, 10.0, 3.4), u, noise_sd=0.1, Ts=1.0, ar=0.9)
    >>> {name: round(slow.sd[name] / white.sd[name], 1) for name in "KTL"}
    {'K': 3.4, 'T': 2.6, 'L': 1.8}
    """
    plant = _plant(model)
    d = _core.predicted_sd(plant, np.ravel(np.asarray(u, float)), Ts, noise_sd, _list(ar))
    return Prediction(
        sd=_named(d["sd"]),
        relative=_named(d["relative"]),
        y=_frozen(d["y"]),
        model=plant,
        notes=notes_from_core(d["notes"]),
        source=_source(plant, noise_sd, ar),
    )


@dataclass(frozen=True, slots=True)
class Trial:
    """A shape of input at the amplitude that it needs, or at the largest that the limits allow.

    Attributes
    ----------
    shape : str
        "prbs", "gbn", "stairs", "step" or "multisine".
    hold : int
        Rows from one move to the next, in the mean.
    amplitude : float
        Units of u.
    reaches : bool
        Whether it reaches the target within the limits.
    peak : float
        Largest distance of the response from the operating point, units of y.
    sd, relative : dict
        Predicted for K, T and L.
    """

    shape: str
    hold: int
    amplitude: float
    reaches: bool
    peak: float
    sd: Mapping[str, float]
    relative: Mapping[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """An input to apply, and what it will tell.

    Attributes
    ----------
    t, u, y : arrays (N,)
        Time in seconds, the input, and the predicted response without noise.
    Ts : float
        Sample time, seconds.
    shape, hold, amplitude :
        Form of the input, its clock in rows, and its size about the operating point.
    sd, relative : dict
        Predicted standard deviations of K, T and L; as shares of K, T and T + L.
    trials : tuple of Trial
        Every shape that was tried, best first.
    model : ProcessModel
        The rough plant.
    noise_sd : float
        Standard deviation of the disturbance.
    u_limits, y_limits : (low, high) or None
        As given.
    notes : tuple of Note
        What to know about the numbers.
    source : str
        Plant and noise, in words.

    Examples
    --------
    >>> import plantune as pt
    >>> plan = pt.analyze.experiment(
    ...     (2.0, 10.0, 3.4), Ts=1.0, noise_sd=0.1, time=300.0, u_limits=(45.0, 55.0)
    ... )
    >>> plan.shape, plan.hold, len(plan.u), round(plan.amplitude, 2)
    ('gbn', 13, 300, 0.25)
    """

    t: Floats
    u: Floats
    y: Floats
    Ts: float
    shape: str
    hold: int
    amplitude: float
    sd: Mapping[str, float]
    relative: Mapping[str, float]
    trials: tuple[Trial, ...]
    model: ProcessModel
    noise_sd: float
    u_limits: tuple[float, float] | None
    y_limits: tuple[float, float] | None
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        rows = [["input", "amplitude", "peak of y", "sd K %", "sd T %", "sd L %"]]
        for trial in self.trials:
            shares = [number(100 * trial.relative[name], 2) for name in _NAMES]
            size = number(trial.amplitude, 3) + ("" if trial.reaches else " (limit)")
            rows.append([trial.shape, size, number(trial.peak, 3), *shares])
        what = f"{self.shape}, {len(self.u)} rows of {self.Ts:g} s, amplitude "
        head = what + f"{number(self.amplitude, 3)}, a move every {self.hold} rows"
        known = _known(self.model, self.sd, self.relative)
        return "\n".join([head, known, *table(rows), *map(str, self.notes)])


@dataclass(frozen=True, slots=True)
class _Wishes:
    """What the core asks for."""

    Ts: float
    noise_sd: float
    ar: list[float]
    time: float | None
    u_limits: tuple[float, float] | None
    y_limits: tuple[float, float] | None
    at: tuple[float, float] | None
    target: float
    shape: str | None
    seed: int


def experiment(
    model: Plant,
    Ts: float,
    noise_sd: float,
    *,
    time: float | None = None,
    u_limits: tuple[float, float] | None = None,
    y_limits: tuple[float, float] | None = None,
    at: tuple[float, float] | None = None,
    target: float = 0.05,
    shape: Shape | None = None,
    ar: float | Sequence[float] = (),
    seed: int = 0,
    limits: Limits | None = None,
) -> Experiment:
    """Plan an experiment that tells K, T and L well enough.

    Parameters
    ----------
    model : ProcessModel or (K, T, L)
        A rough one, of first order plus dead time; seconds.
    Ts : float
        Sample time, seconds.
    noise_sd : float
        Standard deviation of the disturbance at the output, units of y.
    time : float, optional
        Seconds available.  Without it, as many as are needed at the largest amplitude that the
        limits allow.
    u_limits, y_limits : (low, high), optional
        Within which input and output stay, noise aside.
    at : (u, y), optional
        Operating point; by default the middle of the limits, 0 where there are none.
    target : float
        Share of their value to which K, T and L (as a share of T + L) are wished, one standard
        deviation; at most 0.25.
    shape : str, optional
        "prbs", "gbn", "stairs", "step" or "multisine"; by default the one that tells most.
    ar : float or sequence
        Coefficients of a coloured disturbance, `v(t) = ar[0] v(t-1) + ... + e(t)`; none: white.
    seed : int
        Other numbers give other binary sequences.
    limits : Limits, optional
        Threshold M09.

    Returns
    -------
    Experiment
        The amplitude is as small as the target allows.

    Raises
    ------
    UsageError
        Neither time nor limits, an operating point outside of its limits (U01).
    NotIdentifiable
        The limits leave too little in this time (X07): it says which time, amplitude or target
        would do; sampling too slow for T (M09).

    Notes
    -----
    The clock of binary inputs is 1.3 T whatever L is; standard deviations go as
    1/(amplitude sqrt(time)).  Of 20 binary sequences the best is taken: on short records they
    differ by a factor of 2 to 4.  See `predicted_sd`.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.experiment(
    ...     (2.0, 10.0, 3.4), Ts=1.0, noise_sd=0.3, u_limits=(49.0, 51.0), y_limits=(18.0, 22.0)
    ... ))
    gbn, 180 rows of 1 s, amplitude 0.986, a move every 13 rows
    K = 2 ± 0.049 (2.5 %), T = 10 ± 0.5 (5 %), L = 3.4 ± 0.18 (1.3 % of T + L)
    input      amplitude  peak of y  sd K %  sd T %  sd L %
    gbn            0.986       1.91     2.5       5     1.3
    prbs       1 (limit)       1.94     2.8     5.3     1.5
    stairs     1 (limit)       1.97     2.5     6.2     2.5
    multisine  1 (limit)       1.38     5.9      11     3.7
    step       1 (limit)          2     3.5      15     7.7
    """
    limits = limits or DEFAULT_LIMITS
    plant = _plant(model)
    wishes = _Wishes(Ts, noise_sd, _list(ar), time, u_limits, y_limits, at, target, shape, seed)
    d = _core.experiment(plant, wishes, limits)
    trials = tuple(
        Trial(**{**t, "sd": _named(t["sd"]), "relative": _named(t["relative"])})
        for t in d["trials"]
    )
    best = trials[0]
    return Experiment(
        t=_frozen(d["t"]),
        u=_frozen(d["u"]),
        y=_frozen(d["y"]),
        Ts=Ts,
        shape=best.shape,
        hold=best.hold,
        amplitude=best.amplitude,
        sd=best.sd,
        relative=best.relative,
        trials=trials,
        model=plant,
        noise_sd=noise_sd,
        u_limits=u_limits,
        y_limits=y_limits,
        notes=(*notes_from_core(d["notes"]), *limits.changes()),
        source=_source(plant, noise_sd, ar),
    )


def _plant(model: Plant) -> ProcessModel:
    return ProcessModel(*model) if isinstance(model, tuple | list) else model


def _list(ar: float | Sequence[float]) -> list[float]:
    return [float(phi) for phi in np.atleast_1d(np.asarray(ar, float))]


def _named(values: Sequence[float]) -> dict[str, float]:
    return dict(zip(_NAMES, values, strict=True))


def _frozen(x: Floats) -> Floats:
    x.setflags(write=False)
    return x


def _source(plant: ProcessModel, noise_sd: float, ar: float | Sequence[float]) -> str:
    colour = f", ar {_list(ar)}" if _list(ar) else ""
    return f"{plant}, noise sd {noise_sd:g}{colour}"


def _known(plant: ProcessModel, sd: Mapping[str, float], relative: Mapping[str, float]) -> str:
    values = {"K": plant.K, "T": plant.times[0], "L": plant.L}
    of = {"K": "", "T": "", "L": " of T + L"}
    return ", ".join(
        f"{name} = {number(values[name])} ± {number(sd[name], 2)} "
        f"({number(100 * relative[name], 2)} %{of[name]})"
        for name in _NAMES
    )
