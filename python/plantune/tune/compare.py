"""Tuning rules side by side on one model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import isinf
from typing import Any

from plantune import _core
from plantune.errors import NotIdentifiable, refusal
from plantune.estimate.fit import Fit
from plantune.models import PID
from plantune.notes import Limits, Note, merged, note_of
from plantune.simulate import Response, load_step, step
from plantune.text import number, table
from plantune.tune.amigo import amigo
from plantune.tune.imc_pi import imc_pi
from plantune.tune.imc_pid import imc_pid
from plantune.tune.judge import Plant, as_given, plant_of
from plantune.tune.lambda_ import lambda_
from plantune.tune.refined_ziegler_nichols import refined_ziegler_nichols
from plantune.tune.simc import simc
from plantune.tune.tuning import Tuning
from plantune.tune.tyreus_luyben import tyreus_luyben
from plantune.tune.ziegler_nichols import ziegler_nichols

Rule = Callable[..., Tuning]

DEFAULT_RULES: tuple[Rule, ...] = (
    partial(imc_pi, gain_margin=3),
    simc,
    ziegler_nichols,
    refined_ziegler_nichols,
)

_INTEGRATING: tuple[Rule, ...] = (simc, lambda_, amigo, tyreus_luyben, ziegler_nichols)

HIGHER_ORDER: tuple[Rule, ...] = (
    partial(imc_pi, gain_margin=3),
    partial(imc_pid, gain_margin=3, N=10),
    simc,
    partial(simc, controller="PID"),
    amigo,
)


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One rule of a comparison.

    Attributes
    ----------
    tuning : Tuning
        Settings, margins, bands and doubts.
    set_point, load : Response
        To a unit step of the set point, and of a load at the plant input.

    Examples
    --------
    >>> import plantune as pt
    >>> row = pt.tune.compare(pt.models.ProcessModel(K=5.939, T=0.1491, L=0.1)).rows[0]
    >>> row.tuning.rule, round(row.set_point.indices.overshoot, 2), round(row.load.indices.iae, 2)
    ('IMC-PI, gain_margin = 3', 5.64, 1.13)
    """

    tuning: Tuning
    set_point: Response
    load: Response


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Tuning rules on one model; prints as a table.

    Attributes
    ----------
    model : ProcessModel or TransferFunction
        The model all rules were asked for.
    rows : tuple of Row
        One per rule that serves the model, in the order asked for.
    notes : tuple of Note
        Doubts, with the rule they speak of, and rules that do not serve the model.
    source : str
        Fingerprint of the record behind the model; empty without one.

    Examples
    --------
    >>> import plantune as pt
    >>> both = pt.tune.compare(
    ...     pt.models.ProcessModel(K=-2.0, T=20.0, L=1.0), [pt.tune.simc, pt.models.PID(Kp=-20.0)]
    ... )
    >>> [row.tuning.margins.stable for row in both.rows]
    [True, False]
    >>> print(both.notes[0].text)
    P: Kp = -20: unstable: the loop does not settle on its own model
    """

    model: Plant
    rows: tuple[Row, ...]
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        t_end = float(self.rows[0].set_point.t[-1])
        return "\n".join(
            [
                f"{self.model}; unit steps of set point and load over {t_end:.4g} s",
                *table([_SETTINGS + _MARGINS, *map(_settings, self.rows)]),
                "",
                *table([_STEPS + _EFFORT, *map(_steps, self.rows)]),
                *(f"  {note}" for note in self.notes),
            ]
        )


def compare(
    model: Plant | Fit,
    rules: Sequence[Rule | PID] | None = None,
    *,
    t_end: float | None = None,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Comparison:
    """Tune by several rules, and simulate a step of the set point and of a load.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or Fit
        Of a fit the margins come with bands over its uncertainty.
    rules : sequence of rules and PID, optional
        Each rule is called with the model, `delay_at_least=` and `limits=`; settings of one are
        fixed by `functools.partial(imc_pi, phase_margin=45)`.  A PID is judged as it stands, such
        as the one in use.  By default those that serve the model: on one lag IMC-PI with gain
        margin 3, SIMC, Ziegler-Nichols and refined Ziegler-Nichols; on more IMC-PI and IMC-PID with
        gain margin 3, SIMC as PI and as PID, and AMIGO; on an integrating plant SIMC, lambda,
        AMIGO, Tyreus-Luyben and Ziegler-Nichols.
    t_end : float, optional
        Seconds, the same for all; by default until the load has died out in the slowest loop.
    delay_at_least : float
        Seconds of dead time that the loop has at least; see `imc_pi`.
    limits : Limits, optional
        Thresholds; a margin below `C07` or `C07_phase` leaves a note.

    Returns
    -------
    Comparison
        Unstable and weak loops are in it, with a note each (C07); a rule that does not serve the
        model is a note with the code of its refusal.

    Raises
    ------
    UsageError
        No rule is given (U01).
    NotIdentifiable
        No rule serves the model; with a fit, the sign of its gain is open (X12).

    Notes
    -----
    Source 001, 3.6.8 and tables 3.6-4 to 3.6-9, with true integrals and a load step beside the
    set point: `Ti = T` looks best on set points and drags on loads where `T` is long.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> both = compare(ProcessModel(K=-2.0, T=20.0, L=1.0), [partial(imc_pi, tau_c=1.0), simc])
    >>> for row in both.rows:
    ...     set_point, load = row.set_point.indices, row.load.indices
    ...     print(f"{row.tuning.rule}: {set_point.overshoot:.1f} %, load {load.iae:.1f}")
    IMC-PI, tau_c = 1: 4.1 %, load 4.0
    SIMC, tau_c = L: 17.2 %, load 1.6
    """
    rules = _serving(model) if rules is None else rules
    if not rules:
        raise refusal(
            "U01", "`rules` is empty", remedy="leave it out, or rules=[simc, ziegler_nichols]"
        )
    tunings: list[Tuning] = []
    refused: list[NotIdentifiable] = []
    for rule in rules:
        try:
            tunings.append(_tuned(rule, model, delay_at_least, limits))
        except NotIdentifiable as error:
            refused.append(error)
    if not tunings:
        raise refused[0]
    plant: Any = tunings[0].model
    if t_end is None:
        t_end = max(_core.load_horizon(plant, tuning.controller) for tuning in tunings)
    return Comparison(
        model=plant,
        rows=tuple(
            Row(
                tuning=tuning,
                set_point=step(plant, tuning.controller, t_end),
                load=load_step(plant, tuning.controller, t_end),
            )
            for tuning in tunings
        ),
        notes=(
            *merged([(tuning.rule, tuning.notes) for tuning in tunings]),
            *(note_of(error, "warning", f"left out: {error.text}") for error in refused),
        ),
        source=tunings[0].source,
    )


def _serving(model: Plant | Fit) -> tuple[Rule, ...]:
    plant = plant_of(model)
    if getattr(plant, "is_first_order", False):
        return DEFAULT_RULES
    return _INTEGRATING if isinf(plant.dc_gain()) else HIGHER_ORDER


def _tuned(
    rule: Rule | PID, model: Plant | Fit, delay_at_least: float, limits: Limits | None
) -> Tuning:
    if isinstance(rule, PID):
        return as_given(rule, model, delay_at_least, limits)
    if not callable(rule):
        raise refusal(
            "U01",
            f"`rules` holds a {type(rule).__name__}, must hold rules or PIDs",
            remedy="rules=[simc, ziegler_nichols]",
        )
    return rule(model, delay_at_least=delay_at_least, limits=limits)


# As tables 3.6-4 and 3.6-5 of source 001, the settings beside the margins they give.
_SETTINGS = ("rule", "Kp", "Ti [s]", "Td [s]")
_MARGINS = ("gain [dB]", "at [rad/s]", "phase [deg]", "at [rad/s]", "Ms")
_STEPS = ("rule", "settling [s]", "overshoot [%]", "ISE", "IAE", "ITAE", "u overshoot [%]")
_EFFORT = ("u energy", "load IAE")


def _settings(row: Row) -> list[str]:
    pid, m = row.tuning.controller, row.tuning.margins
    margins = [m.gain_db, m.w_gain, m.phase_deg, m.w_phase, m.Ms]
    shown = [number(x) for x in margins] if m.stable else ["unstable", *4 * "–"]
    return [row.tuning.rule, number(pid.Kp), number(pid.Ti), number(pid.Td), *shown]


def _steps(row: Row) -> list[str]:
    i, load = row.set_point.indices, row.load.indices
    step = [i.settling, i.overshoot, i.ise, i.iae, i.itae, i.control_overshoot, i.control_energy]
    return [row.tuning.rule, *map(number, step), number(load.iae)]
