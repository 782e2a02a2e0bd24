"""`plantune design`: an experiment planned before it is run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from plantune.analyze import Experiment, experiment
from plantune.cli.main import app
from plantune.cli.options import Json, LimitOption, limits_of
from plantune.cli.output import csv_of, print_json, refusing, write_file
from plantune.io import to_json

Ends = tuple[float, float] | None


@app.command()
def design(
    K: Annotated[float, typer.Option("--K", help="Rough gain, y/u.")],
    T: Annotated[float, typer.Option("--T", help="Rough time constant, seconds.")],
    L: Annotated[float, typer.Option("--L", help="Rough dead time, seconds.")],
    Ts: Annotated[float, typer.Option("--Ts", help="Sample time, seconds.")],
    noise_sd: Annotated[float, typer.Option(help="Standard deviation of the disturbance of y.")],
    time: Annotated[float | None, typer.Option(help="Seconds available.")] = None,
    u_limits: Annotated[Ends, typer.Option(help="Within which the input stays.")] = None,
    y_limits: Annotated[Ends, typer.Option(help="Within which the output stays.")] = None,
    at: Annotated[Ends, typer.Option(help="Operating point, u and y.")] = None,
    target: Annotated[
        float, typer.Option(help="Wished sd of K, T and L, as shares; one standard deviation.")
    ] = 0.05,
    shape: Annotated[
        Literal["prbs", "gbn", "stairs", "step", "multisine"] | None,
        typer.Option(help="Form of the input; by default the one that tells most."),
    ] = None,
    ar: Annotated[
        list[float] | None, typer.Option(help="Coefficient of a coloured disturbance, repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the binary sequences.")] = 0,
    out: Annotated[Path | None, typer.Option(help="CSV of time, input, expected output.")] = None,
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Plan an experiment from a rough K, T and L: input, size, time, and what it will tell."""
    with refusing(as_json):
        plan = experiment(
            (K, T, L),
            Ts,
            noise_sd,
            time=time,
            u_limits=u_limits,
            y_limits=y_limits,
            at=at,
            target=target,
            shape=shape,
            ar=ar or (),
            seed=seed,
            limits=limits_of(limit),
        )
        if out is not None:
            write_file(out, csv_of({"time [s]": plan.t, "u": plan.u, "y": plan.y}))
    if as_json:
        print_json({**to_json(plan, longest=100), "out": None if out is None else str(out)})
    else:
        _show(plan, out)


def _show(plan: Experiment, out: Path | None) -> None:
    console = Console(highlight=False)
    console.print(str(plan), soft_wrap=True)
    if out is not None:
        console.print(f"input: {out}", soft_wrap=True)
