"""A tuning as JSON, and back."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isclose, isfinite, nan
from os import PathLike
from typing import Any

from plantune.errors import PlantuneError, refusal
from plantune.io import load_json, model_of, write_json
from plantune.io.table import short
from plantune.models import PID
from plantune.notes import Note, Where
from plantune.tune.margins import margins
from plantune.tune.tuning import Tuning


def save_tuning(path: str | PathLike[str], tuning: Tuning) -> None:
    """Write a tuning; `load_tuning` reads it back.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from plantune.models import ProcessModel
    >>> from plantune.tune import simc
    >>> with TemporaryDirectory() as folder:
    ...     save_tuning(f"{folder}/tuning.json", simc(ProcessModel(K=2.0, T=5.0, L=1.0)))
    ...     print(load_tuning(f"{folder}/tuning.json").controller)
    PI: Kp = 1.25, Ti = 5 s
    """
    write_json(path, tuning)


def load_tuning(path: str | PathLike[str]) -> Tuning:
    """Read a tuning that `save_tuning` or `plantune tune` wrote.

    Raises
    ------
    DataError
        Not JSON, not a tuning of this version, or one whose margins are not those of its
        settings (D02); too large (D01).
    UsageError
        There is no such file, or a number in it is out of its range (U01).

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from plantune.io import write_json
    >>> with TemporaryDirectory() as folder:
    ...     write_json(f"{folder}/tuning.json", {"rule": "by hand"})
    ...     load_tuning(f"{folder}/tuning.json")
    Traceback (most recent call last):
    plantune.errors.DataError: D02: no tuning: 'controller' is missing
    count 1
    do: give a file that save_tuning or plantune tune wrote
    """
    return tuning_of(load_json(path))


def tuning_of(values: Any) -> Tuning:
    """Return the tuning whose fields these are; its margins are computed again.

    Raises
    ------
    DataError
        Not a tuning of this version, or one whose margins are not those of its settings (D02).

    Examples
    --------
    >>> from plantune.io import to_json
    >>> from plantune.models import ProcessModel
    >>> from plantune.tune import simc
    >>> print(tuning_of(to_json(simc(ProcessModel(K=2.0, T=5.0, L=1.0)))).rule)
    SIMC, tau_c = L
    """
    try:
        controller, model = model_of(values["controller"]), model_of(values["model"])
        if not isinstance(controller, PID) or isinstance(model, PID):
            raise TypeError("`controller` must be of kind 'pid', and `model` a plant")
        tuning = Tuning(
            controller=controller,
            rule=_text(values["rule"]),
            model=model,
            margins=margins(model, controller),
            bands={str(name): _band(band) for name, band in values["bands"].items()},
            tau_c=_number(values["tau_c"], nan),
            cost=_number(values.get("cost"), nan),
            notes=tuple(_note(note) for note in values["notes"]),
            source=_text(values["source"]),
        )
        same = all(_agrees(tuning, values["margins"], name) for name in ("gain", "Ms", "Mt"))
    except PlantuneError:
        raise
    except KeyError as error:
        raise _no_tuning(f"no tuning: {error} is missing") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise _no_tuning(f"no tuning: {error}") from None
    if not same:
        raise _no_tuning("the margins in this file are not those of its settings")
    return tuning


def _agrees(tuning: Tuning, said: Mapping[str, Any], name: str) -> bool:
    """Whether a margin is the one that the file states; null stands for what is not finite."""
    own: float = getattr(tuning.margins, name)
    return (
        said[name] is None if not isfinite(own) else isclose(own, _number(said[name]), rel_tol=1e-3)
    )


def _number(value: Any, null: float = nan) -> float:
    if value is None:
        return null
    if isinstance(value, bool | str):
        raise TypeError(f"{short(str(value))} is no number")
    return float(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{short(str(value))} is no text")
    return value


def _band(ends: Any) -> tuple[float, float]:
    low, high = ends
    return _number(low, -inf), _number(high, inf)


def _note(fields: Any) -> Note:
    where = fields.get("where")
    return Note(**{**fields, "where": Where(**where) if where else None})


def _no_tuning(text: str) -> PlantuneError:
    remedy = "give a file that save_tuning or plantune tune wrote"
    return refusal("D02", text, count=1, remedy=remedy)
