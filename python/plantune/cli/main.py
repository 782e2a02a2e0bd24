"""`plantune tune` and `plantune demo`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from plantune import job
from plantune.cli.output import as_fields, fail, print_json, write_run
from plantune.cli.summary import show
from plantune.datasets import ENGINE_LOOP, engine_loop, hair_dryer
from plantune.errors import PlantuneError, refusal
from plantune.io import load_model, read
from plantune.notes import DEFAULT_LIMITS, Limits

app = typer.Typer(
    help="From plant data to a validated model to a tuned loop.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
LimitOption = Annotated[
    list[str] | None,
    typer.Option("--limit", help="Change a threshold, e.g. X02=1e-6; noted in every result."),
]
GainMargin = Annotated[float, typer.Option(help="Gain margin asked of the loop, a factor.")]


def main() -> None:
    """Run the command line."""
    app()


@app.callback()
def _plantune() -> None:
    """From plant data to a validated model to a tuned loop."""


@app.command()
def tune(
    data: Annotated[Path, typer.Argument(help="Record: a CSV file.")],
    u: Annotated[str | None, typer.Option(help="Input column, by name or number from 0.")] = None,
    y: Annotated[str | None, typer.Option(help="Output column.")] = None,
    Ts: Annotated[float | None, typer.Option("--Ts", help="Sample time, seconds.")] = None,
    r: Annotated[str | None, typer.Option(help="Set-point column.")] = None,
    time: Annotated[str | None, typer.Option(help="Column of time stamps.")] = None,
    resample: Annotated[
        float | None, typer.Option(help="Bring jittered stamps to this step.")
    ] = None,
    missing: Annotated[str, typer.Option(help="error, segments or mask.")] = "error",
    gain_margin: GainMargin = 3.0,
    given: Annotated[
        list[Path] | None,
        typer.Option(help="model.json of an earlier study, judged beside the new models."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the report and the JSON files.")] = Path(
        "plantune-out"
    ),
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Take a record to a validated model, PI settings with margins, and a report."""

    def work() -> job.Run:
        limits = _limits(limit)
        rec = read(
            data,
            u=_column(u),
            y=_column(y),
            Ts=Ts,
            r=_column(r),
            time=_column(time),
            resample=resample,
            missing=missing,  # type: ignore[arg-type]  # another word is refused
            limits=limits,
        )
        earlier = {path.stem: load_model(path) for path in given or ()}
        return job.run(rec, gain_margin=gain_margin, given=earlier, title=data.stem, limits=limits)

    run, folder = _attempt(work, out, as_json)
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
    done = [_attempt(case, out / name, as_json) for name, case in cases]
    if as_json:
        print_json({folder.name: as_fields(run, folder) for run, folder in done})
    else:
        for run, folder in done:
            show(run, folder)


def _attempt(work: Callable[[], job.Run], out: Path, as_json: bool) -> tuple[job.Run, Path]:
    """Write the run, or print the refusal and exit with its code; a partial run is written too."""
    try:
        try:
            run = work()
            return run, write_run(out, run)
        except PlantuneError as error:
            if not isinstance(error.result, job.Run):
                raise
            write_run(out, error.result)
            _show_partial(error, error.result, out, as_json)
            raise typer.Exit(error.exit_code) from None
    except PlantuneError as error:
        fail(error, as_json)
        raise typer.Exit(error.exit_code) from None


def _show_partial(error: PlantuneError, run: job.Run, folder: Path, as_json: bool) -> None:
    """Print what was identified, and why it carries no tuning."""
    if not as_json:
        show(run, folder)
    fail(error, as_json, as_fields(run, folder))


def _column(name: str | None) -> str | int | None:
    return int(name) if name is not None and name.isdigit() else name


def _limits(changes: list[str] | None) -> Limits:
    pairs: dict[str, float] = {}
    for change in changes or []:
        code, _, value = change.partition("=")
        try:
            pairs[code] = float(value)
        except ValueError:
            raise refusal(
                "U01", f"`--limit` is {change!r}, must be CODE=NUMBER", remedy="--limit X02=1e-6"
            ) from None
    return DEFAULT_LIMITS.with_changes(pairs)


if __name__ == "__main__":
    main()
