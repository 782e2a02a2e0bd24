"""How far each estimator is from the truth: the two tables of docs/which-method.md.

    python examples/which_method.py

Gain and time constant, mean error ± spread over ten records, percent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

import plantune as pt
from plantune.datasets import ENGINE_LOOP

SEEDS = range(10)
METHODS: dict[str, Callable[[pt.Record], pt.Fit]] = {
    "ARX": lambda rec: pt.estimate.arx(rec, 1, 1, 6),
    "OE": lambda rec: pt.estimate.oe(rec, 1, 1, 6),
    "ARMAX": lambda rec: pt.estimate.armax(rec, 1, 1, 1, 6),
    "P1D": lambda rec: pt.estimate.process(rec, "P1D"),
}
PLANT = pt.models.ProcessModel(K=ENGINE_LOOP.K, T=ENGINE_LOOP.T, L=ENGINE_LOOP.L)
TS, N = 0.02, 5000


def measured(seed: int) -> pt.Record:
    """Open loop, noise on the measurement: a tenth of the output's size."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], N // 10).repeat(10)
    y = PLANT.simulate(u, Ts=TS)
    return pt.Record(u=u, y=y + 0.1 * np.std(y) * rng.normal(size=N), Ts=TS)


def driven(seed: int) -> pt.Record:
    """Open loop, noise that drives the plant at its input."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], N // 10).repeat(10)
    return pt.Record(u=u, y=PLANT.simulate(u + 0.4 * rng.normal(size=N), Ts=TS), Ts=TS)


def loop(seed: int, amplitude: float) -> pt.Record:
    """Closed by a tight PI, noise at the plant's input, a set point that switches."""
    rng = np.random.default_rng(seed)
    r = amplitude * rng.choice([-1.0, 1.0], N // 10).repeat(10)
    pid = pt.models.PID(Kp=-0.1315, Ti=0.1491, Ts=TS)
    run = pt.simulate.closed_loop(PLANT, pid, r, d=2 * rng.normal(size=N), Ts=TS)
    return pt.Record(u=run.u[:N], y=run.y[:N], r=r, Ts=TS)


RECORDS: dict[str, Callable[[int], pt.Record]] = {
    "open, noise on y": measured,
    "open, noise on u": driven,
    "closed, r ± 50": lambda seed: loop(seed, 50.0),
    "closed, r ± 20": lambda seed: loop(seed, 20.0),
    "closed, r ± 5": lambda seed: loop(seed, 5.0),
}


def lag(fit: pt.Fit) -> tuple[float, float]:
    """Return gain and time constant of a first-order fit."""
    model = fit.model
    if isinstance(model, pt.models.ProcessModel):
        return model.K, float(model.T)
    return float(model.dc_gain()), -TS / float(np.log(model.poles()[0].real))


def errors() -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Yield record, method, mean and spread of the errors in K and T, percent."""
    truth = np.array([PLANT.K, PLANT.T])
    for kind, make in RECORDS.items():
        records = [make(seed) for seed in SEEDS]
        for name, method in METHODS.items():
            off = 100 * (np.array([lag(method(rec)) for rec in records]) / truth - 1)
            yield kind, name, off.mean(axis=0), off.std(axis=0)


def main() -> None:
    """Print the tables as the page shows them."""
    cells: dict[str, list[str]] = {}
    for kind, _, mean, spread in errors():
        text = ", ".join(f"{m:+.1f} ± {s:.1f}" for m, s in zip(mean, spread, strict=True))
        cells.setdefault(kind, []).append(text)
    print(*["record", *METHODS], sep=" | ")
    for kind, row in cells.items():
        print(kind, *row, sep=" | ")


if __name__ == "__main__":
    main()
