"""What every batch estimator returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.derived import Curve, Derived, Root, bode, derived, roots, step
from plantune.estimate.equation import equation
from plantune.estimate.forecast import Forecast
from plantune.models import (
    MatrixPolyModel,
    PolyModel,
    ProcessModel,
    StateSpace,
    TermModel,
    TransferFunction,
)
from plantune.models.convert import from_core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record, columns

Fitted = PolyModel | ProcessModel | TransferFunction | MatrixPolyModel | StateSpace | TermModel
"""What an estimator may find."""


class OffsetStep(NamedTuple):
    """A step of the offset: a load that came on, or the level of another experiment.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5)
    >>> loaded = pt.Record(u=rec.u, y=rec.y[:, 0] + 20.0 * (rec.time >= 5), Ts=rec.Ts)
    >>> step = pt.estimate.process(loaded, "P1D", offset="steps").steps[0]
    >>> step.time, round(step.size)
    (5.0, 20)
    """

    row: int
    """Row of the record from which on the offset is another one."""
    time: float
    """Its time in seconds."""
    size: float
    """How much the offset changes, in units of y."""
    sd: float
    """Standard deviation of the size."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted model with its uncertainty.

    Attributes
    ----------
    model : one of `plantune.models`, or None
        None for a plain least-squares problem.
    theta, sd : array (n,)
        Parameters and their standard deviations.
    P : array (m, m)
        Covariance of `theta`, then of the offset where it was estimated.
    names : tuple of str
        One per parameter.
    offset : array (ny,)
        `O` in `y = G u + O`, in the record's units; for integrating models the
        drift, and with regressors of one's own the constant `d` of the equation.
    steps : tuple of OffsetStep
        Where the offset changes and by how much; `offset` is the one before the first of them.
    x0 : array (segments, n)
        What the time before each segment has left, from its first row with history on.
    N : int
        Rows used.
    loss, fpe, aic, bic : float
        Mean squared one-step prediction error and the criteria from it.
    status : str
        How the estimation ended.
    expected_digits : array (n,)
        Decimal digits that rounding leaves.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.
    rows : array (k, 2)
        First and last original row of each stretch of the record.
    Ts : float or None
        Sample time of the record, seconds; None for a plain least-squares problem.
    intervals : mapping
        95 % intervals (low, high) by name, where a profile of the loss gave them.
    plants : tuple of ProcessModel
        Of a process fit one per input.
    sampled : PolyModel or None
        All inputs and the noise model, where a process fit has several or coloured noise.
    singular_values : array or None
        Of a subspace fit, those that show the order.
    settings : mapping
        Of a subspace fit, how it was asked for.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.estimate.arx(pt.datasets.hair_dryer(), 2, 2, 3))
    ARX: A(q) y(t) = B(q) u(t - 3) + e(t)
      a1         -1.28872 ± 0.0109
      a2         0.406651 ± 0.00999
      b1        0.0655189 ± 0.00109
      b2        0.0438283 ± 0.00165
      offset     0.258709 ± 0.0675
      996 rows, loss 0.001633, exact
    """

    method: str
    model: Any  # which of them the method says
    theta: Floats
    P: Floats
    sd: Floats
    names: tuple[str, ...]
    offset: Floats
    x0: Floats
    N: int
    loss: float
    fpe: float
    aic: float
    bic: float
    status: str
    expected_digits: Floats
    notes: tuple[Note, ...]
    source: str
    rows: NDArray[np.int64]
    Ts: float | None = None
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    plants: tuple[ProcessModel, ...] = ()
    sampled: PolyModel | None = None
    steps: tuple[OffsetStep, ...] = ()
    singular_values: Floats | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def simulate(self, u: ArrayLike, Ts: float | None = None, x0: float = 0.0) -> Floats:
        """Return the output for the input `u`, offset included, the plant at rest before row 0.

        The offset is the one before its first step: an input of one's own has no load steps.

        Examples
        --------
        >>> import plantune as pt
        >>> fit = pt.estimate.process(pt.datasets.engine_loop(), "P1D")
        >>> fit.simulate([0.0, 0.0], Ts=0.02).round(3)
        array([583.451, 583.451])
        """
        model, level = self._need_model(), self._level
        if isinstance(model, MatrixPolyModel | StateSpace | TermModel):
            y: Floats = model.simulate(u, Ts, x0)
            return y + level
        y = model.simulate(u, Ts, x0, float(level))
        return y

    def predict(self, rec: Record, horizon: int | None = 1) -> Floats:
        """Return the output predicted `horizon` steps ahead on a record; None simulates.

        Steps of the offset count where `rec` is the record of the fit, or rows of it.

        Examples
        --------
        >>> import plantune as pt
        >>> rec = pt.datasets.engine_loop()
        >>> fit = pt.estimate.process(rec, "P1D")
        >>> bool(abs(fit.predict(rec) - rec.y[:, 0])[20:].max() < 1e-6)
        True
        """
        model: Any = self.sampled or self._need_model()
        level = self.without_steps(rec)
        y: Floats = model.predict(level, horizon, self._level)
        if level is rec:
            return y
        at, sizes = self._steps_in(rec)
        return _core.without_steps(y, at, [-size for size in sizes])

    def without_steps(self, rec: Record) -> Record:
        """Return a record less the steps of the offset that lie before or in it.

        The record itself where the fit has no steps, or where it is another record.
        """
        at, sizes = self._steps_in(rec)
        if not at:
            return rec
        return replace(rec, y=_core.without_steps(rec.y[:, 0], at, sizes), source=rec.source)

    def knows_level_of(self, rec: Record) -> bool:
        """Whether the offset of each row of a record is known: always, if it has no steps."""
        return not self.steps or bool(self._steps_in(rec)[0])

    def _steps_in(self, rec: Record) -> tuple[list[int], list[float]]:
        """Rows of this record and sizes of the steps; none where the record is another one."""
        if not self.steps or rec.source != self.source:
            return [], []
        sizes = [step.size for step in self.steps]
        if rec.N == sum(last - first + 1 for first, last in self.rows):
            return [step.row for step in self.steps], sizes
        ascending = (rec.rows[1:] > rec.rows[:-1]).all()
        if not ascending or not (self.rows[1:, 0] > self.rows[:-1, 1]).all():
            return [], []
        numbers = np.concatenate([np.arange(first, last + 1) for first, last in self.rows])
        found = np.searchsorted(rec.rows, numbers[[step.row for step in self.steps]])
        return found.tolist(), sizes

    def forecast(self, rec: Record, u_future: ArrayLike, *, parameters: bool = True) -> Forecast:
        """Return what comes after the last row of a record, with its standard deviation.

        Parameters
        ----------
        rec : Record
            What was measured; its last segment counts.
        u_future : array (K,) or (K, nu)
            Input to come, from one sample time after the last row on.
        parameters : bool
            Whether the deviation holds what the parameters leave open, by the delta rule, beside
            the noise to come, `s^2 sum h_j^2`.

        Returns
        -------
        Forecast

        Raises
        ------
        UsageError
            No model, one with regressors of one's own, or an input of another width (U01).
        NotIdentifiable
            The last segment is not longer than the model's history (X03).

        Notes
        -----
        Ljung 1999, (3.31); Box, Jenkins and Reinsel 1994, (5.2.4).

        Examples
        --------
        >>> import plantune as pt
        >>> rec = pt.datasets.engine_loop(noise_var=1.5)
        >>> fit = pt.estimate.oe(rec, 1, 1, 6)
        >>> ahead = fit.forecast(rec, rec.u[-1].repeat(3))
        >>> ahead.y.shape, bool((abs(ahead.sd - fit.loss**0.5) < 0.02).all())
        ((3,), True)
        """
        self._need_covariance()
        model = self.model
        if isinstance(self.model, TermModel):
            raise refusal(
                "U01",
                "noise to come has no closed form where regressors are one's own",
                remedy="fit.predict(rec, horizon) says what was expected so many steps ahead",
            )
        u = columns(u_future, "u_future")
        P = flat(self) if parameters else np.empty(0)
        y, sd = _core.forecast(
            rec,
            model,
            u,
            float(self.offset[0]),
            P,
            self.loss,
            self.N,
            len(self.P),
            rec.limits or DEFAULT_LIMITS,
        )
        t = rec.time[-1] + rec.Ts * np.arange(1, len(y) + 1)
        return Forecast(t=t, y=y, sd=sd, source=rec.source)

    def equation(self) -> str:
        """Return the model as its equation, one standard deviation in brackets behind each number.

        Examples
        --------
        >>> import plantune as pt
        >>> print(pt.estimate.arx(pt.datasets.hair_dryer(), 2, 2, 3).equation())
        A(q) y(t) = B(q) u(t - 3) + e(t)
        A(q) = 1 - 1.289 (0.011) q^-1 + 0.407 (0.010) q^-2
        B(q) = 0.0655 (0.0011) + 0.0438 (0.0017) q^-1
        O = 0.259 (0.067)
        Ts = 0.08 s
        """
        if isinstance(self._need_model(), StateSpace):
            return str(self.model)
        return equation(self)

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a parameter by its name.

        The two ends of a profile of the loss where there is one (dead times); elsewhere
        1.96 standard deviations on both sides.

        Examples
        --------
        >>> import plantune as pt
        >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5, seed=1), "P1D")
        >>> low, high = fit.interval("L")
        >>> low < fit.model.L < high
        True
        """
        if name not in self.names:
            raise refusal("U01", f"`name` is {name!r}, must be one of {', '.join(self.names)}")
        if name in self.intervals:
            return self.intervals[name]
        i = self.names.index(name)
        return _core.normal_interval(float(self.theta[i]), float(self.sd[i]))

    def derived(self) -> Derived:
        """Return gain, time constants, dampings and what else follows, each with its sd.

        The delta rule; `T = -Ts/ln z` of a real pole, `w_n` and `zeta` of a pair.  METHODS 2.4.

        Examples
        --------
        >>> import plantune as pt
        >>> print(pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3).derived())
        K       0.936 ± 0.00444
        T1     0.2541 ± 0.0104
        T2     0.1356 ± 0.00962
        """
        self._need_covariance()
        return derived(self)

    def poles(self) -> tuple[Root, ...]:
        """Return the poles, each with the covariance of its real and imaginary part.

        In `z` of a polynomial model, else in 1/s.

        Examples
        --------
        >>> import plantune as pt
        >>> print(pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3).poles()[0])
        0.7299 ± 0.00943
        """
        self._need_covariance()
        return roots(self, None)

    def zeros(self, input: int = 0) -> tuple[Root, ...]:
        """Return the zeros from an input, as `poles`."""
        self._need_covariance()
        return roots(self, input)

    def step(self, t: ArrayLike, input: int = 0) -> Curve:
        """Return the response to a unit step of the input at times `t` (s), and its sd.

        Examples
        --------
        >>> import plantune as pt
        >>> y, sd = pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3).step([0.4, 2.0])
        >>> y.round(2), sd.round(3)
        (array([0.34, 0.93]), array([0.002, 0.004]))
        """
        self._need_covariance()
        return step(self, t, input)

    def bode(self, w: ArrayLike, input: int = 0) -> tuple[Curve, Curve]:
        """Return magnitude, and phase in degrees, at `w` rad/s, each with its sd.

        Examples
        --------
        >>> import plantune as pt
        >>> magnitude, phase = pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3).bode([1.0])
        >>> magnitude.value.round(3), magnitude.sd.round(4)
        (array([0.899]), array([0.0037]))
        >>> phase.value.round(1), phase.sd.round(2)
        (array([-33.3]), array([0.16]))
        """
        self._need_covariance()
        return bode(self, w, input)

    @property
    def flat_P(self) -> Floats:
        """The covariance as the core reads it."""
        return np.ascontiguousarray(self.P).reshape(-1)

    @property
    def drawn_from(self) -> tuple[Any, Floats, int, float, float | None]:
        """What the core draws models from: model, flat covariance, rows, loss, sample time."""
        return self.model, flat(self), self.N, self.loss, self.Ts

    @property
    def _level(self) -> float | Floats:
        """What the output is more than the model's; a `TermModel` has its constant inside."""
        if isinstance(self.model, TermModel):
            return 0.0
        return float(self.offset[0]) if len(self.offset) == 1 else self.offset

    def _need_model(self) -> Any:
        if self.model is None:
            raise refusal("U01", "a plain least-squares fit has no model", remedy="use fit.theta")
        return self.model

    def _need_covariance(self) -> None:
        """Refuse a model by states: its entries have no meaning, so they have no covariance."""
        if isinstance(self._need_model(), StateSpace):
            raise refusal(
                "U01",
                f"a fit of {self.method} has no covariance of parameters",
                remedy="pt.estimate.subspace_bands(rec, fit), or the bare numbers of fit.model",
            )

    def __str__(self) -> str:
        head = "" if self.model is None else ": " + str(self.model).splitlines()[0]
        width = max(len(name) for name in (*self.names, "offset"))
        lines = [
            f"  {name:<{width}} {value:12.6g} ± {sd:.3g}"
            for name, value, sd in zip(self.names, self.theta, self.sd, strict=True)
        ]
        for i, variance in enumerate(np.diag(self.P)[len(self.theta) :]):
            name = f"offset{i + 1}" if len(self.offset) > 1 else "offset"
            lines.append(f"  {name:<{width}} {self.offset[i]:12.6g} ± {np.sqrt(variance):.3g}")
        for load in self.steps:
            lines.append(
                f"  {'step':<{width}} {load.size:12.6g} ± {load.sd:.3g} from {load.time:g} s on"
            )
        tail = f"  {self.N} rows, loss {self.loss:.4g}, {self.status}"
        return "\n".join([self.method + head, *lines, tail, *(f"  {n}" for n in self.notes)])

    @property
    def offset_sd(self) -> float:
        """Standard deviation of the (first) offset; NaN where it was not estimated."""
        n = len(self.theta)
        return float(np.sqrt(self.P[n, n])) if len(self.P) > n else float("nan")


