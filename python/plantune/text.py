"""Numbers and tables as plain text."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf, isnan


def number(x: float, digits: int = 4, padded: bool = False) -> str:
    """Return a number with some significant digits, `padded` with zeros to all of them.

    Examples
    --------
    >>> number(0.149152), number(3.0, 3, padded=True), number(float("inf")), number(float("nan"))
    ('0.1492', '3.00', '∞', '–')
    """
    if isnan(x):
        return "–"
    if isinf(x):
        return "∞" if x > 0 else "-∞"
    return f"{x:#.{digits}g}".rstrip(".") if padded else f"{x:.{digits}g}"


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    r"""Return the lines of a table: the first row is its head, the first column its labels.

    Examples
    --------
    >>> print("\n".join(table([["rule", "Kp"], ["SIMC", "-0.13"], ["Ziegler-Nichols", "2"]])))
    rule                Kp
    SIMC             -0.13
    Ziegler-Nichols      2
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = "<" + ">" * (len(widths) - 1)
    return ["  ".join(map("{:{}{}}".format, row, sides, widths)) for row in rows]


def column(name: str) -> str:
    """Return how a column is read in words; one without a header has its number for a name.

    Examples
    --------
    >>> column("temp"), column("2")
    ('temp', 'column 2')
    """
    return f"column {name}" if name.isdecimal() else name


def counted(count: int, noun: str) -> str:
    """Return how many of something there are; a noun with a regular plural.

    Examples
    --------
    >>> counted(0, "alarm"), counted(1, "alarm"), counted(4, "retuning")
    ('no alarm', '1 alarm', '4 retunings')
    """
    return f"{count or 'no'} {noun}{'s' if count > 1 else ''}"
