"""Command line of the benches, and their tables."""

from __future__ import annotations

import argparse
import json
import os
import platform
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benches import frame

HERE = Path(__file__).parent
NAMES = sorted(p.stem for p in HERE.glob("*.py") if p.stem not in ("__init__", "__main__", "frame"))
HEAD = (
    "contestant", "CPU ms", "min-max", "wall ms", "x ours", "min-max", "memory MB", "difference"
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benches", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"benches to run, all by default: {NAMES}")
    parser.add_argument("--quick", action="store_true", help="2 processes and short repeats")
    parser.add_argument("--json", metavar="FILE", help="write every number as well")
    parser.add_argument("--child", nargs=4, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.child:
        module, bench, contestant, seconds = args.child
        print(json.dumps(frame.child(module, int(bench), int(contestant), float(seconds))))
        return
    if unknown := set(args.names) - set(NAMES):
        parser.error(f"no bench {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")
    machine = about()
    print(machine)
    results = []
    for name in args.names or NAMES:
        for result in frame.run(name, args.quick):
            show(result)
            results.append({"bench": name, **result})
    if args.json:
        Path(args.json).write_text(json.dumps({"machine": machine, "results": results}, indent=1))


def about() -> str:
    return (
        f"{cpu_model()}, {os.cpu_count()} cores, Python {platform.python_version()}, "
        f"numpy {np.__version__}\nBLAS and all else single-threaded; each contestant in fresh "
        "processes, taking turns; CPU time is the median over them, ratios are of CPU time"
    )


def cpu_model() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    models = [line.split(":")[1].strip() for line in text.splitlines() if "model name" in line]
    return models[0] if models else platform.machine()


def show(result: dict[str, Any]) -> None:
    print(f"\n{result['title']}")
    if "lines" in result:
        print("\n".join(f"  {line}" for line in result["lines"]), flush=True)
        return
    table = [HEAD, *(cells(row) for row in result["rows"])]
    widths = [max(len(line[i]) for line in table) for i in range(len(HEAD))]
    for line in table:
        first, *rest = (
            c.ljust(w) if i == 0 else c.rjust(w)
            for i, (c, w) in enumerate(zip(line, widths, strict=True))
        )
        print("  " + "  ".join([first, *rest]))
    for name in result["skipped"]:
        print(f"  skipped, {name}")
    if result["remark"]:
        print(f"  {result['remark']}")
    print(end="", flush=True)


def cells(row: dict[str, Any]) -> tuple[str, ...]:
    ratio = row["ratio"]
    return (
        row["name"],
        number(1e3 * median(row["cpu"])),
        spread([1e3 * x for x in row["cpu"]]),
        number(1e3 * median(row["wall"])),
        "1" if ratio is None else number(median(ratio)),
        "" if ratio is None else spread(ratio),
        "" if row["memory"] is None else f"{row['memory'] / 1e6:.1f}",
        "" if row["difference"] is None else f"{row['difference']:.0e}",
    )


def spread(values: list[float]) -> str:
    return f"{number(min(values))}-{number(max(values))}"


def number(x: float) -> str:
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


if __name__ == "__main__":
    main()
