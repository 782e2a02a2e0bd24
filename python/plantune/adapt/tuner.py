"""The auto-tuner, one sample at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import nan
from typing import Any, NoReturn

import numpy as np

from plantune import _core
from plantune.adapt.decision import Decision, Sample
from plantune.adapt.settings import Settings
from plantune.models import PID, ProcessModel
from plantune.notes import notes_from_core
from plantune.simulate import Table


class AutoTuner:
    """Identifies, tunes and gates while the plant runs: a sample goes in, a decision comes out.

    It knows no clock and no link: `plantune.edge` brings the samples and writes what is decided.
    `copy.copy` and `copy.deepcopy` give a tuner that has seen the same and goes on by itself.
    Pickles are refused: keep the samples, and step a new tuner over them.

    Parameters
    ----------
    settings : Settings

    Raises
    ------
    UsageError
        A setting out of its range (U01).

    Notes
    -----
    Source 001, 3.7 and figures 3.7-1 to 3.7-5.  The plant is fitted to the last rows by maximum
    likelihood, offset and delay with it; prediction errors raise alarms, which are judged to be
    another level or another plant; new settings pass a gate.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(t_end=2.0)
    >>> tuner = AutoTuner(Settings(Ts=0.02, nk=(3, 11), controller=PID(Kp=-0.018, Ti=0.0532)))
    >>> for k in range(len(rec.u)):
    ...     sample = Sample(0.02 * k, rec.r[k, 0], rec.u[k, 0], rec.y[k, 0])
    ...     decision = tuner.step(sample)
    >>> print(decision.model)
    G(s) = -5.939 e^(-0.1 s) / (0.1491 s + 1)
    >>> round(decision.target.Kp, 4), decision.controller.Kp
    (-0.1315, -0.036)
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self._core = _core.AutoTuner(settings)

    def step(self, sample: Sample) -> Decision:
        """Take a sample and decide.

        Parameters
        ----------
        sample : Sample
            `u` is the value applied from `t` on, `y` is read at `t`.  A `controller` that is not
            the one decided last is at work all the same: changes start from it, and are judged so.

        Returns
        -------
        Decision
        """
        aux = [float(sample.aux.get(name, nan)) for name in self.settings.signals]
        r, u, y = (nan if x is None else x for x in (sample.r, sample.u, sample.y))
        return decision(self._core.step(sample.t, r, u, y, aux, sample.controller), self.settings)

    def __copy__(self) -> AutoTuner:
        other = object.__new__(type(self))
        other.settings, other._core = self.settings, self._core.copy()
        return other

    def __deepcopy__(self, memo: dict[int, Any]) -> AutoTuner:
        return self.__copy__()  # settings are frozen

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "an AutoTuner is not pickled: pickle its `settings` and the samples that it has seen; "
            "a new one that is stepped over these decides the same to the last bit"
        )

    @property
    def tables(self) -> tuple[Table, Table] | None:
        """Tables of `Kp` and `Ki` as they are now; None without a gain schedule."""
        if (found := self._core.tables()) is None:
            return None
        axes, Kp, Ki = found
        shape = [len(axis) for axis in axes]
        points = tuple(np.array(axis) for axis in axes)
        first, second = (Table(points, np.reshape(values, shape)) for values in (Kp, Ki))
        return first, second


def decision(d: Mapping[str, Any], settings: Settings) -> Decision:
    """Make a Decision of what the core sends."""
    Ms, gain_margin, phase_deg = d["over"] or (nan, nan, nan)
    return Decision(
        t=d["t"],
        u=d["u"],
        y=d["y"],
        accepted=d["accepted"],
        fitted=d["fitted"],
        model=plant(d["model"]),
        offset=d["offset"],
        sd=np.array(d["sd"]),
        delay_posterior={settings.nk[0] + i: p for i, p in enumerate(d["delays"])},
        merged=plant(d["merged"]),
        target=pid(d["target"], settings),
        controller=pid(d["controller"], settings) or settings.controller,
        retuned=d["retuned"],
        operating_point=None if d["node"] is None else tuple(d["node"]),
        new_point=d["new_point"],
        alarm=d["alarm"],
        changed=d["changed"],
        time_to_target=d["time_to_target"],
        Ms=Ms,
        gain_margin=gain_margin,
        phase_deg=phase_deg,
        reasons=notes_from_core(d["reasons"]),
    )


def plant(found: tuple[float, float, float] | None) -> ProcessModel | None:
    """Return K, T, L as a model."""
    return None if found is None else ProcessModel(*found)


def pid(
    found: tuple[float, float, float, float, float | None] | None, settings: Settings
) -> PID | None:
    """Return Kp, Ti, Td, Tf and a pure Ki in the form of the first controller."""
    if found is None:
        return None
    Kp, Ti, Td, Tf, pure_Ki = found
    Ts = settings.controller.Ts or settings.Ts
    return replace(settings.controller, Kp=Kp, Ti=Ti, Td=Td, Tf=Tf, Ts=Ts, pure_Ki=pure_Ki)
