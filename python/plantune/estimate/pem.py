"""Prediction errors: what the verbs of the polynomial family share."""

from __future__ import annotations

from typing import Literal

from plantune import _core
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import Orders
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record

Start = Literal["estimate", "zero"]


def pem(
    rec: Record,
    method: str,
    wanted: Orders,
    offset: bool,
    x0: Start,
    robust: bool,
    limits: Limits | None,
) -> Fit:
    """Return the fit of checked orders, named by its structure."""
    limits = limits or rec.limits or DEFAULT_LIMITS
    return fit_from_core(_core.pem(rec, wanted, offset, x0, robust, limits), method, rec, limits)
