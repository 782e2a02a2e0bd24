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
