"""Linear model by its states, sampled or in continuous time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.models.matrix_poly import MatrixPolyModel
from plantune.models.poly import PolyModel
from plantune.notes import DEFAULT_LIMITS
from plantune.record import Floats, Record, columns

_MATRICES = ("A", "B", "C", "D", "K")


class Reduction(NamedTuple):
    """A model of fewer states.

    Examples
    --------
    >>> model = StateSpace(A=[[0.9, 0], [0, 0.1]], B=[[1], [0.1]], C=[[1, 0.1]], Ts=1.0)
    >>> model.reduce(1).model.n
    1
    """

    model: StateSpace
    hankel: Floats
    bound: float


@dataclass(frozen=True, slots=True, eq=False)
class StateSpace:
    """`x(t+1) = A x(t) + B u(t) + K e(t)`, `y(t) = C x(t) + D u(t) + e(t)`.

    Parameters
    ----------
    A, B, C : array (n, n), (n, nu), (ny, n)
        A vector is a single column `B`, or a single row `C`.
    D : array (ny, nu), optional
        Zero by default.
    K : array (n, ny), optional
        Gain of the innovations `e`; zero by default, the noise then being white on the outputs.
    Ts : float or None
        Sample time, seconds; None is continuous time, `x' = A x + B u`.

    Notes
    -----
    What asks for one output (`pt.tune`, `pt.simulate.closed_loop`) takes a sampled model of one
    output as its `polynomial()`.  The basis of the states has no meaning of its own.

    Examples
    --------
    >>> model = StateSpace(A=[[0.8, 0.1], [0, 0.5]], B=[0, 1], C=[1, 0], Ts=0.1)
    >>> print(model)
    x(t+1) = A x(t) + B u(t), y(t) = C x(t) + D u(t) + e(t)
    2 states, 1 input, 1 output
    A = [ 0.8  0.1
            0  0.5 ]
    B = [ 0
          1 ]
    C = [ 1  0 ]
    D = [ 0 ]
    Ts = 0.1 s
    >>> model.dc_gain()
    array([[1.]])
    """

    kind: ClassVar[str] = "state_space"

    A: Floats
    B: Floats
    C: Floats
    D: Any = None
    K: Any = None
    Ts: float | None = None

    def __post_init__(self) -> None:
        A = _matrix(self.A, "A", column=True)
        n = len(A)
        B, C = _matrix(self.B, "B", column=True), _matrix(self.C, "C", column=False)
        ny, nu = len(C), B.shape[1]
        D = _matrix(np.zeros((ny, nu)) if self.D is None else self.D, "D", column=ny > 1)
        K = _matrix(np.zeros((n, ny)) if self.K is None else self.K, "K", column=True)
        wanted = {"A": (n, n), "B": (n, nu), "C": (ny, n), "D": (ny, nu), "K": (n, ny)}
        for name, M in zip(_MATRICES, (A, B, C, D, K), strict=True):
            if M.shape != wanted[name]:
                raise refusal(
                    "U01",
                    f"`{name}` has shape {M.shape}, must be {wanted[name]}",
                    remedy="A (n, n), B (n, nu), C (ny, n), D (ny, nu), K (n, ny)",
                )
            object.__setattr__(self, name, M)
        Ts = None if self.Ts is None else float(self.Ts)
        if Ts is not None and not 0.0 < Ts < float("inf"):
            raise refusal("U01", f"`Ts` is {Ts}, must be positive", remedy="seconds, or None")
        object.__setattr__(self, "Ts", Ts)

    @classmethod
    def of_core(cls, d: Mapping[str, Any]) -> StateSpace:
        """Return the model that the core sends."""
        n, ny, nu = d["n"], d["ny"], d["nu"]
        shapes = ((n, n), (n, nu), (ny, n), (ny, nu), (n, ny))
        matrices = {
            name: d[name].reshape(shape) for name, shape in zip(_MATRICES, shapes, strict=True)
        }
        return cls(**matrices, Ts=d["Ts"])

    @classmethod
    def of(cls, model: PolyModel | MatrixPolyModel) -> StateSpace:
        """Return a polynomial model by states, its noise model as `K`, exact.

        Examples
        --------
        >>> model = StateSpace.of(PolyModel(A=[1, -0.5], B=[2.0], nk=2, Ts=1.0))
        >>> model.n, model.simulate([1.0, 1.0, 1.0, 1.0])[:, 0].tolist()
        (2, [0.0, 0.0, 2.0, 3.0])
        """
        if isinstance(model, MatrixPolyModel):
            return cls.of_core(_core.matrix_state_space(model))
        return cls.of_core(_core.states_of(model))

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.A)

    @property
    def ny(self) -> int:
        """Number of outputs."""
        return len(self.C)

    @property
    def nu(self) -> int:
        """Number of inputs."""
        return int(self.B.shape[1])

    def simulate(
        self, u: ArrayLike, Ts: float | None = None, x0: ArrayLike | None = None
    ) -> Floats:
        """Return the outputs (N, ny) for the inputs `u` (N, nu), from rest or the state `x0` (n,).

        Parameters
        ----------
        u : array (N,) or (N, nu)
            Inputs, held between the samples.
        Ts : float, optional
            Sample time, seconds; needed in continuous time, whose model is sampled exactly.
        x0 : array (n,), optional
            State at row 0; zero by default.

        Raises
        ------
        UsageError
            `Ts` is absent or not that of the model, or other columns than inputs (U01).

        Examples
        --------
        >>> model = StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0)
        >>> model.simulate([1.0, 1.0, 1.0])[:, 0].tolist()
        [0.0, 2.0, 3.0]
        >>> model.simulate([0.0, 0.0], x0=[4.0])[:, 0].tolist()
        [4.0, 2.0]
        """
        model, u = self._at(Ts), columns(u, "u")
        if x0 is None or not np.any(x0):
            return _core.matrix_simulate(model, u, None)
        x = np.asarray(x0, float).reshape(-1)
        if len(x) != self.n or u.shape[1] != self.nu:
            raise refusal(
                "U01",
                f"`x0` has {len(x)} entries and u {u.shape[1]} columns",
                remedy=f"{self.n} states and {self.nu} inputs",
            )
        flat: Floats = _core.states_simulate(model, np.ascontiguousarray(u).reshape(-1), x.tolist())
        return flat.reshape(-1, self.ny)

    def predict(self, rec: Record, horizon: int | None = 1, offset: ArrayLike = 0.0) -> Floats:
        """Return the outputs (N, ny) predicted `horizon` steps ahead; None simulates.

        The states are filtered by `K`; the initial state of each segment is estimated.

        Parameters
        ----------
        rec : Record
            With the inputs and outputs of the model.
        horizon : int or None
            Steps ahead, at least 1.
        offset : float or array (ny,)
            `O` in `y = G u + O`.

        Examples
        --------
        >>> import plantune as pt
        >>> model = StateSpace(A=[[0.5]], B=[2.0], C=[1.0], K=[0.5], Ts=1.0)
        >>> rec = pt.Record(u=[1, 1, 1], y=[0.0, 2.5, 3.0], Ts=1.0)
        >>> model.predict(rec)[:, 0].round(3).tolist()
        [0.0, 2.0, 3.25]
        """
        level = np.broadcast_to(np.asarray(offset, float), (self.ny,)).tolist()
        limits = rec.limits or DEFAULT_LIMITS
        rows, yhat = _core.matrix_over_record(rec, self, horizon, level, limits)
        full = np.full((rec.N, self.ny), np.nan)
        full[rows] = np.column_stack(yhat)
        return full

    def freqresp(self, w: ArrayLike) -> NDArray[np.complex128]:
        """Return the frequency response (len(w), ny, nu) at `w` rad/s.

        Examples
        --------
        >>> StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0).freqresp([0.0])
        array([[[4.+0.j]]])
        """
        w = np.atleast_1d(np.asarray(w, float))
        return _core.matrix_freqresp(self, w.tolist()).reshape(len(w), self.ny, self.nu)

    def poles(self) -> NDArray[np.complex128]:
        """Return the eigenvalues of `A`: in z, or in 1/s in continuous time.

        Examples
        --------
        >>> StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0).poles()
        array([0.5+0.j])
        """
        return _core.matrix_poles(self)

    def zeros(self, input: int | None = None, output: int | None = None) -> NDArray[np.complex128]:
        """Return the zeros of the whole square model, or from one input to one output.

        Raises
        ------
        UsageError
            Other numbers of inputs and outputs, and no pair is named (U01).

        Examples
        --------
        >>> model = StateSpace(A=[[0.5, 1], [0, 0.2]], B=[1, 1], C=[1, 0], Ts=1.0)
        >>> model.zeros().round(12)
        array([-0.8+0.j])
        """
        pair = None if input is None and output is None else (output or 0, input or 0)
        if pair is not None and not (0 <= pair[0] < self.ny and 0 <= pair[1] < self.nu):
            raise refusal(
                "U01", f"no output {pair[0]} and input {pair[1]}", remedy="count them from 0"
            )
        return _core.states_zeros(self, pair)

    def dc_gain(self) -> Floats:
        """Return the static gains (ny, nu); infinite for an integrator.

        Examples
        --------
        >>> StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0).dc_gain()
        array([[4.]])
        """
        return _core.matrix_dc_gain(self)

    def step(self, t: ArrayLike, input: int = 0) -> Floats:
        """Return the outputs (len(t), ny) at times `t` (s) after a unit step of one input.

        Between the samples of a sampled model the last one holds.

        Examples
        --------
        >>> StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0).step([0.0, 1.0, 2.5])[:, 0].tolist()
        [0.0, 2.0, 3.0]
        """
        times = np.atleast_1d(np.asarray(t, float))
        if self.Ts is None:
            return np.array([self._after(float(s), input) for s in times])
        rows = np.floor(times / self.Ts + 1e-9).astype(int)
        u = np.zeros((max(int(rows.max()), 0) + 1, self.nu))
        u[:, input] = 1.0
        y = self.simulate(u)
        return np.where(rows[:, None] < 0, 0.0, y[np.maximum(rows, 0)])

    def _after(self, s: float, input: int) -> Floats:
        """Return the outputs `s` seconds after a unit step in continuous time."""
        if s < 0.0:
            return np.zeros(self.ny)
        u = np.zeros((2, self.nu))
        u[:, input] = 1.0
        y = self.simulate(u, Ts=s)[1] if s > 0.0 else self.simulate(u, Ts=1.0)[0]
        return np.asarray(y, float)

    def polynomial(self) -> PolyModel:
        """Return the same model of one output as polynomials: ARMAX, or output error if `K = 0`.

        Examples
        --------
        >>> print(StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0).polynomial())
        y(t) = B(q)/F(q) u(t - 1) + e(t)
        B(q) = 2
        F(q) = 1 - 0.5 q^-1
        Ts = 1 s
        """
        return PolyModel.of_core(_core.states_polynomial(self))

    def c2d(self, Ts: float) -> StateSpace:
        """Return a model in continuous time sampled behind a hold, exact.

        Examples
        --------
        >>> StateSpace(A=[[-1.0]], B=[1.0], C=[1.0]).c2d(1.0).A.round(4)
        array([[0.3679]])
        """
        return self.of_core(_core.states_sampled(self, Ts))

    def d2c(self) -> StateSpace:
        """Return the model in continuous time of which this is the sampled form.

        Raises
        ------
        NotIdentifiable
            A pole at or below 0 (M12).

        Examples
        --------
        >>> StateSpace(A=[[-1.0]], B=[1.0], C=[1.0]).c2d(1.0).d2c().A.round(4)
        array([[-1.]])
        """
        return self.of_core(_core.states_continuous(self))

    def reduce(self, n: int) -> Reduction:
        """Return the model with the `n` states that reach and are seen most; balanced truncation.

        Returns
        -------
        Reduction
            `model`; `hankel` (n,), the Hankel singular values of this model; `bound`, twice the
            sum of those cut off, which no frequency's error exceeds.

        Raises
        ------
        NotIdentifiable
            A pole on or outside the unit circle: it has no Gramian (M02).
        UsageError
            More states than there are, or a model in continuous time (U01).

        Notes
        -----
        Moore 1981; Al-Saggaf and Franklin 1987.

        Examples
        --------
        >>> model = StateSpace(A=[[0.9, 0], [0, 0.1]], B=[[1], [0.1]], C=[[1, 0.1]], Ts=1.0)
        >>> small, hankel, bound = model.reduce(1)
        >>> hankel.round(4), bool(abs(model.dc_gain() - small.dc_gain()).max() <= bound)
        (array([5.2655, 0.0078]), True)
        """
        model, hankel, bound = _core.states_reduced(self, n)
        return Reduction(self.of_core(model), hankel, bound)

    def to_control(self, **options: Any) -> Any:
        """Return a `StateSpace` of python-control; options as of `pt.export.to_control`.

        Examples
        --------
        >>> StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=0.1).to_control().dt
        0.1
        """
        from plantune.models.control import to_control

        return to_control(self, **options)

    def same_as(self, other: Any) -> bool:
        """Whether the other model has the same class and numbers.

        Examples
        --------
        >>> model = StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=1.0)
        >>> model.same_as(StateSpace(A=[[0.5]], B=[2.0], C=[1.0], Ts=2.0))
        False
        """
        return (
            type(self) is type(other)
            and self.Ts == other.Ts
            and all(np.array_equal(getattr(self, m), getattr(other, m)) for m in _MATRICES)
        )

    def _at(self, Ts: float | None) -> StateSpace:
        """Return the model at a sample time."""
        if self.Ts is None:
            if Ts is None:
                raise refusal("U01", "`Ts` is missing", remedy="pass Ts= in seconds")
            return self.c2d(Ts)
        if Ts is not None and abs(Ts - self.Ts) > 1e-9 * self.Ts:
            raise refusal("U01", f"`Ts` is {Ts}, the model's is {self.Ts}", remedy="leave it out")
        return self

    def __str__(self) -> str:
        noise = " + K e(t)" if self.K.any() else ""
        left = "x(t+1)" if self.Ts is not None else "x'(t)"
        sizes = ", ".join(
            f"{count} {name}{'s' if count > 1 else ''}"
            for count, name in ((self.n, "state"), (self.nu, "input"), (self.ny, "output"))
        )
        shown = _MATRICES if noise else _MATRICES[:-1]
        return "\n".join(
            [
                f"{left} = A x(t) + B u(t){noise}, y(t) = C x(t) + D u(t) + e(t)",
                sizes,
                *(_printed(name, getattr(self, name)) for name in shown),
                "continuous time" if self.Ts is None else f"Ts = {self.Ts:g} s",
            ]
        )


def _printed(name: str, M: Floats) -> str:
    """Return a matrix with its name, one line a row."""
    cells = [[f"{x:.4g}" for x in row] for row in M]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    rows = [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        for row in cells
    ]
    head = f"{name} = [ "
    return ("\n" + " " * len(head)).join(rows).join([head, " ]"])


def _matrix(x: Any, name: str, *, column: bool) -> Floats:
    """Return a frozen matrix; a vector is a column or a row."""
    a = np.array(x, float)
    if a.ndim == 1:
        a = a.reshape(-1, 1) if column else a.reshape(1, -1)
    if a.ndim == 0:
        a = a.reshape(1, 1)
    if a.ndim != 2 or a.size == 0 or not np.isfinite(a).all():
        raise refusal(
            "U01",
            f"`{name}` has shape {a.shape}, must be a finite matrix",
            remedy="one row per state or output",
        )
    a = np.ascontiguousarray(a)
    a.flags.writeable = False
    return a
