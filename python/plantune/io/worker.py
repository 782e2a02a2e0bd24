"""A reader that is not hardened, in a process of its own, so that no file ends ours (D01, D02).

The process gets the bytes and returns arrays.  It has a limit on memory, on processor time and on
the time that we wait; when it breaks one or crashes, that is a refusal.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plantune.errors import PlantuneError, refusal
from plantune.io.file import memory_for, too_large

SECONDS: Final = 8.0
"""Processor time of a worker, and with a second more what we wait for it."""

# Isolated, but for the same packages as ours.
_START: Final = (
    "import sys; sys.path[:] = sys.argv[1:]; from plantune.io.child import serve; serve()"
)
_ENVIRONMENT: Final = {
    "ARROW_DEFAULT_MEMORY_POOL": "system",  # others reserve much more than they use
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"),
}


class Array(NamedTuple):
    """A column that a worker returns, and what to log of it."""

    name: str
    values: NDArray[Any]
    said: str = ""


def need(package: str, what: str) -> None:
    """Refuse to read what needs a package that is not installed (U01)."""
    if find_spec(package) is None:
        raise refusal(
            "U01",
            f"reading {what} needs the package {package}, which is not installed",
            remedy="pip install plantune[io]",
        )


def decode(format: str, data: bytes, wanted: Sequence[int] = ()) -> list[Array]:
    """Return what `decode(data, wanted)` of the module `plantune.io.<format>` returns."""
    request = {
        "format": format,
        "wanted": list(wanted),
        "memory": memory_for(len(data)),
        "seconds": SECONDS,
    }
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-c", _START, *(path or os.getcwd() for path in sys.path)],
            input=json.dumps(request).encode() + b"\n" + data,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=SECONDS + 1,
            env={**os.environ, **_ENVIRONMENT},
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _too_slow(len(data)) from None
    if done.returncode < 0 and -done.returncode == getattr(signal, "SIGXCPU", 0):
        raise _too_slow(len(data))
    head, _, body = done.stdout.partition(b"\n")
    if done.returncode or not head:
        raise broken(f"it ends its reader (code {done.returncode})")
    return _arrays(json.loads(head), body)


def broken(reason: str) -> PlantuneError:
    """Return the refusal of a file that cannot be read (D02)."""
    return refusal(
        "D02",
        f"the file is damaged: {reason}",
        where=("", 0, None),
        remedy="copy or export it again, or save the table as CSV",
    )


def _arrays(head: dict[str, Any], body: bytes) -> list[Array]:
    if "refusal" in head:
        where = head["refusal"].pop("where")
        raise refusal(**head["refusal"], where=where and tuple(where))
    arrays, at = [], 0
    for name, kind, N, said in head["arrays"]:
        values = np.frombuffer(body, kind, N, at)
        arrays.append(Array(name, values, said))
        at += values.nbytes
    return arrays


def _too_slow(size: int) -> PlantuneError:
    what = f"{size} bytes and takes more than {SECONDS:g} s to unpack"
    return too_large(what, size, SECONDS, SECONDS)
