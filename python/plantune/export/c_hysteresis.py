"""Models of hysteresis in C: `init(s)` in the virgin state, `step(s, x)` returns y.

A model and its inverse are of one class, so the inverse needs nothing of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from plantune.errors import refusal
from plantune.export.c_text import declared, double, function
from plantune.export.subject import hysteresis_about
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


def _series_slip(model: Any, p: str, about: tuple[str, ...]) -> list[str]:
    """Write the last element passed in the present direction; before the first, y holds."""
    rows = [*model.up.tolist(), *model.down.tolist()]
    n_up, n = len(model.up), len(rows)
    state = {"double x, y;": "last input and output", "double way;": "1 rising, -1 falling"}
    init, step = f"void {p}_init({p}_state *s)", f"double {p}_step({p}_state *s, double x)"
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


_WRITERS: dict[str, Callable[[Any, str, tuple[str, ...]], list[str]]] = {
    "series_slip": _series_slip,
}
