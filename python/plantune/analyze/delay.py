"""Delay by a scan of ARX models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True, eq=False)
class DelayScan:
    """The delays tried, and the loss that the best model of each leaves.

    Attributes
    ----------
    nk : int
        Best delay in samples; `order` is the order `na = nb` it goes with.
    candidates, loss, orders : arrays
        Every delay, its loss in units of y squared, and the order at which it does best.
    runner_up : int
        The next best delay.
    N : int
        Rows on which all were compared.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> scan = pt.analyze.delay(pt.datasets.hair_dryer(), nk=(1, 5))
    >>> scan.nk, scan.runner_up, scan.candidates.tolist()
    (3, 2, [1, 2, 3, 4, 5])
    >>> scan.loss.round(4)
    array([0.0015, 0.0014, 0.0015, 0.0075, 0.0093])
    """

    nk: int
    order: int
    candidates: np.ndarray[tuple[int], np.dtype[np.int64]]
    loss: Floats
    orders: np.ndarray[tuple[int], np.dtype[np.int64]]
    runner_up: int
    N: int
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        return f"nk = {self.nk} (order {self.order}; next {self.runner_up})"


def delay(
    rec: Record,
    nk: tuple[int, int] = (0, 20),
    *,
    input: int = 0,
    limits: Limits | None = None,
) -> DelayScan:
    """Scan the delay of ARX models whose order is chosen as well.

    Parameters
    ----------
    rec : Record
        One output.
    nk : (low, high)
        Delays in samples, inclusive; `nk = 1` means `u(t-1)`.
    input : int
        Which input.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    DelayScan
        With note X05 when the best delay lies at an end of the range, X06 when the best two
        do about equally well.

    Raises
    ------
    NotIdentifiable
        No delay lets u explain y (X04), the range or the delay reaches beyond a third of the
        record (X05), the input stands still (X01).

    Notes
    -----
    Orders 1 to 4, judged by BIC; all candidates come from one QR.  Source 001, 3.5.4.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.delay(pt.datasets.hair_dryer()))
    nk = 3 (order 3; next 2)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    return scan_from_core(_core.delay(rec, input, checked_range(nk), limits), rec, limits)


def scan_from_core(d: Mapping[str, Any], rec: Record, limits: Limits) -> DelayScan:
    """Return the fields that the core sends as a value."""
    return DelayScan(
        **{
            **d,
            "candidates": np.array(d["candidates"]),
            "orders": np.array(d["orders"]),
            "notes": (*notes_from_core(d["notes"]), *limits.changes()),
        },
        source=rec.source,
    )


def checked_range(nk: object) -> tuple[int, int]:
    """Return a range of delays; refuse what is none (U01)."""
    ends = tuple(nk) if isinstance(nk, tuple | list) else ()
    if len(ends) != 2 or not all(isinstance(k, int) and 0 <= k < 2**53 for k in ends):
        raise refusal(
            "U01",
            f"`nk` is {nk!r}, must be a pair of whole numbers, zero or more",
            where=("nk", None, None),
            remedy="nk=(0, 20)",
        )
    return ends[0], ends[1]
