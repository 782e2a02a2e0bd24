"""From plant data to a validated model to a tuned loop, with an uncertainty behind every number.

::

    rec = pt.read("heater.csv", u="power", y="temp", Ts=0.08)
    run = pt.job.run(rec)

`inspect` lists what is wrong with a file before that.
Stages, in the order of the work: `prep analyze estimate validate tune simulate`; `job` runs them
all, `report` and `plot` show the result, `export` takes it to a controller, `recursive` learns
sample by sample, `hysteresis` models what remembers, `edge` links to plants, `datasets` brings
records to try.  Stages load when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plantune import adapt as adapt
    from plantune import analyze as analyze
    from plantune import datasets as datasets
    from plantune import edge as edge
    from plantune import estimate as estimate
    from plantune import export as export
    from plantune import hysteresis as hysteresis
    from plantune import job as job
    from plantune import models as models
    from plantune import plot as plot
    from plantune import prep as prep
    from plantune import recursive as recursive
    from plantune import report as report
    from plantune import signals as signals
    from plantune import simulate as simulate
    from plantune import tune as tune
    from plantune import validate as validate
    from plantune.errors import DataError as DataError
    from plantune.errors import NotIdentifiable as NotIdentifiable
    from plantune.errors import NumericsError as NumericsError
    from plantune.errors import PlantuneError as PlantuneError
    from plantune.errors import RunError as RunError
    from plantune.errors import UsageError as UsageError
    from plantune.estimate import Fit as Fit
    from plantune.inspection import inspect as inspect
    from plantune.io import read as read
    from plantune.notes import Limits as Limits
    from plantune.notes import Note as Note
    from plantune.record import Record as Record
    from plantune.simulate import Response as Response
    from plantune.tune import Tuning as Tuning
    from plantune.validate import Verdict as Verdict

# Where each public name lives; a name that maps to None is a stage.
_HOME: dict[str, str | None] = {
    "Record": "record",
    "read": "io",
    "inspect": "inspection",
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
    "adapt": None,
    "analyze": None,
    "estimate": None,
    "recursive": None,
    "hysteresis": None,
    "validate": None,
    "tune": None,
    "simulate": None,
    "job": None,
    "edge": None,
    "export": None,
    "plot": None,
    "report": None,
    "signals": None,
}

__all__ = [*_HOME, "__version__"]


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
