"""The shipped records, each from load to tuned loop or refusal: the figures of docs/records.

    python examples/records.py [--figures FOLDER]

Prints the outcome of each; `--figures` writes each figure as a page.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import plantune as pt

RECORDS = {
    "hair_dryer": pt.datasets.hair_dryer,
    "robot_arm": pt.datasets.robot_arm,
    "engine_loop": lambda: pt.datasets.engine_loop(noise_var=1.5),
    "printer_motor": pt.datasets.printer_motor,
}

# Share of the fresh rows in the first view: enough to tell two simulations apart.
SHOWN = 0.4


def outcome(rec: pt.Record, title: str) -> tuple[pt.job.Run, str]:
    """Return the run, and the refusal where no tuning came of it."""
    try:
        return pt.job.run(rec, title=title), ""
    except pt.NotIdentifiable as error:
        if not isinstance(error.result, pt.job.Run):
            raise
        return error.result, str(error)


def figures(run: pt.job.Run) -> dict[str, object]:
    """Return the simulations on fresh rows; then the loops, or the frequency response without."""
    shown = [run.verdicts[name] for name in dict.fromkeys((run.trusted, run.chosen.method))]
    overlay = pt.plot.compare(*shown, of=run.record)
    t = shown[0].t
    overlay.update_xaxes(range=[t[0], t[round(SHOWN * (len(t) - 1))]])
    if run.comparison is None:
        return {"fresh": overlay, "bode": pt.plot.bode(run.chosen, of=run.record)}
    return {"fresh": overlay, "rules": pt.plot.rules(run.comparison, of=run.record)}


def main() -> None:
    """Print every outcome; write the figures where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figures", type=Path)
    asked = parser.parse_args()
    for name, load in RECORDS.items():
        run, refused = outcome(load(), name.replace("_", " "))
        print(f"{run.title}: {run.trusted} is trusted")
        print(refused or run.tunings[0], end="\n\n")
        if asked.figures:
            asked.figures.mkdir(parents=True, exist_ok=True)
            for kind, fig in figures(run).items():
                page = asked.figures / f"{name}_{kind}.html"
                fig.write_html(page, include_plotlyjs=True, config={"displayModeBar": False})


if __name__ == "__main__":
    main()
