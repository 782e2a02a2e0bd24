"""Model structures of `plantune identify`: each is a verb of `plantune.estimate` and its orders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from plantune import estimate
from plantune.errors import NotIdentifiable, PlantuneError, refusal
from plantune.estimate import Fit
from plantune.record import Record
from plantune.validate import Verdict, check

_ORDERS = {
    "arx": "na nb",
    "armax": "na nb nc",
    "oe": "nb nf",
    "bj": "nb nc nd nf",
    "ararx": "na nb nd",
    "ararmax": "na nb nc nd",
    "iv4": "na nb",
    "srivc": "n nb",
    "process": "code",
    "subspace": "n",
}
"""Verb, and what `--orders` holds in the order of its arguments; a new verb is one line."""

_WITHOUT_NK = ("process", "srivc", "subspace")  # a real number, or in the states


@dataclass(frozen=True, slots=True)
class Identified:
    """A fit, and its verdict on the rows that were kept fresh."""

    fit: Fit
    equation: str
    verdict: Verdict | None

    def __str__(self) -> str:
        fit = self.fit
        head = f"{fit.method}, {fit.N} rows, loss {fit.loss:.4g}, {fit.status}"
        fresh = [f"on fresh rows: {self.verdict}"] if self.verdict is not None else []
        return "\n".join([head, self.equation, *(f"  {note}" for note in fit.notes), *fresh])


def structures() -> list[str]:
    """Return the structures that there are."""
    return [name for name in _ORDERS if hasattr(estimate, name)]


def orders_help() -> str:
    """Return what `--orders` holds for each of them."""
    return "; ".join(f"{name}: {_ORDERS[name].replace(' ', ',')}" for name in structures())


def identified(
    rec: Record, name: str, orders: str, nk: str, regressors: list[str], split: float | None
) -> Identified:
    """Fit a structure, and judge it on the rows behind the split."""
    est, val = (rec, None) if split is None else rec.split(split)
    fit = _fitted(est, name, orders, nk, regressors)
    return Identified(fit, fit.equation(), None if val is None else _judged(val, fit))


def _judged(val: Record, fit: Fit) -> Verdict:
    """Return the verdict, also of a model that is no better than the mean: it says so."""
    try:
        return check(val, fit)
    except NotIdentifiable as error:
        if not isinstance(error.result, Verdict):
            raise
        return error.result


def _fitted(rec: Record, name: str, orders: str, nk: str, regressors: list[str]) -> Fit:
    wanted: dict[str, Any] = _orders(name, orders)
    if name not in _WITHOUT_NK:
        wanted["nk"] = _numbers("nk", nk)
    if regressors:
        if name != "arx":
            raise _wrong("regressor", "given", "for --model arx", "leave it out")
        wanted["regressors"] = regressors
    fit: Fit = getattr(estimate, name)(rec, **wanted, limits=rec.limits)
    return fit


def _orders(name: str, given: str) -> dict[str, Any]:
    names = _ORDERS[name].split()
    example = {"process": "P1D"}.get(name, ",".join("2" for _ in names))
    parts = [part.strip() for part in given.split(",")] if given else []
    if len(parts) != len(names):
        needed = ",".join(names)
        raise _wrong("orders", repr(given), f"{needed} for {name}", f"--orders {example}")
    if name == "process":
        codes = parts[0].split(":")
        return {"code": codes if len(codes) > 1 else codes[0]}
    return {order: _numbers("orders", part) for order, part in zip(names, parts, strict=True)}


def _numbers(option: str, given: str) -> int | list[int]:
    """Return one number, or one per input: `1:2`."""
    parts = given.split(":")
    if not all(part.isdecimal() for part in parts):
        raise _wrong(option, repr(given), "whole numbers, one per input as 1:2", f"--{option} 1")
    numbers = [int(part) for part in parts]
    return numbers[0] if len(numbers) == 1 else numbers


def _wrong(option: str, came: str, needed: str, remedy: str) -> PlantuneError:
    text = f"`--{option}` is {came}, must be {needed}"
    return refusal("U01", text, where=(option, None, None), remedy=remedy)
