"""What was found against what the engineer expects (N03): units mixed up show as factors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from plantune import _core
from plantune.errors import refusal
from plantune.models import PolyModel, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record

Range = tuple[float, float]
"""Lowest and highest value expected."""


def expected_columns(
    rec: Record, expected: Mapping[str, Range], limits: Limits | None = None
) -> tuple[Note, ...]:
    """Return N03 of the columns of a record that lie far outside of their declared ranges.

    Parameters
    ----------
    rec : Record
        Any number of columns; of each its largest magnitude counts.
    expected : mapping of str to (low, high)
        By column; other names are left alone.
    limits : Limits, optional
        Threshold N03.

    Returns
    -------
    tuple of Note

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> for note in expected_columns(rec, {"power": (0, 1000), "temp": (0, 10)}):
    ...     print(note.text)
    power is 6.41, expected 0 to 1000: off by a factor of 156; are the units the same?
    """
    columns = zip((*rec.u_names, *rec.y_names), (*rec.u.T, *rec.y.T), strict=True)
    found = {name: float(x[np.abs(x).argmax()]) for name, x in columns}
    return _departures(found, expected, limits or rec.limits or DEFAULT_LIMITS, columns=True)


def expected_of(
    model: PolyModel | ProcessModel,
    P: Floats | None,
    expected: Mapping[str, Range],
    limits: Limits,
) -> tuple[Note, ...]:
    """Return N03 of what a model, with its flat covariance, says of the plant."""
    return _departures(_quantities(model, P), expected, limits, columns=False)


def _quantities(model: PolyModel | ProcessModel, P: Floats | None) -> dict[str, float]:
    """Return what the model says of the plant; the slowest of several lags as `T` too."""
    found = {name: value for name, value, _ in _core.derived_quantities(model, P)}
    lags = [value for name, value in found.items() if name.startswith("T") and name != "Tz"]
    return {"T": max(lags), **found} if lags else found


def _departures(
    found: Mapping[str, float],
    expected: Mapping[str, Range],
    limits: Limits,
    *,
    columns: bool,
) -> tuple[Note, ...]:
    for name, (low, high) in expected.items():
        if not low < high:
            raise refusal(
                "U01",
                f"`expected` of {name} is ({low}, {high}), must ascend",
                where=(name, None, None),
                remedy='expected={"K": (1, 3)}',
            )
    ranges = [
        (name, value, float(expected[name][0]), float(expected[name][1]))
        for name, value in found.items()
        if name in expected
    ]
    return notes_from_core(_core.expected(ranges, columns, limits))
