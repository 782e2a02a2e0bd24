"""Source 002: a piezo stage by elements in series; noise, the second cycle, and the inverse.

    python examples/source_002.py

Prints the tables of the page.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from plantune.datasets import PIEZO_STAGE, piezo_stage
from plantune.hysteresis import SeriesSlip, cycles, repeatability

THRESHOLD = 0.5
RATIOS = (8, 6, 4, 3, 2)


def noisy(records: int = 40) -> Iterator[tuple[int, list[float]]]:
    """Yield exceedances in a row, then mean elements and mean largest error at each ratio."""
    for consecutive in (1, 3, 5):
        cells: list[float] = []
        for ratio in RATIOS:
            found = [_noisy(consecutive, THRESHOLD / ratio, seed) for seed in range(records)]
            cells += np.mean(found, axis=0).tolist()
        yield consecutive, cells


def _noisy(consecutive: int, noise_sd: float, seed: int) -> tuple[int, float]:
    """Return the elements of both groups, and the largest error without the noise."""
    stage = piezo_stage(cycles=1, drift=0.0, digit=0.0, noise_sd=noise_sd, seed=seed)
    quiet = piezo_stage(cycles=1, drift=0.0, digit=0.0)
    x, y = stage.u[:, 0], stage.y[:, 0]
    model = SeriesSlip.identify(x, y, THRESHOLD, consecutive)
    worst = np.abs(model.simulate(x) - quiet.y[:, 0]).max()
    return len(model.up) + len(model.down), float(worst)


def second() -> Iterator[tuple[tuple[float, float], list[float]]]:
    """Yield (drift, threshold), then elements, repeatability and errors in the second cycle."""
    for drift in (0.3, 0.6, 1.0):
        for threshold in (0.5, 0.25):
            stage = piezo_stage(cycles=2, drift=drift)
            x, y = stage.u[:, 0], stage.y[:, 0]
            first, then = cycles(x)
            model = SeriesSlip.identify(x[first], y[first], threshold)
            own = repeatability(x, y)
            as_it_is = y[then] - model.simulate(x[then])
            moved = y[then] - model.through(x[then][0], y[then][0]).simulate(x[then])
            yield (
                (drift, threshold),
                [
                    len(model.up),
                    len(model.down),
                    own.largest,
                    own.rms,
                    float(np.abs(as_it_is).max()),
                    float(np.abs(moved).max()),
                    float(np.sqrt(np.mean(moved**2))),
                ],
            )


def compensated() -> Iterator[tuple[str, list[float]]]:
    """Yield what stands in front of the stage, then the largest and the rms error, um."""
    t = np.arange(4001) / 2000
    x = 50 - 50 * np.cos(2 * np.pi * t)
    y, r = PIEZO_STAGE.loop(x), 30 - 29.5 * np.cos(2 * np.pi * t)
    ways = {"straight line": r * 100 / y.max()}
    for threshold in (0.5, 0.1):
        model = SeriesSlip.identify(x, y, threshold)
        ways[f"inverse, {threshold} um"] = model.inverse().simulate(r)
        ways[f"inverse of closed, {threshold} um"] = model.closed().inverse().simulate(r)
    for name, voltage in ways.items():
        e = (PIEZO_STAGE.loop(voltage) - r)[2000:]
        yield name, [float(np.abs(e).max()), float(np.sqrt(np.mean(e**2)))]


def main() -> None:
    """Print the tables."""
    print("noise: elements and largest error at a threshold of", RATIOS, "standard deviations")
    for consecutive, cells in noisy():
        print(f"| {consecutive} | " + " | ".join(f"{c:.2f}" for c in cells) + " |")
    print("second cycle: up, down, repeatability, rms; error as it is; re-anchored, rms")
    for (drift, threshold), cells in second():
        values = " | ".join(f"{c:.0f}" if i < 2 else f"{c:.2f}" for i, c in enumerate(cells))
        print(f"| {drift}, {threshold} | {values} |")
    print("compensated: largest error, rms")
    for name, cells in compensated():
        print(f"| {name} | " + " | ".join(f"{c:.3f}" for c in cells) + " |")


if __name__ == "__main__":
    main()
