"""Margins and sensitivities of a loop, with the exact delay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.record import Floats

Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Margins:
    """How far a loop is from instability; infinite where it never crosses.

    Attributes
    ----------
    stable : bool
        Whether the closed loop is stable; if it is not, the rest says nothing.
    gain, gain_db, w_gain : float
        Gain margin as a factor and in decibels, phase crossover in rad/s.  Of several the one
        nearest to 1; a factor below 1 says how far the gain may fall.
    phase_deg, w_phase : float
        Phase margin in degrees, the smallest in size, and its gain crossover in rad/s.
    delay : float
        Delay margin, seconds.
    Ms, Mt : float
        Peaks of the sensitivity and of the complementary sensitivity.
    noise_gain : float
        Peak of `|C/(1+L)|`, how much of the sensor's noise reaches u at most, u/y.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> m = pt.tune.margins(plant, pt.models.PID(Kp=1.0, Ti=5.0))
    >>> round(m.gain, 3), round(m.gain_db, 2), round(m.phase_deg, 1)
    (3.927, 11.88, 67.1)
    """

    stable: bool
    gain: float
    gain_db: float
    w_gain: float
    phase_deg: float
    w_phase: float
    delay: float
    Ms: float
    Mt: float
    noise_gain: float

    def __str__(self) -> str:
        return ("" if self.stable else "unstable: ") + (
            f"gain {self.gain:.3g} ({self.gain_db:.4g} dB) at {self.w_gain:.4g} rad/s, "
            f"phase {self.phase_deg:.4g} deg at {self.w_phase:.4g} rad/s, "
            f"delay {self.delay:.4g} s, Ms {self.Ms:.3g}, Mt {self.Mt:.3g}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivities:
    """Frequency responses of a loop.

    Attributes
    ----------
    w : array (m,)
        Frequencies, rad/s.
    L, S, T, CS : complex array (m,)
        Loop transfer `C G`, sensitivity `1/(1+L)`, complementary sensitivity `L/(1+L)`, and
        `C/(1+L)` from output noise to `-u`.

    Examples
    --------
    >>> import plantune as pt
    >>> plant, pid = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0), pt.models.PID(Kp=1.0, Ti=5.0)
    >>> s = pt.tune.sensitivities(plant, pid, [0.01, 0.1, 1.0])
    >>> abs(s.S).round(3)
    array([0.025, 0.248, 1.433])
    """

    w: Floats
    L: Complex
    S: Complex
    T: Complex
    CS: Complex


def margins(model: LinearModel, pid: PID) -> Margins:
    """Return gain, phase and delay margins, Ms and Mt, with the exact delay.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or PolyModel
        The plant; its first input is the controller's output.
    pid : PID
        A sampled one meets the exact pulse transfer function.

    Returns
    -------
    Margins
        Of several crossings the nearest to -1.

    Notes
    -----
    Source 001, (3.6-27) to (3.6-30).  Stability by the
    argument principle.

    Examples
    --------
    >>> from plantune.models import PID, ProcessModel
    >>> print(margins(ProcessModel(K=5.939, T=0.1491, L=0.1), PID(Kp=0.131451, Ti=0.1491)))
    gain 3 (9.542 dB) at 15.71 rad/s, phase 60 deg at 5.236 rad/s, delay 0.2 s, Ms 1.63, Mt 1.01
    """
    return Margins(**_core.margins(model, pid))


def sensitivities(
    model: LinearModel, pid: PID, w: ArrayLike, *, delay: str = "exact"
) -> Sensitivities:
    """Return the frequency responses of the loop.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or PolyModel
        The plant; its first input is the controller's output.
    pid : PID
        A sampled one meets the exact pulse transfer function.
    w : array (m,)
        Frequencies, rad/s.
    delay : "exact", "pade" or "taylor"
        The dead time as it is, or by the forms of source 001, (3.4-3) and (3.4-5).

    Returns
    -------
    Sensitivities

    Examples
    --------
    >>> from plantune.models import PID, ProcessModel
    >>> s = sensitivities(ProcessModel(K=1.0, T=1.0, L=0.0), PID(Kp=1.0, Ti=1.0), [1.0])
    >>> s.S + s.T
    array([1.+0.j])
    """
    w = np.ascontiguousarray(np.atleast_1d(w), float)
    return Sensitivities(w, *_core.sensitivities(model, pid, w, delay))
