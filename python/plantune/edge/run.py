"""An auto-tuner at a link: read, decide, write."""

from __future__ import annotations

from collections.abc import Iterator

from plantune.adapt import AutoTuner, Decision, Sample
from plantune.edge.links import Link


def run(link: Link, tuner: AutoTuner) -> Iterator[tuple[Sample, Decision]]:
    """Read sample by sample until the link ends, decide, and write settings that are new.

    The link keeps the time, and its flags say what is written.

    Parameters
    ----------
    link : Link
        A plant, a record, or both behind flags.
    tuner : AutoTuner
        Its `Ts` is the link's.

    Yields
    ------
    pair of Sample and Decision

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    >>> rec = pt.datasets.engine_loop(t_end=3.0)
    >>> plant = pt.edge.SimulatedPlant(rec.r[:, 0], pid, K=-5.939, T=0.1491, L=0.1, Ts=0.02)
    >>> tuner = pt.adapt.AutoTuner(pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid))
    >>> decisions = [decision for _, decision in run(plant, tuner)]
    >>> decisions[-1].controller == plant.controller, plant.controller == pid
    (True, False)
    """
    while (sample := link.read()) is not None:
        decision = tuner.step(sample)
        if decision.retuned:
            link.write(decision.controller)
        yield sample, decision
