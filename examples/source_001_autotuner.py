"""Source 001, 3.7.6: the experiments of its auto-tuner, the document's scheme beside ours.

    python examples/source_001_autotuner.py [--figures FOLDER]

Prints the tables of the page; `--figures` writes each figure as a page.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import plantune as pt
from plantune.plot.style import MODEL, SECOND, SET_POINT, figure, line

K, T, L, OFFSET = pt.datasets.ENGINE_LOOP
TRUE = np.array([K, T, L])
TS = 0.02
FIRST = pt.models.PID(Kp=-0.018, Ti=0.018 / 0.3385)
REST = (400.0 - OFFSET) / K
NOISE_VAR = 1.5
RATE = round(1 / TS)

# Something happens here in the last two experiments, seconds.
EVENT = 15.0

OURS = pt.adapt.Settings(Ts=TS, nk=(3, 11), controller=FIRST, target=0.02)
DOCUMENT = partial(pt.adapt.Settings.source_001, TS, FIRST)

# The document starts at u = 0, so that y falls from the offset to the set point.
SCHEMES = {
    "document, from the first sample": (DOCUMENT(), {"u0": 0.0}),
    "document, bank opened after 18 s": (DOCUMENT(opens=18 * RATE), {"u0": 0.0}),
    "document, filter and loop at rest": (DOCUMENT(steady=True), {}),
    "document, without offset": (DOCUMENT(), {"u0": 0.0, "offset": 0.0}),
    "ours": (OURS, {"u0": 0.0}),
    "ours, without offset": (OURS, {"u0": 0.0, "offset": 0.0}),
    "ours, written at once": (replace(OURS, max_change=10.0), {"u0": 0.0}),
}


def loop(
    settings: pt.adapt.Settings, seed: int = 0, t_end: float = 30.0, **plant: object
) -> pt.adapt.AdaptLog:
    """Run an auto-tuner live at the engine; the set point is 400, then switches by +-50."""
    r = np.r_[400.0, pt.datasets.engine_loop(seed=seed, t_end=t_end).r[:-1, 0]]
    at = {"K": K, "T": T, "L": L, "offset": OFFSET, **plant}
    link = pt.edge.SimulatedPlant(r, settings.controller, Ts=TS, seed=seed, **at)
    return pt.adapt.collect(pt.edge.run(link, pt.adapt.AutoTuner(settings)), settings)


def wished(K: float = K, L: float = L) -> pt.models.PID:
    """Return the settings that a plant known exactly would get."""
    return pt.tune.imc_pi(pt.models.ProcessModel(K=K, T=T, L=L), gain_margin=3).controller


def off(found: np.ndarray, true: np.ndarray | float) -> np.ndarray:
    """Return how far off it is, percent."""
    return 100 * np.abs(found / true - 1)


def for_good(holds: np.ndarray) -> float:
    """Return the time from which it holds to the end, seconds; infinite where it does not."""
    missed = np.flatnonzero(~holds)
    begins = missed[-1] + 1 if len(missed) else 0
    return TS * begins if begins < len(holds) else np.inf


def convergence(seeds: Sequence[int] = range(10)) -> Iterator[tuple[str, np.ndarray]]:
    """Yield for each scheme when it first accepts, K and T off then and at the end, and when tuned.

    Seconds and percent, medians over the seeds; tuned is Kp and Ki within 1 % for good.
    """
    pid = wished()
    for name, (settings, plant) in SCHEMES.items():
        rows = []
        for seed in seeds:
            log = loop(settings, seed, **plant)
            first = np.flatnonzero(log.accepted)[0]
            apart = off(log.merged[[first, -1], :2], TRUE[:2]).ravel()
            tuned = (off(log.Kp, pid.Kp) < 1) & (off(log.Ki, pid.Kp / pid.Ti) < 1)
            rows.append([log.t[first], *apart, for_good(tuned)])
        yield name, np.median(rows, axis=0)


def noisy(
    seconds: Sequence[float] = (2.0, 5.0, 10.0), seeds: Sequence[int] = range(60)
) -> Iterator[tuple[float, np.ndarray]]:
    """Yield a time and its table: a row for each of K, T, L; RMS error, bound, error over sd.

    Errors and bounds in percent.  Nothing is written: every run keeps the first controller.
    """
    shadow = pt.adapt.Settings(Ts=TS, nk=(3, 11), controller=FIRST, worth=1e9)
    logs = [loop(shadow, seed, 10.1, noise_sd=NOISE_VAR**0.5) for seed in seeds]
    for t in seconds:
        k = round(t * RATE)
        found = np.array([[x[k] for x in (log.K, log.T, log.L)] for log in logs])
        sd = np.array([log.sd[k, :3] for log in logs])
        bounds = np.array([bound(log.u[: k + 1]) for log in logs])
        columns = 100 * (found / TRUE - 1), 100 * bounds / TRUE, (found - TRUE) / sd
        yield t, np.sqrt(np.mean(np.square(columns), axis=1)).T


def bound(u: np.ndarray) -> np.ndarray:
    """Return the Cramer-Rao bound of K, T and L, the offset unknown as well: standard deviations.

    White noise on the output: the inverse of sum psi psi'/var, where psi are the derivatives of
    the output by the parameters.
    """

    def output(K: float, T: float, L: float) -> np.ndarray:
        return K * REST + pt.models.ProcessModel(K=K, T=T, L=L).simulate(u - REST, Ts=TS)

    h = 1e-5
    moved = [(output(*(TRUE + d)) - output(*(TRUE - d))) / (2 * h) for d in h * np.eye(3)]
    psi = np.column_stack([*moved, np.ones(len(u))])
    return np.sqrt(NOISE_VAR * np.diag(np.linalg.inv(psi.T @ psi)))[:3]


def sure(seeds: Sequence[int] = range(60)) -> np.ndarray:
    """Return when K and T are sure to 2 %, and when that was expected at 2, 3 and 4 s."""
    rows = []
    for seed in seeds:
        log = loop(OURS, seed, 15.0, noise_sd=NOISE_VAR**0.5)
        reached = log.t[np.flatnonzero(log.time_to_target == 0)[0]]
        expected = [log.t[k] + log.time_to_target[k] for k in (2 * RATE, 3 * RATE, 4 * RATE)]
        rows.append([reached, *expected])
    return np.array(rows)


def stepped(seed: int = 0, by: float = -60.0) -> pt.adapt.AdaptLog:
    """Run ours with noise; the offset steps after 15 s."""
    offset = OFFSET + by * (np.arange(30 * RATE) >= EVENT * RATE)
    return loop(OURS, seed, offset=offset, noise_sd=NOISE_VAR**0.5)


def changed(seed: int = 0) -> pt.adapt.AdaptLog:
    """Run ours with noise; after 15 s the gain doubles and the delay grows by 3 samples."""
    after = np.arange(30 * RATE) >= EVENT * RATE
    plant = {"K": np.where(after, 2 * K, K), "L": np.where(after, L + 3 * TS, L)}
    return loop(OURS, seed, noise_sd=NOISE_VAR**0.5, **plant)


def Ms_of(log: pt.adapt.AdaptLog, row: int) -> float:
    """Return Ms of the settings at work at a row, on the plant as it then is."""
    is_after = log.t[row] >= EVENT
    plant = pt.models.ProcessModel(K=2 * K, T=T, L=L + 3 * TS) if is_after else None
    pid = pt.models.PID(Kp=log.Kp[row], Ti=log.Kp[row] / log.Ki[row], Ts=TS)
    return pt.tune.margins(plant or pt.models.ProcessModel(K=K, T=T, L=L), pid).Ms


def events(seeds: Sequence[int] = range(20)) -> tuple[np.ndarray, np.ndarray]:
    """Return what follows the step and the change of the plant, run by run.

    Of the step: largest errors of K and T after it, percent, and alarms in all.  Of the change:
    seconds until alarm, judgement and settings with Ms below 1.8; largest |y - r|, alarms in all.
    """
    k = round(EVENT * RATE)
    steps, changes = [], []
    for seed in seeds:
        log = stepped(seed)
        steps.append([max(off(log.K[k:], K)), max(off(log.T[k:], T)), log.alarm.sum()])
        log = changed(seed)
        alarm, judged = (log.t[k + np.argmax(x[k:])] - EVENT for x in (log.alarm, log.changed))
        rows = k + np.flatnonzero(log.retuned[k:])
        tame = next(row for row in rows if Ms_of(log, row) < 1.8)
        changes.append(
            [alarm, judged, log.t[tame] - EVENT, max(abs(log.y - log.r)[k:]), log.alarm.sum()]
        )
    return np.array(steps), np.array(changes)


def figures() -> dict[str, object]:
    """Return the document's run beside ours, and ours when the plant changes."""
    return {"source_001_beside": beside(), "source_001_changed": pt.plot.adapt(changed())}


