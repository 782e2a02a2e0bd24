"""Butterworth filters over a record: the same on inputs, outputs and reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from plantune import _core
from plantune._core import Butterworth
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.prep.rows import with_doubts
from plantune.record import Record


def lowpass(rec: Record, order: int = 5, w: float = 20.0, limits: Limits | None = None) -> Record:
    """Remove what is faster than `w` from inputs, outputs and reference.

    All pass the same filter, so a model of the record stays a model of what comes out.  Each
    segment starts in equilibrium with its first value; the rows at which the filter still
    remembers more than 1e-6 of an unknown past are marked as outputs that do not count, at most a
    tenth of each segment.  Over outputs that do not count the last one is held, and the rows that
    remember it are marked as well.  `aux` stays as it is: it tells levels, not motion.

    Parameters
    ----------
    rec : Record
        Segments are filtered one by one.
    order : int
        1 to 20.
    w : float
        Cut-off, rad/s.  Source 001 takes twice the plant's fastest corner, `2 / T_min`.
    limits : Limits, optional
        Thresholds F02 and D07.

    Returns
    -------
    Record
        Same rows and `source`; a note F02 where the filter still remembers too much.

    Raises
    ------
    DataError
        The filter remembers holes in the outputs for too long (D07).
    NotIdentifiable
        The cut-off is at or above the Nyquist frequency (M10).
    UsageError
        An argument out of its range (U01).

    Notes
    -----
    Source 001, 3.5.3.  The filter itself, one sample at a time, is `Butterworth`.  An estimator
    with an offset and a noise model needs no filter: a filter with memory always costs rows.

    Examples
    --------
    >>> from plantune.datasets import engine_loop
    >>> rec = lowpass(engine_loop(noise_var=1.5))
    >>> rec.log[-1]
    'low-pass Butterworth of order 5, 20 rad/s, on u, y and r: 119 outputs marked, ...'
    """
    return _filtered(rec, "low", order, w, limits)


def highpass(rec: Record, order: int = 5, w: float = 1.0, limits: Limits | None = None) -> Record:
    """Remove levels and what is slower than `w` from inputs, outputs and reference.

    Everything else is as in `lowpass`.

    Parameters
    ----------
    rec : Record
        Segments are filtered one by one.
    order : int
        1 to 20.
    w : float
        Cut-off, rad/s.  Source 001 takes half the plant's slowest corner, `0.5 / T_max`.
    limits : Limits, optional
        Thresholds F02 and D07.

    Returns
    -------
    Record
        Same rows and `source`; a note F02 where the filter still remembers too much.

    Raises
    ------
    DataError
        The filter remembers holes in the outputs for too long (D07).
    NotIdentifiable
        The cut-off is at or above the Nyquist frequency (M10).
    UsageError
        An argument out of its range (U01).

    Notes
    -----
    It takes away the steady state that tells the gain.  To be rid of a level, estimate an offset.

    Examples
    --------
    >>> from plantune.datasets import engine_loop
    >>> rec = highpass(engine_loop(), order=2)
    >>> float(rec.u[0, 0]), float(rec.y[0, 0])
    (0.0, 0.0)
    """
    return _filtered(rec, "high", order, w, limits)


def bandpass(
    rec: Record,
    order: int = 5,
    w: tuple[float, float] = (1.0, 20.0),
    limits: Limits | None = None,
) -> Record:
    """Keep what lies between two frequencies of inputs, outputs and reference.

    Everything else is as in `lowpass`.

    Parameters
    ----------
    rec : Record
        Segments are filtered one by one.
    order : int
        Of the prototype, 1 to 20; the band-pass has twice as many poles.
    w : pair of float
        Cut-offs, rad/s, ascending.
    limits : Limits, optional
        Thresholds F02 and D07.

    Returns
    -------
    Record
        Same rows and `source`; a note F02 where the filter still remembers too much.

    Raises
    ------
    DataError
        The filter remembers holes in the outputs for too long (D07).
    NotIdentifiable
        A cut-off is at or above the Nyquist frequency (M10).
    UsageError
        An argument out of its range (U01).

    Notes
    -----
    Source 001, (3.7-1) to (3.7-6).  Its memory is that of its lower cut-off: there its step
    response takes 13.6 s to settle.

    Examples
    --------
    >>> from plantune.datasets import engine_loop
    >>> rec = bandpass(engine_loop(t_end=20.0))
    >>> rec.notes[0].code, int(rec.valid.sum())
    ('F02', 900)
    """
    return _filtered(rec, "band", order, w, limits)


def _filtered(rec: Record, band: str, order: int, w: Any, limits: Limits | None) -> Record:
    limits = limits or rec.limits or DEFAULT_LIMITS
    design = Butterworth(band, order, w, rec.Ts)
    out, marks = _core.prefilter(rec, rec.r, design, limits)
    cutoff = "{:g} to {:g}".format(*w) if band == "band" else f"{w:g}"
    said = (
        f"{band}-pass Butterworth of order {order}, {cutoff} rad/s, on "
        f"{'u and y' if rec.r is None else 'u, y and r'}: {marks['count']} outputs marked, "
        f"{marks['left']:.2g} of an unknown start left"
    )
    return replace(
        rec,
        **out,
        log=(*rec.log, said),
        notes=with_doubts(rec, marks["notes"], limits),
    )
