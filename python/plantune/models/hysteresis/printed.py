"""Models made of elements, as text: an equation, and tables of the elements."""

from __future__ import annotations

from typing import Any

from plantune.text import number, table

_MOST = 24  # elements of a table that are printed


def elements(model: Any, equation: str, *tables: tuple[str, ...]) -> str:
    """Return the equation and tables of the fields named, deviations behind what was fitted.

    Examples
    --------
    >>> import plantune as pt
    >>> stack = pt.hysteresis.PlayStack(r=[0, 1], w=[2, 1], offset=3)
    >>> print(elements(stack, "y = offset + sum w z", ("r", "w")))
    y = offset + sum w z
         r  w
      0  0  2
      1  1  1
      offset 3
    """
    found = model.identified
    sd = dict(zip(found.names, found.sd, strict=False)) if found else {}
    lines = [line for names in tables for line in _table(model, names, sd)]
    for name in ("spring", "offset"):
        if getattr(model, name, 0.0):
            lines.append(f"{name} {_cell(getattr(model, name), sd.get(name))}")
    return "\n  ".join([equation, *lines])


def _table(model: Any, names: tuple[str, ...], sd: dict[str, float]) -> list[str]:
    columns = [getattr(model, name) for name in names]
    n = max(map(len, columns))
    rows = [["", *names]]
    for i in range(min(n, _MOST)):
        row = [
            _cell(values[i], sd.get(f"{name.removesuffix('s')}{i}")) if i < len(values) else ""
            for name, values in zip(names, columns, strict=True)
        ]
        rows.append([str(i), *row])
    more = [f"and {n - _MOST} more"] if n > _MOST else []
    return [line.rstrip() for line in table(rows)] + more


def _cell(value: float, sd: float | None) -> str:
    return f"{value:.5g}" if not sd else f"{value:.5g} ± {number(float(sd), 2)}"
