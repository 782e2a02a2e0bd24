"""`plantune watch`: the auto-tuner at work, over a record or at a simulated plant."""

from __future__ import annotations

import time
from collections.abc import Iterator
from math import inf, nan
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.live import Live

from plantune.adapt import AdaptLog, AutoTuner, Decision, Sample, Settings, collect
from plantune.adapt.log import ESTIMATES, EVENTS, GAINS
from plantune.cli.main import app
from plantune.cli.options import Json, LimitOption, limits_of
from plantune.cli.output import csv_of, print_json, refusing, write_file
from plantune.cli.reading import Reading, takes_record
from plantune.cli.watch_view import View, event, events_of, summary
from plantune.datasets import ENGINE_LOOP, engine_loop
from plantune.edge import Link, RecordedPlant, SimulatedPlant, run
from plantune.errors import refusal
from plantune.io import to_json
from plantune.models import PID
from plantune.record import Record

Steps = Iterator[tuple[Sample, Decision]]

_DEMO = "demo"
_OFTEN = 10  # frames per second


@app.command()
@takes_record
def watch(
    reading: Reading,
    Kp: Annotated[
        float | None, typer.Option("--Kp", help="Proportional gain at work, u/y; not for demo.")
    ] = None,
    Ti: Annotated[float, typer.Option("--Ti", help="Integral time at work, seconds.")] = inf,
    nk: Annotated[str, typer.Option(help="Delays to look at, samples.")] = "1:15",
    gain_margin: Annotated[float, typer.Option(help="Gain margin asked of the loop.")] = 3.0,
    pace: Annotated[
        float, typer.Option(help="Times as fast as the plant; 0 is as fast as it goes.")
    ] = 0.0,
    out: Annotated[
        Path | None,
        typer.Option(help="CSV file for the log, a record: empty cells where nothing is known."),
    ] = None,
    figure: Annotated[Path | None, typer.Option(help="HTML file for the figure.")] = None,
    decisions: Annotated[
        bool, typer.Option("--decisions", help="With --json: a line for each estimate and event.")
    ] = False,
    limit: LimitOption = None,
    as_json: Json = False,
) -> None:
    """Watch the auto-tuner over a record, or `demo`: an engine loop that it tunes.

    A record stays as it was: what would have been written is shown.  The demo changes its plant
    after half of the time.
    """
    with refusing(as_json):
        link, settings, title, rec = _set_up(reading, Kp, Ti, nk, gain_margin, limit)
        steps = _shown(link, settings, title, pace, as_json, decisions)
        log = collect(steps, settings, "" if rec is None else rec.source)
        if out is not None:
            write_file(out, _csv(log))
        if figure is not None:
            write_file(figure, _drawn(log, rec), "--figure")
    if as_json:
        if not decisions:
            print_json(to_json(summary(log)))
        return
    console = Console(highlight=False)
    console.print(f"{log}", soft_wrap=True)


def _set_up(
    reading: Reading, Kp: float | None, Ti: float, nk: str, gain_margin: float, limit: LimitOption
) -> tuple[Link, Settings, str, Record | None]:
    """Return the link, the settings, a title, and the record if it is one."""
    limits, delays = limits_of(limit), _delays(nk)
    if [str(path) for path in reading.data] == [_DEMO]:
        link = _demo()
        asked = Settings(link.Ts, delays, link.controller, gain_margin, limits=limits)
        return link, asked, "Simulated engine loop, the plant changes on the way", None
    if Kp is None:
        raise refusal(
            "U01", "`--Kp` is missing, must be the gain at work", remedy="--Kp 1.2 --Ti 30"
        )
    rec, pid = reading.record(limits), PID(Kp, Ti)
    asked = Settings(rec.Ts, delays, pid, gain_margin, limits=limits)
    return RecordedPlant(rec, shadow=True), asked, reading.title, rec


def _delays(nk: str) -> tuple[int, int]:
    low, _, high = nk.partition(":")
    try:
        return int(low), int(high)
    except ValueError:
        raise refusal(
            "U01", f"`--nk` is {nk!r}, must be LOW:HIGH in samples", remedy="--nk 1:15"
        ) from None


def _demo() -> SimulatedPlant:
    """Return the engine loop of source 001 with noise; its gain grows by half after 20 s."""
    r = engine_loop(t_end=40.0, seed=1).r
    assert r is not None
    rows, later = len(r), len(r) // 2
    return SimulatedPlant(
        r[:, 0],
        PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=0.02),
        K=[ENGINE_LOOP.K] * later + [1.5 * ENGINE_LOOP.K] * (rows - later),
        T=ENGINE_LOOP.T,
        L=ENGINE_LOOP.L,
        offset=ENGINE_LOOP.offset,
        Ts=0.02,
        noise_sd=1.0,
        seed=1,
    )


def _shown(
    link: Link, settings: Settings, title: str, pace: float, as_json: bool, decisions: bool
) -> Steps:
    """Pass the steps on, and show them: live, in a pipe a line per event, or as JSON."""
    steps = run(link, AutoTuner(settings))
    if pace > 0:
        steps = _paced(steps, pace)
    if as_json:
        for sample, decision in steps:
            if decisions and (decision.fitted or events_of(decision)):
                print_json(to_json(event(sample, decision)))
            yield sample, decision
        return
    console = Console(highlight=False)
    view = View(title, settings)
    if not console.is_terminal:
        for sample, decision in steps:
            view.take(sample, decision)
            if happened := view.line(decision):
                console.print(happened, soft_wrap=True)
            yield sample, decision
        return
    with Live(get_renderable=view.render, console=console, refresh_per_second=_OFTEN):
        for sample, decision in steps:
            view.take(sample, decision)
            yield sample, decision


def _paced(steps: Steps, pace: float) -> Steps:
    """Wait until it is time for each step."""
    start, first = time.monotonic(), nan
    for sample, decision in steps:
        first = sample.t if first != first else first
        ahead = (sample.t - first) / pace - (time.monotonic() - start)
        if ahead > 0:
            time.sleep(ahead)
        yield sample, decision


def _csv(log: AdaptLog) -> str:
    """Return the signals, and what was decided, as a table."""
    names = ["t", "u", "y", "r", *ESTIMATES, *GAINS, *EVENTS]
    if np.isnan(log.r).all():
        names.remove("r")
    return csv_of({name: getattr(log, name) for name in names})


def _drawn(log: AdaptLog, rec: Record | None) -> str:
    from plantune import plot  # only here: it takes longer to load than all else

    html: str = plot.adapt(log, of=rec).to_html(include_plotlyjs=True)
    return html
