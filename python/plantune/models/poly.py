"""Polynomial model `A y = (B / F) u + (C / D) e`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from plantune.errors import refusal
from plantune.models.base import LinearModel, coefficients
from plantune.models.matrix_poly import MatrixPolyModel
from plantune.record import Floats

_ONE = (1.0,)


@dataclass(frozen=True, slots=True, eq=False)
class PolyModel(LinearModel):
    """`A(q) y(t) = sum_i B_i(q)/F_i(q) u_i(t - nk_i) + C(q)/D(q) e(t)`.

    Parameters
    ----------
    A, C, D : array
        Ascending powers of `q^-1`, beginning with 1.
    B, F : array, or a list of arrays with several inputs
        `B` without leading zeros (the delay is `nk`); `F` beginning with 1.
    nk : int, or a list with several inputs
        Delay in samples.
    Ts : float
        Sample time, seconds.

    Notes
    -----
    An `A` or a `B` of three dimensions is a model of several outputs: `MatrixPolyModel`, which is
    returned and has no C D F.

    Examples
    --------
    >>> print(PolyModel(A=[1, -0.8], B=[0.5], nk=3, Ts=0.1))
    A(q) y(t) = B(q) u(t - 3) + e(t)
    A(q) = 1 - 0.8 q^-1
    B(q) = 0.5
    Ts = 0.1 s
    """

    kind: ClassVar[str] = "poly"

    A: Floats = _ONE  # type: ignore[assignment]
    B: Any = _ONE
    C: Floats = _ONE  # type: ignore[assignment]
    D: Floats = _ONE  # type: ignore[assignment]
    F: Any = None
    nk: Any = 1
    Ts: float = 1.0

    def __new__(cls, *args: Any, **fields: Any) -> Any:
        """Return a `MatrixPolyModel` where `A` holds matrices."""
        given = dict(zip(cls.__slots__, args, strict=False)) | fields
        if np.ndim(given.get("A", _ONE)) == 3:
            return MatrixPolyModel(**given)
        return object.__new__(cls)

    def __post_init__(self) -> None:
        several = len(self.B) > 0 and np.ndim(self.B[0]) > 0
        inputs = len(self.B) if several else 1
        frozen: dict[str, Any] = {p: _monic(getattr(self, p), p) for p in ("A", "C", "D")}
        F = ([_ONE] * inputs if several else _ONE) if self.F is None else self.F
        if several:
            frozen["B"] = [coefficients(b, "B") for b in self.B]
            frozen["F"] = [_monic(f, "F") for f in F]
        else:
            frozen["B"], frozen["F"] = coefficients(self.B, "B"), _monic(F, "F")
        nk = self.nk if np.ndim(self.nk) else [self.nk] * inputs
        if len(nk) != inputs or len(self._list(frozen["F"])) != inputs:
            raise refusal("U01", f"B has {inputs} inputs, `nk` {len(nk)}", remedy="one per input")
        if any(k < 0 or k != int(k) for k in nk):
            raise refusal("U01", f"`nk` is {nk}, must be whole and >= 0", remedy="nk=1")
        frozen["nk"] = [int(k) for k in nk] if several else int(nk[0])
        frozen["Ts"] = float(self.Ts)
        for name, value in frozen.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of_core(cls, d: Mapping[str, Any]) -> PolyModel:
        """Return the model that the core sends: one input has its polynomials bare."""
        model = object.__new__(cls)  # what the core sends is checked there
        single = len(d["B"]) == 1
        for name, value in d.items():
            bare = single and name in ("B", "F", "nk")
            object.__setattr__(model, name, value[0] if bare else value)
        return model

    @property
    def core(self) -> SimpleNamespace:
        """The model as the core reads it: every polynomial of an input in a list."""
        return SimpleNamespace(
            A=self.A.tolist(),
            B=[b.tolist() for b in self._list(self.B)],
            C=self.C.tolist(),
            D=self.D.tolist(),
            F=[f.tolist() for f in self._list(self.F)],
            nk=self.nk if isinstance(self.nk, list) else [self.nk],
            Ts=self.Ts,
        )

    @staticmethod
    def _list(x: Any) -> Sequence[Any]:
        return x if isinstance(x, list) else [x]

    def __str__(self) -> str:
        inputs = zip(self._list(self.B), self._list(self.F), self.core.nk, strict=True)
        terms: list[str] = []
        lines: list[str] = []
        several = isinstance(self.B, list)
        for i, (b, f, nk) in enumerate(inputs, 1):
            tag = str(i) if several else ""
            over = f"/F{tag}(q)" if len(f) > 1 else ""
            terms.append(f"B{tag}(q){over} u{tag}(t - {nk})")
            lines.append(f"B{tag}(q) = {written(b)}")
            if over:
                lines.append(f"F{tag}(q) = {written(f)}")
        noise = "C(q)" if len(self.C) > 1 else ""
        noise += "/D(q)" if len(self.D) > 1 else ""
        left = "A(q) y(t)" if len(self.A) > 1 else "y(t)"
        head = f"{left} = {' + '.join(terms)} + {noise and noise + ' '}e(t)"
        own = [
            f"{name}(q) = {written(p)}"
            for name, p in (("A", self.A), ("C", self.C), ("D", self.D))
            if len(p) > 1
        ]
        return "\n".join([head, *own[:1], *lines, *own[1:], f"Ts = {self.Ts:g} s"])


def _monic(p: Any, name: str) -> Floats:
    x = coefficients(p, name)
    if x[0] != 1.0:
        raise refusal("U01", f"`{name}` begins with {x[0]}, must begin with 1", remedy="divide")
    return x


def written(p: Floats) -> str:
    """Return a polynomial in `q^-1` as text."""
    terms: list[str] = []
    for k, c in enumerate(p):
        power = f" q^-{k}" if k else ""
        sign = ("-" if c < 0 else "+") if terms else ("-" if c < 0 else "")
        terms.append(f"{sign} {abs(c):.6g}{power}" if terms else f"{sign}{abs(c):.6g}{power}")
    return " ".join(terms)
