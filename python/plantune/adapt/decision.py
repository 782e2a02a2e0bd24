"""What the auto-tuner takes, and what it makes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from plantune.models import PID, ProcessModel
from plantune.notes import Note
from plantune.record import Floats


@dataclass(frozen=True, slots=True)
class Sample:
    """The signals of one sample; None where a signal is not read.

    Parameters
    ----------
    t : float
        Time, seconds.
    r, u, y : float or None
        Set point, input applied from `t` on, output read at `t`.
    aux : mapping of name to float
        Further signals, such as those that tell the operating point.
    controller : PID or None
        Settings at work, where they are read; None takes those that were decided last.

    Examples
    --------
    >>> Sample(0.02, r=400.0, u=30.9, y=399.7).aux
    {}
    """

    t: float
    r: float | None = None
    u: float | None = None
    y: float | None = None
    aux: Mapping[str, float] = field(default_factory=dict)
    controller: PID | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """What the auto-tuner makes of a sample.

    Attributes
    ----------
    t : float
        Time of the sample, seconds.
    u, y : float
        Input from `t` on and output at `t`, read or simulated; NaN where neither.
    accepted : bool
        Whether an estimate was taken at this sample.
    fitted : bool
        Whether `model` is new.
    model : ProcessModel or None
        The last estimate, accepted or not; None before the first.
    offset : float
        `O` in `y = G u + O`; NaN without a model.
    sd : array (4,)
        Standard deviations of `K`, `T`, `L` and the offset; NaN without a model.
    delay_posterior : mapping
        Probability of each delay `nk` in samples, `L = (nk - 1) Ts` rounded.
    merged : ProcessModel or None
        Accepted estimates merged, from which the settings follow.
    target : PID or None
        What the tuning rule asks for.
    controller : PID
        What is to be at work from now on.
    retuned : bool
        Whether `controller` is new.
    operating_point : tuple of int, or None
        The break point of each signal; None between all of them, or without break points.
    new_point : bool
        Whether the operating point begins here.
    alarm : bool
        Whether the prediction errors are too large: another level, or another plant.
    changed : bool
        Whether it was another plant: what was learnt before is forgotten.
    time_to_target : float
        Expected seconds until K and T are as sure as aimed at; 0 once they are.
    Ms, gain_margin, phase_deg : float
        95 % quantile of Ms, 5 % quantiles of the margins over the plants that are possible, of the
        settings judged at this sample; NaN where none were.
    reasons : tuple of Note
        Why the estimate was not taken, or the settings not changed, or not all the way.

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=0.2, Ti=1.0)
    >>> tuner = pt.adapt.AutoTuner(pt.adapt.Settings(Ts=0.1, nk=(1, 5), controller=pid))
    >>> decision = tuner.step(Sample(0.0, r=1.0, u=0.5, y=0.0))
    >>> decision.model is None, decision.controller.Kp
    (True, 0.2)
    """

    t: float
    u: float
    y: float
    accepted: bool
    fitted: bool
    model: ProcessModel | None
    offset: float
    sd: Floats
    delay_posterior: Mapping[int, float]
    merged: ProcessModel | None
    target: PID | None
    controller: PID
    retuned: bool
    operating_point: tuple[int, ...] | None
    new_point: bool
    alarm: bool
    changed: bool
    time_to_target: float
    Ms: float
    gain_margin: float
    phase_deg: float
    reasons: tuple[Note, ...]
