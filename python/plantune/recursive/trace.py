"""What a recursive estimator leaves behind on a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.models import PolyModel
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Parameters, errors and alarms along a record.

    Attributes
    ----------
    t : array (m,)
        Time of the rows that were kept, seconds.
    rows : array (m,)
        Their numbers in the record.
    theta, sd : array (m, n)
        Coefficients after each row and their standard deviations, infinite before anything is
        known.
    names : tuple of str
        Of the coefficients.
    offset, offset_sd : array (m,)
        `O` in `y = G u + O` in the record's units, and its standard deviation.
    eps : array (m,)
        Prediction error at each row; NaN where there was none: lags missing at the start of a
        segment, or an output that does not count.
    learnt : array (m,) of bool
        Whether the row was learnt: not without a prediction, nor while the input rests.
    alarms : array
        Times at which a step of the offset was seen, seconds; of all rows.
    noise_sd : float
        Standard deviation of the noise at the end.
    final : PolyModel
        The model at the end.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5)
    >>> trace = pt.recursive.ARMAX(1, 1, 1, 6, lam=0.995).run(rec)
    >>> trace.theta.shape, trace.names, trace.alarms.tolist()
    ((3000, 3), ('a1', 'b1', 'c1'), [])
    >>> print(trace)  # doctest: +ELLIPSIS
    ARMAX after 3000 rows: a1 -0.8733 ± 0.00074, b1 -0.7511 ± 0.0042, c1 -0.8466 ± 0.023, ...
    >>> bool(abs(trace.model_at(20.0).dc_gain() + 5.939) < 0.2)
    True
    """

    method: str
    t: Floats
    rows: NDArray[np.int64]
    theta: Floats
    sd: Floats
    names: tuple[str, ...]
    offset: Floats
    offset_sd: Floats
    eps: Floats
    learnt: NDArray[np.bool_]
    alarms: Floats
    noise_sd: float
    final: PolyModel
    source: str

    def model_at(self, t: float) -> PolyModel:
        """Return the model after the last row kept that is not later than `t`, seconds.

        Examples
        --------
        >>> import plantune as pt
        >>> trace = pt.recursive.ARX(1, 1, 6).run(pt.datasets.engine_loop())
        >>> round(float(trace.model_at(1.0).dc_gain()), 2)
        -5.94
        """
        before = np.flatnonzero(self.t <= t)
        if not len(before):
            raise refusal(
                "U01",
                f"`t` is {t}, before the first row at {self.t[0]:g}",
                remedy=f"the trace runs from {self.t[0]:g} to {self.t[-1]:g}",
            )
        parts = self._polynomials(self.theta[before[-1]])
        return PolyModel(**parts, nk=self.final.nk, Ts=self.final.Ts)

    def _polynomials(self, theta: Floats) -> dict[str, Floats]:
        """Return `A B C D F` of coefficients in the order of `names`."""

        def part(letter: str) -> list[float]:
            own = zip(self.names, theta, strict=True)
            return [float(value) for name, value in own if name[0] == letter]

        monic = {p: np.array([1.0, *part(p.lower())]) for p in "ACDF"}
        return {**monic, "B": np.array(part("b"))}

    def __str__(self) -> str:
        named = zip(
            (*self.names, "offset"),
            (*self.theta[-1], self.offset[-1]),
            (*self.sd[-1], self.offset_sd[-1]),
            strict=True,
        )
        values = ", ".join(f"{name} {value:.4g} ± {sd:.2g}" for name, value, sd in named)
        alarms = f"; offset steps at {', '.join(f'{t:g}' for t in self.alarms)}"
        head = f"{self.method} after {int(self.rows[-1]) + 1} rows: {values}"
        return head + (alarms if len(self.alarms) else "")


def from_core(fields: Mapping[str, Any], rec: Record, estimator: _core.Recursion) -> Trace:
    """Return the trace that the core sends as a dict, with what the record adds."""
    time = rec.time
    values = {
        **fields,
        "t": time[fields["rows"]],
        "alarms": time[fields["alarms"]],
    }
    for array in values.values():
        array.flags.writeable = False
    return Trace(
        method=type(estimator).__name__,
        **values,
        names=tuple(estimator.names),
        noise_sd=estimator.noise_sd,
        final=estimator.model,
        source=rec.source,
    )