def flat(fit: Fit) -> Floats:
    """Return the covariance as the core reads it."""
    return fit.flat_P


def widened(fit: Fit, factor: float) -> Fit:
    """Return the fit with standard deviations and intervals `factor` times as wide."""
    P, sd = _core.widened(flat(fit), len(fit.theta), factor)
    intervals = {name: stretched(fit, name, factor) for name in fit.intervals}
    return replace(fit, P=P.reshape(fit.P.shape), sd=sd, intervals=intervals)


def stretched(fit: Fit, name: str, factor: float) -> tuple[float, float]:
    """Return the interval of a parameter with both ends `factor` times as far from it."""
    x = float(fit.theta[fit.names.index(name)])
    return _core.stretched(fit.intervals[name], x, factor)


class KnownProcess(NamedTuple):
    """What the core needs of a process fit to find its place on the record again."""

    codes: list[str]
    plants: tuple[ProcessModel, ...]
    c: list[float]
    d: list[float]
    N: int
    loss: float
    offset: bool
    steps: list[int]


def known_process(rec: Record, fit: Fit) -> KnownProcess | None:
    """Return what is known of a process fit on its record; None of other fits."""
    if not fit.plants:
        return None
    _need_own_record(rec, fit)
    c, d = (
        ([], [])
        if fit.sampled is None
        else (fit.sampled.C[1:].tolist(), fit.sampled.D[1:].tolist())
    )
    has_offset = len(fit.P) > len(fit.theta)
    return KnownProcess(
        codes=fit.method.split(),
        plants=fit.plants,
        c=c,
        d=d,
        N=fit.N,
        loss=fit.loss,
        offset=has_offset,
        steps=[step.row for step in fit.steps],
    )


