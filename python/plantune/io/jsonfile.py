"""Results as plain JSON whose keys are the field names; models also back from it."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from plantune import models
from plantune.errors import PlantuneError, refusal
from plantune.io.file import contents
from plantune.io.table import short
from plantune.models import hysteresis


def to_json(value: Any, longest: int | None = None) -> Any:
    """Return a value as what JSON can hold: objects, lists, numbers, text, true, false, null.

    Dataclasses and named tuples become objects of their fields, models with their `kind`; arrays
    become lists; a complex number `[re, im]`; a slice `[start, stop]`; what is not finite null.

    Parameters
    ----------
    value : Any
        A frozen value of plantune, or anything made of dataclasses, mappings, sequences, arrays.
    longest : int, optional
        Arrays with more rows are left out; `{"shape": [...]}` stands in their place.

    Examples
    --------
    >>> import numpy as np
    >>> from plantune.models import TransferFunction
    >>> to_json(TransferFunction([2.0], [5.0, 1.0], L=1.3))
    {'kind': 'transfer', 'num': [2.0], 'den': [5.0, 1.0], 'L': 1.3}
    >>> to_json({"poles": np.array([0.5 + 0.1j]), "Ti": float("inf"), "y": np.zeros(9)}, longest=4)
    {'poles': [[0.5, 0.1]], 'Ti': None, 'y': {'shape': [9]}}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        kind = getattr(value, "kind", None)
        names = [field.name for field in dataclasses.fields(value)]
        fields = {name: to_json(getattr(value, name), longest) for name in names}
        return {"kind": kind, **fields} if isinstance(kind, str) else fields
    if isinstance(value, np.ndarray):
        too_long = longest is not None and value.ndim > 0 and len(value) > longest
        return {"shape": list(value.shape)} if too_long else to_json(value.tolist())
    if isinstance(value, np.generic):
        return to_json(value.item())
    if isinstance(value, Mapping):
        return {str(key): to_json(item, longest) for key, item in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return to_json(value._asdict(), longest)
    if isinstance(value, list | tuple | set | frozenset | range):
        return [to_json(item, longest) for item in value]
    if isinstance(value, slice):
        return [value.start, value.stop]
    if isinstance(value, complex):
        return [to_json(value.real), to_json(value.imag)]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    raise refusal("U01", f"a {type(value).__name__} has no JSON form", remedy="leave it out")


def write_json(path: str | PathLike[str], value: Any, longest: int | None = None) -> None:
    """Write a value as JSON; the file is there whole or not at all.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_json(f"{folder}/run.json", {"fit": 88.1})
    ...     print(Path(f"{folder}/run.json").read_text())
    {
      "fit": 88.1
    }
    """
    text = json.dumps(to_json(value, longest), indent=2, allow_nan=False, ensure_ascii=False)
    write_text(path, text + "\n")


def write_text(path: str | PathLike[str], text: str) -> None:
    """Write a text; the file is there whole or not at all.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_text(f"{folder}/pid.c", "/* PID */")
    ...     print([path.name for path in Path(folder).iterdir()])
    ['pid.c']
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_text(text, encoding="utf-8")
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def save_model(path: str | PathLike[str], model: Any) -> None:
    """Write a model or controller of `plantune.models`; `load_model` reads it back.

    Of a model of hysteresis its parameters are written, not how it was identified.

    Raises
    ------
    UsageError
        Not a model, or one with a number that JSON cannot hold.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from plantune.models import ProcessModel
    >>> with TemporaryDirectory() as folder:
    ...     save_model(f"{folder}/model.json", ProcessModel(K=2.0, T=5.0, L=1.3))
    ...     print(load_model(f"{folder}/model.json"))
    G(s) = 2 e^(-1.3 s) / (5 s + 1)
    """
    if getattr(model, "kind", None) not in _classes():
        raise refusal(
            "U01",
            f"a {type(model).__name__} is no model",
            remedy="save one of " + ", ".join(cls.__name__ for cls in _classes().values()),
        )
    values: dict[str, Any] = {"kind": model.kind}
    for field in dataclasses.fields(model):
        if not field.repr:
            continue
        number = getattr(model, field.name)
        values[field.name] = to_json(number)
        lost = values[field.name] is None and number is not None and number != field.default
        if lost or _holds_null(values[field.name]):
            raise refusal(
                "U01",
                f"`{field.name}` of the model is not finite",
                where=(field.name, None, None),
                remedy="save a model of finite numbers",
            )
    write_json(path, values)


def load_model(path: str | PathLike[str]) -> Any:
    """Read a model that `save_model` wrote.

    Raises
    ------
    DataError
        Not JSON, or not a model of this version (D02); too large (D01).
    UsageError
        There is no such file, or a number in it is out of its range (U01).

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from plantune.models import PID
    >>> with TemporaryDirectory() as folder:
    ...     save_model(f"{folder}/controller.json", PID(Kp=2.0, Ti=10.0))
    ...     print(load_model(f"{folder}/controller.json"))
    PI: Kp = 2, Ti = 10 s
    """
    return model_of(load_json(path))


def load_json(path: str | PathLike[str]) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    DataError
        Not JSON (D02); too large (D01).
    UsageError
        There is no such file (U01).

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_json(f"{folder}/fit.json", {"fit": 88.1})
    ...     load_json(f"{folder}/fit.json")
    {'fit': 88.1}
    """
    return _parsed(contents(path))


def model_of(values: Any) -> Any:
    """Return the model or controller whose fields, and `kind`, these are.

    Raises
    ------
    DataError
        Not a model of this version (D02).
    UsageError
        A number in it is out of its range (U01).

    Examples
    --------
    >>> print(model_of({"kind": "process", "K": 2.0, "T": 5.0, "L": 1.3}))
    G(s) = 2 e^(-1.3 s) / (5 s + 1)
    """
    values = dict(values) if isinstance(values, Mapping) else {}
    kind = str(values.pop("kind", "absent"))
    if kind not in _classes():
        raise _no_model(f"`kind` is {short(kind)}, must be one of {', '.join(_classes())}")
    cls = _classes()[kind]
    known = {field.name for field in dataclasses.fields(cls)}
    if not values.keys() <= known:
        unknown = ", ".join(short(name) for name in sorted(values.keys() - known)[:5])
        raise _no_model(f"a model of kind {kind!r} has no {unknown}")
    try:
        return cls(**{name: value for name, value in values.items() if value is not None})
    except PlantuneError:
        raise
    except (TypeError, ValueError) as error:
        raise _no_model(f"no model of kind {kind!r}: {error}") from None


def _classes() -> dict[str, Any]:
    """Every class of `plantune.models`, and of those of hysteresis, by its `kind`."""
    named = [*vars(models).values(), *vars(hysteresis).values()]
    classes = [value for value in named if dataclasses.is_dataclass(value)]
    return {cls.kind: cls for cls in classes if hasattr(cls, "kind")}


def _parsed(data: bytes) -> Any:
    try:
        return json.loads(data)
    except UnicodeDecodeError as error:
        raise _no_model(f"byte {error.start} is no text") from None
    except (ValueError, RecursionError) as error:
        raise _no_model(f"not JSON: {error}") from None


def _no_model(text: str) -> PlantuneError:
    return refusal("D02", text, count=1, remedy="give a file that save_model wrote")


def _holds_null(value: Any) -> bool:
    return isinstance(value, list) and any(item is None or _holds_null(item) for item in value)
