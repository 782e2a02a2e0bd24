"""From plant data to a validated model to a tuned loop, with an uncertainty behind every number.

::

    rec = pt.read("heater.csv", u="power", y="temp", Ts=0.08)
    run = pt.job.run(rec)

Stages, in the order of the work: `prep analyze estimate validate tune simulate`; `job` runs them
all, `report` and `plot` show the result, `datasets` brings records to try.  Stages load when first
used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plantune import (
        analyze,
        datasets,
        estimate,
        job,
        models,
        plot,
        prep,
        report,
        simulate,
        tune,
        validate,
    )
    from plantune.errors import (
        DataError,
        NotIdentifiable,
        NumericsError,
        PlantuneError,
        RunError,
        UsageError,
    )
    from plantune.estimate import Fit
    from plantune.io import read
    from plantune.notes import Limits, Note
    from plantune.record import Record
    from plantune.simulate import Response
    from plantune.tune import Tuning
    from plantune.validate import Verdict

# Where each public name lives; a name that maps to None is a stage.
_HOME: dict[str, str | None] = {
    "Record": "record",
    "read": "io",
    "Limits": "notes",
    "Note": "notes",
    "Fit": "estimate",
    "Verdict": "validate",
    "Tuning": "tune",
    "Response": "simulate",
    "DataError": "errors",
    "NotIdentifiable": "errors",
    "NumericsError": "errors",
    "PlantuneError": "errors",
    "RunError": "errors",
    "UsageError": "errors",
    "models": None,
    "datasets": None,
    "prep": None,
    "analyze": None,
    "estimate": None,
    "validate": None,
    "tune": None,
    "simulate": None,
    "job": None,
    "plot": None,
    "report": None,
}

__all__ = [*_HOME, "__version__"]  # noqa: PLE0604 - strings, spelled once above


def __getattr__(name: str) -> Any:
    if name == "__version__":
        value: Any = import_module("plantune._core").__version__
    elif name not in _HOME:
        raise AttributeError(f"module 'plantune' has no attribute {name!r}")
    else:
        home = _HOME[name]
        module = import_module(f"plantune.{home or name}")
        value = getattr(module, name) if home else module
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
