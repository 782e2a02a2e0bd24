"""A link to a record: read, and nothing else."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from plantune.adapt import Sample
from plantune.adapt.signals import record_of, signal, starts_of
from plantune.edge.links import Link
from plantune.errors import refusal
from plantune.record import Record


def record(link: Link, N: int | None = None) -> Record:
    """Read a link to its end, or `N` samples, and return them as a record.

    Nothing is written: the controller at work stays as it is.  The record of a run under the
    auto-tuner is `plantune.adapt.collect(run(link, tuner), settings).to_record()`.

    Parameters
    ----------
    link : Link
        A simulated plant, or any other.
    N : int, optional
        Samples to read, >= 1; needed for a link that has no end.

    Returns
    -------
    Record
        `u`, `y`, and `r` and `aux` where they are read at every sample.  A sample without `u` is
        left out; a `y` that is not read does not count.  Gaps are between segments.

    Raises
    ------
    UsageError
        `N` below 1, or a link that is at its end (U01).
    DataError
        `u` is never read, or `y` in too few samples (D07).

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    >>> r = pt.datasets.engine_loop(t_end=10.0).r[:, 0]
    >>> plant = pt.edge.SimulatedPlant(r, pid, K=-5.939, T=0.1491, L=0.1, Ts=0.02, noise_sd=1.0)
    >>> print(record(plant))
    Record u -> y: 500 rows, Ts 0.02 s, 1 segment
    """
    if N is not None and N < 1:
        raise refusal("U01", f"`N` is {N}, must be at least 1", remedy="leave it out to read all")
    samples = list(_read(link, N))
    if not samples:
        text = "`link` is at its end, must have a sample left"
        raise refusal("U01", text, remedy="make it anew, or read it once only")
    names = dict.fromkeys(name for sample in samples for name in sample.aux)
    t, r, u, y = (signal(samples, name) for name in "truy")
    aux = {name: np.array([s.aux.get(name, np.nan) for s in samples]) for name in names}
    return record_of((t, r, u, y), link.Ts, starts_of(t, link.Ts), aux)


def _read(link: Link, N: int | None) -> Iterator[Sample]:
    k = 0
    while k != N and (sample := link.read()) is not None:
        yield sample
        k += 1
