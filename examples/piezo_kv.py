"""Five loops of a piezo stack up to 1.9 kV: which model of hysteresis holds, and how far.

    python examples/piezo_kv.py [--figures FOLDER]

Reads the record set `piezo_kv` from the folder that PLANTUNE_DATA names.  Prints the error of each
model on each loop: fitted to that loop, and fitted to the largest one alone.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np

import plantune as pt
from plantune.hysteresis import PlayStack

LOOPS = ("08kv", "1kv", "11kv", "15kv", "19kv")
MODELS = {
    "10 plays": {"n": 10},
    "30 plays, asymmetric": {"asymmetric": True},
    "10 plays on x, 10 on |x|": {"even": True},
}


def loops() -> dict[str, pt.Record]:
    """Return the records, smallest loop first."""
    root = Path(__file__).resolve().parents[1]
    path = root / os.environ.get("PLANTUNE_DATA", "../shared/data") / "piezo_kv"
    return {
        name: pt.read(
            path / "MeasurementData.mat", u=f"Vplus_{name}", y=f"Displacement_{name}", Ts=1.0
        )
        for name in LOOPS
    }


def error(model: pt.hysteresis.PlayStack, rec: pt.Record) -> float:
    """Return the norm of the error over the norm of the output, in percent."""
    y = rec.y[:, 0]
    return 100 * float(np.linalg.norm(model.simulate(rec.u[:, 0]) - y) / np.linalg.norm(y))


def row(name: str, values: list[float]) -> str:
    """Return a row of the table."""
    return f"{name:42}" + "".join(f"{value:9.2f}" for value in values)


def main() -> None:
    """Print the table; write a figure of each loop where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figures", type=Path)
    asked = parser.parse_args()
    records = loops()
    print(f"{'error, % of the norm of the output':42}" + "".join(f"{name:>9}" for name in LOOPS))
    for name, options in MODELS.items():
        own = {k: PlayStack.identify(r.u[:, 0], r.y[:, 0], **options) for k, r in records.items()}
        print(row(f"{name}: of each loop", [error(own[k], records[k]) for k in LOOPS]))
        largest = own[LOOPS[-1]]
        print(row(f"{name}: of 1.9 kV", [error(largest, records[k]) for k in LOOPS]))
        if asked.figures and "even" in options:
            asked.figures.mkdir(parents=True, exist_ok=True)
            for k, rec in records.items():
                fig = pt.plot.hysteresis(own[k], rec.u[:, 0], rec.y[:, 0], of=rec)
                fig.write_html(asked.figures / f"piezo_{k}.html", include_plotlyjs=True)
    print(
        "\nButterflies need plays on |x|.  Domains that switch at 1.9 kV do not\n"
        "at 0.8 kV: what the largest loop shows does not foretell the small ones."
    )


if __name__ == "__main__":
    main()