def beside() -> object:
    """Draw output, merged gain and time constant, and the gain at work of both schemes."""
    logs = {
        "document": (loop(DOCUMENT(opens=18 * RATE), u0=0.0), SECOND, 1.4),
        "ours": (loop(OURS, u0=0.0), MODEL, 1.8),
    }
    title = "Source 001, 3.7.6c: the document's scheme and ours"
    subtitle = (
        "offset 583.451, no noise; the document's bank opens after 18 s; dashed: set point, theory"
    )
    fig = figure(title, subtitle, [170, 110, 110, 110])
    log = logs["ours"][0]
    pid = wished()
    for row, (true, name) in enumerate(
        [(log.r, "y"), (K, "K"), (T, "T [s]"), (pid.Kp, "Kp")], start=1
    ):
        dashed = {"dash": "dash", "width": 1.0, "opacity": 0.6, "showlegend": False}
        line(fig, log.t, np.broadcast_to(true, log.t.shape), name, SET_POINT, row, **dashed)
        fig.update_yaxes(title_text=name, row=row, col=1)
    for name, (log, color, width) in logs.items():
        for row, x in enumerate((log.y, *log.merged.T[:2], log.Kp), start=1):
            shown = {"legendgroup": name, "showlegend": row == 1, "held": row > 1}
            line(fig, log.t, x, name, color, row, width=width, **shown)
    fig.update_xaxes(title_text="time [s]", row=4, col=1)
    return fig


