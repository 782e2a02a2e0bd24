"""Options that every command takes."""

from __future__ import annotations

from typing import Annotated

import typer

from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
LimitOption = Annotated[
    list[str] | None,
    typer.Option("--limit", help="Change a threshold, e.g. X02=1e-6; noted in every result."),
]


def ranges_of(given: list[str] | None) -> dict[str, tuple[float, float]]:
    """Return expected ranges by name."""
    ranges: dict[str, tuple[float, float]] = {}
    for one in given or []:
        name, _, ends = one.rpartition("=")
        low, _, high = ends.partition(":")
        try:
            ranges[name] = (float(low), float(high))
        except ValueError:
            raise refusal(
                "U01", f"`--expected` is {one!r}, must be NAME=LOW:HIGH", remedy="--expected K=1:3"
            ) from None
    return ranges


def limits_of(changes: list[str] | None) -> Limits:
    """Return the thresholds, some of them changed."""
    pairs: dict[str, float] = {}
    for change in changes or []:
        code, _, value = change.partition("=")
        try:
            pairs[code] = float(value)
        except ValueError:
            raise refusal(
                "U01", f"`--limit` is {change!r}, must be CODE=NUMBER", remedy="--limit X02=1e-6"
            ) from None
    return DEFAULT_LIMITS.with_changes(pairs)
