"""A mass on a spring, a damper and a force with memory."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models.hysteresis.base import HysteresisModel, Identified, column
from plantune.notes import notes_from_core
from plantune.record import Floats

_PARAMETERS = ("m", "c", "k", "alpha", "bg", "bd", "nu")
_STATES = ("y0", "v0", "z0")

State = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class BoucWen(HysteresisModel):
    """`m y'' + c y' + k y + z = u`, z the force of Bouc and Wen.

    `z' = alpha y' - |z|^nu (bg |y'| sgn z + bd y')`.

    Parameters
    ----------
    m, c, k : float
        Mass (> 0), damping and stiffness, in units of u over those of y.
    alpha : float
        Stiffness of z where z = 0.
    bg, bd : float
        `beta gamma` and `beta delta` of the literature, of which no data can tell beta.  While
        |z| grows, its stiffness is `alpha - (bg + bd) |z|^nu`; while it falls,
        `alpha + (bg - bd) |z|^nu`.
    nu : float
        How sharply z yields, > 0.
    Ts : float, optional
        Sample time of `stream` and default of `simulate`, s.
    x0 : (y, y', z)
        State at the first row of the record that it was identified from.

    Raises
    ------
    UsageError
        A number that is not finite, or not positive where it must be (U01).

    Notes
    -----
    `alpha` and `k` differ only as far as z leaves its straight line: small swings do not tell
    them apart.  Wen, J. Eng. Mech. Div. 102, 1976; Noël and Schoukens,
    Hysteretic benchmark with a dynamic nonlinearity, 2016.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.hysteresis.BoucWen(m=2, c=10, k=5e4, alpha=5e4, bg=800, bd=-1100, nu=1)
    >>> (plant.simulate([0, 50, 100, 50], Ts=1 / 750) * 1e6).round(1)
    array([  0. ,   5.4,  54.3, 178.6])
    """

    kind: ClassVar[str] = "bouc_wen"

    m: float
    c: float
    k: float
    alpha: float
    bg: float
    bd: float
    nu: float = 1.0
    Ts: float | None = None
    x0: State | None = field(default=None, repr=False)
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in _PARAMETERS:
            object.__setattr__(self, name, float(getattr(self, name)))
        _core.hysteresis_check(self)

    def simulate(
        self,
        x: ArrayLike,
        Ts: float | None = None,
        *,
        x0: State | str = "rest",
        hold: str = "spline",
        substeps: int | None = None,
    ) -> Floats:
        """Return the displacement (N,) under the force `x` (N,).

        Parameters
        ----------
        x : array (N,)
            Force u at the sampling instants.
        Ts : float, optional
            Sample time, s; by default the model's.
        x0 : "rest" or (y, y', z)
            State at the first row.  `initial_state` finds it from a record.
        hold : "spline", "line" or "zoh"
            How the force runs between samples; "line" gives what `stream` gives, to the last bit.
        substeps : int, optional
            Steps of the integrator per sample; by default ten per radian of the stiffest
            oscillation, four at least.

        Raises
        ------
        UsageError
            No sample time, or an argument out of its range (U01).
        NumericsError
            The output grows beyond all numbers (N02).

        Examples
        --------
        >>> import plantune as pt
        >>> plant = pt.hysteresis.BoucWen(2, 10, 5e4, 5e4, 800, -1100, Ts=1 / 750)
        >>> stream = plant.stream()
        >>> y = [stream.step(u) for u in (0.0, 50.0, 100.0)]
        >>> y == plant.simulate([0.0, 50.0, 100.0], hold="line").tolist()
        True
        """
        if isinstance(x0, str) and x0 != "rest":
            raise refusal("U01", f"`x0` is {x0!r}", remedy='pass "rest" or (y, y\', z)')
        start = (0.0, 0.0, 0.0) if isinstance(x0, str) else x0
        return _core.bouc_wen_simulate(self, column(x, "x"), self._Ts(Ts), start, hold, substeps)

    def initial_state(self, u: ArrayLike, y: ArrayLike, Ts: float | None = None) -> State:
        """Return the state (y, y', z) at the first row of a record that does not begin at rest.

        Output error over the first 200 rows, from several forces z.

        Parameters
        ----------
        u, y : array (N,)
            Force and measured displacement.
        Ts : float, optional
            Sample time, s; by default the model's.

        Raises
        ------
        NotIdentifiable
            Fewer than six rows (X03).

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> plant = pt.hysteresis.BoucWen(2, 10, 5e4, 5e4, 800, -1100, Ts=1 / 750)
        >>> u = 100 * np.sin(np.arange(400) / 4)
        >>> y = plant.simulate(u)
        >>> x0 = plant.initial_state(u[200:], y[200:])
        >>> error = plant.simulate(u[200:], x0=x0) - y[200:]
        >>> bool(abs(error).max() < 1e-6)
        True
        """
        u, y = column(u, "u"), column(y, "y")
        return _core.bouc_wen_initial_state(self, u, y, self._Ts(Ts))

    @classmethod
    def identify(
        cls,
        u: ArrayLike,
        y: ArrayLike,
        Ts: float,
        *,
        nu: float | None = None,
        x0: str = "estimate",
    ) -> BoucWen:
        """Fit the model to a force and the displacement under it.

        Variable projection in the form of the equation gives a first model without a search over
        the output; output error gives the answer and its standard deviations.

        Parameters
        ----------
        u, y : array (N,)
            Force and measured displacement.
        Ts : float
            Sample time, s.
        nu : float, optional
            How sharply z yields, where it is known; 1 is the usual choice.
        x0 : "estimate" or "rest"
            Whether the state at the first row is fitted too.

        Returns
        -------
        BoucWen
            `identified.sd` are those of `m c k alpha bg bd nu y0 v0 z0`, for white noise on y; 0
            of what was given.  Notes: X02 nu is open, N05 the search did not converge, M09 few
            samples per period, M12 a stiffness or damping below zero.

        Raises
        ------
        DataError
            u and y of different lengths (D09).
        NotIdentifiable
            A signal stands still (X01), z does not show or a parameter depends on the others
            (X02), too few rows (X03), fewer than five samples per period (M09).
        NumericsError
            No parameters reproduce the record (N05, N02).

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> plant = pt.hysteresis.BoucWen(m=2, c=10, k=5e4, alpha=5e4, bg=800, bd=-1100, Ts=1 / 750)
        >>> t = np.arange(1500) / 750
        >>> u = 60 * np.sin(2 * np.pi * (20 + 15 * t) * t)
        >>> noise = np.random.default_rng(1).normal(0, 5e-6, len(t))
        >>> model = pt.hysteresis.BoucWen.identify(u, plant.simulate(u) + noise, Ts=1 / 750)
        >>> print(model)
        m y'' + c y' + k y + z = u
        z' = alpha y' - |z|^nu (bg |y'| sgn z + bd y')
        m     = 2.0003 ± 0.0006
        c     = 9.71 ± 0.2
        k     = 50571.9 ± 3.8e+02
        alpha = 49457.3 ± 3.5e+02
        bg    = 816.1 ± 13
        bd    = -1119.4 ± 17
        nu    = 0.999 ± 0.003
        """
        return cls._fitted(u, y, Ts, nu, x0, start_only=False)

    @classmethod
    def fit_start(
        cls, u: ArrayLike, y: ArrayLike, Ts: float, *, nu: float | None = None
    ) -> BoucWen:
        """Return the first model of `identify`, of the equation error alone.

        Arguments and refusals are those of `identify`; `identified.sd` is 0.

        Examples
        --------
        >>> import numpy as np
        >>> import plantune as pt
        >>> plant = pt.hysteresis.BoucWen(m=2, c=10, k=5e4, alpha=5e4, bg=800, bd=-1100, Ts=1 / 750)
        >>> u = 60 * np.sin(2 * np.pi * (20 + np.arange(1500) / 50) * np.arange(1500) / 750)
        >>> pt.hysteresis.BoucWen.fit_start(u, plant.simulate(u), Ts=1 / 750).m
        2.00
        """
        return cls._fitted(u, y, Ts, nu, "estimate", start_only=True)

    @classmethod
    def _fitted(
        cls, u: ArrayLike, y: ArrayLike, Ts: float, nu: float | None, x0: str, *, start_only: bool
    ) -> BoucWen:
        if x0 not in ("estimate", "rest"):
            raise refusal("U01", f"`x0` is {x0!r}", remedy='pass "estimate" or "rest"')
        model, how, notes, state = _core.bouc_wen_identify(
            column(u, "u"), column(y, "y"), float(Ts), nu, x0 == "rest", start_only
        )
        names = (*_PARAMETERS, *_STATES)
        identified = Identified(**{**how, "tried": ()}, names=names, notes=notes_from_core(notes))
        return cls(**model, x0=state, identified=identified)

    def _Ts(self, Ts: float | None) -> float:
        given = self.Ts if Ts is None else Ts
        if given is None:
            raise refusal("U01", "`Ts` is not given", remedy="pass Ts= in seconds")
        return float(given)

    def __str__(self) -> str:
        lines = ["m y'' + c y' + k y + z = u", "z' = alpha y' - |z|^nu (bg |y'| sgn z + bd y')"]
        sd = self.identified.sd if self.identified else [0.0] * len(_PARAMETERS)
        for name, own in zip(_PARAMETERS, sd, strict=False):
            spread = f" ± {own:.2g}" if own > 0 else ""
            lines.append(f"{name:5} = {getattr(self, name):.6g}{spread}")
        return "\n".join(lines)
