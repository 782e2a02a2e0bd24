"""ARX model with regressors of one's own, `A y = B u + sum_m g_m x_m + d + e`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.models.base import coefficients
from plantune.models.poly import written
from plantune.notes import DEFAULT_LIMITS
from plantune.record import Floats, Record, columns

Regressor = str | tuple[str, Callable[[Record], ArrayLike]]
"""A term by name, or a name with a function from a record to one value per row."""


@dataclass(frozen=True, slots=True, eq=False)
class TermModel:
    """`A(q) y(t) = sum_i B_i(q) u_i(t - nk_i) + sum_m g_m x_m(t) + d + e(t)`.

    Parameters
    ----------
    A : array
        Ascending powers of `q^-1`, beginning with 1.
    B : list of arrays
        One per input, empty where an input has no linear part.
    nk : list of int
        Delays in samples.
    regressors : sequence
        The `x_m`, as `pt.estimate.arx` takes them.
    g : array
        Their coefficients.
    d : float
        The constant: a model that is not linear in its signals has no level `O`.
    Ts : float
        Sample time, seconds.
    u_names, y_name : tuple of str, str
        What the regressors may call the signals, beside `u`, `u1 u2 ...` and `y`.

    Examples
    --------
    >>> model = TermModel(A=[1, -0.8], B=[[0.5]], nk=[1], regressors=["sign(y(t-1))"], g=[-0.1])
    >>> print(model)
    A(q) y(t) = B(q) u(t - 1) - 0.1 sign(y(t-1)) + e(t)
    A(q) = 1 - 0.8 q^-1
    B(q) = 0.5
    Ts = 1 s
    >>> model.simulate([1.0, 0.0, 0.0]).round(2)
    array([0. , 0.5, 0.3])
    """

    kind: ClassVar[str] = "terms"

    A: Floats
    B: list[Floats]
    nk: list[int]
    regressors: tuple[Regressor, ...]
    g: Floats
    d: float = 0.0
    Ts: float = 1.0
    u_names: tuple[str, ...] = ()
    y_name: str = "y"

    def __post_init__(self) -> None:
        names = self.u_names or _numbered(len(self.B))
        frozen: dict[str, Any] = {
            "A": coefficients(self.A, "A"),
            "B": [_frozen(b) for b in self.B],
            "nk": [int(nk) for nk in self.nk],
            "regressors": regressors_of(self.regressors),
            "g": _frozen(self.g),
            "d": float(self.d),
            "Ts": float(self.Ts),
            "u_names": tuple(names),
        }
        for name, value in frozen.items():
            object.__setattr__(self, name, value)
        lengths = {len(self.B), len(self.nk), len(self.u_names)}
        if len(lengths) > 1 or len(self.g) != len(self.regressors) or self.A[0] != 1.0:
            raise refusal(
                "U01",
                f"{len(self.B)} B, {len(self.nk)} nk, {len(self.g)} g, A begins with {self.A[0]}",
                remedy="one B and nk per input, one g per regressor, A beginning with 1",
            )
        _core.check_terms(by_name(self.regressors), [*self.u_names, self.y_name])

    @property
    def core(self) -> Any:
        """The model as the core reads it: a function is one of the columns given with a record."""
        return SimpleNamespace(
            A=self.A.tolist(),
            B=[b.tolist() for b in self.B],
            nk=self.nk,
            regressors=numbered(self.regressors),
            g=self.g.tolist(),
            d=self.d,
            names=[*self.u_names, self.y_name],
        )

    def simulate(self, u: ArrayLike, Ts: float | None = None, x0: ArrayLike = ()) -> Floats:
        """Return the output for the input `u`: the equation run on its own outputs, without noise.

        Parameters
        ----------
        u : array (N,) or (N, nu)
            Input; before row 0 all signals are zero, and so is a function that has no value.
        Ts : float, optional
            Sample time, as a check.
        x0 : array
            Outputs of the first rows where they are known.

        Returns
        -------
        array (N,)

        Raises
        ------
        UsageError
            Another `Ts`, or a function that reads the output (U01).
        NumericsError
            The model leaves all bounds (N02).

        Examples
        --------
        >>> model = TermModel(A=[1, -0.5], B=[[]], nk=[1], regressors=["positive(u(t-1))"], g=[2])
        >>> model.simulate([1.0, -1.0, 0.0]).tolist()
        [0.0, 2.0, 1.0]
        """
        if Ts is not None and abs(Ts - self.Ts) > 1e-9 * self.Ts:
            raise refusal("U01", f"`Ts` is {Ts}, the model has {self.Ts}", remedy="leave Ts out")
        rows = columns(u, "u")
        given = self._given_of_inputs(rows) if functions(self.regressors) else _none(len(rows))
        known = np.ascontiguousarray(np.atleast_1d(np.asarray(x0, float)))
        return _core.term_simulate(self, rows, given, known)

    def predict(self, rec: Record, horizon: int | None = 1, offset: float = 0.0) -> Floats:
        """Return the output predicted `horizon` steps ahead on a record; None simulates.

        From what was measured the equation runs on by itself, without noise; a simulation starts
        from the first rows of each segment.  Rows without history are NaN.

        Parameters
        ----------
        rec : Record
            With the columns of the model.
        horizon : int or None
            Steps ahead, at least 1.
        offset : float
            Not used: the constant is `d`.

        Returns
        -------
        array (N,)

        Raises
        ------
        UsageError
            A function that reads the output, further than one step ahead (U01).
        NumericsError
            The model leaves all bounds (N02).

        Examples
        --------
        >>> rec = Record(u=[1.0, -1.0, 0.0], y=[0.0, 2.0, 1.1], Ts=1.0)
        >>> model = TermModel(A=[1, -0.5], B=[[]], nk=[1], regressors=["positive(u(t-1))"], g=[2])
        >>> model.predict(rec).tolist()
        [nan, 2.0, 1.0]
        """
        given = self.given(rec, ahead=horizon != 1)
        rows, yhat = _core.term_over_record(rec, self, given, horizon, rec.limits or DEFAULT_LIMITS)
        full = np.full(rec.N, np.nan)
        full[rows] = yhat
        return full

    def given(self, rec: Record, ahead: bool = False) -> Floats:
        """Return the columns of the functions on a record; `ahead` refuses those that read y.

        Examples
        --------
        >>> rec = Record(u=[1.0, -1.0, 0.0], y=[0.0, 2.0, 1.1], Ts=1.0)
        >>> cube = ("cube", lambda rec: rec.u[:, 0] ** 3)
        >>> TermModel(A=[1], B=[[]], nk=[1], regressors=[cube], g=[1]).given(rec).ravel().tolist()
        [1.0, -1.0, 0.0]
        """
        columns = given_columns(self.regressors, rec)
        if ahead and columns.size:
            other = given_columns(self.regressors, _without_output(rec))
            reads = ~((columns == other) | (np.isnan(columns) & np.isnan(other))).all(axis=0)
            if reads.any():
                name = functions(self.regressors)[int(np.flatnonzero(reads)[0])][0]
                raise refusal(
                    "U01",
                    f"regressor `{name}` is a function that reads y, which is not known ahead",
                    where=("regressors", None, None),
                    remedy="give it by name, such as sign(y(t-1)), or predict one step ahead",
                )
        return columns

    def _given_of_inputs(self, u: Floats) -> Floats:
        y = np.zeros(len(u))
        rec = Record(u=u, y=y, Ts=self.Ts, u_names=self.u_names, y_names=(self.y_name,))
        return np.nan_to_num(self.given(rec, ahead=True))

    def same_as(self, other: Any) -> bool:
        """Whether the other model has the same class and numbers.

        Examples
        --------
        >>> model = TermModel(A=[1, -0.5], B=[[1]], nk=[1], regressors=[], g=[])
        >>> model.same_as(TermModel(A=[1, -0.5], B=[[1]], nk=[1], regressors=[], g=[]))
        True
        """
        return type(self) is type(other) and repr(self) == repr(other)

    def __str__(self) -> str:
        several = len(self.B) > 1
        linear = [
            (f"B{i if several else ''}(q)", f"{name}(t - {nk})", b)
            for i, (name, nk, b) in enumerate(zip(self.u_names, self.nk, self.B, strict=True), 1)
            if len(b)
        ]
        own = [f"{_signed(g)} {name}" for g, name in zip(self.g, self.names, strict=True)]
        right = " + ".join(f"{B} {u}" for B, u, _ in linear)
        right = " ".join([right, *own, *([_signed(self.d)] if self.d else [])]).removeprefix(" + ")
        left = f"A(q) {self.y_name}(t)" if len(self.A) > 1 else f"{self.y_name}(t)"
        lines = [f"{left} = {right.strip().removeprefix('+ ')} + e(t)"]
        if len(self.A) > 1:
            lines.append(f"A(q) = {written(self.A)}")
        lines += [f"{B} = {written(b)}" for B, _, b in linear]
        return "\n".join([*lines, f"Ts = {self.Ts:g} s"])

    @property
    def names(self) -> tuple[str, ...]:
        """The regressors as they are called."""
        return tuple(x if isinstance(x, str) else x[0] for x in self.regressors)


def regressors_of(given: Sequence[Regressor]) -> tuple[Regressor, ...]:
    """Return checked regressors (U01).

    Examples
    --------
    >>> regressors_of(["u(t-1)*y(t-1)"])
    ('u(t-1)*y(t-1)',)
    """
    if isinstance(given, str):
        given = [given]
    for x in given:
        pair = isinstance(x, tuple | list) and [isinstance(x[0], str), *map(callable, x[1:])]
        if not (isinstance(x, str) or pair == [True, True]):
            raise refusal(
                "U01",
                f"`regressors` holds {x!r}",
                where=("regressors", None, None),
                remedy='a term such as "u(t-1)*y(t-1)", or ("name", function of the record)',
            )
    return tuple(x if isinstance(x, str) else (x[0], x[1]) for x in given)


def by_name(regressors: Sequence[Regressor]) -> list[str]:
    """Return those that are terms."""
    return [x for x in regressors if isinstance(x, str)]


def functions(regressors: Sequence[Regressor]) -> list[tuple[str, Callable[[Record], ArrayLike]]]:
    """Return those that are functions."""
    return [x for x in regressors if not isinstance(x, str)]


def numbered(regressors: Sequence[Regressor]) -> list[tuple[str, int | None]]:
    """Return them as the core takes them: a term, or the number of the column of a function."""
    order = iter(range(len(regressors)))
    return [(x, None) if isinstance(x, str) else (x[0], next(order)) for x in regressors]


def given_columns(regressors: Sequence[Regressor], rec: Record) -> Floats:
    """Return the values of the functions (N, k) on a record; NaN where one has none."""
    found = []
    for name, function in functions(regressors):
        column = np.asarray(function(rec), float)
        if column.shape != (rec.N,) or np.isinf(column).any():
            raise refusal(
                "U01",
                f"regressor `{name}` returns shape {column.shape}, or what is infinite",
                where=("regressors", None, None),
                remedy=f"return one number for each of the {rec.N} rows, NaN where there is none",
            )
        found.append(column)
    return np.ascontiguousarray(np.column_stack(found)) if found else _none(rec.N)


def _none(rows: int) -> Floats:
    return np.empty((rows, 0))


def _without_output(rec: Record) -> Record:
    """Return the record with other outputs, to see what depends on them."""
    other = Record(
        u=rec.u,
        y=-rec.y - 1.0,
        Ts=rec.Ts,
        starts=rec.starts,
        u_names=rec.u_names,
        y_names=rec.y_names,
        aux=rec.aux,
    )
    return other


def _frozen(p: Any) -> Floats:
    return coefficients(p, "B") if len(p) else coefficients([0.0], "B")[:0]


def _numbered(inputs: int) -> tuple[str, ...]:
    return ("u",) if inputs == 1 else tuple(f"u{i}" for i in range(1, inputs + 1))


def _signed(x: float) -> str:
    return f"{'-' if x < 0 else '+'} {abs(x):.6g}"
