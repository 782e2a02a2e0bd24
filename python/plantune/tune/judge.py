"""What every rule shares: from settings to a `Tuning` with margins, their bands and doubts.

A rule may be computed on a reduced model; margins and bands are always those of the model given.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import nan
from typing import Any

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit
from plantune.models import PID, PolyModel, ProcessModel, TransferFunction
from plantune.models.base import LinearModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.tune.margins import Margins, margins
from plantune.tune.tuning import Tuning

Plant = ProcessModel | TransferFunction

_BANDS = ("gain", "phase_deg", "delay", "Ms", "Mt")


def tuned(
    rule: str,
    model: Plant | Fit,
    settings: Callable[[Plant], dict[str, Any]],
    delay_at_least: float,
    limits: Limits | None,
    made_for: Callable[[ProcessModel, float], tuple[Note, ...]] = lambda plant, tau_c: (),
) -> Tuning:
    """Return the tuning of a rule, `settings(plant)` being its `Kp Ti Td Tf tau_c plant reduced`.

    `made_for(plant, tau_c)` says where the rule is used outside of its range; see `outside`.  Its
    plant is what the rule was computed on, which may be reduced.
    """
    limits = limits or DEFAULT_LIMITS
    plant, notes = _plant(model, delay_at_least, limits)
    found = settings(plant)
    tau_c, served, reduced = (found.pop(name) for name in ("tau_c", "plant", "reduced"))
    if served is not None:
        served = ProcessModel(**served)
        notes = (*notes, *(_reduced(served) if reduced else ()), *made_for(served, tau_c))
    return judged(rule, model, plant, PID(**found), tau_c=tau_c, notes=notes, limits=limits)


def _reduced(served: ProcessModel) -> tuple[Note, ...]:
    """T05 where the rule was computed on less than the model given."""
    return (
        Note(
            code="T05",
            severity="info",
            text=f"settings are those for {served}, by the half rule",
            remedy="judge them by the margins, which are of the model given",
        ),
    )


def outside(name: str, value: float, low: float, high: float) -> tuple[Note, ...]:
    """T02 where a rule is used outside of the range that its source made it for."""
    if low <= value <= high:
        return ()
    return (
        Note(
            code="T02",
            severity="warning",
            text=f"{name} is {value:.3g}; the rule was made for {low:.3g} to {high:.3g}",
            measured=value,
            limit=low if value < low else high,
            remedy="judge it by its margins, or take simc or simc_plus, which have no such range",
        ),
    )


def as_given(
    pid: PID, model: LinearModel | Fit, delay_at_least: float, limits: Limits | None
) -> Tuning:
    """Return the tuning that a controller is, whatever rule it came from."""
    limits = limits or DEFAULT_LIMITS
    if isinstance(model, PolyModel):
        return judged(str(pid), model, model, pid, limits=limits)
    plant, notes = _plant(model, delay_at_least, limits)
    return judged(str(pid), model, plant, pid, notes=notes, limits=limits)


def judged(
    rule: str,
    model: LinearModel | Fit | Sequence[Fit],
    plant: LinearModel,
    pid: PID,
    *,
    tau_c: float = nan,
    cost: float = nan,
    notes: tuple[Note, ...] = (),
    limits: Limits | None = None,
) -> Tuning:
    """Return settings with their margins on `plant`, and the bands of these over the fits."""
    limits = limits or DEFAULT_LIMITS
    m = margins(plant, pid)
    fits = [] if isinstance(model, LinearModel) else [model] if isinstance(model, Fit) else model
    drawn_from = [fit.drawn_from for fit in fits]
    if len(fits) == 1:
        drawn_from = [(plant, *drawn_from[0][1:])]  # with the dead time that the rule counted
    bands = dict(zip(_BANDS, _core.margin_bands(drawn_from, pid), strict=True)) if fits else {}
    return Tuning(
        controller=pid,
        rule=rule,
        model=plant,
        margins=m,
        bands=bands,
        tau_c=tau_c,
        cost=cost,
        notes=(*notes, *_weak(m, bands, limits), *limits.changes()),
        source=fits[0].source if fits else "",
    )


def plant_of(model: LinearModel | Fit) -> Plant:
    """Return the model, also that of a fit; refuse what is neither lags nor a transfer function."""
    plant = model.model if isinstance(model, Fit) else model
    if not isinstance(plant, Plant):
        raise refusal(
            "U01",
            "a tuning rule needs a process model or a transfer function",
            remedy='estimate.process(rec, "P1D")',
        )
    return plant


def check_fit(fit: Fit, limits: Limits) -> None:
    """Refuse a process model of open sign (X12), or sampled too slowly (M09)."""
    if isinstance(fit.model, ProcessModel):
        estimates = list(zip(fit.theta.tolist(), fit.sd.tolist(), strict=True))
        slowest = max(estimates[1 : 1 + len(fit.model.times)], default=None)
        _core.check_tunable(estimates[0], slowest, fit.Ts, limits)


def _plant(
    model: LinearModel | Fit, delay_at_least: float, limits: Limits
) -> tuple[Plant, tuple[Note, ...]]:
    """Return the model that is tuned on."""
    plant = plant_of(model)
    if isinstance(model, Fit):
        check_fit(model, limits)
    return with_delay(plant, delay_at_least)


def with_delay(plant: Plant, least: float) -> tuple[Plant, tuple[Note, ...]]:
    """Return the plant with at least so much dead time, and T01 where that changes it."""
    if not 0 <= plant.L < least:  # the core refuses a dead time below zero
        return plant, ()
    note = Note(
        code="T01",
        severity="warning",
        text=f"the model's dead time, {plant.L:.4g} s, counts as {least:.4g} s",
        measured=plant.L,
        limit=least,
        remedy="sample faster to resolve the dead time, or give tau_c",
    )
    return replace(plant, L=least), (note,)


def _weak(m: Margins, bands: dict[str, tuple[float, float]], limits: Limits) -> tuple[Note, ...]:
    """C07 where the loop is unstable, or leaves too little margin on some model it may meet."""
    if not m.stable:
        return (
            Note(
                code="C07",
                severity="warning",
                text="unstable: the loop does not settle on its own model",
                remedy="do not apply; take less gain, and the sign of the process gain",
            ),
        )
    least = (
        ("gain margin", "", m.gain, bands.get("gain"), limits.C07),
        ("phase margin", " deg", m.phase_deg, bands.get("phase_deg"), limits.C07_phase),
    )
    return tuple(
        Note(
            code="C07",
            severity="warning",
            text=f"weak margins: the {word} {'may be as low as' if band else 'is'} {low:.3g}{unit}",
            measured=low,
            limit=limit,
            remedy="do not apply unattended; ask for more margin"
            + (", or record longer or larger steps" if band else ""),
        )
        for word, unit, own, band, limit in least
        if (low := band[0] if band else own) < limit and not 0 < low <= 1 / limit
    )
