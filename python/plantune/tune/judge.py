"""What every rule shares: from settings to a `Tuning` with margins, their bands and doubts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, flat
from plantune.models import PID, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.tune.margins import Margins, margins
from plantune.tune.tuning import Tuning

_BANDS = ("gain", "phase_deg", "delay", "Ms", "Mt")


def tuned(
    rule: str,
    model: ProcessModel | Fit,
    settings: Callable[[ProcessModel], dict[str, Any]],
    delay_at_least: float,
    limits: Limits | None,
    made_for: Callable[[ProcessModel, float], tuple[Note, ...]] = lambda plant, tau_c: (),
) -> Tuning:
    """Return the tuning of a rule, `settings(plant)` being its `Kp Ti Td Tf tau_c`.

    `made_for(plant, tau_c)` says where the rule is used outside of its range; see `outside`.
    """
    limits = limits or DEFAULT_LIMITS
    plant, notes = _plant(model, delay_at_least, limits)
    found = settings(plant)
    tau_c = found.pop("tau_c")
    notes = (*notes, *made_for(plant, tau_c))
    return _judged(rule, model, plant, PID(**found), tau_c, notes, limits)


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
    pid: PID, model: ProcessModel | Fit, delay_at_least: float, limits: Limits | None
) -> Tuning:
    """Return the tuning that a controller is, whatever rule it came from."""
    limits = limits or DEFAULT_LIMITS
    plant, notes = _plant(model, delay_at_least, limits)
    return _judged(str(pid), model, plant, pid, float("nan"), notes, limits)


def _judged(
    rule: str,
    model: ProcessModel | Fit,
    plant: ProcessModel,
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


def _plant(
    model: ProcessModel | Fit, delay_at_least: float, limits: Limits
) -> tuple[ProcessModel, tuple[Note, ...]]:
    """Return the process model that is tuned on."""
    plant = model.model if isinstance(model, Fit) else model
    if not isinstance(plant, ProcessModel):
        raise refusal(
            "U01", "a tuning rule needs a process model", remedy='estimate.process(rec, "P1D")'
        )
    if isinstance(model, Fit):
        K, T = zip(model.theta[:2].tolist(), model.sd[:2].tolist(), strict=True)
        _core.check_tunable(K, T, model.Ts, limits)
    return _with_delay(plant, delay_at_least)


def _with_delay(plant: ProcessModel, least: float) -> tuple[ProcessModel, tuple[Note, ...]]:
    if plant.L >= least:
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
