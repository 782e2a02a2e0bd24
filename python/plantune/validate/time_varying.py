"""Whether the plant changed within a record, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.orders import whole
from plantune.notes import DEFAULT_LIMITS, Limits, Note, Where
from plantune.record import Record
from plantune.text import number

_APART = 3.0

ORDER = 4
"""Order of the ARX that is looked at by default: it leaves white errors of most plants."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeVarying:
    """What the score process shows; true where the plant changed.

    Attributes
    ----------
    statistic, limit : float
        Its maximum, and what chance passes in one record of two hundred.
    row, time : int, float
        Where it lies: original row, seconds.
    apart : float
        Largest difference of a parameter before and after, standard deviations.
    gains : (float, float)
        Static gain of the first input before and after.
    notes : tuple of Note
        M07 where both are beyond their limits.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> bool(pt.validate.time_varying(pt.datasets.engine_loop(noise_var=1.5), nk=6))
    False
    """

    statistic: float
    limit: float
    row: int
    time: float
    apart: float
    gains: tuple[float, float]
    notes: tuple[Note, ...]
    source: str

    def __bool__(self) -> bool:
        return bool(self.notes)

    def __str__(self) -> str:
        word = "the plant changed" if self else "no change seen"
        head = f"{word}: statistic {self.statistic:.1f}, limit {self.limit:.1f}"
        return "\n".join([head, *(f"  {note}" for note in self.notes)])


def time_varying(
    rec: Record,
    *,
    nk: int | Sequence[int] = 1,
    order: int = ORDER,
    limits: Limits | None = None,
) -> TimeVarying:
    """Look for a change of the parameters of an ARX model within the record (M07).

    Parameters
    ----------
    rec : Record
        One output.
    nk : int, or one per input
        Delay in samples, such as that of `analyze.delay`.
    order : int
        `na = nb`, high enough to leave white errors.
    limits : Limits, optional
        Thresholds of the record.

    Returns
    -------
    TimeVarying
        With the time of the change.

    Raises
    ------
    NotIdentifiable
        Ten percent of the rows are too few for the parameters, or the input is too poor (X03).

    Notes
    -----
    The score process needs one fit; its limit was simulated.  The two sides must then differ by
    three standard deviations.  Nyblom 1989; Andrews 1993.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> rng = np.random.default_rng(1)
    >>> u, y = np.sign(rng.normal(size=1000)), np.zeros(1000)
    >>> for k in range(1, 1000):
    ...     y[k] = 0.8 * y[k - 1] + (0.5 if k < 600 else 1.0) * u[k - 1] + 0.1 * rng.normal()
    >>> found = time_varying(pt.Record(u=u, y=y, Ts=0.1))
    >>> bool(found), abs(found.row - 600) < 10
    (True, True)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    delays = [whole("nk", nk)] * rec.nu if isinstance(nk, int) else [whole("nk", k) for k in nk]
    if whole("order", order) < 1 or len(delays) != rec.nu or rec.ny != 1:
        raise refusal(
            "U01", "`order` must be at least 1, `nk` one per input, of one output", remedy="order=4"
        )
    found = look(rec, delays, order, limits)
    if found is None:
        raise refusal(
            "X03",
            f"a tenth of {rec.N} rows is too few for a change of order {order}, or u too poor",
            count=rec.N,
            remedy="record longer, or look at a lower order",
        )
    return found


def look(rec: Record, nk: list[int], order: int, limits: Limits) -> TimeVarying | None:
    """Return what `time_varying` does; None where the rows are too few."""
    d = _core.time_varying(rec, nk, order, limits)
    if d is None:
        return None
    time = float(rec.time[d["row"]])
    row = int(rec.rows[d["row"]])
    changed = d["statistic"] > d["limit"] and d["apart"] > _APART
    note = Note(
        code="M07",
        severity="warning",
        text=f"the plant changed at about {number(time)} s: parameters before and after differ by "
        f"{d['apart']:.1f} sd, gain {number(d['gains'][0])} and {number(d['gains'][1])}",
        where=Where(rec.y_names[0], row, time),
        measured=d["statistic"],
        limit=d["limit"],
        remedy="fit both parts alone: between(start, stop)",
    )
    return TimeVarying(
        **{**d, "row": row}, time=time, notes=(note,) if changed else (), source=rec.source
    )


def sure(found: TimeVarying | None, widening: float) -> tuple[Note, ...]:
    """Return M07 where its statistic is beyond what colour of the errors makes of chance.

    Colour widens deviations by `widening`, and a change makes errors coloured itself: so the limit
    grows with it, not with its square.
    """
    return found.notes if found is not None and found.statistic > found.limit * widening else ()
