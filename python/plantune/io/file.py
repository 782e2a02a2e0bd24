"""A file as bytes, if it is small enough and of the format that its name says."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Final

from plantune.errors import PlantuneError, refusal

LARGEST_FILE: Final = 64 * 2**20
"""Bytes; larger files are refused before they are read (D01)."""

_MAGIC: Final = (
    (b"\x89PNG\r\n\x1a\n", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"PAR1", "a Parquet file"),
    (b"MATLAB 5.0 MAT-file", "a MATLAB file of version 5"),
    (b"MATLAB 7.3 MAT-file", "a MATLAB file of version 7.3 (HDF5)"),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
    (b"PK\x03\x04", "a zip archive (xlsx is one)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Office file (xls)"),
    (b"%PDF-", "a PDF document"),
    (b"\x93NUMPY", "a NumPy array file"),
)


def contents(path: str | PathLike[str], largest: int = LARGEST_FILE) -> bytes:
    """Return the bytes of a file of at most `largest` bytes (D01; U01 where there is none)."""
    file = Path(path)
    try:
        size = file.stat().st_size
        if size > largest:
            raise too_many(size, "bytes", largest)
        return file.read_bytes()
    except OSError as error:
        raise refusal(
            "U01",
            f"cannot read {file.name!r}: {(error.strerror or 'no such file').lower()}",
            remedy="check the path",
        ) from None


def suffix_of(path: str | PathLike[str]) -> str:
    """Return the lower-case suffix with its dot."""
    return Path(path).suffix.lower()


def format_seen(data: bytes) -> str | None:
    """Return the name of the binary format that the first bytes announce, or None."""
    return next((name for magic, name in _MAGIC if data.startswith(magic)), None)


def refuse_binary(data: bytes) -> None:
    """Refuse bytes that announce a binary format (D02)."""
    seen = format_seen(data)
    if seen:
        raise refusal(
            "D02",
            f"the file says it is a table of text, and is {seen}",
            where=("", 0, None),
            remedy="export the table as CSV",
        )


def too_few(rows: int, what: str) -> PlantuneError:
    """Return the refusal of fewer than two rows (D04)."""
    return refusal(
        "D04",
        f"the file holds {what} and no row of data" if rows == 0 else f"the file holds {what}",
        count=rows,
        measured=float(rows),
        limit=2.0,
        remedy="give a file with at least two rows of data",
    )


def too_many(count: int, what: str, limit: int) -> PlantuneError:
    """Return the refusal of more bytes, lines or columns than can be taken (D01)."""
    return too_large(f"{count} {what}", count, count, limit)


def too_large(what: str, count: int, measured: float, limit: float) -> PlantuneError:
    """Return the refusal of a file that has more than can be taken (D01)."""
    return refusal(
        "D01",
        f"the file has {what}",
        count=count,
        measured=float(measured),
        limit=float(limit),
        remedy="cut it into parts, or keep only the columns needed",
    )


def memory_for(size: int) -> int:
    """Return the bytes of memory that a file of `size` bytes may take while it is read."""
    return 10 * size + 200 * 2**20


def most_declared(size: int) -> int:
    """Return the bytes that a file of `size` bytes may say it holds unpacked (D01).

    A hundred times its own; a constant column packs better than that, so a megabyte is always
    allowed.
    """
    return max(2**20, 100 * size)


def most_unpacked(size: int) -> int:
    """Return the bytes of a file of `size` bytes that may be unpacked (D01).

    No more than fits `memory_for` with the copies a record takes.
    """
    return min(most_declared(size), 2 * size + 32 * 2**20)


def too_much_unpacked(size: int, most: int, unpacked: int | None = None) -> PlantuneError:
    """Return the refusal of a file that holds more than `most` bytes (D01)."""
    seen = "too many" if unpacked is None else unpacked
    return too_large(f"{size} bytes and unpacks to {seen} bytes", size, unpacked or most, most)
