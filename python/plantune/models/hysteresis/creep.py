"""Plays and the creep behind them, and the charge of a piezo actuator with its leak."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models.hysteresis.base import HysteresisModel, Identified, column, frozen
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Creeping(HysteresisModel):
    """Fields of `Creep` and of its inverse."""

    kind: ClassVar[str] = ""

    r: Floats
    w: Floats
    tau: Floats
    c: Floats
    Ts: float
    offset: float = 0.0
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in ("r", "w", "tau"):
            object.__setattr__(self, name, frozen(getattr(self, name), name))
        for name in ("Ts", "offset"):
            object.__setattr__(self, name, float(getattr(self, name)))
        shape = (len(self.tau), len(self.r))
        c = np.array(self.c, float)
        if c.size != shape[0] * shape[1]:
            text = f"`c` has shape {c.shape}, must have {shape}"
            raise refusal("U01", text, remedy="pass a row per `tau` and a column per `r`")
        c = c.reshape(shape)
        c.flags.writeable = False
        object.__setattr__(self, "c", c)
        _core.hysteresis_check(self)


@dataclass(frozen=True, slots=True, eq=False)
class Creep(_Creeping):
    """`y = offset + sum w_i z_i + sum c_ki s_ki`, `tau_k s_ki' = z_i - s_ki`, over plays `z_i`.

    Parameters
    ----------
    r : array (n,)
        Half widths of the plays, ascending from 0 on, in units of the input.
    w : array (n,)
        What follows at once, y/x.
    tau : array (K,)
        Time constants of the creep, seconds.
    c : array (K, n)
        What follows slowly, y/x: after a step of `z_i` another `c_ki (1 - e^(-t/tau_k))`.
    Ts : float
        Sample time, seconds.
    offset : float
        Added to the sum, in units of y.

    Raises
    ------
    UsageError
        Half widths that do not ascend, a `tau` or `Ts` that is not positive (U01).

    Notes
    -----
    The input holds over a sample, and the update is exact.  The virgin state is rest at 0.
    Kuhnen and Janocha, 1998; source 002, 3.2 explains the creep by a leak: `ChargeLeak`.

    Examples
    --------
    >>> import plantune as pt
    >>> creep = pt.hysteresis.Creep(r=[0, 1], w=[1, 1], tau=[2.0], c=[[0.5, 0.0]], Ts=1.0)
    >>> y = creep.simulate([2.0, 2.0, 2.0, 0.0])
    >>> y.round(4)
    array([3.    , 3.3935, 3.6321, 1.7769])
    >>> creep.inverse().simulate(y).round(12)
    array([2., 2., 2., 0.])
    """

    kind: ClassVar[str] = "creep"

    def inverse(self) -> CreepInverse:  # type: ignore[override]
        """Return the model whose output is this one's input.

        Raises
        ------
        UsageError
            `w[0]` at `r = 0` is not positive: part of the output follows the input late (U01).

        Examples
        --------
        >>> import plantune as pt
        >>> creep = pt.hysteresis.Creep(r=[0], w=[1], tau=[2.0], c=[[0.5]], Ts=1.0)
        >>> creep.inverse().simulate([1.0, 1.0, 1.0]).round(4)
        array([1.    , 0.8033, 0.7226])
        """
        return CreepInverse(**_core.hysteresis_inverse(self))

    @staticmethod
    def identify(
        x: ArrayLike,
        y: ArrayLike,
        Ts: float,
        *,
        n: int = 10,
        r: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        offset: bool = True,
    ) -> Creep:
        """Fit plays and the creep of each in one convex fit, weights >= 0.

        Parameters
        ----------
        x, y : array (N,)
            Input and output of a record that begins at rest at 0.
        Ts : float
            Sample time, seconds.
        n : int
            Number of plays, evenly spaced up to the largest `|x|`.
        r : array, optional
            Their half widths instead.
        tau : array, optional
            Time constants, seconds.  By default evenly in log t from `4 Ts` to half the record,
            two per decade at most: the number that, fitted on the first half, predicts the second
            half best.
        offset : bool
            Whether the offset is fitted.

        Returns
        -------
        Creep
            `.identified.tried` has the numbers of time constants; 0 is plays without creep.

        Raises
        ------
        NotIdentifiable
            An input of 0 throughout (X01), fewer than 20 rows (X03).
        UsageError
            A wrong argument (U01).

        Examples
        --------
        >>> import numpy as np, plantune as pt
        >>> truth = pt.hysteresis.Creep(r=[0, 0.3], w=[1, 0.5], tau=[3.0], c=[[0.2, 0.1]], Ts=0.1)
        >>> x = np.round(2 * np.sin(np.arange(1000) / 70) * np.cos(np.arange(1000) / 23)) / 2
        >>> model = pt.hysteresis.Creep.identify(x, truth.simulate(x), 0.1)
        >>> model.identified.relative < 5e-3
        True
        """
        fields, how = _core.creep_identify(
            column(x, "x"),
            column(y, "y"),
            Ts,
            max(0, n),
            None if r is None else frozen(r, "r"),
            None if tau is None else frozen(tau, "tau"),
            offset,
        )
        plays, constants = range(len(fields["r"])), range(len(fields["tau"]))
        names = [f"w{i}" for i in plays] + [f"c[{k},{i}]" for k in constants for i in plays]
        return Creep(**fields, identified=Identified(**how, names=(*names, "offset")))


@dataclass(frozen=True, slots=True, eq=False)
class CreepInverse(_Creeping):
    """What finds the input of a `Creep` model, sample by sample; from `Creep.inverse`.

    Attributes
    ----------
    r, w, tau, c, Ts, offset
        Of the model whose inverse it is.

    Examples
    --------
    >>> import plantune as pt
    >>> creep = pt.hysteresis.Creep(r=[0], w=[1], tau=[2.0], c=[[0.5]], Ts=1.0)
    >>> creep.inverse().stream().step(1.0)
    1.0
    """

    kind: ClassVar[str] = "creep_inverse"

    def inverse(self) -> Creep:  # type: ignore[override]
        """Return the model itself."""
        return Creep(**_core.hysteresis_inverse(self))


@dataclass(frozen=True, slots=True, eq=False)
class ChargeLeak(HysteresisModel):
    """`y = G q`, `q' = i - V/X`, `V = q/C`: the charge of a piezo actuator, and its leak.

    Parameters
    ----------
    C : float
        Capacitance, F.
    R : float
        Leak resistance without current, ohm.
    a : float
        How the leak opens: `X(i) = R / sqrt((a i)^2 + 1)`, 1/A; 0 for a resistor.
    G : float
        Output per charge, y/(A s).
    Ts : float
        Sample time, seconds.

    Raises
    ------
    UsageError
        A capacitance, resistance or sample time that is not positive (U01).

    Notes
    -----
    The input is the current in A, held over a sample; the output is that before it has acted.
    The `i` of X is the leak's own current, so that `i = V / sqrt(R^2 - (a V)^2)` and `|V|` stays
    below `R/a`, 618 V with the source's numbers, the defaults.  The step is exact for a resistor,
    and of fourth order in `Ts` otherwise.  Source 002, (5) and (6); the source's numbers cannot be
    checked beyond 5 nA at 103.5 V.

    Examples
    --------
    >>> import plantune as pt
    >>> piezo = pt.hysteresis.ChargeLeak(C=1e-6, G=1.0, Ts=1.0)
    >>> print(f"{piezo.resistance(5e-9):.4g} ohm, {piezo.leak(103.5):.3g} A")
    2.07e+10 ohm, 5e-09 A
    >>> piezo.simulate([1e-6, 0.0, 0.0]) * 1e6
    array([0.        , 0.99997619, 0.99992857])
    """

    kind: ClassVar[str] = "charge_leak"

    C: float
    R: float = 21e9
    a: float = 3.4e7
    G: float = 1.0
    Ts: float = 1.0
    identified: Identified | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name in ("C", "R", "a", "G", "Ts"):
            object.__setattr__(self, name, float(getattr(self, name)))
        _core.hysteresis_check(self)

    def leak(self, V: float) -> float:
        """Return the current in A that leaks at `V`; supplied, it holds the charge.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.hysteresis.ChargeLeak(C=1e-6, R=1e9, a=0.0).leak(100.0)
        1e-07
        """
        return _core.leak_current(self, V)

    def resistance(self, i: float) -> float:
        """Return the resistance of the leak in ohm at the leak current `i` in A.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.hysteresis.ChargeLeak(C=1e-6).resistance(0.0)
        21000000000.0
        """
        return _core.leak_resistance(self, i)

    def inverse(self) -> Any:
        """Refuse: no current moves the charge within its own sample; see `leak`."""
        return _core.hysteresis_inverse(self)
