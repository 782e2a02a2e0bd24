"""Test inputs for experiments: binary sequences, multisines, chirps, staircases.

All but a staircase lie between -1 and 1: scale and shift them, `50 + 5 * prbs(600, hold=12)`.  The
same arguments give the same signal; a seed picks another one.  `plantune.analyze.experiment`
chooses among them by what each would tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.record import Floats

__all__ = ["chirp", "crest_factor", "gbn", "multisine", "prbs", "staircase"]


def prbs(N: int, hold: int = 1, *, bits: int | None = None, seed: int = 0) -> Floats:
    """Return a pseudo-random binary sequence of -1 and +1.

    Parameters
    ----------
    N : int
        Rows.
    hold : int
        Rows for which each value is held, the clock; 1.1 to 1.6 time constants serve a first
        order best.
    bits : int, optional
        Bits of the shift register, 3 to 20; it repeats after `2^bits - 1` values.  By default as
        few as give no repetition.
    seed : int
        Where in the sequence it begins.

    Returns
    -------
    array (N,)

    Raises
    ------
    UsageError
        A clock of no rows, or bits out of range (U01).

    Notes
    -----
    Over a period M the autocorrelation is 1 at lag 0 and -1/M elsewhere.  Golomb, Shift Register
    Sequences, 1967.

    Examples
    --------
    >>> prbs(8, hold=2)
    array([ 1.,  1., -1., -1.,  1.,  1.,  1.,  1.])
    >>> float(prbs(127, bits=7).sum())
    1.0
    """
    _check_whole(N=N, hold=hold, seed=seed)
    return _core.prbs(N, hold, _core.register_bits(N, hold) if bits is None else bits, seed)


def gbn(N: int, hold: float, *, least: int = 1, seed: int = 0) -> Floats:
    """Return generalised binary noise of -1 and +1.

    Parameters
    ----------
    N : int
        Rows.
    hold : float
        Mean number of rows between changes, above `least`.
    least : int
        Rows for which each value stays at least, the clock.
    seed : int
        Other numbers give other sequences.

    Returns
    -------
    array (N,)

    Raises
    ------
    UsageError
        A mean time that is not above the least (U01).

    Notes
    -----
    At each tick of the clock it changes with probability p = least/hold, so that over l ticks its
    correlation is (1 - 2 p)^l.  Tulleken, Automatica 26, 1990.

    Examples
    --------
    >>> u = gbn(10_000, hold=20, least=5, seed=1)
    >>> changes = int((u[1:] != u[:-1]).sum())
    >>> 460 < changes < 540
    True
    """
    _check_whole(N=N, least=least, seed=seed)
    return _core.gbn(N, hold, least, seed)


def multisine(
    N: int,
    Ts: float,
    band: tuple[float, float],
    *,
    period: int | None = None,
    phases: Literal["schroeder", "random"] = "schroeder",
    seed: int = 0,
) -> Floats:
    """Return a sum of cosines of equal amplitude, with a peak of 1.

    Parameters
    ----------
    N : int
        Rows.
    Ts : float
        Sample time, seconds.
    band : (low, high)
        Frequencies, rad/s; every line of the period within it is there, the mean and the Nyquist
        frequency are not.
    period : int, optional
        Rows of a period, by default N.
    phases : "schroeder" or "random"
        Schroeder's keep the peak low: a crest factor of about 1.7 against 3 to 4.
    seed : int
        Of random phases.

    Returns
    -------
    array (N,)

    Raises
    ------
    UsageError
        A band that holds no line or passes the Nyquist frequency (U01).

    Notes
    -----
    The phase of the j-th of F lines is -pi j (j - 1)/F.  Schroeder, IEEE Trans. Inf. Theory 16,
    1970.

    Examples
    --------
    >>> u = multisine(512, Ts=1.0, band=(0.0, 1.0))
    >>> print(f"{crest_factor(u):.2f}")
    1.72
    >>> lines = np.flatnonzero(np.abs(np.fft.rfft(u)) > 1e-6)
    >>> int(lines[0]), int(lines[-1])
    (1, 81)
    """
    period = N if period is None else period
    _check_whole(N=N, period=period, seed=seed)
    if phases not in ("schroeder", "random"):
        raise refusal(
            "U01",
            f"`phases` is {phases!r}, must be 'schroeder' or 'random'",
            remedy="phases='schroeder'",
        )
    return _core.multisine(N, period, band, Ts, seed if phases == "random" else None)


def chirp(
    N: int,
    Ts: float,
    band: tuple[float, float],
    *,
    sweep: Literal["linear", "logarithmic"] = "logarithmic",
) -> Floats:
    """Return a sine between -1 and 1 whose frequency sweeps over a band.

    Parameters
    ----------
    N : int
        Rows.
    Ts : float
        Sample time, seconds.
    band : (first, last)
        Frequencies at the beginning and at the end, rad/s.
    sweep : "logarithmic" or "linear"
        The same time for each decade, or for each rad/s.

    Returns
    -------
    array (N,)

    Raises
    ------
    UsageError
        Frequencies that are not positive or pass the Nyquist frequency (U01).

    Examples
    --------
    >>> chirp(6, Ts=1.0, band=(0.5, 2.0), sweep="linear").round(3)
    array([ 0.   ,  0.585,  0.997,  0.494, -0.757, -0.612])
    """
    _check_whole(N=N)
    if sweep not in ("linear", "logarithmic"):
        raise refusal(
            "U01",
            f"`sweep` is {sweep!r}, must be 'linear' or 'logarithmic'",
            remedy="sweep='logarithmic'",
        )
    return _core.chirp(N, Ts, band, sweep == "logarithmic")


def staircase(levels: Sequence[float], hold: int) -> Floats:
    """Return each level, held for some rows.

    Parameters
    ----------
    levels : sequence of float
        In turn.
    hold : int
        Rows for each.

    Returns
    -------
    array (len(levels) * hold,)

    Examples
    --------
    >>> staircase([0.0, 1.0, -1.0], hold=2)
    array([ 0.,  0.,  1.,  1., -1., -1.])
    """
    _check_whole(hold=hold)
    return _core.staircase([float(level) for level in levels], hold)


def crest_factor(u: ArrayLike) -> float:
    """Return max|u| / rms(u) about zero: how much peak it takes to bring some power.

    Parameters
    ----------
    u : array (N,)
        A signal about zero.

    Returns
    -------
    float
        1 of a binary signal, 1.41 of a sine.

    Examples
    --------
    >>> crest_factor(prbs(100, hold=3))
    1.0
    """
    return _core.crest_factor(np.ravel(np.asarray(u, float)))


def _check_whole(**given: object) -> None:
    """Refuse counts that are not whole numbers, zero or more (U01)."""
    for name, value in given.items():
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
            raise refusal(
                "U01",
                f"`{name}` is {value!r}, must be a whole number, zero or more",
                where=(name, None, None),
                remedy=f"{name}=1",
            )
