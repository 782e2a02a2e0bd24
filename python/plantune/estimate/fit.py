"""What every batch estimator returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune.errors import refusal
from plantune.models import PolyModel, ProcessModel
from plantune.models.convert import from_core
from plantune.notes import Limits, Note, notes_from_core
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted model with its uncertainty.

    Attributes
    ----------
    model : PolyModel, ProcessModel or None
        None for a plain least-squares problem.
    theta, sd : array (n,)
        Parameters and their standard deviations.
    P : array (m, m)
        Covariance of `theta`, then of the offset where it was estimated.
    names : tuple of str
        One per parameter.
    offset : array (ny,)
        `O` in `y = G u + O`, in the record's units; for integrating models the drift.
    x0 : array (segments, n)
        Initial state of each segment at its first row with history.
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
    model: PolyModel | ProcessModel | None
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

    def simulate(self, u: ArrayLike, Ts: float | None = None, x0: float = 0.0) -> Floats:
        """Return the output for the input `u`, offset included, the plant at rest before row 0.

        Examples
        --------
        >>> import plantune as pt
        >>> fit = pt.estimate.process(pt.datasets.engine_loop(), "P1D")
        >>> fit.simulate([0.0, 0.0], Ts=0.02).round(3)
        array([583.451, 583.451])
        """
        model, offset = self._need_model(), float(self.offset[0])
        y = model.simulate(u, Ts, x0)
        if isinstance(model, ProcessModel) and model.integrating:
            return y + offset * (Ts or 0.0) * np.arange(len(y))  # the drift
        return y + offset

    def predict(self, rec: Record, horizon: int | None = 1) -> Floats:
        """Return the output predicted `horizon` steps ahead on a record; None simulates.

        Examples
        --------
        >>> import plantune as pt
        >>> rec = pt.datasets.engine_loop()
        >>> fit = pt.estimate.process(rec, "P1D")
        >>> bool(abs(fit.predict(rec) - rec.y[:, 0])[20:].max() < 1e-6)
        True
        """
        model = self.sampled or self._need_model()
        return model.predict(rec, horizon, float(self.offset[0]))

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
        return float(self.theta[i] - 1.96 * self.sd[i]), float(self.theta[i] + 1.96 * self.sd[i])

    @property
    def drawn_from(self) -> tuple[Any, Floats, int, float, float | None]:
        """What the core draws models from: model, flat covariance, rows, loss, sample time."""
        return self.model, flat(self), self.N, self.loss, self.Ts

    def _need_model(self) -> PolyModel | ProcessModel:
        if self.model is None:
            raise refusal("U01", "a plain least-squares fit has no model", remedy="use fit.theta")
        return self.model

    def __str__(self) -> str:
        head = "" if self.model is None else ": " + str(self.model).splitlines()[0]
        width = max(len(name) for name in (*self.names, "offset"))
        lines = [
            f"  {name:<{width}} {value:12.6g} ± {sd:.3g}"
            for name, value, sd in zip(self.names, self.theta, self.sd, strict=True)
        ]
        if len(self.P) > len(self.theta):
            sd = self.offset_sd
            lines.append(f"  {'offset':<{width}} {self.offset[0]:12.6g} ± {sd:.3g}")
        tail = f"  {self.N} rows, loss {self.loss:.4g}, {self.status}"
        return "\n".join([self.method + head, *lines, tail, *(f"  {n}" for n in self.notes)])

    @property
    def offset_sd(self) -> float:
        """Standard deviation of the offset; NaN where it was not estimated."""
        n = len(self.theta)
        return float(np.sqrt(self.P[n, n])) if len(self.P) > n else float("nan")


def flat(fit: Fit) -> Floats:
    """Return the covariance as the core reads it."""
    return np.ascontiguousarray(fit.P).reshape(-1)


def fit_from_core(d: Mapping[str, Any], method: str, rec: Record | None, limits: Limits) -> Fit:
    """Return the fit that the core sends as a dict."""
    return Fit(
        method=method,
        **{
            **d,
            "model": None if d["model"] is None else from_core(d["model"]),
            "names": tuple(d["names"]),
            "intervals": {name: (low, high) for name, low, high in d["intervals"]},
            "plants": tuple(from_core(plant) for plant in d["plants"]),
            "sampled": None if d["sampled"] is None else from_core(d["sampled"]),
            "notes": (*notes_from_core(d["notes"]), *limits.changes()),
        },
        source="" if rec is None else rec.source,
        Ts=None if rec is None else rec.Ts,
    )
