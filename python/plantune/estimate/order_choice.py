"""The orders of a polynomial model, by criteria and by the loss on fresh rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.orders import Orders, whole
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Record
from plantune.text import number, table

Range = int | tuple[int, int]
"""One number, or the lowest and the highest of several."""

_MOST = 5000
_USED = {"ARX": ("na", "nb"), "OE": ("nb", "nf"), "ARMAX": ("na", "nb", "nc")}


@dataclass(frozen=True, slots=True)
class OrderRow:
    """One candidate: its orders, and what it leaves.

    Attributes
    ----------
    orders : Orders
        `na nb nc nd nf nk`; `nb nf nk` one per input.
    d : int
        Number of coefficients.
    loss, fpe, aic, bic : float
        Mean squared one-step error on the rows of the fit, and the criteria from it.
    fresh : float or None
        Mean squared one-step error on fresh rows.
    converged : bool
        Whether the search ended at a minimum.

    Examples
    --------
    >>> import plantune as pt
    >>> pt.estimate.order(pt.datasets.hair_dryer(), na=2, nb=2, nk=3).best.d
    4
    """

    orders: Orders
    d: int
    loss: float
    fpe: float
    aic: float
    bic: float
    fresh: float | None
    converged: bool

    def __str__(self) -> str:
        return ", ".join(f"{name} = {value}" for name, value in _said(self.orders))


@dataclass(frozen=True, slots=True, eq=False)
class OrderTable:
    """All candidates on the same rows; prints as a table.

    Attributes
    ----------
    method : str
        `ARX`, `OE` or `ARMAX`.
    rows : tuple of OrderRow
        In the order of the grid.
    best : OrderRow
        With fresh rows the smallest model whose loss there is within the share X06 of the least;
        without, the least BIC.
    runner_up : OrderRow or None
        The next by what decides.
    N : int
        Rows on which all were fitted.
    notes : tuple of Note
        V14 where other orders do about as well or the grid ends at the best, X06 where one of
        another delay does.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> found = pt.estimate.order(pt.datasets.hair_dryer(), na=(1, 3), nb=(1, 3), nk=(2, 4))
    >>> len(found.rows), found.N, found.best.orders.nk
    (27, 994, [3])
    """

    method: str
    rows: tuple[OrderRow, ...]
    best: OrderRow
    runner_up: OrderRow | None
    N: int
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        names = [name for name, _ in _said(self.best.orders)]
        shown = sorted(self.rows, key=_decides)[:12]
        by = "loss on fresh rows" if self.best.fresh is not None else "BIC"
        head = f"{len(self.rows)} {self.method} models on {self.N} rows, by {by}; best: {self.best}"
        lines = table([("", *names, "loss", "FPE", "AIC", "BIC", "fresh"), *map(self._row, shown)])
        return "\n".join([head, *lines, *(f"  {note}" for note in self.notes)])

    def _row(self, row: OrderRow) -> list[str]:
        mark = "best" if row is self.best else "next" if row is self.runner_up else ""
        fresh = "-" if row.fresh is None else number(row.fresh)
        criteria = [number(row.fpe), f"{row.aic:.1f}", f"{row.bic:.1f}", fresh]
        return [mark, *(str(v) for _, v in _said(row.orders)), number(row.loss), *criteria]


def order(
    rec: Record,
    method: Literal["ARX", "OE", "ARMAX", "arx", "oe", "armax"] = "ARX",
    *,
    na: Range = (1, 4),
    nb: Range | Sequence[Range] = (1, 4),
    nc: Range = (1, 2),
    nf: Range | Sequence[Range] = (1, 3),
    nk: Range | Sequence[Range] = (1, 5),
    fresh: Record | None = None,
    offset: bool = True,
    limits: Limits | None = None,
) -> OrderTable:
    """Compare a grid of orders and delays on the same rows of a record.

    Parameters
    ----------
    rec : Record
        One output.
    method : "ARX", "OE" or "ARMAX"
        Which structure, in letters of either case; orders that it does not have are not used.
    na, nc : int or (low, high)
        Orders tried, inclusive.
    nb, nf, nk : int or (low, high), or a list of these
        The same for every input, or one per input.
    fresh : Record, optional
        Rows that no candidate has seen; the loss there decides.
    offset : bool
        Whether a constant is estimated as well.
    limits : Limits, optional
        Thresholds; X06 is the share of loss that does not count.

    Returns
    -------
    OrderTable
        Near-ties are named, not hidden.

    Raises
    ------
    NotIdentifiable
        No candidate is supported by the record: the refusal of the first.
    UsageError
        A range that is none, or more than 5000 candidates (U01).

    Notes
    -----
    All ARX candidates come from one triangle; others are fitted one by one.
    Source 001, 3.5.5; Ljung 1999, 16.4.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> found = order(est, na=(1, 6), nb=(1, 6), nk=(1, 6), fresh=val)
    >>> len(found.rows), found.best.d < found.runner_up.d
    (216, True)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    name = str(method).upper()
    if name not in _USED:
        raise refusal("U01", f"`method` is {method!r}, must be one of ARX, OE, ARMAX", remedy="ARX")
    ranges = {"na": na, "nb": nb, "nc": nc, "nf": nf}
    wanted = {k: v if k in _USED[name] else 0 for k, v in ranges.items()}
    grid = _grid(rec.nu, {**wanted, "nk": nk})
    d = _core.order_choice(rec, grid, fresh, offset, limits)
    rows = tuple(_order_row(row) for row in d["rows"])
    runner_up = d["runner_up"]
    return OrderTable(
        method=name,
        rows=rows,
        best=rows[d["best"]],
        runner_up=None if runner_up is None else rows[runner_up],
        N=d["N"],
        notes=(*notes_from_core(d["notes"]), *limits.changes()),
        source=rec.source,
    )


