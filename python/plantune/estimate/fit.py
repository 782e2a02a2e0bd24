"""What every batch estimator returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune.errors import refusal
from plantune.estimate.derived import Curve, Derived, Root, bode, derived, roots, step
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

    def simulate(self, u: ArrayLike, Ts: float | None = None, x0: float = 0.0) -> Floats:
        """Return the output for the input `u`, offset included, the plant at rest before row 0.

        Examples
        --------
        >>> import plantune as pt
        >>> fit = pt.estimate.process(pt.datasets.engine_loop(), "P1D")
        >>> fit.simulate([0.0, 0.0], Ts=0.02).round(3)
        array([583.451, 583.451])
        """
        return self._need_model().simulate(u, Ts, x0) + float(self.offset[0])

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
        return self._need_model().predict(rec, horizon, float(self.offset[0]))

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
        self._need_model()
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
        self._need_model()
        return roots(self, None)

    def zeros(self, input: int = 0) -> tuple[Root, ...]:
        """Return the zeros from an input, as `poles`."""
        self._need_model()
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
        self._need_model()
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
        self._need_model()
        return bode(self, w, input)

    @property
    def flat_P(self) -> Floats:
        """The covariance as the core reads it."""
        return np.ascontiguousarray(self.P).reshape(-1)

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
    return fit.flat_P


def refit_arguments(rec: Record, fit: Fit) -> tuple[Any, float | None, str]:
    """Return model, offset and start of a fit, from which the core predicts the record again."""
    model = fit.model
    if not isinstance(model, PolyModel):
        raise refusal(
            "U01", f"`fit` is of {fit.method}", remedy="fit a polynomial model, such as oe or arx"
        )
    if rec.source != fit.source:
        raise refusal(
            "U01", "`rec` is not the record of the fit", remedy="give the record it was fitted to"
        )
    offset = float(fit.offset[0]) if len(fit.P) > len(fit.theta) else None
    return model, offset, "estimate" if fit.x0.shape[1] else "zero"


def fit_from_core(d: Mapping[str, Any], method: str, rec: Record | None, limits: Limits) -> Fit:
    """Return the fit that the core sends as a dict."""
    return Fit(
        method=method,
        **{
            **d,
            "model": None if d["model"] is None else from_core(d["model"]),
            "names": tuple(d["names"]),
            "notes": (*notes_from_core(d["notes"]), *limits.changes()),
        },
        source="" if rec is None else rec.source,
        Ts=None if rec is None else rec.Ts,
    )
