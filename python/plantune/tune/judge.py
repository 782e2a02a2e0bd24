"""What every rule shares: from settings to a `Tuning` with margins, their bands and doubts.

A rule may be computed on a reduced model; margins and bands are always those of the model given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, flat
from plantune.models import PID, ProcessModel, TransferFunction
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
    return _judged(rule, model, plant, PID(**found), tau_c, notes, limits)


def _reduced(served: ProcessModel) -> tuple[Note, ...]:
    """T03 where the rule was computed on less than the model given."""
    return (
        Note(
            code="T03",
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


def as_given(pid: PID, model: Plant | Fit, delay_at_least: float, limits: Limits | None) -> Tuning:
    """Return the tuning that a controller is, whatever rule it came from."""
    limits = limits or DEFAULT_LIMITS
    plant, notes = _plant(model, delay_at_least, limits)
    return _judged(str(pid), model, plant, pid, float("nan"), notes, limits)


def _judged(
    rule: str,
    model: Plant | Fit,
    plant: Plant,
    pid: PID,
    tau_c: float,
    notes: tuple[Note, ...],
    limits: Limits,
) -> Tuning:
    m = margins(plant, pid)
    bands: dict[str, tuple[float, float]] = {}
    if isinstance(model, Fit):
        bands = dict(zip(_BANDS, _core.margin_bands(plant, flat(model), pid), strict=True))
    return Tuning(
        controller=pid,
        rule=rule,
        model=plant,
        margins=m,
        bands=bands,
        tau_c=tau_c,
        notes=(*notes, *_weak(m, bands, limits), *limits.changes()),
        source=model.source if isinstance(model, Fit) else "",
    )


def plant_of(model: Plant | Fit) -> Plant:
    """Return the model, also that of a fit; refuse what is neither lags nor a transfer function."""
    plant = model.model if isinstance(model, Fit) else model
    if not isinstance(plant, Plant):
        raise refusal(
            "U01",
            "a tuning rule needs a process model or a transfer function",
            remedy='estimate.process(rec, "P1D")',
        )
    return plant


def _plant(
    model: Plant | Fit, delay_at_least: float, limits: Limits
) -> tuple[Plant, tuple[Note, ...]]:
    """Return the model that is tuned on."""
    plant = plant_of(model)
    if isinstance(model, Fit) and isinstance(plant, ProcessModel):
        estimates = list(zip(model.theta.tolist(), model.sd.tolist(), strict=True))
        slowest = max(estimates[1 : 1 + len(plant.times)], default=None)
        _core.check_tunable(estimates[0], slowest, model.Ts, limits)
    return _with_delay(plant, delay_at_least)


def _with_delay(plant: Plant, least: float) -> tuple[Plant, tuple[Note, ...]]:
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
        if (low := band[0] if band else own) < limit
    )
