"""A fit as its equation, one standard deviation in brackets behind each number."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import TYPE_CHECKING, Any

from plantune.models import PolyModel, ProcessModel, TermModel

if TYPE_CHECKING:
    from plantune.estimate.fit import Fit

_DIGITS = 9  # decimals beyond which a fixed-point number is no pleasure to read


def equation(fit: Fit) -> str:
    """Return the equation of a fit.

    Examples
    --------
    >>> import plantune as pt
    >>> print(equation(pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5))))
    G(s) = K e^(-L s) / (T s + 1)
    K = -5.9345 (0.0054)
    T = 0.14861 (0.00076)
    L = 0.10049 (0.00058)
    O = 583.27 (0.17)
    """
    model, sds = fit.model, iter(fit.sd.tolist())
    offset = (float(fit.offset[0]), fit.offset_sd) if len(fit.P) > len(fit.theta) else None
    if isinstance(model, TermModel):
        return "\n".join(_terms(model, sds, offset))
    level = [] if offset is None else [f"O = {with_sd(*offset)}"]
    if isinstance(model, PolyModel):
        head, *_, last = str(model).splitlines()
        return "\n".join([head, *_polynomials(model, sds), *level, last])
    shape = _letters(model) if isinstance(model, ProcessModel) else str(model)
    named = zip(fit.names, fit.theta.tolist(), sds, strict=True)
    return "\n".join([shape, *(f"{name} = {with_sd(x, sd)}" for name, x, sd in named), *level])


def with_sd(value: float, sd: float) -> str:
    """Return a number to two digits of its standard deviation, which follows in brackets.

    Examples
    --------
    >>> with_sd(-0.87451, 0.0123), with_sd(583.4512, 21.0), with_sd(2.5, 0.0)
    ('-0.875 (0.012)', '583 (21)', '2.5')
    """
    if not (isfinite(sd) and sd > 0.0):
        return f"{value:.6g}"
    decimals = 1 - int(f"{sd:.1e}".partition("e")[2])
    if decimals > _DIGITS or decimals < -3 or abs(value) > 1e7:
        return f"{value:.6g} ({sd:.2g})"
    decimals = max(decimals, 0)
    return f"{value:.{decimals}f} ({sd:.{decimals}f})"


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


def _letters(model: ProcessModel) -> str:
    """Return the shape of a process model in letters."""
    several = len(model.times) > 1
    names = [f"T{i if several else ''}" for i in range(1, len(model.times) + 1)]
    factors = [f"({T} s + 1)" for T in names]
    if model.zeta is not None:
        factors[0] = f"({names[0]}^2 s^2 + 2 zeta {names[0]} s + 1)"
    below = " ".join((["s"] if model.integrating else []) + factors)
    above = "K" + (" (Tz s + 1)" if model.Tz else "") + (" e^(-L s)" if model.L else "")
    if not below:
        return f"G(s) = {above}"
    one = len(factors) + model.integrating == 1
    return f"G(s) = {above} / {below}" if one else f"G(s) = {above} / ({below})"


def _terms(model: TermModel, sds: Iterator[float], d: tuple[float, float] | None) -> Iterator[str]:
    """Yield the equation with the numbers of the regressors in it, then `A` and `B`."""
    linear = PolyModel(A=model.A, B=[b if len(b) else [0.0] for b in model.B], nk=model.nk)
    a = [next(sds) for _ in model.A[1:]]
    b = [[next(sds) for _ in part] for part in model.B]
    g = list(sds)
    paths = [
        f"B{i if len(model.B) > 1 else ''}(q) {name}(t - {nk})"
        for i, (name, nk, part) in enumerate(zip(model.u_names, model.nk, model.B, strict=True), 1)
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
    for i, (part, deviations) in enumerate(zip(model.B, b, strict=True), 1):
        if len(part):
            yield f"B{i if len(model.B) > 1 else ''}(q) = {_sum(part.tolist(), deviations, 0)}"
    yield f"Ts = {model.Ts:g} s"
