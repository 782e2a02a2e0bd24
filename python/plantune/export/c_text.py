"""Pieces of a C source: head, structure, prototypes, functions, numbers with all their digits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite

from plantune.errors import refusal
from plantune.export.subject import comment


def function(head: str, *lines: str) -> list[str]:
    """Return a definition."""
    return [head, "{", *(f"    {line}" for line in lines), "}"]


def declared(
    p: str, about: Iterable[str], state: Mapping[str, str], functions: Mapping[str, str]
) -> list[str]:
    """Head, structure and prototypes; the definitions follow, until the last `#endif`."""
    P = p.upper()
    return [
        "/*",
        *(f" * {line}".rstrip() for line in comment(about)),
        " */",
        f"#ifndef {P}_STATE",
        f"#define {P}_STATE",
        "",
        "typedef struct {",
        *("    " + _said(member, text) for member, text in state.items()),
        f"}} {p}_state;",
        "",
        *(_said(function + ";", text) for function, text in functions.items()),
        "",
        "#endif",
        f"#ifndef {P}_DECLARATIONS",
        "",
    ]


def _said(code: str, text: str) -> str:
    return f"{code} /* {text} */" if text else code


def array(name: str, values: Sequence[float]) -> str:
    """Return a constant array."""
    return f"static const double {name}[] = {{{', '.join(map(double, values))}}};"


def text(lines: list[str]) -> str:
    """Return the file."""
    return "\n".join([*lines, "", "#endif"]) + "\n"


def double(x: float) -> str:
    """Return a double literal, all its digits."""
    if not isfinite(x):
        raise refusal("U01", f"a setting is {x}, must be finite", remedy="pass finite settings")
    return repr(float(x))
