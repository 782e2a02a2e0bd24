"""`plantune tune` and `plantune demo`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

import typer

from plantune import job
from plantune.cli.model_tuning import print_comparison, show_comparison, tune_model
from plantune.cli.options import Json, LimitOption, limits_of, ranges_of
from plantune.cli.output import as_fields, fail, print_json, refusing, write_run
from plantune.cli.parser import Group
from plantune.cli.reading import Reading, takes_record
from plantune.cli.summary import show
from plantune.datasets import ENGINE_LOOP, engine_loop, hair_dryer
from plantune.errors import PlantuneError, refusal
from plantune.io import load_model

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
    given: Annotated[
        list[Path] | None,
        typer.Option(help="model.json of an earlier study, judged beside the new models."),
    ] = None,
    u_limits: Annotated[
        tuple[float, float] | None,
        typer.Option(help="Ends of the actuator's travel; rows at or beyond them are left out."),
    ] = None,
    action: Annotated[
        Literal["direct", "reverse"] | None,
        typer.Option(help="How the controller acts; a gain of the other sign is refused."),
    ] = None,
    expected: Annotated[
        list[str] | None,
        typer.Option(help="What is known of a column or of K, T, L: K=1:3, power=0:100."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the report and the JSON files.")] = Path(
        "plantune-out"
    ),
    Ms: Annotated[
        float, typer.Option("--Ms", help="Largest sensitivity of the optimum, for a MODEL.json.")
    ] = 1.6,
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Take a record to a validated model, PI settings with margins, and a report.

    A model.json instead of a record is tuned on as it is, by several rules.
    """
    if reading.data[0].suffix == ".json":
        _tune_model(reading, gain_margin, Ms, out, limit, as_json)
        return

    def work() -> job.Run:
        limits = limits_of(limit)
        rec = reading.record(limits)
        earlier = {path.stem: load_model(path) for path in given or ()}
        return job.run(
            rec,
            gain_margin=gain_margin,
            given=earlier,
            u_limits=u_limits,
            action=action,
            expected=ranges_of(expected),
            title=reading.title,
            limits=limits,
        )

    run, folder = _attempt(work, out, as_json)
    if as_json:
        print_json(as_fields(run, folder))
    else:
        show(run, folder)


def _tune_model(
    reading: Reading, gain_margin: float, Ms: float, out: Path, limit: LimitOption, as_json: bool
) -> None:
    """Compare the rules on a model that is known."""
    with refusing(as_json):
        if len(reading.data) > 1:
            raise refusal("U01", "several files, of which one is a model", remedy="give one model")
        found = tune_model(reading.data[0], gain_margin, Ms, out, limits_of(limit))
    (print_comparison if as_json else show_comparison)(*found)


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
    done = [_attempt(case, out / name, as_json) for name, case in cases]
    if as_json:
        print_json({folder.name: as_fields(run, folder) for run, folder in done})
    else:
        for run, folder in done:
            show(run, folder)


def _attempt(work: Callable[[], job.Run], out: Path, as_json: bool) -> tuple[job.Run, Path]:
    """Write the run, or print the refusal and exit with its code; a partial run is written too."""
    with refusing(as_json):
        try:
            run = work()
            return run, write_run(out, run)
        except PlantuneError as error:
            if not isinstance(error.result, job.Run):
                raise
            write_run(out, error.result)
            _show_partial(error, error.result, out, as_json)
            raise typer.Exit(error.exit_code) from None


def _show_partial(error: PlantuneError, run: job.Run, folder: Path, as_json: bool) -> None:
    """Print what was identified, and why it carries no tuning."""
    if not as_json:
        show(run, folder)
    fail(error, as_json, as_fields(run, folder))


if __name__ == "__main__":
    main()
