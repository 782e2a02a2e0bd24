"""Numbers and names as the page prints them; every helper escapes what it is given."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from math import isfinite

from plantune.text import number

LONGEST = 200
"""Letters of a text from outside; the rest becomes an ellipsis."""


def escaped(text: object, longest: int = LONGEST) -> str:
    """Return a text in which no markup acts, shortened to `longest` letters.

    Examples
    --------
    >>> escaped("<script>")
    '&lt;script&gt;'
    """
    plain = str(text)
    plain = plain if len(plain) <= longest else plain[: longest - 1] + "…"
    return html.escape(plain)


def with_sd(x: float, sd: float) -> str:
    """Return a number and its standard deviation, both to the second digit of the latter.

    Examples
    --------
    >>> with_sd(-5.93912, 0.0412), with_sd(12345.6, 230.0), with_sd(2.0, 0.0)
    ('-5.939 ± 0.041', '12346 ± 230', '2 ± 0')
    """
    if not (isfinite(sd) and sd > 0 and isfinite(x)):
        return number(x, 6) + (" ± 0" if sd == 0 else "")
    decimals = 1 - int(f"{sd:.1e}".split("e")[1])
    if not -6 <= decimals <= 6:
        return f"{x:.4g} ± {sd:.2g}"
    decimals = max(0, decimals)
    return f"{x:.{decimals}f} ± {sd:.{decimals}f}"


def with_interval(
    x: float, interval: tuple[float, float] | None, digits: int = 3, unit: str = ""
) -> str:
    """Return a number and its 95 % interval in brackets.

    Examples
    --------
    >>> with_interval(3.0, (2.941, 3.06)), with_interval(3.0, None)
    ('3.00 (2.94 to 3.06)', '3.00')
    """
    if interval is None:
        return number(x, digits, padded=True) + unit
    low, high = (number(end, digits, padded=True) + unit for end in interval)
    return f"{number(x, digits, padded=True)}{unit} ({low} to {high})"


def unit_of(text: str) -> str:
    """Return a unit behind a number, nothing for the pure number.

    Examples
    --------
    >>> unit_of("s"), unit_of("1"), unit_of("")
    (' s', '', '')
    """
    return f" {text}" if text and text != "1" else ""


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], note: str = "") -> str:
    """Return a table whose first column holds the headings of the rows; all texts are escaped.

    Examples
    --------
    >>> "<td>&lt;b&gt;</td>" in table("what", ["name", "value"], [["a", "<b>"]])
    True
    """
    tops = "".join(f'<th scope="col">{escaped(text)}</th>' for text in head)
    lines = []
    for first, *cells in rows:
        body = "".join(f"<td>{escaped(cell)}</td>" for cell in cells)
        lines.append(f'<tr><th scope="row">{escaped(first)}</th>{body}</tr>')
    top = f"<thead><tr>{tops}</tr></thead>" if any(head) else ""
    foot = f'<p class="small">{escaped(note, 600)}</p>' if note else ""
    return (
        f'<div class="scroll"><table><caption>{escaped(caption)}</caption>'
        f"{top}<tbody>{''.join(lines)}</tbody></table></div>{foot}"
    )
