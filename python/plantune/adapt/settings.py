"""How the auto-tuner is set."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from sys import float_info
from typing import Any, Literal

from plantune.errors import refusal
from plantune.models import PID, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.simulate import Table

Pair = tuple[float, float]

_LEAST = float_info.min


@dataclass(frozen=True, slots=True, eq=False)
class BankSettings:
    """Identification by a bank of recursions, one for each delay, at every sample.

    Parameters
    ----------
    lam, lam0, rho : float
        The forgetting factor goes from `lam0` to `lam`: `lam - (lam - lam0) rho**t`.
    method : "rml" or "els"
        Recursive maximum likelihood, or extended least squares.
    offset : bool
        Whether the offset is a parameter.
    band : pair of float, optional
        Cut-offs of a Butterworth band-pass on u and y, rad/s.
    order : int
        Its order.
    steady : bool
        Whether it starts in equilibrium with the first sample, or at zero.
    opens : int
        Samples before the bank begins to learn.
    delay : "posterior" or "counters"
        How the delay is chosen: by probability, or by counters with hysteresis.
    window, hysteresis : int
        Samples of the moving window of the counters, and the demand that they must exceed.

    Notes
    -----
    METHODS 1.2 to 1.5; with a band, no offset and counters it is source 001, 3.7.4.

    Examples
    --------
    >>> BankSettings.source_001().band
    (1.0, 20.0)
    """

    lam: float = 0.995
    lam0: float = 0.95
    rho: float = 0.99
    method: Literal["rml", "els"] = "rml"
    offset: bool = True
    band: Pair | None = None
    order: int = 5
    steady: bool = False
    opens: int = 0
    delay: Literal["posterior", "counters"] = "posterior"
    window: int = 50
    hysteresis: int = 5

    @classmethod
    def source_001(cls, steady: bool = False, opens: int = 0) -> BankSettings:
        """Return the bank of source 001, 3.7.4: band-pass, no offset, forgetting 0.995, counters.

        Started at zero, as there, the filter needs 16 to 30 s to forget an offset of 583, and
        estimates before that are wrong; `steady` starts it at the first sample.

        Examples
        --------
        >>> BankSettings.source_001(steady=True).offset
        False
        """
        return cls(
            lam0=0.995,
            rho=1.0,
            offset=False,
            band=(1.0, 20.0),
            steady=steady,
            opens=opens,
            delay="counters",
        )


@dataclass(frozen=True, slots=True, eq=False)
class Settings:
    """What the auto-tuner is asked for, and what it may do.

    Parameters
    ----------
    Ts : float
        Sample time, seconds.
    nk : pair of int
        Least and largest delay in samples, `L = (nk - 1) Ts`.
    controller : PID
        The controller at work in the beginning; the sign of its gain is the action of the loop.
    gain_margin, phase_margin, tau_c : float, optional
        What IMC-PI aims at, one of them: a factor, degrees, or a closed-loop time constant in
        seconds.  A gain margin of 3 by default.
    rule : "imc" or "posterior"
        IMC-PI on the merged model, or the PI of least IAE that keeps `Ms` on 95 % of the plants
        that are possible.
    answer : "load", "set_point" or "both"
        What the posterior rule answers well.
    write : iterable of "Kp", "Ti", "Td"
        What may be written; what may not stays as it is, and the loop is judged with it.
    Ms : float
        Largest 95 % quantile of the sensitivity over the uncertainty of what is written.
    rows, every : int
        Rows that are fitted, and samples between fits.
    fraction : bool
        Whether a delay may lie between samples.
    bank : BankSettings, optional
        Identification by a bank of recursions instead.
    K, T, L : pair of float, optional
        Limits of an accepted plant; by default any gain of the controller's sign, any time
        constant, and the delays of `nk`.
    sd, spread : three of float
        Largest standard deviation of an accepted estimate, and largest scatter over the moving
        window: of K and T relative to them, of L relative to `T + L`.
    answered : float
        Least time since u first moved in the window before an estimate is accepted, in units of
        `T + L`: at 4 the answer to a step has come to 98 %, below its gain is extrapolated.
    settled : int
        Estimates in the moving window, at least 2.
    average : bool
        Whether the mean over the window is taken, or its last.
    merge_rate : float
        `C_AR` of source 001, (3.7-14) to (3.7-19), in (0, 1].
    nominal : ProcessModel, optional
        Nominal plant to merge with.
    worth : float
        Least relative change of a gain that is worth writing.
    max_change, dwell : float
        Largest factor of a change, and least time between two, in units of `T + L`.
    saturation, excitation : float
        Largest share of the window that u may be at a limit; least travel of u within the window
        relative to its largest.
    stuck : int
        Most samples that y may keep its value while u moves.
    u_limits : pair of float
        Limits of the actuator.
    break_points, margins : mapping
        Break points of each operating-point signal of the sample's `aux`, and how far it may be
        from them.
    schedule : pair of Table, optional
        `Kp` and `Ki` over the operating-point signals, in the order of `break_points`; they are
        updated where the plant was.
    simulated_plant : ProcessModel, optional
        First-order plant that gives `y` where it is not read, with `simulated_offset`.
    simulated_controller : bool
        Whether the controller gives `u` where it is not read.
    u0 : float
        First input of what is simulated, at which the plant is at rest.
    target : float
        Relative standard deviation of K and T aimed at, for the time to target.
    limits : Limits
        `C07` and `C07_phase` are the least margins over the uncertainty.

    Raises
    ------
    UsageError
        An argument out of its range (U01).

    Examples
    --------
    >>> settings = Settings(Ts=0.02, nk=(3, 11), controller=PID(Kp=-0.018, Ti=0.053))
    >>> settings.imc, settings.K
    (('gain_margin', 3.0), (-inf, -2.2250738585072014e-308))
    """

    Ts: float
    nk: tuple[int, int]
    controller: PID
    gain_margin: float | None = None
    phase_margin: float | None = None
    tau_c: float | None = None
    rule: Literal["imc", "posterior"] = "imc"
    answer: Literal["load", "set_point", "both"] = "load"
    write: Collection[str] = ("Kp", "Ti", "Td")
    Ms: float = 1.8
    rows: int = 750
    every: int = 10
    fraction: bool = True
    bank: BankSettings | None = None
    K: Pair | None = None
    T: Pair | None = None
    L: Pair | None = None
    sd: tuple[float, float, float] = (0.05, 0.08, 0.05)
    spread: tuple[float, float, float] = (0.05, 0.08, 0.05)
    answered: float = 4.0
    settled: int = 3
    average: bool = False
    merge_rate: float = 1.0
    nominal: ProcessModel | None = None
    worth: float = 0.05
    max_change: float = 2.0
    dwell: float = 5.0
    saturation: float = 0.05
    excitation: float = 0.02
    stuck: int = 50
    u_limits: Pair = (-inf, inf)
    break_points: Mapping[str, Sequence[float]] | None = None
    margins: Mapping[str, float] | None = None
    schedule: tuple[Table, Table] | None = None
    simulated_plant: ProcessModel | None = None
    simulated_offset: float = 0.0
    simulated_controller: bool = False
    u0: float = 0.0
    target: float = 0.01
    limits: Limits = DEFAULT_LIMITS

    def __post_init__(self) -> None:
        given = [
            n for n in ("gain_margin", "phase_margin", "tau_c") if getattr(self, n) is not None
        ]
        if len(given) > 1:
            raise refusal("U01", f"{' and '.join(given)} are given", remedy="give one of them")
        if not set(self.write) <= {"Kp", "Ti", "Td"}:
            raise refusal(
                "U01",
                f"`write` is {sorted(self.write)}, must be among Kp Ti Td",
                remedy='write=["Kp", "Ti"]',
            )
        if self.break_points and set(self.break_points) != set(self.margins or {}):
            raise refusal(
                "U01",
                f"`margins` are of {sorted(self.margins or {})}, must be of the break points' "
                f"signals, {sorted(self.break_points)}",
                remedy="one margin per signal",
            )
        if not given:
            object.__setattr__(self, "gain_margin", 3.0)
        action = self.controller.Kp or self.controller.Ki
        defaults = {
            "K": (_LEAST, inf) if action > 0 else (-inf, -_LEAST),
            "T": (_LEAST, inf),
            "L": ((self.nk[0] - 1.5) * self.Ts, (self.nk[1] + 0.5) * self.Ts),
        }
        for name, pair in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, pair)

    @classmethod
    def source_001(
        cls, Ts: float, controller: PID, steady: bool = False, opens: int = 0, **changes: object
    ) -> Settings:
        """Return the auto-tuner of source 001, 3.7, as the errata correct it.

        It has no gate and no uncertainty, and is here to be compared with: with an offset its
        early estimates are wrong, and it tunes on them.

        Parameters
        ----------
        Ts : float
            Sample time, seconds.
        controller : PID
            The controller at work in the beginning.
        steady : bool
            Whether the band-pass starts in equilibrium with the first sample, or at zero as there.
        opens : int
            Samples before the bank begins to learn.
        **changes
            Other settings, in place of those of the source.

        Notes
        -----
        Figure 3.7-5 limits K and T, and does not say where.  Here |K| is limited to 2 to 18, a
        third to three times that of the engine, and T to 0.05 to 0.6 s: its time constants are 0.1
        to 0.5 s (table 3.5-2).  For another plant give `K=`, `T=` and `nk=`.

        Examples
        --------
        >>> settings = Settings.source_001(0.02, PID(Kp=-0.018, Ti=0.053))
        >>> settings.K, settings.T, settings.max_change
        ((-18.0, -2.0), (0.05, 0.6), inf)
        """
        action = controller.Kp or controller.Ki
        own: dict[str, Any] = {
            "nk": (3, 11),
            "K": (2.0, 18.0) if action > 0 else (-18.0, -2.0),
            "T": (0.05, 0.6),
            "bank": BankSettings.source_001(steady, opens),
            "sd": (inf, inf, inf),
            "spread": (0.02, 0.02, 0.01),
            "answered": 0.0,
            "settled": 50,
            "average": True,
            "merge_rate": 0.5,
            "Ms": inf,
            "max_change": inf,
            "dwell": 0.0,
            "worth": 0.0,
            "saturation": 1.0,
            "excitation": 0.0,
            "limits": Limits(C07=1e-9, C07_phase=1e-9),
        }
        return cls(Ts=Ts, controller=controller, **{**own, **changes})

    @property
    def imc(self) -> tuple[str, float]:
        """What IMC-PI aims at, by name."""
        for name in ("gain_margin", "phase_margin", "tau_c"):
            if (value := getattr(self, name)) is not None:
                return name, float(value)
        raise AssertionError  # a gain margin is the default

    @property
    def writes(self) -> list[bool]:
        """Whether `Kp`, `Ti` and `Td` may be written."""
        return [name in self.write for name in ("Kp", "Ti", "Td")]

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the operating-point signals."""
        return tuple(self.break_points or ())

    @property
    def points(self) -> tuple[list[list[float]], list[float]] | None:
        """Break points and margins, signal by signal."""
        if not self.break_points or not self.margins:
            return None
        at = [[float(x) for x in points] for points in self.break_points.values()]
        return at, [float(self.margins[name]) for name in self.break_points]

    @property
    def tables(self) -> tuple[tuple[list[list[float]], list[float]], ...] | None:
        """Axes and values of the gain schedule."""
        if self.schedule is None:
            return None
        flat = [([a.tolist() for a in t.axes], t.values.ravel().tolist()) for t in self.schedule]
        return tuple(flat)

    @property
    def gate_gain_margin(self) -> float:
        """Least gain margin over the uncertainty, a factor."""
        return self.limits.C07

    @property
    def gate_phase_margin(self) -> float:
        """Least phase margin over the uncertainty, degrees."""
        return self.limits.C07_phase
