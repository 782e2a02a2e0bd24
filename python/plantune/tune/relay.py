"""The relay test: a model from the limit cycle, refined on the same record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.models import ProcessModel
from plantune.models.convert import from_core
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record
from plantune.text import number, table


@dataclass(frozen=True, slots=True, eq=False)
class RelayTest:
    """What a relay test says of a plant: `model` from its cycle, `fit` from every row.

    Tune on `fit`, which carries its uncertainty; where both disagree (T03) read
    `docs/questions/how-do-i-run-a-relay-test.md`.

    Attributes
    ----------
    model : ProcessModel
        From the exact inversion of the cycle.
    sd : array (3,)
        Standard deviations of its `K, T, L`, from the sample time and from what it leaves of y.
    offset : float
        `O` in `y = G u + O`, from the inversion.
    known : "rest" or "asymmetry"
        How it is known: from the equilibrium before the test, or from the cycle alone.
    fit : Fit or None
        First order plus dead time fitted to every row of the record; None where that is refused,
        which a note says.
    Ku, Tu : float
        Ultimate gain, u/y with the sign of `K`, and ultimate period, seconds, of `model`.
    t_on, t_off : float
        Seconds at the upper and at the lower level, mean over the settled periods.
    periods : int
        How many those are.
    t, u, y, yhat : array (n,)
        Time, input, measured output and that of `model` over them.
    thresholds : (float, float)
        y where u went to the upper, and where it went to the lower level.
    levels : (low, high)
        Of u.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.
    Ts : float
        Its sample time, seconds.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=3.0, L=1.0)
    >>> rec = pt.simulate.relay(
    ...     plant, high=2.0, low=-1.0, hysteresis=0.3, Ts=0.05, t_end=60.0, noise_sd=0.1, rest=5.0
    ... )
    >>> test = pt.tune.relay(rec)
    >>> print(test)
    relay: G(s) = 1.90838 e^(-0.993873 s) / (2.8737 s + 1)
                   cycle              fit
      K     1.9084 ± 0.2   2.0019 ± 0.073
      T    2.8737 ± 0.36      2.97 ± 0.12
      L  0.99387 ± 0.039  1.0043 ± 0.0067
      offset 0.008527 from the rest
      ultimate gain 2.724, period 3.539 s
      10 periods: 1.755 s at 2, 2.965 s at -1, hysteresis 0.2909
    >>> print(pt.tune.simc(test.fit).controller)
    PI: Kp = 0.738616, Ti = 2.97005 s
    """

    model: ProcessModel
    sd: Floats
    offset: float
    known: str
    fit: Fit | None
    Ku: float
    Tu: float
    t_on: float
    t_off: float
    periods: int
    t: Floats
    u: Floats
    y: Floats
    yhat: Floats
    thresholds: tuple[float, float]
    levels: tuple[float, float]
    notes: tuple[Note, ...]
    source: str
    Ts: float

    @property
    def K(self) -> float:
        """Gain, y/u."""
        return self.model.K

    @property
    def T(self) -> float:
        """Time constant, seconds."""
        return self.model.times[0]

    @property
    def L(self) -> float:
        """Dead time, seconds."""
        return self.model.L

    @property
    def hysteresis(self) -> float:
        """Half the distance of the thresholds, the relay's own and what y moves within a sample."""
        return abs(self.thresholds[1] - self.thresholds[0]) / 2

    def __str__(self) -> str:
        said = {"cycle": (np.array([self.K, self.T, self.L]), self.sd)}
        if self.fit is not None:
            said["fit"] = (self.fit.theta, self.fit.sd)
        rows = [["", *said]]
        for i, name in enumerate("KTL"):
            cells = (f"{values[i]:.5g} ± {sd[i]:.2g}" for values, sd in said.values())
            rows.append([name, *cells])
        low, high = map(number, self.levels)
        lines = [
            f"relay: {self.model}",
            *("  " + line for line in table(rows)),
            f"  offset {number(self.offset)} from the {self.known}",
            f"  ultimate gain {number(self.Ku)}, period {number(self.Tu)} s",
            f"  {self.periods} periods: {number(self.t_on)} s at {high}, {number(self.t_off)} s at "
            f"{low}, hysteresis {number(self.hysteresis)}",
        ]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def relay(
    rec: Record,
    *,
    rest: tuple[float, float] | None = None,
    limits: Limits | None = None,
) -> RelayTest:
    """Return K, T, L from the limit cycle of an asymmetric relay, and the fit of the record.

    Parameters
    ----------
    rec : Record
        One input that switches between two levels, one output that oscillates; at least two whole
        periods, settled.  A stretch at another, constant input before the test is taken as the
        plant at rest.  Of several segments the longest is inverted; all are fitted.
    rest : (u0, y0), optional
        An equilibrium of the plant, instead of such a stretch.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    RelayTest
        With note T03 where inversion and fit disagree by more than three standard deviations, X02
        where the cycle says little, X07 where y was not at rest or periods were left out; a refusal
        of the fit is a note as well.

    Raises
    ------
    UsageError
        u takes more than two levels (U01).
    NotIdentifiable
        u does not move (X01), a symmetric cycle (X02), fewer than two periods (X03), a relay that
        noise switches (X04), an oscillation that has not settled (X07), a cycle that no plant of
        first order has (M12).

    Notes
    -----
    With `A = K (high - low)` and `p, q` the distances of y at the switchings from where it would
    settle, `t_on = T ln((A e^(L/T) - q)/p)` and `t_off = T ln((A e^(L/T) - p)/q)`.  The mean over
    whole periods gives the offset from the gain; the last equation is `K = int(y - y0)/int(u - u0)`
    from an equilibrium, or else the balance of one half-cycle.  All hold exactly for a sampled
    relay.  The switching instants count as uncertain by one sample, so `sd` does not vanish
    without noise.  Where the dead time is short against `T`, an equilibrium tells far more.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=-2.0, T=3.0, L=1.0)
    >>> rec = pt.simulate.relay(
    ...     plant, high=2.0, low=-1.0, hysteresis=0.1, Ts=0.01, t_end=30.0, offset=0.5
    ... )
    >>> test = relay(rec)
    >>> print(test.model, "offset", round(test.offset, 3), "from the", test.known)
    G(s) = -2 e^(-0.999999 s) / (3 s + 1) offset 0.5 from the asymmetry
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    d = _core.relay(rec, rest, limits)
    first, last = d.pop("rows")
    fit = d["fit"]
    return RelayTest(
        **{
            **d,
            "model": from_core(d["model"]),
            "fit": None if fit is None else fit_from_core(fit, "P1D", rec, limits),
            "notes": (*notes_from_core(d["notes"]), *limits.changes()),
        },
        t=rec.time[first:last],
        u=rec.u[first:last, 0],
        y=rec.y[first:last, 0],
        source=rec.source,
        Ts=rec.Ts,
    )
