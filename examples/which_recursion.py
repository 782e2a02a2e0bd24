"""Recursive estimators beside each other on an engine whose truth is known: tables of the page.

python examples/which_recursion.py
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

import plantune as pt

K, T, L, OFFSET = pt.datasets.ENGINE_LOOP
TS = 0.02
NOISE_VAR = 1.5
FIRST = pt.models.PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=TS)
R = pt.recursive

RECURSIONS = {
    "ARX": lambda **how: R.ARX(1, 1, 6, **how),
    "ARMAX": lambda **how: R.ARMAX(1, 1, 1, 6, **how),
    "ARMAX, ELS": lambda **how: R.ARMAX(1, 1, 1, 6, method="els", **how),
    "OE": lambda **how: R.OE(1, 1, 6, **how),
    "BJ": lambda **how: R.BJ(1, 1, 1, 1, 6, **how),
}
BATCH = {
    "batch ARMAX": lambda rec: pt.estimate.armax(rec, 1, 1, 1, 6),
    "batch OE": lambda rec: pt.estimate.oe(rec, 1, 1, 6),
}

# Of ARMAX(1, 1, 1): a1, b1, c1 and the constant.
WALK = (0.0, 3e-5, 0.0, 3e-3)
WAYS = {
    "nothing forgotten": {},
    "exponential, 0.995": {"lam": 0.995},
    "exponential, 0.98": {"lam": 0.98},
    "variable, 0.99": {"lam": 0.99, "forgetting": "variable"},
    "directional, 0.9": {"lam": 0.9, "forgetting": "directional"},
    "Kalman": {"forgetting": "kalman", "R1": WALK},
}
WINDOW = "window of 15 s, as the auto-tuner has it"

# Of rows of 60 s: where the gain begins to drift, where it steps, and where judging ends.
DRIFT, STEP = slice(1000, 2000), 1500
MORE = 0.3


def off(model: pt.models.PolyModel) -> tuple[float, float]:
    """Return how far off gain and time constant of a first-order model are, percent."""
    pole = -(model.A if len(model.A) > 1 else model.F)[1]
    found = model.dc_gain(), -TS / np.log(pole) if 0 < pole < 1 else np.nan
    return 100 * (found[0] / K - 1), 100 * (found[1] / T - 1)


def errors(
    seconds: Sequence[float] = (5.0, 10.0, 60.0), seeds: Sequence[int] = range(20)
) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Yield for each estimator the RMS errors of K and T after each time, percent."""

    def of(name: str, rec: pt.Record) -> tuple[float, float]:
        if name in BATCH:
            return off(BATCH[name](rec).model)
        estimator = RECURSIONS[name]()
        estimator.run(rec, every=rec.N)
        return off(estimator.model)

    records = {
        t: [pt.datasets.engine_loop(NOISE_VAR, seed, t_end=t) for seed in seeds] for t in seconds
    }
    for name in (*RECURSIONS, *BATCH):
        yield (
            name,
            [
                np.sqrt(np.mean(np.square([of(name, rec) for rec in records[t]]), axis=0))
                for t in seconds
            ],
        )


def varying(gain: np.ndarray, seed: int) -> pt.Record:
    """Return a record of the engine whose gain is so many times its own."""
    r = pt.datasets.engine_loop(seed=seed, t_end=TS * len(gain)).r[:, 0]
    at = {"K": K * gain, "T": T, "L": L, "offset": OFFSET, "noise_sd": NOISE_VAR**0.5}
    return pt.edge.record(pt.edge.SimulatedPlant(r, FIRST, Ts=TS, seed=seed, **at))


def followed(seeds: Sequence[int] = range(6)) -> Iterator[tuple[str, np.ndarray]]:
    """Yield for each way to forget how the gain is followed: constant, drifting, after a step.

    Percent RMS while it is constant (the last 30 of 60 s); while it grows by 30 % within 20 s and
    in the 4 s after; and seconds after a step of 30 % from which on it is within 5 %.
    """
    rows = np.arange(3000)
    drift = 1 + MORE * np.clip((rows - DRIFT.start) / (DRIFT.stop - DRIFT.start), 0, 1)
    step = 1 + MORE * (rows >= STEP)
    made = [[varying(gain, seed) for gain in (np.ones(3000), drift, step)] for seed in seeds]
    for name in (*WAYS, WINDOW):
        found = []
        for records in made:
            constant, drifting, stepped = (
                100 * (gain_of(name, rec) / (K * gain) - 1)
                for rec, gain in zip(records, (1.0, drift, step), strict=True)
            )
            within = for_good(abs(stepped[STEP:]) < 5)
            found.append([rms(constant[STEP:]), rms(drifting[DRIFT.start : 2200]), within])
        yield name, np.median(found, axis=0)


def for_good(holds: np.ndarray) -> float:
    """Return the time from which it holds to the end, seconds; infinite where it does not."""
    missed = np.flatnonzero(~holds)
    begins = missed[-1] + 1 if len(missed) else 0
    return TS * begins if begins < len(holds) else np.inf


def gain_of(name: str, rec: pt.Record) -> np.ndarray:
    """Return the gain after each row, NaN before the first."""
    if name == WINDOW:
        return pt.adapt.replay(rec, pt.adapt.Settings(Ts=TS, nk=(3, 11), controller=FIRST)).K
    trace = R.ARMAX(1, 1, 1, 6, **WAYS[name]).run(rec)
    gain = np.full(rec.N, np.nan)
    gain[trace.rows] = trace.theta[:, 1] / (1 + trace.theta[:, 0])
    return gain


def rms(x: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def main() -> None:
    """Print the tables."""
    print("RMS errors of K, T after 5, 10, 60 s [%]")
    for name, numbers in errors():
        print(name.ljust(14), *(f"{x:6.2f}" for x in np.ravel(numbers)))
    print("\ngain: constant, drifting [% RMS]; within 5 % after a step [s]")
    for name, numbers in followed():
        print(name.ljust(42), *(f"{x:6.2f}" for x in numbers))


if __name__ == "__main__":
    main()
