"""The frame of every bench: contestants in fresh processes, interleaved, compared by ratio.

A bench module holds `BENCHES`, a list of `Bench` (timed) and `Report` (text).  The parent starts
one process per contestant and round, in the order A B A B; the child sets up, warms up,
times the job and prints what it measured together with the job's result.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

FULL, QUICK = (5, 0.5), (2, 0.1)  # processes per contestant; seconds of repeats in each

THREADS = ("OPENBLAS", "MKL", "OMP", "BLIS", "VECLIB_MAXIMUM", "NUMEXPR", "RAYON", "NUMBA")
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in THREADS}
# What is freed goes back to the system at once, so that a peak cannot hide in old pages.
PLAIN_MALLOC = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "0"}

Job = Callable[[], Any]


@dataclass(frozen=True)
class Contestant:
    """`setup` is not timed and returns the job; the job returns numbers, which are compared."""

    name: str
    setup: Callable[[], Job]
    needs: tuple[str, ...] = ()  # modules without which it is skipped


def relative_difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(np.max(np.abs(theirs - ours)) / np.max(np.abs(ours)))


@dataclass(frozen=True)
class Bench:
    """Timed jobs, ours first."""

    title: str
    contestants: Sequence[Contestant]
    difference: Callable[[np.ndarray, np.ndarray], float] | None = relative_difference
    memory: bool = True
    patience: int = 1  # times as many processes as other benches
    remark: Callable[[list[dict[str, Any]]], str] | None = None  # a line on the finished rows


@dataclass(frozen=True)
class Report:
    """Lines that a fresh process works out, for instance a table of accuracy."""

    title: str
    lines: Callable[[], list[str]]


# In the child ---------------------------------------------------------------------------------


def child(module: str, bench: int, contestant: int, seconds: float) -> dict[str, Any]:
    """Measure one contestant; `seconds` 0 asks for memory, contestant -1 for a report."""
    entry = importlib.import_module(f"benches.{module}").BENCHES[bench]
    if contestant < 0:
        return {"lines": entry.lines()}
    job = entry.contestants[contestant].setup()
    if not seconds:
        return {"memory": peak_growth(job)}
    result = job()
    job()
    cpu, wall = repeat(job, seconds)
    result = [] if result is None else np.ravel(result).tolist()
    return {"cpu": cpu, "wall": wall, "result": result}


def repeat(job: Job, seconds: float) -> tuple[float, float]:
    """Median CPU and wall time of the job; at least five repeats."""
    cpu, wall, end = [], [], time.perf_counter() + seconds
    while len(cpu) < 5 or time.perf_counter() < end:
        start = cpu_time(), time.perf_counter()
        job()
        cpu.append(cpu_time() - start[0])
        wall.append(time.perf_counter() - start[1])
    return median(cpu), median(wall)


def cpu_time() -> float:
    """Seconds of this process, all threads, and of the children that it waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def peak_growth(job: Job) -> int | None:
    """Bytes by which the first run of the job raises the peak of resident memory (Linux)."""
    try:
        with open("/proc/self/clear_refs", "w") as f:
            f.write("5")  # the peak starts again from what is resident now
    except OSError:
        return None
    before = resident("VmHWM")
    keep = job()
    growth = resident("VmHWM") - before
    del keep
    return growth


def resident(key: str) -> int:
    with open("/proc/self/status") as f:
        return next(int(line.split()[1]) * 1024 for line in f if line.startswith(key))


# In the parent --------------------------------------------------------------------------------


def spawn(module: str, bench: int, contestant: int, seconds: float) -> dict[str, Any]:
    env = {**os.environ, **ONE_THREAD, **({} if seconds else PLAIN_MALLOC)}
    args = [sys.executable, "-m", "benches", "--child"]
    args += [module, str(bench), str(contestant), str(seconds)]
    done = subprocess.run(args, env=env, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def run(module: str, quick: bool) -> Iterator[dict[str, Any]]:
    """Every bench of a module: its title with rows and skipped peers, or with lines."""
    for number, entry in enumerate(importlib.import_module(f"benches.{module}").BENCHES):
        if isinstance(entry, Report):
            yield {"title": entry.title, **spawn(module, number, -1, 1.0)}
        else:
            yield side_by_side(module, number, entry, *(QUICK if quick else FULL))


def side_by_side(
    module: str, number: int, bench: Bench, rounds: int, seconds: float
) -> dict[str, Any]:
    missing = {
        k: [m for m in c.needs if importlib.util.find_spec(m) is None]
        for k, c in enumerate(bench.contestants)
    }
    present = [k for k in missing if not missing[k]]
    runs: dict[int, list[dict[str, Any]]] = {k: [] for k in present}
    for _ in range(rounds * bench.patience):  # A B A B: what disturbs the machine meets all of them
        for k in present:
            runs[k].append(spawn(module, number, k, seconds))
    rows = []
    for k in present:
        memory = spawn(module, number, k, 0)["memory"] if bench.memory else None
        rows.append(row(bench, bench.contestants[k].name, runs[k], runs[0], memory))
    skipped = [
        f"{bench.contestants[k].name}: needs {', '.join(m)}" for k, m in missing.items() if m
    ]
    remark = bench.remark(rows) if bench.remark else None
    return {"title": bench.title, "rows": rows, "skipped": skipped, "remark": remark}


def row(
    bench: Bench, name: str, runs: list[dict], ours: list[dict], memory: int | None
) -> dict[str, Any]:
    ratios = [a["cpu"] / b["cpu"] for a, b in zip(runs, ours, strict=True)]
    results = [np.array(r[0]["result"]) for r in (ours, runs)]
    compared = runs is not ours and bench.difference is not None
    return {
        "name": name,
        "cpu": [r["cpu"] for r in runs],
        "wall": [r["wall"] for r in runs],
        "ratio": None if runs is ours else ratios,
        "memory": memory,
        "difference": bench.difference(*results) if compared else None,
        "result": runs[0]["result"],
    }
