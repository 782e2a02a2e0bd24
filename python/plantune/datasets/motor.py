"""A simulated motor that moves the carriage of a printer; its truth is known.

`G(s) = K / ((Tm s + 1)(Te s + 1))`, volts to speed, and with the belt a third lag `Tb`.  Source
000, chapter 3, whose record was not kept: gain and slowest pole are those of its printed models,
1.8 and 0.96; the fast lags are ours.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from plantune import _core
from plantune.datasets.arguments import check_arguments
from plantune.errors import refusal
from plantune.models import PolyModel, ProcessModel, c2d
from plantune.record import Floats, Record


class PrinterMotor(NamedTuple):
    """The truth behind `printer_motor`: gain in (in/s)/V, lags in seconds, step of the encoder.

    Examples
    --------
    >>> PRINTER_MOTOR.K, PRINTER_MOTOR.Tm, PRINTER_MOTOR.Te, PRINTER_MOTOR.Tb
    (1.8, 0.049, 0.002, 0.006)
    """

    K: float
    Tm: float
    Te: float
    Tb: float
    Ts: float
    resolution: float

    def model(self, order: int = 2) -> PolyModel:
        """Return the motor behind a zero-order hold; of order 3 with its belt.

        Examples
        --------
        >>> PRINTER_MOTOR.model().poles().round(3)
        array([0.96 +0.j, 0.368+0.j])
        """
        if order not in (2, 3):
            raise refusal("U01", f"`order` is {order}, must be 2 or 3", remedy="order=2")
        lags = [self.Tm, self.Te, self.Tb][:order]
        return c2d(ProcessModel(K=self.K, T=tuple(lags)), self.Ts)


PRINTER_MOTOR: Final = PrinterMotor(K=1.8, Tm=0.049, Te=0.002, Tb=0.006, Ts=0.002, resolution=0.8)
"""An encoder of 625 counts per inch, read every 2 ms, tells speeds in steps of 0.8 in/s."""

DRIVES: Final = ("step", "prbs", "staircase", "square", "chirp", "trapezoid")
"""Inputs of `printer_motor`."""

_VOLTS: Final = 12.0
_PERIOD: Final = 400
_PRBS_HOLD: Final = 10
_PRBS_BITS: Final = 10


def printer_motor(
    kind: str = "prbs",
    *,
    order: int = 2,
    noise_var: float = 0.0,
    equation_var: float = 0.0,
    resolution: float = PRINTER_MOTOR.resolution,
    seed: int = 0,
    t_end: float = 4.0,
) -> Record:
    """Simulate the motor of a printer's carriage, from rest, at up to 12 V either way.

    Parameters
    ----------
    kind : str
        One of `DRIVES`: "step", up in the first half and down in the second; "prbs", held for
        20 ms; "staircase" of four steps up and four down; "square" of 0.8 s; "chirp" from 1.25 to
        125 Hz; "trapezoid", the run of a carriage to and fro in 0.8 s.
    order : 2 or 3
        Without or with the belt as a third lag.
    noise_var, equation_var : float
        Variance of white noise on the speed that is measured, and on the right side of the
        difference equation `A y = B u + e`, (in/s)^2.
    resolution : float
        Step in which the encoder tells the speed, in/s; 0 for none.
    seed : int
        Of the noise and the "prbs", >= 0.
    t_end : float
        Length of the record, seconds.

    Returns
    -------
    Record
        Input `voltage`, V; output `speed`, in/s; `Ts` 0.002 s.

    Raises
    ------
    UsageError
        An argument out of its range (U01).

    Examples
    --------
    >>> rec = printer_motor("trapezoid", t_end=0.8)
    >>> print(rec)
    Record voltage -> speed: 400 rows, Ts 0.002 s, 1 segment
    >>> print(rec.u.max(), rec.y.max().round(1))
    12.0 21.6
    """
    if kind not in DRIVES:
        raise refusal("U01", f"`kind` is {kind!r}", remedy="choose one of " + ", ".join(DRIVES))
    Ts = PRINTER_MOTOR.Ts
    at_least_zero = {
        "noise_var": noise_var,
        "equation_var": equation_var,
        "resolution": resolution,
        "seed": seed,
    }
    check_arguments(at_least_zero, t_end, 8 * Ts, 1e4)
    N = round(t_end / Ts)
    rng = np.random.default_rng(seed)
    motor = PRINTER_MOTOR.model(order)
    disturbance = PolyModel(A=motor.A, B=[1.0], nk=0, Ts=Ts)
    u = _VOLTS * _drive(kind, N, seed)
    y = motor.simulate(u) + disturbance.simulate(rng.normal(0.0, equation_var**0.5, N))
    y += rng.normal(0.0, noise_var**0.5, N)
    return Record(
        u=u,
        y=resolution * np.round(y / resolution) if resolution else y,
        Ts=Ts,
        u_names=("voltage",),
        y_names=("speed",),
        units={"voltage": "V", "speed": "in/s"},
        log=(
            f"simulated printer motor: {kind}, order {order}, noise variance {noise_var:g}, "
            f"equation noise {equation_var:g}, resolution {resolution:g} in/s, seed {seed}",
        ),
    )


def _drive(kind: str, N: int, seed: int) -> Floats:
    if kind == "prbs":
        return _core.prbs(N, _PRBS_HOLD, _PRBS_BITS, seed)
    if kind == "step":
        # Half a period of rest before it goes up, and another half of the record later down.
        up, down = min(_PERIOD // 2, N // 4), N // 2 + min(_PERIOD // 2, N // 4)
        return np.repeat([0.0, 1.0, 0.0], [up, down - up, N - down])
    return _core.drive(kind, N, _PERIOD)
