"""A fit as its equation, one standard deviation in brackets behind each number."""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, isfinite, log10
from typing import Any

from plantune.models import PolyModel, ProcessModel, TermModel
from plantune.record import Floats

_DIGITS = 9  # decimals beyond which a fixed-point number is no pleasure to read


def equation(
    model: PolyModel | ProcessModel | TermModel, sd: Floats, offset: tuple[float, float] | None
) -> str:
    """Return the equation of a model; `sd` in the order of its parameters, `offset` with its own.

    Examples
    --------
    >>> import numpy as np
    >>> model = PolyModel(A=[1, -0.8745], B=[-0.7455], nk=6, Ts=0.02)
    >>> print(equation(model, np.array([0.0012, 0.0031]), (583.4512, 0.02)))
    A(q) y(t) = B(q) u(t - 6) + e(t)
    A(q) = 1 - 0.8745 (0.0012) q^-1
    B(q) = -0.7455 (0.0031)
    O = 583.451 (0.020)
    Ts = 0.02 s
    """
    if isinstance(model, ProcessModel):
        return "\n".join([*_process(model, sd), *_offset("O", offset)])
    sds = iter(sd.tolist())
    if isinstance(model, TermModel):
        return "\n".join(_terms(model, sds, offset))
    head, *_, last = str(model).splitlines()
    return "\n".join([head, *_polynomials(model, sds), *_offset("O", offset), last])


def with_sd(value: float, sd: float) -> str:
    """Return a number to two digits of its standard deviation, which follows in brackets.

    Examples
    --------
    >>> with_sd(-0.87451, 0.0123), with_sd(583.4512, 21.0), with_sd(2.5, 0.0)
    ('-0.875 (0.012)', '583 (21)', '2.5')
    """
    if not (isfinite(sd) and sd > 0.0):
        return f"{value:.6g}"
    decimals = 1 - floor(log10(sd))
    if decimals > _DIGITS or decimals < -3 or abs(value) > 1e7:
        return f"{value:.6g} ({sd:.2g})"
    decimals = max(decimals, 0)
    return f"{value:.{decimals}f} ({sd:.{decimals}f})"


def _offset(name: str, offset: tuple[float, float] | None) -> list[str]:
    return [] if offset is None else [f"{name} = {with_sd(*offset)}"]


def _polynomials(model: PolyModel, sds: Iterator[float]) -> Iterator[str]:
    """Yield `A B C D F`, each where it says anything; the deviations come in the same order."""
    core: Any = model.core
    several = len(core.B) > 1
    if len(core.A) > 1:
        yield f"A(q) = {_monic(core.A, sds)}"
    for i, b in enumerate(core.B, 1):
        yield f"B{i if several else ''}(q) = {_sum(b, [next(sds) for _ in b], 0)}"
    for name, p in (("C", core.C), ("D", core.D)):
        if len(p) > 1:
            yield f"{name}(q) = {_monic(p, sds)}"
    for i, f in enumerate(core.F, 1):
        if len(f) > 1:
            yield f"F{i if several else ''}(q) = {_monic(f, sds)}"


def _monic(p: list[float], sds: Iterator[float]) -> str:
    rest = [next(sds) for _ in p[1:]]
    tail = _sum(p[1:], rest, 1)
    return f"1 - {tail[1:]}" if tail.startswith("-") else f"1 + {tail}"


def _sum(p: list[float], sds: list[float], first: int) -> str:
    """Return coefficients of `q^-first` and further powers as a sum."""
    text = ""
    for k, (c, sd) in enumerate(zip(p, sds, strict=True), first):
        power = f" q^-{k}" if k else ""
        number = with_sd(abs(c), sd) + power
        sign = ("-" if c < 0 else "") if not text else (" - " if c < 0 else " + ")
        text += sign + number
    return text


def _process(model: ProcessModel, sd: Floats) -> Iterator[str]:
    """Yield the shape in letters, then a line for each."""
    several = len(model.times) > 1
    names = [f"T{i if several else ''}" for i in range(1, len(model.times) + 1)]
    factors = [f"({T} s + 1)" for T in names]
    if model.zeta is not None:
        first = names[0]
        factors[0] = f"({first}^2 s^2 + 2 zeta {first} s + 1)"
    below = " ".join((["s"] if model.integrating else []) + factors)
    above = "K" + (" (Tz s + 1)" if model.Tz else "") + (" e^(-L s)" if model.L else "")
    yield f"G(s) = {above}" + (f" / ({below})" if " " in below else f" / {below}" * bool(below))
    values = dict(zip(names, model.times, strict=True))
    yield from (f"{name} = {with_sd(value, s)}" for name, value, s in _named(model, values, sd))


def _named(
    model: ProcessModel, times: dict[str, float], sd: Floats
) -> Iterator[tuple[str, float, float]]:
    """Yield name, value and deviation in the order of `theta`: K, T, L, Tz, zeta."""
    zeta = {} if model.zeta is None else {"zeta": model.zeta}
    zero = {"Tz": model.Tz} if model.Tz else {}
    values = {"K": model.K, **times, **({"L": model.L} if model.L else {}), **zero, **zeta}
    sds = sd.tolist() if len(sd) == len(values) else [float("nan")] * len(values)
    for (name, value), s in zip(values.items(), sds, strict=True):
        yield name, value, s


def _terms(
    model: TermModel, sds: Iterator[float], d: tuple[float, float] | None
) -> Iterator[str]:
    """Yield the equation with the numbers of the regressors in it, then `A` and `B`."""
    linear = PolyModel(A=model.A, B=[b if len(b) else [0.0] for b in model.B], nk=model.nk)
    a = [next(sds) for _ in model.A[1:]]
    b = [[next(sds) for _ in part] for part in model.B]
    g = list(sds)
    paths = [
        f"B{i if len(model.B) > 1 else ''}(q) {name}(t - {nk})"
        for i, (name, nk, part) in enumerate(
            zip(model.u_names, model.nk, model.B, strict=True), 1
        )
        if len(part)
    ]
    right = " + ".join(paths)
    for value, sd, name in zip(model.g.tolist(), g, model.names, strict=True):
        sign = ("- " if value < 0 else "+ ") if right else ("-" if value < 0 else "")
        right += f"{' ' if right else ''}{sign}{with_sd(abs(value), sd)} {name}"
    if d is not None:
        right += f" {'-' if d[0] < 0 else '+'} {with_sd(abs(d[0]), d[1])}"
    left = f"A(q) {model.y_name}(t)" if len(model.A) > 1 else f"{model.y_name}(t)"
    yield f"{left} = {right} + e(t)"
    if len(model.A) > 1:
        yield f"A(q) = {_monic(linear.A.tolist(), iter(a))}"
    for i, (part, sd) in enumerate(zip(model.B, b, strict=True), 1):
        if len(part):
            yield f"B{i if len(model.B) > 1 else ''}(q) = {_sum(part.tolist(), sd, 0)}"
    yield f"Ts = {model.Ts:g} s"
