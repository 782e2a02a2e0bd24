"""Which of the four declared encodings a text is in."""

from __future__ import annotations

import codecs
from typing import Final

from plantune.errors import PlantuneError, refusal

UTF_8: Final = "utf-8-sig"


def encoding_of(data: bytes) -> str:
    """Return `utf-8-sig`, `utf-16` or `gb18030`; refuse anything else with the byte (D03)."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return _checked(data, "utf-16")
    try:
        return _checked(data, UTF_8)
    except UnicodeDecodeError as error:
        offset = error.start
    try:
        return _checked(data, "gb18030")
    except UnicodeDecodeError:
        raise _unreadable(f"byte {offset} is no UTF-8, and the file no GB18030", offset) from None


def _checked(data: bytes, encoding: str) -> str:
    """Return `encoding` if it decodes the bytes, without a NUL."""
    try:
        nul = data.decode(encoding).find("\0")
    except UnicodeDecodeError as error:
        if encoding != "utf-16":
            raise
        raise _unreadable(f"byte {error.start} is no UTF-16", error.start) from None
    if nul >= 0:
        offset = 2 * nul + 2 if encoding == "utf-16" else data.index(b"\0")
        raise _unreadable(f"byte {offset} is NUL, which no text holds", offset)
    return encoding


def _unreadable(text: str, offset: int) -> PlantuneError:
    return refusal(
        "D03",
        text,
        where=(f"byte {offset}", None, None),
        count=1,
        remedy="save the file as UTF-8",
    )
