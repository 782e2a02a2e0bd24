"""`plantune simulate`: a model alone, or in a loop with a controller."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from plantune import simulate as sim
from plantune.cli.main import app
from plantune.cli.options import Json
from plantune.cli.output import csv_of, print_json, refusing, write_file
from plantune.errors import refusal
from plantune.io import load_json, load_model, model_of, to_json
from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.record import Floats
from plantune.simulate import Response
from plantune.text import number
from plantune.tune import tuning_of

_POINTS = 1001


@app.command()
def simulate(
    model: Annotated[Path, typer.Argument(help="model.json or tuning.json of `plantune tune`.")],
    controller: Annotated[
        Path | None, typer.Option(help="tuning.json or a controller's JSON; or give --Kp.")
    ] = None,
    Kp: Annotated[float | None, typer.Option("--Kp", help="Proportional gain, u/y.")] = None,
    Ti: Annotated[float, typer.Option("--Ti", help="Integral time, seconds.")] = inf,
    Td: Annotated[float, typer.Option("--Td", help="Derivative time, seconds.")] = 0.0,
    Tf: Annotated[float, typer.Option("--Tf", help="Filter time, seconds.")] = 0.0,
    Ts: Annotated[
        float | None, typer.Option("--Ts", help="Sample time of the controller, seconds.")
    ] = None,
    load: Annotated[
        bool, typer.Option("--load", help="Step a load at the plant input, not the set point.")
    ] = False,
    t_end: Annotated[float | None, typer.Option(help="Seconds to simulate.")] = None,
    out: Annotated[Path | None, typer.Option(help="CSV file for the signals.")] = None,
    as_json: Json = False,
) -> None:
    """Answer a unit step: of the loop with a controller, or of the model alone."""
    with refusing(as_json):
        plant, own = _plant(model)
        pid = own if controller is None and Kp is None else _pid(controller, Kp, Ti, Td, Tf, Ts)
        signals, indices = _run(plant, pid, load, t_end)
        if out is not None:
            write_file(out, csv_of(signals))
    if as_json:
        print_json(to_json({**signals, "indices": indices}))
        return
    console = Console(highlight=False)
    console.print(f"{plant}")
    console.print(f"{pid}" if pid is not None else "open loop")
    for name, value in (to_json(indices) if indices else {"final": signals["y"][-1]}).items():
        console.print(f"  {name:<18} {number(value) if value is not None else '–'}")


def _plant(file: Path) -> tuple[LinearModel, PID | None]:
    """Return the plant of a file, and the controller if it is a tuning."""
    values = load_json(file)
    if isinstance(values, dict) and "controller" in values:
        tuning = tuning_of(values)
        return tuning.model, tuning.controller
    plant = model_of(values)
    if not isinstance(plant, LinearModel):
        text = f"{file} holds a {type(plant).__name__}, must hold a linear model"
        raise refusal("U01", text, remedy="a controller goes to --controller")
    return plant, None


def _pid(
    file: Path | None, Kp: float | None, Ti: float, Td: float, Tf: float, Ts: float | None
) -> PID:
    if file is None:
        assert Kp is not None
        return PID(Kp, Ti, Td, Tf, Ts=Ts)
    if Kp is not None:
        raise refusal("U01", "--controller and --Kp are both given", remedy="give one of them")
    values = load_json(file)
    if isinstance(values, dict) and "controller" in values:
        return tuning_of(values).controller
    pid = load_model(file)
    if not isinstance(pid, PID):
        raise refusal("U01", f"{file} holds no controller", remedy="give a tuning.json")
    return pid


def _run(
    plant: LinearModel, pid: PID | None, load: bool, t_end: float | None
) -> tuple[Mapping[str, Floats], Any]:
    """Return the signals over time, and the indices of a loop."""
    if pid is None:
        return _open_loop(plant, t_end), None
    run: Response = (sim.load_step if load else sim.step)(plant, pid, t_end)
    return {"t": run.t, "r": run.r, "y": run.y, "u": run.u}, run.indices


def _open_loop(plant: LinearModel, t_end: float | None) -> Mapping[str, Floats]:
    end = plant.horizon() if t_end is None else t_end
    if not 0 < end < inf:
        raise refusal("U01", f"`t_end` is {end}, must be positive and finite", remedy="--t-end 10")
    t = np.linspace(0.0, end, _POINTS)
    return {"t": t, "y": plant.step(t)}
