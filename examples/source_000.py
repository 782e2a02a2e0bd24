"""Source 000, chapter 3, on a motor whose truth is known: the tables of 3.3, and figures.

    python examples/source_000.py [--figures FOLDER] [--moto FILE]

`--figures` writes each figure as a page, `--moto` adds the record of the MotoShield (MAT file).
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import plantune as pt
from plantune.datasets import DRIVES, PRINTER_MOTOR, printer_motor

ORDERS = (2, 3)
TREATMENTS = ("none", "y alone", "both", "OE")


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
    asked = parser.parse_args()
    for order in ORDERS:
        print(*table(order), sep="\n", end="\n\n")
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
