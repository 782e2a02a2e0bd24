"""What a record says against the method of a fit, without being asked."""

from __future__ import annotations

from dataclasses import replace

from plantune import _core
from plantune.estimate.fit import Fit, flat
from plantune.models import PolyModel, ProcessModel, StateSpace, TransferFunction
from plantune.models.convert import c2d
from plantune.notes import Limits, Note, notes_from_core
from plantune.record import Record
from plantune.validate.closed_loop import closed_loop
from plantune.validate.time_varying import ORDER, look, sure


def against(
    rec: Record, fit: Fit, *, white: bool, widening: float, limits: Limits
) -> tuple[Note, ...]:
    """Return X09, M07 and V08 where a record of one output speaks against a linear fit.

    `white` says whether the one-step errors of the fit may be white there, `widening` by how much
    their colour widens standard deviations.
    """
    if isinstance(fit.model, StateSpace):
        return () if fit.method == "PBSID" else _feedback_in_the_past(rec, fit, limits)
    if not isinstance(fit.model, PolyModel | ProcessModel | TransferFunction) or rec.ny != 1:
        return ()
    if rec.irregular:
        return ()  # all three compare with sampled models
    noisy = _core.noisy_regressors(rec, fit.model, flat(fit), limits)
    return (
        *_feedback(rec, fit, white, limits),
        *_change(rec, fit, widening, limits),
        *notes_from_core(noisy),
    )


def _feedback(rec: Record, fit: Fit, white: bool, limits: Limits) -> tuple[Note, ...]:
    """X09 where an input answers the output, and no noise model of the fit takes that up."""
    if has_noise_model(fit) and white:
        return ()
    why = "whose noise model is not true" if has_noise_model(fit) else "which has no noise model"
    more = f": {fit.method}, {why}, is biased where it was fitted on such rows"
    found = closed_loop(rec, direct=0 in _delays(rec, fit), limits=limits).notes
    return tuple(replace(note, text=note.text.partition(";")[0] + more) for note in found)


def _feedback_in_the_past(rec: Record, fit: Fit, limits: Limits) -> tuple[Note, ...]:
    """X09 where an input answers the output: the past that a subspace is found from holds it."""
    found = closed_loop(rec, direct=bool(fit.settings.get("direct")), limits=limits).notes
    more = f": {fit.method} is biased where it was fitted on such rows, pt.estimate.pbsid is not"
    return tuple(replace(note, text=note.text.partition(";")[0] + more) for note in found)


def has_noise_model(fit: Fit) -> bool:
    """Whether the errors of a fit go through more than the identity.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> has_noise_model(pt.estimate.arx(rec, 2, 2, 3)), has_noise_model(pt.estimate.process(rec))
    (True, False)
    """
    model = fit.sampled or fit.model
    return isinstance(model, PolyModel) and len(model.A) + len(model.C) + len(model.D) > 3


def _change(rec: Record, fit: Fit, widening: float, limits: Limits) -> tuple[Note, ...]:
    """M07 where an ARX of the delays of the fit changes; an integrator has no gain to change."""
    if any(plant.integrating for plant in fit.plants):
        return ()
    found = look(rec, _delays(rec, fit), ORDER, limits)
    return sure(found, widening)


def _delays(rec: Record, fit: Fit) -> list[int]:
    """Return the delay of each input in samples; 0 where y jumps with it."""
    model = fit.sampled or fit.model
    model = model if isinstance(model, PolyModel) else c2d(model, rec.Ts)
    return [int(nk) for nk in (model.nk if rec.nu > 1 else [model.nk])]
