"""Polynomial model of several outputs, `A(q) y(t) = B(q) u(t - nk) + e(t)`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS
from plantune.record import Floats, Record, columns


@dataclass(frozen=True, slots=True, eq=False)
class MatrixPolyModel:
    """`y(t) + A_1 y(t-1) + … = B_0 u(t-nk) + B_1 u(t-nk-1) + … + e(t)`, matrices.

    `PolyModel` with an `A` and a `B` of three dimensions returns one.

    Parameters
    ----------
    A : array (na+1, ny, ny)
        Ascending powers of `q^-1`; `A[0]` is the identity.
    B : array (nb, ny, nu)
        Without leading zeros: the delay is `nk`.
    nk : int, or a list with one per input
        Delay in samples.
    Ts : float
        Sample time, seconds.

    Notes
    -----
    Source 000, (2.1-7) to (2.1-9).

    Examples
    --------
    >>> A = [[[1, 0], [0, 1]], [[-0.8, 0.1], [0, -0.5]]]
    >>> model = MatrixPolyModel(A=A, B=[[[0.5], [1.0]]], nk=2, Ts=0.1)
    >>> print(model)
    A(q) y(t) = B(q) u(t - 2) + e(t)
    y1(t) = 0.8 y1(t-1) - 0.1 y2(t-1) + 0.5 u1(t-2) + e1(t)
    y2(t) = 0.5 y2(t-1) + 1 u1(t-2) + e2(t)
    Ts = 0.1 s
    >>> model.dc_gain().round(3).tolist()
    [[1.5], [2.0]]
    """

    kind: ClassVar[str] = "matrix_poly"

    A: Floats
    B: Floats
    nk: Any = 1
    Ts: float = 1.0

    def __post_init__(self) -> None:
        A, B = _matrices(self.A, "A"), _matrices(self.B, "B")
        ny, nu = A.shape[1], B.shape[2]
        if A.shape[2] != ny or not np.array_equal(A[0], np.eye(ny)):
            raise refusal(
                "U01",
                f"`A` has shape {A.shape} or does not begin with the identity",
                remedy="A of shape (na+1, ny, ny), A[0] = I",
            )
        if B.shape[1] != ny:
            raise refusal(
                "U01", f"`B` has shape {B.shape}, A {A.shape}", remedy="B of shape (nb, ny, nu)"
            )
        nk = list(self.nk) if np.ndim(self.nk) else [self.nk] * nu
        if len(nk) != nu or any(k < 0 or k != int(k) for k in nk):
            raise refusal(
                "U01", f"`nk` is {self.nk}, must be whole and >= 0", remedy=f"one, or {nu}"
            )
        fields = {"A": A, "B": B, "nk": [int(k) for k in nk], "Ts": float(self.Ts)}
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of_core(cls, d: Mapping[str, Any]) -> MatrixPolyModel:
        """Return the model that the core sends."""
        ny, nk = d["ny"], d["nk"]
        A, B = d["A"].reshape(-1, ny, ny), d["B"].reshape(-1, ny, len(nk))
        return cls(A=A, B=B, nk=nk, Ts=d["Ts"])

    @property
    def core(self) -> SimpleNamespace:
        """The model as the core reads it."""
        A, B = (x.reshape(len(x), -1).tolist() for x in (self.A, self.B))
        return SimpleNamespace(A=A, B=B, nk=self.nk, ny=self.ny, Ts=self.Ts)

    @property
    def ny(self) -> int:
        """Number of outputs."""
        return int(self.A.shape[1])

    @property
    def nu(self) -> int:
        """Number of inputs."""
        return int(self.B.shape[2])

    def simulate(self, u: ArrayLike, Ts: float | None = None, x0: float = 0.0) -> Floats:
        """Return the outputs (N, ny) for the inputs `u` (N, nu), from rest.

        Raises
        ------
        UsageError
            `Ts` is not that of the model, an `x0`, or other columns than inputs (U01).

        Examples
        --------
        >>> model = MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]], nk=1, Ts=1.0)
        >>> model.simulate([1.0, 1.0, 1.0])[:, 0].tolist()
        [0.0, 2.0, 3.0]
        """
        if Ts is not None and abs(Ts - self.Ts) > 1e-9 * self.Ts:
            raise refusal("U01", f"`Ts` is {Ts}, the model's is {self.Ts}", remedy="leave it out")
        if x0 != 0.0:
            raise refusal("U01", f"`x0` is {x0}, must be 0", remedy="predict estimates the state")
        return _core.matrix_simulate(self, columns(u, "u"), None)

    def predict(self, rec: Record, horizon: int | None = 1, offset: ArrayLike = 0.0) -> Floats:
        """Return the outputs (N, ny) predicted `horizon` steps ahead; None simulates.

        A prediction runs from the rows measured until then; of a simulation the initial state of
        each segment is estimated.  Rows without history are NaN.

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
        >>> model = MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]], nk=1, Ts=1.0)
        >>> rec = pt.Record(u=[1, 1, 1], y=[0.0, 2.5, 3.0], Ts=1.0)
        >>> model.predict(rec)[:, 0].tolist()
        [nan, 2.0, 3.25]
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
        >>> model = MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]], nk=0, Ts=1.0)
        >>> model.freqresp([0.0])
        array([[[4.+0.j]]])
        """
        w = np.atleast_1d(np.asarray(w, float))
        return _core.matrix_freqresp(self, w.tolist()).reshape(len(w), self.ny, self.nu)

    def poles(self) -> NDArray[np.complex128]:
        """Return the poles in z: eigenvalues of the block companion matrix of `A`.

        Examples
        --------
        >>> MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]]).poles()
        array([0.5+0.j])
        """
        return _core.matrix_poles(self)

    def dc_gain(self) -> Floats:
        """Return the static gains (ny, nu); infinite with a pole at 1.

        Examples
        --------
        >>> MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]]).dc_gain()
        array([[4.]])
        """
        return _core.matrix_dc_gain(self)

    def to_control(self, **options: Any) -> Any:
        """Return a sampled `StateSpace` of python-control; options as of `pt.export.to_control`.

        Examples
        --------
        >>> MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]], Ts=0.1).to_control().dt
        0.1
        """
        from plantune.models.control import to_control

        return to_control(self, **options)

    def same_as(self, other: Any) -> bool:
        """Whether the other model has the same class and numbers.

        Examples
        --------
        >>> model = MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.0]]])
        >>> model.same_as(MatrixPolyModel(A=[[[1.0]], [[-0.5]]], B=[[[2.5]]]))
        False
        """
        mine = (self.A, self.B, self.nk, self.Ts)
        return type(self) is type(other) and all(
            np.array_equal(a, b)
            for a, b in zip(mine, (other.A, other.B, other.nk, other.Ts), strict=True)
        )

    def __str__(self) -> str:
        delays = sorted(set(self.nk))
        head = f"u(t - {delays[0]})" if len(delays) == 1 else "u(t - nk)"
        lines = [f"A(q) y(t) = B(q) {head} + e(t)"]
        for i in range(self.ny):
            terms = [
                (-self.A[k, i, j], f"y{j + 1}(t-{k})")
                for j in range(self.ny)
                for k in range(1, len(self.A))
            ]
            terms += [
                (self.B[k, i, j], f"u{j + 1}(t-{nk + k})" if nk + k else f"u{j + 1}(t)")
                for j, nk in enumerate(self.nk)
                for k in range(len(self.B))
            ]
            lines.append(f"y{i + 1}(t) = {_sum(terms)} + e{i + 1}(t)")
        return "\n".join([*lines, f"Ts = {self.Ts:g} s"])


def _sum(terms: Sequence[tuple[float, str]]) -> str:
    text = ""
    for c, signal in terms:
        if c == 0.0:
            continue
        sign = (" - " if c < 0 else " + ") if text else ("-" if c < 0 else "")
        text += f"{sign}{abs(c):.6g} {signal}"
    return text or "0"


def _matrices(x: Any, name: str) -> Floats:
    """Return a frozen array of three dimensions; refuse what is not finite."""
    a = np.array(x, float)
    if a.ndim != 3 or a.size == 0 or not np.isfinite(a).all():
        raise refusal(
            "U01",
            f"`{name}` has shape {a.shape}, must be finite and of three dimensions",
            remedy="one matrix per lag",
        )
    a.flags.writeable = False
    return a
