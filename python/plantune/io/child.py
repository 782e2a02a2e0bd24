"""The other side of `worker`: limits, decodes, replies."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from plantune.errors import PlantuneError, fields_of
from plantune.io.file import most_unpacked, too_much_unpacked
from plantune.io.table import short
from plantune.io.worker import Array, broken


def serve() -> None:
    """Read a request and the bytes of a file, and write the arrays in it, or a refusal."""
    request = json.loads(sys.stdin.buffer.readline())
    data = sys.stdin.buffer.read()
    reader = import_module(f"plantune.io.{request['format']}")
    for package in reader.NEEDS:
        import_module(package)
    _limit(request["memory"], request["seconds"])
    arrays: list[Array] = []
    try:
        arrays = [_plain(array) for array in reader.decode(data, request["wanted"])]
        kinds = [(a.name, a.values.dtype.str, len(a.values), a.said) for a in arrays]
        head: dict[str, Any] = {"arrays": kinds}
    except PlantuneError as error:
        head = _refusal(error)
    except MemoryError:
        head = _refusal(too_much_unpacked(len(data), most_unpacked(len(data))))
    except Exception as error:  # whatever the library makes of such a file
        text = str(error).partition("\n")[0]
        head = _refusal(broken(f"{type(error).__name__} {short(text, 100)}"))
    sys.stdout.buffer.write(json.dumps(head).encode() + b"\n")
    for array in arrays:
        sys.stdout.buffer.write(array.values.view(np.uint8).data)


def _plain(array: Array) -> Array:
    values = np.ascontiguousarray(array.values)
    return array._replace(values=values.astype(values.dtype.newbyteorder("="), copy=False))


def _refusal(error: PlantuneError) -> dict[str, Any]:
    return {"refusal": {"code": error.code, "text": error.text, **fields_of(error)}}


def _limit(memory: int, seconds: float) -> None:
    """Limit what this process may take on top of what it has, where the platform can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 1))
    status = Path("/proc/self/statm")
    if status.exists():
        own = int(status.read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (own + memory, own + memory))
