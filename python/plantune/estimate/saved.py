"""Fits as JSON files, there and back."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy as np

from plantune.errors import refusal
from plantune.estimate.fit import Fit, OffsetStep
from plantune.io import load_json, to_json, write_json
from plantune.io.jsonfile import model_of
from plantune.notes import Note, Where

_KIND = "fit"


def save_fit(path: str | PathLike[str], fit: Fit) -> None:
    """Write a fit with its model, covariance and notes; `load_fit` reads it back.

    Parameters
    ----------
    path : path
        JSON file; it is there whole or not at all.
    fit : Fit
        Of any estimator.

    Raises
    ------
    UsageError
        Not a fit, or a model with a function as regressor, which no file can hold (U01).

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import plantune as pt
    >>> fit = pt.estimate.arx(pt.datasets.hair_dryer(), 2, 2, 3)
    >>> with TemporaryDirectory() as folder:
    ...     save_fit(f"{folder}/fit.json", fit)
    ...     again = load_fit(f"{folder}/fit.json")
    >>> str(again) == str(fit), bool((again.P == fit.P).all())
    (True, True)
    """
    if not isinstance(fit, Fit):
        raise refusal("U01", f"a {type(fit).__name__} is no fit", remedy="pt.io.save_model")
    write_json(path, {"kind": _KIND, **to_json(fit)})


def load_fit(path: str | PathLike[str]) -> Fit:
    """Read a fit that `save_fit` wrote; what was not finite is NaN.

    Raises
    ------
    DataError
        Not JSON, or not a fit of this version (D02); too large (D01).
    UsageError
        There is no such file (U01).

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import plantune as pt
    >>> with TemporaryDirectory() as folder:
    ...     save_fit(f"{folder}/fit.json", pt.estimate.process(pt.datasets.engine_loop()))
    ...     print(load_fit(f"{folder}/fit.json").model)
    G(s) = -5.939 e^(-0.1 s) / (0.1491 s + 1)
    """
    values = load_json(path)
    if not isinstance(values, dict) or values.pop("kind", None) != _KIND:
        raise _no_fit("it holds no fit")
    try:
        return Fit(**{name: _field(name, value) for name, value in values.items()})
    except (TypeError, ValueError, KeyError) as error:
        raise _no_fit(str(error)) from None


def _field(name: str, value: Any) -> Any:
    if name in ("model", "sampled"):
        return None if value is None else model_of(value)
    if name == "plants":
        return tuple(model_of(plant) for plant in value)
    if name == "intervals":
        return {parameter: tuple(ends) for parameter, ends in value.items()}
    if name == "notes":
        return tuple(_note(note) for note in value)
    if name == "steps":
        return tuple(
            OffsetStep(**step) if isinstance(step, dict) else OffsetStep(*step) for step in value
        )
    if name == "names":
        return tuple(value)
    if isinstance(value, list):
        return _array(value, np.int64 if name == "rows" else np.float64)
    return float("nan") if value is None and name in ("loss", "fpe", "aic", "bic") else value


def _array(value: list[Any], dtype: type) -> Any:
    array: Any = np.array(value, dtype)
    array.flags.writeable = False
    return array


def _note(fields: dict[str, Any]) -> Note:
    where = fields.get("where")
    return Note(**{**fields, "where": Where(**where) if where else None})


def _no_fit(text: str) -> Exception:
    return refusal("D02", f"no fit: {text}", count=1, remedy="give a file that save_fit wrote")
