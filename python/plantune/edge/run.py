"""An auto-tuner at a link: read, decide, write."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from plantune.adapt import AutoTuner, Decision, Sample
from plantune.edge.flags import PARAMETERS
from plantune.edge.links import Link
from plantune.edge.links.link import same_settings
from plantune.errors import refusal


def run(link: Link, tuner: AutoTuner) -> Iterator[tuple[Sample, Decision]]:
    """Read sample by sample until the link ends, decide, and write settings that are new.

    New are those that were tuned, and those that a gain schedule gives where the plant has gone.
    The link keeps the time, and its flags say what is written.  Where the link reads its settings,
    those are taken to be at work: in shadow every change is judged from them.

    Parameters
    ----------
    link : Link
        A plant, a record, or both behind flags.
    tuner : AutoTuner
        Its `Ts` is the link's.

    Yields
    ------
    pair of Sample and Decision

    Raises
    ------
    UsageError
        The link writes a part of what the tuner may write (U01).

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
    _check(link, tuner)
    decided = tuner.settings.controller
    while (sample := link.read()) is not None:
        read = link.controller
        decision = tuner.step(replace(sample, controller=read))
        if not same_settings(decision.controller, decided if read is None else read):
            link.write(decision.controller)
        decided = decision.controller
        yield sample, decision


def _check(link: Link, tuner: AutoTuner) -> None:
    """Refuse a link that would write a part of the settings that are judged together."""
    wanted, able = set(tuner.settings.write), link.capabilities.write & set(PARAMETERS)
    if able and not wanted <= able:
        raise refusal(
            "U01",
            f"the link writes {' '.join(sorted(able))} only, and the tuner would write "
            f"{' '.join(sorted(wanted))}: a loop that nobody judged",
            remedy=f"Settings(write={sorted(able)})",
        )
