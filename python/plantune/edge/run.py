"""An auto-tuner at a link: read, decide, write."""

from __future__ import annotations

from collections.abc import Iterator

from plantune.adapt import AutoTuner, Decision, Sample
from plantune.edge.links import Link
from plantune.models import PID


def run(link: Link, tuner: AutoTuner) -> Iterator[tuple[Sample, Decision]]:
    """Read sample by sample until the link ends, decide, and write settings that are new.

    New are those that were tuned, and those that a gain schedule gives where the plant has gone.
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
    at_work = _settings(tuner.settings.controller)
    while (sample := link.read()) is not None:
        decision = tuner.step(sample)
        wanted = _settings(decision.controller)
        if wanted != at_work:
            link.write(decision.controller)
            at_work = wanted
        yield sample, decision


def _settings(pid: PID) -> tuple[float, ...]:
    return pid.Kp, pid.Ki, pid.Td
