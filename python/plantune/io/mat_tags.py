"""The tags of a MAT file, walked before anything is unpacked (D01, D02).

Version 5: a head of 128 bytes, then elements of a type, a length and that many bytes; an element of
type 15 holds another one, packed by zlib.  Version 4: one head of 20 bytes per matrix.
"""

from __future__ import annotations

import struct
import zlib
from typing import Final

from plantune.errors import PlantuneError, refusal
from plantune.io.file import format_seen, most_unpacked, too_much_unpacked
from plantune.io.worker import broken

_MATRIX: Final = 14
_PACKED: Final = 15
_BYTES: Final = {0: 8, 1: 4, 2: 4, 3: 2, 4: 2, 5: 1}  # of a number of version 4, by its kind


def check_tags(data: bytes) -> None:
    """Refuse bytes that are no MAT file of version 4 or 5, or that declare too much."""
    head = data[124:128]
    if data.startswith(b"MATLAB 7.3") or data.startswith(b"\x89HDF") or data[512:516] == b"\x89HDF":
        raise _other("a MATLAB file of version 7.3 (HDF5)", "save it with -v7 in MATLAB")
    if head in (b"\x00\x01IM", b"\x01\x00MI"):
        unpacked = _walk_5(data, "<" if head.endswith(b"IM") else ">")
    elif (order := _order_4(data)) is not None:
        unpacked = _walk_4(data, order)
    else:
        raise _other(format_seen(data) or "no MATLAB file", "save it with -v7 in MATLAB, or as CSV")
    if unpacked > (most := most_unpacked(len(data))):
        raise too_much_unpacked(len(data), most, unpacked)


def _walk_5(data: bytes, order: str) -> int:
    """Return the bytes that all elements hold unpacked."""
    at, unpacked = 128, 0
    while at < len(data):
        if at + 8 > len(data):
            raise broken(f"byte {at} begins an element, and the file ends")
        kind, size = struct.unpack_from(order + "II", data, at)
        if kind not in (_MATRIX, _PACKED):
            raise broken(f"byte {at} has type {kind}, which begins no variable")
        if at + 8 + size > len(data):
            raise broken(f"byte {at} declares {size} bytes, and {len(data) - at - 8} are left")
        own = size
        if kind == _PACKED:
            own = _unpacked(data[at + 8 : at + 8 + size], order, at)
        unpacked += own
        at += 8 + size
    return unpacked


def _unpacked(packed: bytes, order: str, at: int) -> int:
    """Return the bytes that a packed element declares."""
    try:
        head = zlib.decompressobj().decompress(packed, 8)
    except zlib.error as error:
        raise broken(f"the packed bytes from {at} on are none: {error}") from None
    if len(head) < 8:
        raise broken(f"the packed bytes from {at} on end at once")
    kind, size = struct.unpack(order + "II", head)
    if kind != _MATRIX:
        raise broken(f"the packed bytes from {at} on have type {kind}, which is no variable")
    return int(size)


def _order_4(data: bytes) -> str | None:
    """Return the byte order of a file of version 4, or None where it is none."""
    if len(data) < 20:
        return None
    for order, machine in (("<", 0), (">", 1)):
        (kind,) = struct.unpack_from(order + "I", data)
        numbers, matrix = kind // 10 % 10, kind % 10
        if kind // 100 == 10 * machine and numbers in _BYTES and matrix <= 2:
            return order
    return None


def _walk_4(data: bytes, order: str) -> int:
    at = 0
    while at < len(data):
        if at + 20 > len(data):
            raise broken(f"byte {at} begins a matrix, and the file ends")
        kind, rows, width, imaginary, name = struct.unpack_from(order + "IIIII", data, at)
        if kind // 10 % 10 not in _BYTES or imaginary > 1:
            raise broken(f"byte {at} has type {kind}, which is no matrix")
        size = name + rows * width * _BYTES[kind // 10 % 10] * (1 + imaginary)
        if at + 20 + size > len(data):
            raise broken(f"byte {at} declares {size} bytes, and {len(data) - at - 20} are left")
        at += 20 + size
    return len(data)


def _other(seen: str, remedy: str) -> PlantuneError:
    return refusal(
        "D02",
        f"the file says it is a MATLAB file of version 5, and is {seen}",
        where=("", 0, None),
        remedy=remedy,
    )
