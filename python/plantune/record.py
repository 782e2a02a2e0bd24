"""Inputs and outputs of a plant, checked and frozen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits, Note

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Inputs `u`, outputs `y` and what is known about them.

    `u[k]` acts from `t[k]` to `t[k+1]`; `y[k]` is read at `t[k]`.  Gaps and several experiments
    are the same thing: `starts` holds the first row of each contiguous segment, and every
    estimator honours it.

    Parameters
    ----------
    u : array (N,) or (N, nu)
        Inputs.
    y : array (N,) or (N, ny)
        Outputs.
    Ts : float
        Sample time in seconds; always given, but for stamps `t`, whose mean step it then is.
    r : array (N,) or (N, ny), optional
        Reference (set point).
    aux : mapping of name to array (N,), optional
        Further signals, for instance the operating point.
    t0 : float
        Time of the first row in seconds.
    t : array (N,), optional
        Time stamps in seconds; None when uniform.  Where they are not, `estimate.process`, its
        `simulate` and `validate.check` serve them as they are; all else asks for `prep.resample`.
    valid : array (N,) or (N, ny) of bool, optional
        Which outputs count; a NaN output is accepted where it does not.
    starts : sequence of int, optional
        First row of each segment, beginning with 0.
    u_names, y_names : sequence of str, optional
        Names, by default `u` and `y`, or `u1 u2 …`.
    units : mapping of name to str, optional
        Units by name.
    hold : "zoh"
        How the input behaves between rows.
    rows : array (N,) of int, optional
        Row numbers in the original file, so that overlap of two parts is seen.
    log : sequence of str
        Each preparation step, with counts.
    source : str
        Fingerprint of the record that this one was made from; computed when empty.
    limits : Limits, optional
        Thresholds that the record was checked with (D07, D08).
    notes : sequence of Note
        What reading and preparation leave in doubt.

    Raises
    ------
    DataError
        Missing (D07), infinite (D08), of different length (D09), of a wrong shape (D10) or
        type (D11); stamps that do not ascend (D13).

    Examples
    --------
    >>> rec = Record(u=[0, 1, 1, 1], y=[0.0, 0.0, 0.4, 0.6], Ts=0.1)
    >>> rec.N, rec.nu, rec.ny
    (4, 1, 1)
    >>> est, val = rec.split(0.5)
    >>> val.rows.tolist()
    [2, 3]
    """

    u: Floats
    y: Floats
    Ts: float = None  # type: ignore[assignment]  # filled in below
    r: Floats | None = None
    aux: Mapping[str, Floats] = field(default_factory=dict)
    t0: float = 0.0
    t: Floats | None = None
    valid: NDArray[np.bool_] = None  # type: ignore[assignment]  # filled in below
    starts: NDArray[np.int64] = None  # type: ignore[assignment]
    u_names: tuple[str, ...] = ()
    y_names: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    hold: str = "zoh"
    rows: NDArray[np.int64] = None  # type: ignore[assignment]
    log: tuple[str, ...] = ()
    source: str = ""
    limits: Limits | None = None
    notes: tuple[Note, ...] = ()

    def __post_init__(self) -> None:
        for name, value in self._frozen_fields().items():
            object.__setattr__(self, name, value)
        if self.hold != "zoh":
            raise refusal("U01", f"`hold` is {self.hold!r}, must be 'zoh'", remedy="resample first")
        _check_further({"r": self.r, "t": self.t, **self.aux})
        fingerprint = _core.check_record(self, self.limits or DEFAULT_LIMITS)
        object.__setattr__(self, "source", self.source or fingerprint)

    def _frozen_fields(self) -> dict[str, Any]:
        """Bring every field to its type and shape; what the numbers say is checked by the core."""
        u, y = columns(self.u, "u"), columns(self.y, "y")
        per_row = (len(y),)
        valid = np.ones(y.shape, bool) if self.valid is None else self.valid
        starts = np.array([0]) if self.starts is None else self.starts
        rows = np.arange(len(y)) if self.rows is None else self.rows
        frozen: dict[str, Any] = {
            "u": u,
            "u_names": _names(self.u_names, "u", u.shape[1]),
            "y_names": _names(self.y_names, "y", y.shape[1]),
            "valid": _like(np.asarray(valid, bool), y.shape, "valid"),
            "y": _hold_missing(y, self.valid),
            "Ts": _seconds(self._mean_step(starts) if self.Ts is None else self.Ts),
            "t0": float(self.t0),
            "starts": _frozen(np.array(starts, np.int64)),
            "rows": _like(np.asarray(rows, np.int64), per_row, "rows"),
        }
        if self.r is not None:
            frozen["r"] = _like(columns(self.r, "r"), y.shape, "r")
        if self.t is not None:
            frozen["t"] = _like(columns(self.t, "t")[:, 0], per_row, "t")
        aux = {name: _like(columns(x, name)[:, 0], per_row, name) for name, x in self.aux.items()}
        frozen["aux"] = MappingProxyType(aux)
        frozen["units"] = MappingProxyType(dict(self.units))
        frozen["log"] = tuple(self.log)
        frozen["notes"] = tuple(self.notes)
        return frozen

    def _mean_step(self, starts: ArrayLike) -> float | None:
        if self.t is None:
            return None
        t = columns(self.t, "t")[:, 0]
        return _core.mean_step(np.ascontiguousarray(t), np.asarray(starts, np.int64).tolist())

    @property
    def irregular(self) -> bool:
        """Whether the stamps are not uniform within segments.

        Examples
        --------
        >>> Record(u=range(4), y=range(4), t=[0.0, 1.0, 2.5, 2.7]).irregular
        True
        """
        return self.t is not None and _core.is_irregular(self, self.limits or DEFAULT_LIMITS)

    @property
    def N(self) -> int:
        """Number of rows."""
        return len(self.y)

    @property
    def nu(self) -> int:
        """Number of inputs."""
        return int(self.u.shape[1])

    @property
    def ny(self) -> int:
        """Number of outputs."""
        return int(self.y.shape[1])

    @property
    def time(self) -> Floats:
        """Time of each row in seconds; gaps count."""
        if self.t is not None:
            return self.t
        ascending = bool((self.rows[1:] > self.rows[:-1]).all())
        steps = self.rows - self.rows[0] if ascending else np.arange(self.N)
        return np.asarray(self.t0 + steps * self.Ts, np.float64)

    @property
    def segments(self) -> tuple[slice, ...]:
        """Rows of each contiguous segment."""
        edges = [*self.starts.tolist(), self.N]
        return tuple(slice(a, b) for a, b in pairwise(edges))

    def split(self, share: float = 0.5) -> tuple[Record, Record]:
        """Return the first `share` of the rows and the rest.

        Examples
        --------
        >>> rec = Record(u=range(10), y=range(10), Ts=1.0)
        >>> [part.N for part in rec.split(0.7)]
        [7, 3]
        """
        if not 0 < share < 1:
            raise refusal("U01", f"`share` is {share}, must lie in (0, 1)", remedy="split(0.5)")
        edge = round(share * self.N)
        return self.take(slice(0, edge)), self.take(slice(edge, self.N))

    def between(self, start: float, stop: float) -> Record:
        """Return the rows with `start <= t < stop`, seconds.

        Examples
        --------
        >>> Record(u=range(10), y=range(10), Ts=0.5).between(1.0, 2.0).rows.tolist()
        [2, 3]
        """
        tolerance = 1e-9 * self.Ts
        inside = (self.time >= start - tolerance) & (self.time < stop - tolerance)
        where = np.flatnonzero(inside)
        if len(where) < 2:
            raise refusal(
                "D04",
                f"{len(where)} rows between {start} and {stop} {self.time_unit}",
                count=len(where),
                remedy=f"the record runs from {self.time[0]:g} to {self.time[-1]:g} "
                f"{self.time_unit}",
            )
        return self.take(slice(int(where[0]), int(where[-1]) + 1))

    def take(self, part: slice) -> Record:
        """Return a contiguous part of the rows; segments, names, log and source are kept.

        Examples
        --------
        >>> Record(u=range(10), y=range(10), Ts=1.0).take(slice(4, 7)).rows.tolist()
        [4, 5, 6]
        """
        first, last, _ = part.indices(self.N)
        inner = self.starts[(self.starts > first) & (self.starts < last)] - first
        return replace(
            self,
            u=self.u[part],
            y=self.y[part],
            r=None if self.r is None else self.r[part],
            aux={name: x[part] for name, x in self.aux.items()},
            t0=float(self.time[first]),
            t=None if self.t is None else self.t[part],
            valid=self.valid[part],
            starts=np.concatenate([[0], inner]),
            rows=self.rows[part],
        )

    @property
    def time_unit(self) -> str:
        """Unit of time: seconds, or samples where the source states no sampling time.

        Examples
        --------
        >>> Record(u=range(3), y=range(3), Ts=1.0, units={"time": "sample"}).time_unit
        'sample'
        """
        return "sample" if self.units.get("time") == "sample" else "s"

    @staticmethod
    def join(records: Sequence[Record]) -> Record:
        """Return several records as segments of one.

        Examples
        --------
        >>> a, b = Record(u=range(10), y=range(10), Ts=1.0).split(0.4)
        >>> Record.join([a, b]).starts.tolist()
        [0, 4]
        """
        first = records[0]
        for other in records[1:]:
            same = (other.u_names, other.y_names) == (first.u_names, first.y_names)
            steps_differ = other.Ts != first.Ts and not (other.irregular or first.irregular)
            if steps_differ or not same or (other.r is None) != (first.r is None):
                raise refusal(
                    "U01",
                    f"records differ in Ts, columns or reference: {_label(first)}, {_label(other)}",
                    remedy="resample or rename first",
                )

        def stack(name: str) -> NDArray[Any]:
            return np.concatenate([getattr(rec, name) for rec in records])

        offsets = np.cumsum([0, *(rec.N for rec in records)])
        at_any_stamps = any(rec.irregular for rec in records)
        same_source = len({rec.source for rec in records}) == 1
        return replace(
            first,
            u=stack("u"),
            y=stack("y"),
            Ts=None if at_any_stamps else first.Ts,  # type: ignore[arg-type]
            r=None if first.r is None else stack("r"),
            aux={n: np.concatenate([rec.aux[n] for rec in records]) for n in first.aux},
            t=None if all(rec.t is None for rec in records) else stack("time"),
            valid=stack("valid"),
            starts=np.concatenate(
                [rec.starts + o for rec, o in zip(records, offsets, strict=False)]
            ),
            rows=stack("rows"),
            log=(*first.log, f"joined {len(records)} records"),
            notes=tuple(dict.fromkeys(note for rec in records for note in rec.notes)),
            source=first.source if same_source else "",
        )

    def same_as(self, other: Record) -> bool:
        """Whether every field agrees (`==` would be ambiguous for arrays).

        Examples
        --------
        >>> rec = Record(u=range(3), y=range(3), Ts=1.0)
        >>> rec.same_as(Record(u=range(3), y=range(3), Ts=1.0))
        True
        """
        return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    def __str__(self) -> str:
        return (
            f"Record {_label(self)}: {self.N} rows, Ts {self.Ts:g} {self.time_unit}, "
            f"{len(self.starts)} segment{'s' if len(self.starts) > 1 else ''}"
        )

    # A mapping proxy cannot be pickled; the fields as plain values can.
    def __getstate__(self) -> dict[str, Any]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}
        return {**state, "aux": dict(self.aux), "units": dict(self.units)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            proxy = name in ("aux", "units")
            object.__setattr__(self, name, MappingProxyType(value) if proxy else value)


def _frozen(x: NDArray[Any]) -> NDArray[Any]:
    x.flags.writeable = False
    return x


def columns(x: ArrayLike, name: str) -> Floats:
    """`x` as a frozen float64 array (N, columns)."""
    if isinstance(x, np.ma.MaskedArray) and np.ma.getmaskarray(x).any():
        raise refusal(
            "D07",
            f"`{name}` is a masked array with {int(np.ma.getmaskarray(x).sum())} masked values",
            where=(name, None, None),
            count=int(np.ma.getmaskarray(x).sum()),
            remedy="pass x.filled(nan) and mark the rows in `valid`",
        )
    try:
        raw = np.asarray(x)
    except ValueError:
        raise refusal(
            "D11",
            f"`{name}` has rows of different lengths",
            where=(name, None, None),
            remedy="pass an array (N,) or (N, columns)",
        ) from None
    if raw.dtype.kind not in "fiub":
        raise refusal(
            "D11",
            f"`{name}` holds {raw.dtype}, not numbers",
            where=(name, None, None),
            remedy="convert the column to real numbers first",
        )
    if raw.ndim == 2 and raw.shape[0] == 1:
        raw = raw.reshape(-1, 1)
    if raw.ndim not in (1, 2) or (raw.ndim == 2 and raw.shape[0] < raw.shape[1]):
        raise refusal(
            "D10",
            f"`{name}` has shape {raw.shape}, expected (N,) or (N, columns)",
            where=(name, None, None),
            remedy=f"time runs along axis 0: pass {name}.T",
        )
    shape = raw.shape if raw.ndim == 2 else (len(raw), 1)
    if raw.dtype == np.float64 and raw.flags.c_contiguous and not raw.flags.writeable:
        return raw.reshape(shape)
    return _frozen(np.array(raw, np.float64, order="C", copy=True).reshape(shape))


def _like(x: NDArray[Any], shape: tuple[int, ...], name: str) -> NDArray[Any]:
    x = x.reshape(shape) if x.size == np.prod(shape) else x
    if x.shape != shape:
        raise refusal(
            "D09",
            f"`{name}` has shape {x.shape}, y needs {shape}",
            where=(name, None, None),
            remedy="give every signal one value per row",
        )
    return _frozen(np.array(x, order="C", copy=True)) if x.flags.writeable else x


def _hold_missing(y: Floats, valid: ArrayLike | None) -> Floats:
    """`y` with the last other value wherever an output does not count and is not finite."""
    if valid is None or np.isfinite(y).all():
        return y
    kept = np.asarray(valid, bool).reshape(y.shape) | np.isfinite(y)
    rows = np.where(kept, np.arange(len(y))[:, None], kept.argmax(axis=0))
    held = np.take_along_axis(y, np.maximum.accumulate(rows, axis=0), axis=0)
    return _frozen(np.ascontiguousarray(held))


def _check_further(signals: Mapping[str, Floats | None]) -> None:
    """Refuse further signals that are missing (D07) or infinite (D08) somewhere."""
    for name, x in signals.items():
        if x is None or np.isfinite(x).all():
            continue
        bad = ~np.isfinite(x)
        missing = bool(np.isnan(x).any())
        raise refusal(
            "D07" if missing else "D08",
            f"`{name}` is {'missing (NaN)' if missing else 'infinite'} in {int(bad.sum())} rows",
            where=(name, int(np.argwhere(bad)[0][0]), None),
            count=int(bad.sum()),
            remedy="give a finite value in every row, or leave the signal out",
        )


def _names(names: Sequence[str], letter: str, n: int) -> tuple[str, ...]:
    if isinstance(names, str):
        names = (names,)
    if not names:
        return (letter,) if n == 1 else tuple(f"{letter}{i + 1}" for i in range(n))
    if len(names) != n:
        raise refusal(
            "D09",
            f"`{letter}_names` has {len(names)} names for {n} columns",
            remedy=f"give {n} names",
        )
    return tuple(names)


def _seconds(Ts: Any) -> float:
    try:
        return float(Ts)
    except (TypeError, ValueError):
        text = f"`Ts` is {Ts!r}, must be seconds"
        raise refusal("U01", text, remedy="pass Ts=0.1, or stamps t= of two rows or more") from None


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return a is b or (a is not None and b is not None and np.array_equal(a, b))
    if isinstance(a, Mapping):
        return a.keys() == b.keys() and all(_same(a[k], b[k]) for k in a)
    return bool(a == b)


def _label(rec: Record) -> str:
    return f"{', '.join(rec.u_names)} -> {', '.join(rec.y_names)}"
