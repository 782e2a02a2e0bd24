"""`plantune tune MODEL.json`: the rules on a model that is known already."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from rich.console import Console
from rich.text import Text

from plantune import report
from plantune.cli.output import print_json, whole_folder
from plantune.cli.summary import rules_table, shown_note
from plantune.errors import refusal
from plantune.io import load_model, to_json, write_json
from plantune.models import ProcessModel, TransferFunction
from plantune.notes import Limits
from plantune.tune import Comparison, compare, imc_pi, optimal, save_tuning
from plantune.tune.compare import DEFAULT_RULES, Rule


def tune_model(
    file: Path, gain_margin: float, Ms: float, out: Path, limits: Limits
) -> tuple[Comparison, Path]:
    """Compare the rules on the model of a file; write the page, the comparison and the first."""
    model = load_model(file)
    if not isinstance(model, ProcessModel | TransferFunction):
        raise refusal(
            "U01",
            f"{file} holds a {type(model).__name__}, must hold a ProcessModel or TransferFunction",
            remedy="give the model.json of a process model; tune.optimal takes polynomial ones",
        )
    rules: list[Rule] = [
        partial(imc_pi, gain_margin=gain_margin),
        *DEFAULT_RULES[1:],
        partial(optimal, Ms=Ms),
        partial(optimal, Ms=Ms, controller="PID"),
    ]
    comparison = compare(model, rules, limits=limits)
    with whole_folder(out) as staging:
        report.write_comparison(staging / "report.html", comparison, file.stem)
        write_json(staging / "comparison.json", comparison, longest=0)
        save_tuning(staging / "tuning.json", comparison.rows[0].tuning)
    return comparison, out


def show_comparison(comparison: Comparison, folder: Path) -> None:
    """Print the rules side by side, and the doubts."""
    console = Console(highlight=False)
    console.print()
    console.print(Text(str(comparison.model), style="bold"), soft_wrap=True)
    console.print(rules_table(comparison))
    for note in comparison.notes:
        console.print(shown_note(note), soft_wrap=True)
    console.print(Text(f"report: {folder / 'report.html'}", style="bold"), soft_wrap=True)


def print_comparison(comparison: Comparison, folder: Path) -> None:
    """Print one JSON object."""
    print_json({**to_json(comparison, longest=0), "out": str(folder)})
