"""What an auto-tuner decided along a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plantune.adapt.settings import Settings
from plantune.adapt.signals import record_of, starts_of
from plantune.notes import Note, notes_from_core
from plantune.record import Floats, Record
from plantune.text import counted

Flags = NDArray[np.bool_]

ESTIMATES = ("K", "T", "L", "offset")
GAINS = ("Kp", "Ki")
EVENTS = ("accepted", "retuned", "alarm", "changed")
"""Columns that a log gives to a record; the first are not known before the first estimate."""


@dataclass(frozen=True, slots=True, eq=False)
class AdaptLog:
    """Decisions of every sample as columns.

    Attributes
    ----------
    t, r, u, y : array (N,)
        The samples, read or simulated; seconds, and the units of the record.
    K, T, L, offset : array (N,)
        The last estimate, NaN before the first.
    sd : array (N, 4)
        Standard deviations of `K`, `T`, `L` and the offset.
    delays : array (N, delays)
        Probability of each delay of `nk`.
    nk : array (delays,)
        The delays, samples.
    merged : array (N, 3)
        `K`, `T`, `L` from which the settings follow, NaN before the first acceptance.
    Kp, Ki : array (N,)
        Settings at work from that sample on.
    target : array (N, 2)
        `Kp` and `Ki` that the rule asks for.
    operating_point : list of tuple or None
        Break points of each sample.
    time_to_target : array (N,)
        Expected seconds until K and T are as sure as aimed at.
    accepted, fitted, retuned, new_point, alarm, changed : array (N,) of bool
        What happened at a sample; see `Decision`.
    reasons : list of (int, tuple of Note)
        Rows at which something was not done, and why.
    settings : Settings
        What the tuner was asked for.
    source : str
        Fingerprint of the record; empty where there is none.
    starts : array
        First sample of each stretch without a gap.

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    >>> settings = pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid)
    >>> print(pt.adapt.replay(pt.datasets.engine_loop(noise_var=1.5, seed=3), settings))
    AdaptLog: 3000 samples, 290 estimates accepted, first at 2.18 s; 5 retunings, no alarm
      K = -5.9403 (0.011), T = 0.14873 (0.0015) s, L = 0.1 (0.0012) s
      Kp = -0.13141, Ki = -0.88216
    """

    t: Floats
    r: Floats
    u: Floats
    y: Floats
    K: Floats
    T: Floats
    L: Floats
    offset: Floats
    sd: Floats
    delays: Floats
    nk: NDArray[np.int64]
    merged: Floats
    Kp: Floats
    Ki: Floats
    target: Floats
    operating_point: list[tuple[int, ...] | None]
    time_to_target: Floats
    accepted: Flags
    fitted: Flags
    retuned: Flags
    new_point: Flags
    alarm: Flags
    changed: Flags
    reasons: list[tuple[int, tuple[Note, ...]]]
    settings: Settings
    source: str
    starts: NDArray[np.int64]

    def to_record(self, estimates: bool = False) -> Record:
        """Return the log as a record, with the settings and events as further signals.

        Parameters
        ----------
        estimates : bool
            Whether `K`, `T`, `L` and the offset are further signals as well.  Samples that have
            none, such as those before the first estimate, are then left out.

        Returns
        -------
        Record
            `u`, `y`, `r`, and `aux` with `Kp Ki accepted retuned alarm changed`.  What is not
            known is left out: rows without `u`, an `r` that is not known in every row; a `y` that
            is not known does not count.  Gaps are between segments.

        Raises
        ------
        DataError
            No sample has `u`, or an estimate that is asked for, or too few have `y` (D07).

        Examples
        --------
        >>> import plantune as pt
        >>> rec = pt.datasets.engine_loop(t_end=2.0)
        >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
        >>> log = pt.adapt.replay(rec, pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid))
        >>> log.to_record().N, sorted(log.to_record().aux)[:2]
        (100, ['Ki', 'Kp'])
        >>> known = log.to_record(estimates=True)
        >>> known.N, known.t0, round(float(known.aux["K"][-1]), 3)
        (81, 0.38, -5.939)
        """
        found = {name: getattr(self, name) for name in ESTIMATES} if estimates else {}
        told = {name: getattr(self, name).astype(float) for name in (*GAINS, *EVENTS)}
        signals = (self.t, self.r, self.u, self.y)
        needed = list(found.values())
        return record_of(signals, self.settings.Ts, self.starts, {**found, **told}, needed)

    def __str__(self) -> str:
        accepted, retuned = np.flatnonzero(self.accepted), np.flatnonzero(self.retuned)
        first = f"first at {self.t[accepted[0]]:.4g} s" if len(accepted) else "none"
        lines = [
            f"AdaptLog: {len(self.t)} samples, {len(accepted)} estimates accepted, {first}; "
            f"{counted(len(retuned), 'retuning')}, {counted(int(self.alarm.sum()), 'alarm')}",
        ]
        if len(accepted):
            k = accepted[-1]
            sd = self.sd[k]
            lines.append(
                f"  K = {self.K[k]:.5g} ({sd[0]:.2g}), T = {self.T[k]:.5g} ({sd[1]:.2g}) s, "
                f"L = {self.L[k]:.5g} ({sd[2]:.2g}) s"
            )
            lines.append(f"  Kp = {self.Kp[-1]:.5g}, Ki = {self.Ki[-1]:.5g}")
        return "\n".join(lines)


def log_of(d: Mapping[str, Any], r: Floats, rec: Record, settings: Settings) -> AdaptLog:
    """Make a log of what the core sends of a record."""
    t = rec.time
    model, controller = d["model"], d["controller"]
    names = ("accepted", "fitted", "retuned", "new_point", "alarm", "changed")
    flags = {name: d["flags"][:, i] for i, name in enumerate(names)}
    return AdaptLog(
        t=t,
        r=r,
        u=d["u"],
        y=d["y"],
        K=model[:, 0],
        T=model[:, 1],
        L=model[:, 2],
        offset=d["offset"],
        sd=d["sd"],
        delays=d["delays"],
        nk=np.arange(settings.nk[0], settings.nk[1] + 1),
        merged=d["merged"],
        Kp=controller[:, 0],
        Ki=controller[:, 1],
        target=d["target"],
        operating_point=[None if node is None else tuple(node) for node in d["node"]],
        time_to_target=d["time_to_target"],
        reasons=[(row, notes_from_core(notes)) for row, notes in d["reasons"]],
        settings=settings,
        source=rec.source,
        starts=np.union1d(rec.starts, starts_of(t, settings.Ts)),
        **flags,
    )
