"""What every section of the page asks of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from plantune.models import ProcessModel
from plantune.plot.style import Names

if TYPE_CHECKING:
    from plantune.estimate import Fit
    from plantune.job import Run
    from plantune.validate import Verdict

SECTIONS = {
    "notes": "What to know first",
    "settings": "Controller settings",
    "rules": "Rules compared",
    "model": "Model",
    "figures": "Figures",
    "indices": "Indices of the closed loop",
    "provenance": "Where this comes from",
}


def section(name: str, body: str) -> str:
    """Put the heading above the body of a section."""
    return f'<section id="{name}"><h2>{SECTIONS[name]}</h2>{body}</section>'


def verdict_on_chosen(run: Run) -> Verdict | None:
    """Pick the verdict on the kind of model that is tuned on."""
    return run.verdicts.get(run.chosen.method)


def rule_names(run: Run) -> list[str]:
    """Name each rule as it is read."""
    return [tuning.rule.replace("_", " ") for tuning in run.tunings]


def is_process(fit: Fit) -> bool:
    """Whether a fit is a process model."""
    return isinstance(fit.model, ProcessModel)


def fresh(run: Run) -> bool:
    """Whether the models were judged on rows that they were not fitted on."""
    return not any(note.code == "M11" for v in run.verdicts.values() for note in v.notes)


def where(run: Run) -> str:
    """Name the rows on which the models were judged."""
    return "fresh rows" if fresh(run) else "the rows it was fitted on"


def units(run: Run) -> dict[str, str]:
    """Return the units of the parameters of a process model and of the offset."""
    names = Names(run.record)
    time = names.time_unit
    return {"K": names.gain_unit, "T": time, "L": time, "offset": names.y_unit or "y"}
