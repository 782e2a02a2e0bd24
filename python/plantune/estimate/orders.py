"""Orders of the polynomial family, as the estimators take them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from plantune.errors import refusal

PerInput = int | Sequence[int]
"""One number for all inputs, or one per input."""


class Orders(NamedTuple):
    """Numbers of free coefficients of `A B C D F` and delays; `nb nf nk` per input."""

    na: int
    nb: list[int]
    nc: int
    nd: int
    nf: list[int]
    nk: list[int]


def orders(
    nu: int,
    *,
    na: int = 0,
    nb: PerInput,
    nc: int = 0,
    nd: int = 0,
    nf: PerInput = 0,
    nk: PerInput,
) -> Orders:
    """Return checked orders for `nu` inputs (U01)."""
    return Orders(
        whole("na", na),
        _per_input("nb", nb, nu),
        whole("nc", nc),
        whole("nd", nd),
        _per_input("nf", nf, nu),
        _per_input("nk", nk, nu),
    )


def whole(name: str, value: object) -> int:
    """Return a checked whole number, zero or more (U01)."""
    if type(value) is int and value >= 0:
        return value
    if not isinstance(value, bool) and hasattr(value, "__index__") and value.__index__() >= 0:
        return value.__index__()  # type: ignore[no-any-return]
    raise refusal("U01", f"`{name}` is {value!r}, must be whole and >= 0", remedy=f"{name}=2")


def _per_input(name: str, value: PerInput, nu: int) -> list[int]:
    if type(value) is not int and isinstance(value, Sequence):
        return [whole(name, v) for v in value]
    return [whole(name, value)] * nu
