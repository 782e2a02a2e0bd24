"""`plantune tune` and `plantune demo`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from plantune import job
from plantune.cli.options import Json, LimitOption, limits_of
from plantune.cli.output import as_fields, fail, print_json, write_run
from plantune.cli.parser import Group
from plantune.cli.reading import Reading, takes_record
from plantune.cli.summary import show
from plantune.datasets import ENGINE_LOOP, engine_loop, hair_dryer
from plantune.errors import PlantuneError

app = typer.Typer(
    cls=Group,
    help="From plant data to a validated model to a tuned loop.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

GainMargin = Annotated[float, typer.Option(help="Gain margin asked of the loop, a factor.")]


def main() -> None:
    """Run the command line."""
    app()


@app.callback()
def _plantune() -> None:
    """From plant data to a validated model to a tuned loop."""


@app.command()
@takes_record
def tune(
    reading: Reading,
    gain_margin: GainMargin = 3.0,
    out: Annotated[Path, typer.Option(help="Folder for the report and the JSON files.")] = Path(
        "plantune-out"
    ),
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Take a record to a validated model, PI settings with margins, and a report."""

    def work() -> tuple[job.Run, Path]:
        limits = limits_of(limit)
        rec = reading.record(limits)
        run = job.run(rec, gain_margin=gain_margin, title=reading.title, limits=limits)
        return run, write_run(out, run)

    run, folder = _attempt(work, as_json)
    if as_json:
        print_json(as_fields(run, folder))
    else:
        show(run, folder)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for the reports.")] = Path("plantune-demo"),
    as_json: Json = False,
) -> None:
    """Run the main job on a measured hair dryer and on a simulated engine loop of known truth."""
    cases: list[tuple[str, Callable[[], job.Run]]] = [
        ("hair_dryer", lambda: job.run(hair_dryer(), title="Hair dryer")),
        (
            "engine_loop",
            lambda: job.run(
                engine_loop(noise_var=1.5),
                title="Simulated engine loop",
                truth=ENGINE_LOOP._asdict(),
            ),
        ),
    ]
    done = []
    for name, case in cases:

        def work(name: str = name, case: Callable[[], job.Run] = case) -> tuple[job.Run, Path]:
            run = case()
            return run, write_run(out / name, run)

        done.append(_attempt(work, as_json))
    if as_json:
        print_json({folder.name: as_fields(run, folder) for run, folder in done})
    else:
        for run, folder in done:
            show(run, folder)


def _attempt(work: Callable[[], tuple[job.Run, Path]], as_json: bool) -> tuple[job.Run, Path]:
    """Do the work, or print the refusal and exit with its code."""
    try:
        return work()
    except PlantuneError as error:
        fail(error, as_json)
        raise typer.Exit(error.exit_code) from None


if __name__ == "__main__":
    main()
