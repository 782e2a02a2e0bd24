"""Parquet files: the footer first, then in a process of its own the columns asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.file import (
    format_seen,
    most_declared,
    most_unpacked,
    too_few,
    too_many,
    too_much_unpacked,
)
from plantune.io.numbers import Numbers
from plantune.io.table import (
    LONGEST_CELL,
    MOST_COLUMNS,
    MOST_LINES,
    Cells,
    Column,
    Places,
    Table,
    Wanted,
    beside,
    column,
    inert,
    short,
)
from plantune.io.worker import Array, broken, need
from plantune.io.worker import decode as decode_in_worker

NEEDS: Final = ("pyarrow.parquet",)
_MAGIC: Final = b"PAR1"


def open_parquet(data: bytes) -> ParquetSheet:
    """Return the table of a Parquet file, its footer read."""
    _check_frame(data)
    need("pyarrow", "Parquet files")
    footer = _footer(data)
    meta = footer.metadata
    if meta.num_rows > MOST_LINES:
        raise too_many(meta.num_rows, "rows", MOST_LINES)
    unpacked = sum(meta.row_group(i).total_byte_size for i in range(meta.num_row_groups))
    if unpacked > (most := most_declared(len(data))):
        raise too_much_unpacked(len(data), most, unpacked)
    if meta.num_rows < 2:
        raise too_few(max(0, meta.num_rows), "one row of data" if meta.num_rows > 0 else "a header")
    schema = footer.schema_arrow
    if len(schema) > MOST_COLUMNS:
        raise too_many(len(schema), "columns", MOST_COLUMNS)
    columns = tuple(column(field.name, i) for i, field in enumerate(schema))
    return ParquetSheet(columns, tuple(str(field.type) for field in schema), data, meta.num_rows)


@dataclass(frozen=True, slots=True)
class ParquetSheet:
    """A Parquet file whose footer has been read."""

    columns: tuple[Column, ...]
    types: tuple[str, ...]
    data: bytes
    N: int

    def read(self, wanted: Wanted) -> Table:
        """Return the columns wanted."""
        every, size = wanted.every, len(self.data)
        unpacked = 8 * self.N * len(every)
        if unpacked > (most := most_unpacked(size)):
            raise too_much_unpacked(size, most, unpacked)
        found = decode_in_worker("parquet", self.data, every)
        arrays = {i: array.values for i, array in zip(every, found, strict=True)}
        if any(len(values) != self.N for values in arrays.values()):
            raise broken(f"the footer declares {self.N} rows, and the pages hold others")
        places = Places(np.arange(self.N))
        log = [f"read {self.N} rows of a Parquet file of {len(self.columns)} columns"]
        log += [f"`{self.columns[i].name}` is {self.types[i]}" for i in wanted.stamps]
        return Table(
            beside([self._numbers(i, arrays[i], places, log) for i in wanted.numbers], self.N),
            {i: arrays[i] for i in wanted.cells},
            places,
            tuple(log),
        )

    def _numbers(
        self, i: int, values: Cells, places: Places, log: list[str]
    ) -> NDArray[np.float64]:
        if values.dtype.kind == "f":
            return values.astype(np.float64)
        name = self.columns[i].name
        if values.dtype.kind == "M":
            raise _no_number(name, self.types[i], self.N)
        text = Numbers(name, comma_is_free=True)
        text.take([bytes(cell).decode("utf-8", "replace") for cell in values])
        log.append(f"`{name}` is {self.types[i]}, read as numbers")
        return text.column(places)


def decode(data: bytes, wanted: Sequence[int]) -> list[Array]:
    """Return the columns wanted; runs in the worker."""
    footer = _footer(data)
    names = footer.schema_arrow.names
    table = footer.read(columns=sorted({names[i] for i in wanted}), use_threads=False)
    found = []
    for i in wanted:
        same = [k for k, name in enumerate(table.schema.names) if name == names[i]]
        values = table.column(same[names[:i].count(names[i])])
        found.append(Array(names[i], _plain(inert(names[i], i), values)))
    return found


def _plain(name: str, values: Any) -> NDArray[Any]:
    """Return a column as numbers with NaN, times with NaT, or text."""
    import pyarrow as pa
    from pyarrow import compute, types

    kind = values.type
    if types.is_dictionary(kind):
        return _plain(name, values.cast(kind.value_type))
    if types.is_timestamp(kind) or types.is_date(kind):
        unit = kind.unit if types.is_timestamp(kind) else "ms"
        return np.asarray(values.cast(pa.timestamp(unit)).to_numpy())
    if types.is_floating(kind) or types.is_integer(kind) or types.is_boolean(kind):
        return _floats(values)
    if types.is_decimal(kind) or types.is_null(kind):
        return _floats(values)
    if types.is_string(kind) or types.is_large_string(kind):
        cut = compute.utf8_slice_codeunits(values.fill_null(""), 0, LONGEST_CELL)
        return np.asarray(cut.cast(pa.large_binary()).to_numpy(), f"S{LONGEST_CELL}")
    raise _no_number(name, str(kind), len(values))


def _floats(values: Any) -> NDArray[np.float64]:
    import pyarrow as pa

    return np.asarray(values.cast(pa.float64(), safe=False).to_numpy(), np.float64)


def _footer(data: bytes) -> Any:
    import pyarrow as pa
    from pyarrow import parquet

    try:
        return parquet.ParquetFile(pa.BufferReader(data))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise broken(short(str(error).partition("\n")[0], 100)) from None


def _check_frame(data: bytes) -> None:
    """Refuse bytes without the marks at both ends, or a footer that does not fit (D02)."""
    if not data.startswith(_MAGIC):
        seen = format_seen(data) or "another file"
        raise refusal(
            "D02",
            f"the file says it is a Parquet file, and is {seen}",
            where=("", 0, None),
            remedy="give it the suffix of its format, or save the table as CSV",
        )
    if not data.endswith(_MAGIC) or int.from_bytes(data[-8:-4], "little") + 12 > len(data):
        raise broken("a Parquet file whose end is missing")


def _no_number(name: str, kind: str, N: int) -> PlantuneError:
    return refusal(
        "D11",
        f"`{name}` holds {kind}, not numbers",
        where=(name, 0, None),
        count=N,
        remedy="choose a column of numbers",
    )
