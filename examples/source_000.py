"""Source 000, chapter 3, on a motor whose truth is known: the tables of 3.3, and figures.

    python examples/source_000.py [--figures FOLDER] [--moto FILE] [--factors]

`--figures` writes each figure as a page, `--moto` adds the record of the MotoShield (MAT file),
`--factors` counts on 2000 records when smoothing helps.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

import plantune as pt
from plantune.datasets import DRIVES, PRINTER_MOTOR, printer_motor

ORDERS = (2, 3)
TREATMENTS = ("none", "y alone", "both", "OE")
SEEDS = range(200)

# The records of "When smoothing helps", as `printer_motor` makes them.
NOISES = {
    "PRBS, output noise of variance 0.01": {"noise_var": 0.01, "resolution": 0.0},
    "PRBS, 0.15": {"noise_var": 0.15, "resolution": 0.0},
    "PRBS, 1.0": {"noise_var": 1.0, "resolution": 0.0},
    "PRBS, encoder 0.8 in/s": {},
    "step, 0.1": {"kind": "step", "noise_var": 0.1, "resolution": 0.0},
    "step, encoder 0.8 in/s": {"kind": "step"},
    "PRBS, equation noise 0.01": {"equation_var": 0.01, "resolution": 0.0},
    "PRBS, equation noise 0.1": {"equation_var": 0.1, "resolution": 0.0},
    "PRBS, equation noise 1.0": {"equation_var": 1.0, "resolution": 0.0},
    "step, equation noise 0.1": {"kind": "step", "equation_var": 0.1, "resolution": 0.0},
}


def table(order: int) -> list[str]:
    """Return table 3.3 for one order: error on fresh rows, and distance to the truth."""
    truth = PRINTER_MOTOR.model(order)
    head = [f"{what} {name}" for what in ("error", "truth") for name in TREATMENTS]
    lines = ["  ".join([f"order {order}".ljust(9), *(f"{name:>13}" for name in head)])]
    for kind in DRIVES:
        rec = printer_motor(kind, order=order)
        rows = pt.validate.smoothing(rec, order, order).rows
        apart = [distance(row.fit.model, truth, rec) for row in rows]
        numbers = [*(row.mse for row in rows), *apart]
        lines.append("  ".join([kind.ljust(9), *(f"{x:13.4f}" for x in numbers)]))
    return lines


def distance(model: pt.models.PolyModel, truth: pt.models.PolyModel, rec: pt.Record) -> float:
    """Return the mean squared distance of two models over a record's input, from rest."""
    return float(np.mean((model.simulate(rec.u) - truth.simulate(rec.u)) ** 2))


def factors(seeds: Iterable[int], **plant: object) -> tuple[list[float], Counter[str]]:
    """Return how many times nearer the truth than none each comes, medians; and what is advised.

    Distances to the motor of order two, on a PRBS that no fit has seen.
    """
    truth, fresh = PRINTER_MOTOR.model(), printer_motor(seed=999, resolution=0.0)
    nearer, advised = [], Counter[str]()
    for seed in seeds:
        found = pt.validate.smoothing(printer_motor(seed=seed, **plant), 2, 2)
        none, *others = (distance(row.fit.model, truth, fresh) for row in found.rows)
        nearer.append([none / other for other in others])
        advised[found.best.name] += 1
    return np.median(nearer, axis=0).tolist(), advised


def figures() -> dict[str, object]:
    """Return the overlay of the simulations and the Bode plot, second order, PRBS."""
    rec = printer_motor()
    rows = {row.name: row.fit for row in pt.validate.smoothing(rec, 2, 2).rows}
    exact = pt.estimate.arx(printer_motor(resolution=0.0), 2, 2)
    shown = {name: rows[name] for name in ("none", "y alone", "both")}
    fresh = rec.between(2.0, 2.6)
    judged = pt.validate.compare(fresh, *shown.values(), names=list(shown))
    named = [replace(fit, method=name) for name, fit in {**shown, "truth": exact}.items()]
    bode = pt.plot.bode(*named, of=rec, w=np.geomspace(2.0, 1000.0, 300))
    bode.update_layout(
        title_text="Least squares with y smoothed, with both, with none, and the truth"
    )
    bode.for_each_trace(lambda band: band.update(showlegend=False), {"fill": "tonexty"})
    overlay = pt.plot.compare(*judged.rows, of=rec)
    return {"source_000_overlay": overlay, "source_000_bode": bode}


def moto(path: Path) -> pt.Record:
    """Return the record of the MotoShield without its start from rest, 50 rows."""
    return pt.read(path, u="u", y="y", Ts=0.02).take(slice(50, None))


def main() -> None:
    """Print the tables; write the figures where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figures", type=Path)
    parser.add_argument("--moto", type=Path)
    parser.add_argument("--factors", action="store_true")
    asked = parser.parse_args()
    for order in ORDERS:
        print(*table(order), sep="\n", end="\n\n")
    if asked.factors:
        for name, plant in NOISES.items():
            times, advised = factors(SEEDS, **plant)
            print(name, *(f"{x:.2g}" for x in times), dict(advised), sep=" | ")
    if asked.moto:
        for order in ORDERS:
            found = pt.validate.smoothing(moto(asked.moto), order, order)
            print(f"MotoShield, order {order}: {found}", end="\n\n")
    if asked.figures:
        for name, fig in figures().items():
            page = asked.figures / f"{name}.html"
            fig.write_html(page, include_plotlyjs=True, config={"displayModeBar": False})


if __name__ == "__main__":
    main()