def refit_arguments(rec: Record, fit: Fit) -> tuple[Any, float | None, str]:
    """Return model, offset and start of a fit, from which the core predicts the record again."""
    model = fit.model
    if not isinstance(model, PolyModel):
        raise refusal(
            "U01",
            f"`fit` is of {fit.method}",
            remedy="fit a polynomial or process model, such as oe, arx or process",
        )
    _need_own_record(rec, fit)
    offset = float(fit.offset[0]) if len(fit.P) > len(fit.theta) else None
    return model, offset, "estimate" if fit.x0.shape[1] else "zero"


def _need_own_record(rec: Record, fit: Fit) -> None:
    if rec.source != fit.source:
        raise refusal(
            "U01", "`rec` is not the record of the fit", remedy="give the record it was fitted to"
        )


def fit_from_core(
    d: Mapping[str, Any],
    method: str,
    rec: Record | None,
    limits: Limits,
    further: tuple[Note, ...] = (),
) -> Fit:
    """Return the fit that the core sends as a dict, with further notes."""
    steps = () if rec is None else (OffsetStep(k, float(rec.time[k]), *s) for k, *s in d["steps"])
    return Fit(
        method=method,
        **{
            **d,
            "model": None if d["model"] is None else from_core(d["model"]),
            "names": tuple(d["names"]),
            "intervals": {name: (low, high) for name, low, high in d["intervals"]},
            "plants": tuple(from_core(plant) for plant in d["plants"]),
            "sampled": None if d["sampled"] is None else from_core(d["sampled"]),
            "notes": (*notes_from_core(d["notes"]), *further, *limits.changes()),
            "steps": tuple(steps),
        },
        source="" if rec is None else rec.source,
        Ts=None if rec is None else rec.Ts,
    )
