"""A record, played row by row as if the plant were running."""

from __future__ import annotations

from plantune.adapt import Sample
from plantune.edge.links.link import Capabilities, asked_for, unwritable
from plantune.errors import refusal
from plantune.models import PID
from plantune.record import Record


class RecordedPlant:
    """A record of one input and one output, row by row.

    Parameters
    ----------
    rec : Record
        One input, one output; its reference and further signals are played too.  Times are the
        record's own, so that gaps show; an output that does not count is not read.
    controller : PID, optional
        Settings that were at work, if they are known.
    shadow : bool
        Whether writes are counted, in `written`, instead of refused.

    Attributes
    ----------
    written : list of (float, PID)
        Time and settings of each write.
    Ts, capabilities, controller : float, Capabilities, PID or None
        As every `Link` has them; the controller stays what it was.

    Raises
    ------
    UsageError
        Several inputs or outputs (U01).
    RunError
        A write (C09), unless in shadow; a record never takes r or u.

    Examples
    --------
    >>> import plantune as pt
    >>> link = RecordedPlant(pt.Record(u=[1, 1], y=[0.0, 0.5], Ts=0.1), shadow=True)
    >>> link.read()
    Sample(t=0.0, r=None, u=1.0, y=0.0, aux={}, controller=None)
    >>> link.write(pt.models.PID(Kp=2.0, Ti=1.0))
    >>> len(link.written), link.read().y, link.read()
    (1, 0.5, None)
    """

    def __init__(self, rec: Record, controller: PID | None = None, *, shadow: bool = False) -> None:
        if rec.nu != 1 or rec.ny != 1:
            raise refusal(
                "U01",
                f"the record has {rec.nu} inputs and {rec.ny} outputs, must have one of each",
                remedy="read it again with one u and one y",
            )
        self.Ts = rec.Ts
        self.controller = controller
        self.written: list[tuple[float, PID]] = []
        self._rec = rec
        self._time = rec.time
        self._row = 0
        self._shadow = shadow

    @property
    def capabilities(self) -> Capabilities:
        """What the record holds can be read, and settings written in shadow."""
        read = {"u", "y"} | ({"r"} if self._rec.r is not None else set())
        read |= {"aux"} if self._rec.aux else set()
        settings = {"Kp", "Ti", "Td"}
        read |= settings if self.controller is not None else set()
        return Capabilities(frozenset(read), frozenset(settings if self._shadow else set()))

    def read(self) -> Sample | None:
        """Return the next row; None at the end."""
        rec, k = self._rec, self._row
        if k == rec.N:
            return None
        self._row = k + 1
        return Sample(
            t=float(self._time[k]),
            r=None if rec.r is None else float(rec.r[k, 0]),
            u=float(rec.u[k, 0]),
            y=float(rec.y[k, 0]) if rec.valid[k, 0] else None,
            aux={name: float(x[k]) for name, x in rec.aux.items()},
        )

    def write(
        self, controller: PID | None = None, *, r: float | None = None, u: float | None = None
    ) -> None:
        """Count settings, in shadow; refuse everything else."""
        if unknown := asked_for(controller, r, u) - self.capabilities.write:
            raise unwritable(unknown, "a record")
        if controller is not None:
            self.written.append((float(self._time[max(self._row - 1, 0)]), controller))
