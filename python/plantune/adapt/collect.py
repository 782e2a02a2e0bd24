"""The log of a tuner that was stepped from outside."""

from __future__ import annotations

from collections.abc import Iterable
from math import nan

import numpy as np

from plantune.adapt.decision import Decision, Sample
from plantune.adapt.log import AdaptLog
from plantune.adapt.settings import Settings
from plantune.adapt.signals import signal, starts_of
from plantune.errors import refusal
from plantune.models import PID, ProcessModel


def collect(
    steps: Iterable[tuple[Sample, Decision]], settings: Settings, source: str = ""
) -> AdaptLog:
    """Return decisions, sample by sample, as the log that `replay` returns of a record.

    Parameters
    ----------
    steps : iterable of (Sample, Decision)
        Such as `plantune.edge.run` yields them.
    settings : Settings
        Of the tuner.
    source : str
        Fingerprint of the record, if there is one.

    Returns
    -------
    AdaptLog

    Raises
    ------
    UsageError
        No step at all (U01).

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    >>> settings = pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid)
    >>> link = pt.edge.RecordedPlant(pt.datasets.engine_loop(t_end=2.0), shadow=True)
    >>> log = collect(pt.edge.run(link, pt.adapt.AutoTuner(settings)), settings)
    >>> len(log.t), bool(log.accepted.any())
    (100, True)
    """
    pairs = list(steps)
    if not pairs:
        raise refusal("U01", "`steps` is empty, must hold a sample", remedy="read the link first")
    samples, decisions = zip(*pairs, strict=True)

    def flag(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        return np.array([getattr(d, name) for d in decisions], bool)

    t = signal(samples, "t")
    model = np.array([_parameters(d.model) for d in decisions])
    controller = np.array([_gains(d.controller) for d in decisions])
    return AdaptLog(
        t=t,
        r=signal(samples, "r"),
        u=np.array([d.u for d in decisions], float),
        y=np.array([d.y for d in decisions], float),
        K=model[:, 0],
        T=model[:, 1],
        L=model[:, 2],
        offset=np.array([d.offset for d in decisions]),
        sd=np.array([d.sd for d in decisions]),
        delays=np.array([list(d.delay_posterior.values()) for d in decisions], float),
        nk=np.array(list(decisions[0].delay_posterior), np.int64),
        merged=np.array([_parameters(d.merged) for d in decisions]),
        Kp=controller[:, 0],
        Ki=controller[:, 1],
        target=np.array([_gains(d.target) for d in decisions]),
        operating_point=[d.operating_point for d in decisions],
        time_to_target=np.array([d.time_to_target for d in decisions]),
        accepted=flag("accepted"),
        fitted=flag("fitted"),
        retuned=flag("retuned"),
        new_point=flag("new_point"),
        alarm=flag("alarm"),
        changed=flag("changed"),
        reasons=[(k, d.reasons) for k, d in enumerate(decisions) if d.reasons],
        settings=settings,
        source=source,
        starts=starts_of(t, settings.Ts),
    )


def _parameters(model: ProcessModel | None) -> tuple[float, float, float]:
    if model is None:
        return nan, nan, nan
    (T,) = np.atleast_1d(model.T)
    return model.K, float(T), model.L


def _gains(pid: PID | None) -> tuple[float, float]:
    return (nan, nan) if pid is None else (pid.Kp, pid.Ki)