def main() -> None:
    """Print the tables; write the figures where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figures", type=Path)
    asked = parser.parse_args()
    print("first accepted [s], K, T off then, K, T off at the end [%], tuned [s]")
    for name, numbers in convergence():
        print(name.ljust(34), *(f"{x:8.3g}" for x in numbers))
    print("\nseconds: of K, T, L the RMS error [%], the bound [%], error over sd")
    for t, rows in noisy():
        print(f"{t:7.3g}", *(f"{x:6.2f}" for x in rows.ravel()))
    reached, *expected = sure().T
    print("\nsure to 2 % after, and when that was expected at 2, 3 and 4 s: 10, 50, 90 % [s]")
    for x in (reached, *expected):
        print(*(f"{q:6.2f}" for q in np.quantile(x, (0.1, 0.5, 0.9))))
    steps, changes = events()
    print("\noffset steps by -60: K, T off [%], alarms; largest", steps.max(axis=0).round(2))
    print("plant changes: alarm, judged, Ms < 1.8 [s], largest |y - r|, alarms; median and largest")
    print(np.median(changes, axis=0).round(2), changes.max(axis=0).round(2))
    if asked.figures:
        asked.figures.mkdir(parents=True, exist_ok=True)
        for name, fig in figures().items():
            page = asked.figures / f"{name}.html"
            fig.write_html(page, include_plotlyjs=True, config={"displayModeBar": False})


if __name__ == "__main__":
    main()