def _grid(nu: int, ranges: Mapping[str, Any]) -> list[Orders]:
    """Return all combinations."""
    na, nc = (_values(name, ranges[name]) for name in ("na", "nc"))
    nb, nf, nk = (_per_input(name, ranges[name], nu) for name in ("nb", "nf", "nk"))
    count = len(na) * len(nc) * len(nb) * len(nf) * len(nk)
    if count > _MOST:
        raise refusal(
            "U01",
            f"{count} candidates are asked for, at most {_MOST} are compared",
            count=count,
            remedy="give narrower ranges, or the delays of `analyze.delay`",
        )
    return [
        Orders(a, list(b), c, 0, list(f), list(k)) for a, b, c, f, k in product(na, nb, nc, nf, nk)
    ]


def _per_input(name: str, value: Any, nu: int) -> list[tuple[int, ...]]:
    """Return combinations over the inputs; one range moves all inputs together."""
    if isinstance(value, list):
        if len(value) != nu:
            raise refusal("U01", f"`{name}` has {len(value)} entries, must have {nu}", remedy="one")
        return list(product(*(_values(name, v) for v in value)))
    return [(v,) * nu for v in _values(name, value)]


def _values(name: str, value: Any) -> list[int]:
    if not isinstance(value, tuple):
        return [whole(name, value)]
    if len(value) != 2 or whole(name, value[0]) > whole(name, value[1]):
        raise refusal(
            "U01",
            f"`{name}` is {value!r}, must be a number or an ascending pair",
            where=(name, None, None),
            remedy=f"{name}=(1, 4)",
        )
    return list(range(whole(name, value[0]), whole(name, value[1]) + 1))


def _order_row(d: Mapping[str, Any]) -> OrderRow:
    names = ("na", "nb", "nc", "nd", "nf", "nk")
    rest = {name: value for name, value in d.items() if name not in names}
    return OrderRow(orders=Orders(*(d[name] for name in names)), **rest)


def _said(orders: Orders) -> list[tuple[str, object]]:
    """Return the orders in use; one number where there is one input."""
    each = [(k, v[0] if isinstance(v, list) and len(v) == 1 else v) for k, v in _fields(orders)]
    return [(k, v) for k, v in each if k == "nk" or (any(v) if isinstance(v, list) else v)]


def _fields(orders: Orders) -> list[tuple[str, Any]]:
    return list(orders._asdict().items())


def _decides(row: OrderRow) -> float:
    return row.bic if row.fresh is None else row.fresh
