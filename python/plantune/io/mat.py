"""MAT files of versions 4 and 5: variables to columns.

A vector is a column by its name, a matrix `A` the columns `A[0] A[1] …`, a field of a structure
`s.field`.  Time runs along the longer side.  What is no real number is no column.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from plantune.errors import refusal
from plantune.io.file import too_few, too_many
from plantune.io.mat_tags import check_tags
from plantune.io.table import MOST_COLUMNS, Column, Places, Table, Wanted, beside, inert
from plantune.io.worker import Array, need
from plantune.io.worker import decode as decode_in_worker

NEEDS: Final = ("scipy.io",)
_DEEPEST: Final = 8  # structures in structures


def open_mat(data: bytes) -> MatSheet:
    """Return the vectors and matrices of a MAT file."""
    check_tags(data)
    need("scipy", "MAT files")
    arrays = decode_in_worker("mat", data)
    if not arrays:
        raise too_few(0, "no vector of numbers")
    names = [inert(array.name, i) for i, array in enumerate(arrays)]
    columns = (
        Column(name, name, length=len(array.values))
        for name, array in zip(names, arrays, strict=True)
    )
    return MatSheet(tuple(columns), tuple(arrays))


@dataclass(frozen=True, slots=True)
class MatSheet:
    """A MAT file that has been read."""

    columns: tuple[Column, ...]
    arrays: tuple[Array, ...]

    def read(self, wanted: Wanted) -> Table:
        """Return the columns wanted; stamps and words are numbers too."""
        N = len(self.arrays[wanted.every[0]].values)
        said = dict.fromkeys(self.arrays[i].said for i in wanted.every)
        return Table(
            beside([self._numbers(i) for i in wanted.numbers], N),
            {i: self._numbers(i) for i in wanted.cells},
            Places(np.arange(N)),
            (f"read {N} rows of a MAT file", *filter(None, said)),
        )

    def _numbers(self, i: int) -> NDArray[np.float64]:
        values = self.arrays[i].values
        if len(values) < 2:
            raise too_few(len(values), "one value of `" + self.columns[i].name + "`")
        if values.dtype.kind == "c":
            raise refusal(
                "D11",
                f"`{self.columns[i].name}` holds complex numbers",
                where=(self.columns[i].name, 0, None),
                count=len(values),
                remedy="save its real part, or its magnitude",
            )
        return values.astype(np.float64)


def decode(data: bytes, wanted: Sequence[int]) -> list[Array]:
    """Return all columns; runs in the worker."""
    from scipy.io import loadmat

    with catch_warnings(record=True) as warned:
        simplefilter("always")
        variables = loadmat(BytesIO(data))
    doubled = next((w for w in warned if "Duplicate variable name" in str(w.message)), None)
    if doubled:
        raise refusal(
            "D12",
            str(doubled.message).partition(" in stream")[0],
            where=("", 0, None),
            count=2,
            remedy="save the variables under two names",
        )
    found: list[Array] = []
    for name, value in variables.items():
        if not name.startswith("__"):
            found.extend(_columns(name, value, 0))
            if len(found) > MOST_COLUMNS:
                raise too_many(len(found), "columns", MOST_COLUMNS)
    return found


def _columns(name: str, value: Any, depth: int) -> Iterator[Array]:
    if not isinstance(value, np.ndarray) or value.ndim != 2 or depth > _DEEPEST:
        return
    if value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            yield from _columns(f"{name}.{field}", value[field].item(), depth + 1)
    elif value.dtype.kind in "fiubc" and 1 in value.shape and value.size > 1:
        yield Array(name, value.ravel())
    elif value.dtype.kind in "fiubc" and value.size > 1:
        wide = value.shape[0] < value.shape[1]
        said = f"{name}: {value.shape[0]} rows of {value.shape[1]} read as columns" if wide else ""
        for i, row in enumerate(value if wide else value.T):
            yield Array(f"{name}[{i}]", row, said)
