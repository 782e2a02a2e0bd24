"""Whatever is asked of whatever table ends in a record or in a refusal."""

import random
from datetime import datetime, timedelta

import numpy as np
import pytest

import plantune as pt

FORMS = ["%Y-%m-%dT%H:%M:%S", "%d/%m/%Y %I:%M:%S %p", "%H:%M:%S", "%Y-%m-%d", "number"]
ODD = ["", "nan", "-9999", "1e400", "Bad", "3,5", '"4"', "10:00 PM", "01/02/2024 10:00", "1.7e12"]
GRADES = ["Good", "Bad", "Uncertain", "192", "0"]
OPTIONS = {
    "Ts": [0.1, 1.0],
    "sort": [True, "segments"],
    "ragged": ["skip"],
    "missing": ["segments", "mask"],
    "resample": [0.1, 1.0, 0.7, 1e-7],
    "quality": ["q", {"y": "q"}],
    "uncertain": ["keep"],
    "sentinels": [(-9999,)],
    "aux": ["a"],
    "limits": [pt.Limits(D07=0.9, D15=0.5)],
    "time": [0, 1, (0, 1), (0, 2)],
}


def stamps(rng, N):
    """Count up by some step, set the clock back or shuffle at times, and write in some form."""
    step, form = rng.choice([0.1, 1.0, 3600.0]), rng.choice(FORMS)
    t = step * np.arange(N)
    if rng.random() < 0.3:
        t[rng.randrange(N) :] -= rng.choice([step, 3600.0])
    if rng.random() < 0.3:
        rng.shuffle(t)
    if form == "number":
        return [f"{x:.1f}" for x in t]
    return [(datetime(2024, 1, 13) + timedelta(seconds=x)).strftime(form) for x in t.tolist()]


def table(rng):
    N = rng.choice([2, 3, 5, 30])
    values = [[str(rng.choice([1, 2, rng.random()])) for _ in range(N)] for _ in range(3)]
    columns = [stamps(rng, N), stamps(rng, N), *values, rng.choices(GRADES, k=N)]
    rows = [list(row) for row in zip(*columns, strict=True)]
    for _ in range(rng.choice([0, 0, 1, 3])):
        rows[rng.randrange(N)][rng.randrange(6)] = rng.choice(ODD)
    if rng.random() < 0.2:
        rows.insert(rng.randrange(N), rows[rng.randrange(N)])
    if rng.random() < 0.2:
        rows[rng.randrange(N)] = rng.choice(rows)[: rng.randrange(7)]
    head = rng.choice(["time,Time,u,y,a,q", "Date,Time,u,y,a,q", "x,z,u,y,a,q"]).split(",")
    delimiter = rng.choice([",", ";", "\t"])
    return "\n".join(delimiter.join(row) for row in [head, *rows]) + "\n"


@pytest.mark.parametrize("seed", range(4))
def test_a_record_or_a_refusal(tmp_path, seed):
    rng = random.Random(seed)
    path, seen = tmp_path / "a.csv", set()
    for _ in range(300):
        path.write_text(table(rng))
        wanted = {k: rng.choice(v) for k, v in OPTIONS.items() if rng.random() < 0.3}
        try:
            rec = pt.read(path, u="u", y="y", **wanted)
        except pt.PlantuneError as error:
            seen.add(error.code)
            assert error.remedy and str(error).count("\n") <= 2, error
        else:
            seen.add("record")
            assert np.isfinite(rec.u).all() and np.isfinite(rec.y).all() and rec.Ts > 0
            assert len(rec.rows) == len(rec.time) == rec.N
    assert {"record", "D07", "D13", "D16", "U01"} <= seen
