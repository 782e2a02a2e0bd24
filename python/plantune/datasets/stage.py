"""A simulated piezo stage: an asymmetric loop with drift and creep, read in steps; truth known.

`y = h + a max(h - h_a, 0)^2 + drift + creep`, `h` a stack of plays of the voltage.  Source 002,
2.4, whose record was not kept: 0 to 100 V, about 60 um, 14 bit over 20 V at 100 um/V.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from plantune.datasets.arguments import check_arguments
from plantune.errors import refusal
from plantune.models import ProcessModel
from plantune.models.hysteresis import PlayStack
from plantune.record import Floats, Record


class PiezoStage(NamedTuple):
    """The truth behind `piezo_stage`: plays in V, bend in 1/um from 20 um on, times in seconds.

    Examples
    --------
    >>> round(1000 * PIEZO_STAGE.digit, 2)
    122.07
    """

    plays: PlayStack
    bend: float
    bends_at: float
    creep: float
    creep_T: float
    digit: float

    def loop(self, x: Floats) -> Floats:
        """Return the position for a voltage `x` (N,), without drift and creep, in um.

        Examples
        --------
        >>> PIEZO_STAGE.loop(np.array([0.0, 100.0])).round(1)
        array([ 0., 60.])
        """
        stage = self.plays.stream()
        stage.run(np.array([100.0, 0.0]))  # it has been up before
        h = stage.run(x)
        return h + self.bend * np.maximum(h - self.bends_at, 0.0) ** 2


_STACK: Final = PlayStack(
    r=np.linspace(0.0, 45.0, 10),
    w=np.array([0.42, 0.05, 0.04, 0.04, 0.03, 0.03, 0.02, 0.02, 0.01, 0.01]),
    offset=-4.75,  # what they keep at 0 V once they have been at 100 V
)

PIEZO_STAGE: Final = PiezoStage(
    plays=_STACK,
    bend=2.5 / 37.5**2,
    bends_at=20.0,
    creep=0.01,
    creep_T=0.5,
    digit=100 * 20 / 2**14,
)
"""14 bit over +-10 V at 100 um/V are 122.07 nm a digit (the text prints 120.5)."""


def piezo_stage(
    cycles: int = 2,
    *,
    drift: float = 0.6,
    noise_sd: float = 0.0,
    digit: float = PIEZO_STAGE.digit,
    rows: int = 2000,
    seed: int = 0,
) -> Record:
    """Simulate a piezo stage under 50 + 50 sin(w t) V, from the lowest voltage on.

    Parameters
    ----------
    cycles : int
        How many, 1 to 1000.
    drift : float
        Of the position, um a cycle.
    noise_sd : float
        Standard deviation of white noise on the position, um.
    digit : float
        Step in which the position is read, um; 0 for none.
    rows : int
        Samples a cycle of 1 s, 20 to 1e6.
    seed : int
        Of the noise, >= 0.

    Returns
    -------
    Record
        Input `voltage`, V; output `position`, um; the first and the last row at 0 V.

    Raises
    ------
    UsageError
        An argument out of its range (U01).

    Notes
    -----
    The position creeps after the loop by a hundredth of it, with a time constant of half a second:
    the second cycle lies above the first one by drift and creep.

    Examples
    --------
    >>> rec = piezo_stage(cycles=2)
    >>> print(rec)
    Record voltage -> position: 4001 rows, Ts 0.0005 s, 1 segment
    >>> print(rec.u.max(), rec.y.max().round(0))
    100.0 61.0
    """
    if not 1 <= cycles <= 1000 or not 20 <= rows <= 1_000_000:
        raise refusal(
            "U01",
            f"`cycles` is {cycles}, `rows` {rows}; 1 to 1000 and 20 to 1000000 are simulated",
            remedy="cycles=2, rows=2000",
        )
    check_arguments({"noise_sd": noise_sd, "digit": digit, "seed": seed}, cycles, 1, 1000)
    t = np.arange(cycles * rows + 1) / rows
    x = 50 - 50 * np.cos(2 * np.pi * t)
    loop = PIEZO_STAGE.loop(x)
    creep = ProcessModel(K=PIEZO_STAGE.creep, T=PIEZO_STAGE.creep_T).simulate(loop, 1 / rows)
    y = loop + drift * t + creep + np.random.default_rng(seed).normal(0.0, noise_sd, len(t))
    return Record(
        u=x,
        y=digit * np.round(y / digit) if digit else y,
        Ts=1 / rows,
        u_names=("voltage",),
        y_names=("position",),
        units={"voltage": "V", "position": "um"},
        log=(
            f"simulated piezo stage: {cycles} cycles, drift {drift:g} um a cycle, noise "
            f"{noise_sd:g} um, digit {digit:.5g} um, seed {seed}",
        ),
    )
