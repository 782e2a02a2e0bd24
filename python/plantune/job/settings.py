"""The process model on all rows, as wide as its judge says, and the rules tuned on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from plantune import _core
from plantune.estimate import Fit, process
from plantune.estimate.candidates import again
from plantune.estimate.fit import flat, widened
from plantune.job.outcome import Run
from plantune.notes import Limits, notes_from_core
from plantune.tune import Tuning, imc_pi, imc_pid, optimal
from plantune.tune import compare as compare_rules
from plantune.tune.compare import DEFAULT_RULES, HIGHER_ORDER
from plantune.validate.trust import noise_holds

# Largest sensitivity of the optimum, on 95 % of the models that the record leaves open.
_MS = 1.6


def process_for_settings(run: Run, limits: Limits, *, refit: bool, closed_loop: bool) -> Fit:
    """Fit the process model to all rows, and widen it by what the judge says."""
    name = run.process or "P1D"
    fit = process(run.record, name, limits=limits) if refit else run.fits[name]
    rival, judge, feedback = run.rival, None, None
    if rival is not None:
        judge = (rival, run.verdicts[rival], run.fits[rival].model.nk)
    at = fit.names.index("L")
    delay = (float(fit.theta[at]), float(fit.sd[at]), run.record.Ts)
    if closed_loop and rival == run.trusted and noise_holds(run.fits[rival], run.verdicts[rival]):
        known = again(run.fits[rival], run.record, limits) if refit else run.fits[rival]
        feedback = ((fit.model, flat(fit)), (known.model, flat(known)))
    factor, found = _core.judge(run.verdicts[name], delay, judge, feedback, limits)
    fit = widened(fit, factor)
    return replace(fit, notes=(*fit.notes, *notes_from_core(found)))


def tuned(run: Run, gain_margin: float, limits: Limits) -> Run:
    """Tune by IMC-PI, which is recommended, and set the other rules beside it."""
    rules: tuple[Callable[..., Tuning], ...]
    if run.process == "P1D":
        rules = (partial(imc_pi, gain_margin=gain_margin), *DEFAULT_RULES[1:])
    else:
        first = partial(_on_two_lags, gain_margin=gain_margin)
        rules = (first, partial(imc_pid, gain_margin=gain_margin, N=10), *HIGHER_ORDER[2:])
    comparison = compare_rules(
        run.chosen,
        (*rules, partial(optimal, Ms=_MS)),
        delay_at_least=run.record.Ts,
        limits=limits,
    )
    return replace(
        run,
        comparison=comparison,
        tunings=tuple(row.tuning for row in comparison.rows),
        responses=tuple(row.set_point for row in comparison.rows),
    )


def _on_two_lags(model: Fit, *, gain_margin: float, **more: Any) -> Tuning:
    """IMC-PI with at least the gain margin asked for on the model itself.

    `Ti` is that of one lag, so the margin goes with `1/Kp`.  A larger one is kept: to spend it
    would cost phase margin, of which two lags leave less.
    """
    found = imc_pi(model, gain_margin=gain_margin, **more)
    if found.margins.gain >= gain_margin:
        return found
    wanted = gain_margin * gain_margin / found.margins.gain
    return replace(imc_pi(model, gain_margin=wanted, **more), rule=found.rule)
