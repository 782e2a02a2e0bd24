"""Models of hysteresis in C: `init(s)` in the virgin state, `step(s, x)` returns y.

Inverses are models too: that of a `SeriesSlip` is one, those of a `PlayStack` and of a
`MaxwellSlip` are a `PlayStack`, that of an `AsymmetricStack` is an `AsymmetricInverse`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from plantune.errors import refusal
from plantune.export.c_text import array, declared, double, function
from plantune.export.subject import hysteresis_about
from plantune.models.hysteresis.asymmetric_stack import AsymmetricStack
from plantune.models.hysteresis.base import HysteresisModel


def hysteresis(model: HysteresisModel, p: str, units: tuple[str, str]) -> list[str]:
    """Return the lines of a source whose names begin with `p`."""
    writer = _WRITERS.get(model.kind)
    if writer is None:
        raise refusal(
            "U01",
            f"a {type(model).__name__} cannot be exported",
            remedy="export one of " + ", ".join(sorted(_WRITERS)),
        )
    return writer(model, p, hysteresis_about(model, units))


def _heads(p: str) -> tuple[str, str]:
    return f"void {p}_init({p}_state *s)", f"double {p}_step({p}_state *s, double x)"


def _series_slip(model: Any, p: str, about: tuple[str, ...]) -> list[str]:
    """Write the last element passed in the present direction; before the first, y holds."""
    rows = [*model.up.tolist(), *model.down.tolist()]
    n_up, n = len(model.up), len(rows)
    state = {"double x, y;": "last input and output", "double way;": "1 rising, -1 falling"}
    init, step = _heads(p)
    return [
        *declared(p, about, state, {init: "", step: "returns y"}),
        f"static const double {p}_elements[{n}][3] = {{ /* x_b, y_b, slope */",
        *(f"    {{{', '.join(map(double, row))}}}," for row in rows),
        "};",
        "",
        *function(
            init,
            "s->x = -1.7976931348623157e308; /* from below: whatever comes has risen */",
            f"s->y = {p}_elements[0][1];",
            "s->way = 1.0;",
        ),
        "",
        *function(
            step,
            "if (!(x - x == 0.0))",
            "    return s->y; /* not a reading: the output holds */",
            "if (x != s->x)",
            "    s->way = x > s->x ? 1.0 : -1.0;",
            "s->x = x;",
            f"const int end = s->way > 0.0 ? {n_up} : {n};",
            f"for (int i = s->way > 0.0 ? 0 : {n_up}; i < end; i++) {{",
            f"    const double *e = {p}_elements[i];",
            "    if ((x - e[0]) * s->way < 0.0)",
            "        break;",
            "    s->y = e[1] + e[2] * (x - e[0]);",
            "}",
            "return s->y;",
        ),
    ]


def _play_stack(model: Any, p: str, about: tuple[str, ...]) -> list[str]:
    """Write plays and their weighted sum."""
    return _stack(model, p, about, [], f"return {p}_plays(s, x);", model.offset)


def _asymmetric_stack(model: Any, p: str, about: tuple[str, ...]) -> list[str]:
    """Write plays, and the curve through which they are seen."""
    return _stack(model, p, about, _curve(model, p), f"return {p}_curve({p}_plays(s, x));")


def _asymmetric_inverse(model: Any, p: str, about: tuple[str, ...]) -> list[str]:
    """Write the curve, and plays behind it."""
    return _stack(model, p, about, _curve(model, p), f"return {p}_plays(s, {p}_curve(x));")


def _stack(
    model: Any, p: str, about: tuple[str, ...], curve: list[str], step_is: str, offset: float = 0.0
) -> list[str]:
    """Write plays, with what a step makes of them and of a curve."""
    n = len(model.r)
    init, step = _heads(p)
    state = {f"double z[{n}];": "outputs of the plays"}
    return [
        *declared(p, about, state, {init: "", step: "returns y"}),
        *curve,
        "/* the plays: half widths, weights, first outputs */",
        array(f"{p}_r", model.r),
        array(f"{p}_w", model.w),
        array(f"{p}_z0", model.z0),
        "",
        *function(
            f"static double {p}_plays({p}_state *s, double x)",
            f"double sum = {double(offset)};",
            f"for (int i = 0; i < {n}; i++) {{",
            f"    const double low = x - {p}_r[i], high = x + {p}_r[i];",
            "    if (x - x == 0.0) /* else it is no reading: all holds */",
            "        s->z[i] = s->z[i] < low ? low : s->z[i] > high ? high : s->z[i];",
            f"    sum += {p}_w[i] * s->z[i];",
            "}",
            "return sum;",
        ),
        "",
        *function(init, f"for (int i = 0; i < {n}; i++)", f"    s->z[i] = {p}_z0[i];"),
        "",
        *function(step, step_is),
    ]


def _curve(model: Any, p: str) -> list[str]:
    """Write a rising curve: straight lines through knots."""
    # Without one, a knot at 0 that changes nothing.
    knots = model.knots if len(model.knots) else [0.0]
    slopes = model.slopes if len(model.knots) else [*model.slopes, *model.slopes]
    line = AsymmetricStack(np.zeros(1), np.ones(1), model.knots, model.slopes, model.offset)
    return [
        "/* the curve: knots, its values there, slopes below, between and above them */",
        array(f"{p}_knots", knots),
        array(f"{p}_at_knots", line.simulate(knots).tolist()),
        array(f"{p}_slopes", slopes),
        "",
        *function(
            f"static double {p}_curve(double h)",
            "int k = 0;",
            f"while (k < {len(knots)} && {p}_knots[k] < h)",
            "    k++;",
            "const int near = k > 0 ? k - 1 : 0;",
            f"return {p}_at_knots[near] + {p}_slopes[k] * (h - {p}_knots[near]);",
        ),
        "",
    ]


def _maxwell_slip(model: Any, p: str, about: tuple[str, ...]) -> list[str]:
    """Write springs whose blocks stay within f / k of x."""
    # Without one, a block whose spring is none.
    r, k = (model.r, model.k) if len(model.k) else ([0.0], [0.0])
    n = len(k)
    init, step = _heads(p)
    state = {"double x;": "last input", f"double block[{n}];": "where each block stands"}
    return [
        *declared(p, about, state, {init: "", step: "returns y"}),
        array(f"{p}_r", r),
        array(f"{p}_k", k),
        "",
        *function(init, "s->x = 0.0;", f"for (int i = 0; i < {n}; i++)", "    s->block[i] = 0.0;"),
        "",
        *function(
            step,
            "if (x - x == 0.0) /* else it is no reading: all holds */",
            "    s->x = x;",
            f"double y = {double(model.offset)} + {double(model.spring)} * s->x;",
            f"for (int i = 0; i < {n}; i++) {{",
            f"    const double low = s->x - {p}_r[i], high = s->x + {p}_r[i];",
            "    const double at = s->block[i];",
            "    s->block[i] = at < low ? low : at > high ? high : at;",
            f"    y += {p}_k[i] * (s->x - s->block[i]);",
            "}",
            "return y;",
        ),
    ]


_WRITERS: dict[str, Callable[[Any, str, tuple[str, ...]], list[str]]] = {
    "series_slip": _series_slip,
    "play_stack": _play_stack,
    "asymmetric_stack": _asymmetric_stack,
    "asymmetric_inverse": _asymmetric_inverse,
    "maxwell_slip": _maxwell_slip,
}
