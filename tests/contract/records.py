"""Record B0 of BAD_INPUTS.md, its plant, and what every refusal must carry."""

import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

import plantune as pt
from plantune.cli.main import app

TS = 0.1
TRUE_ARX = (-0.8, 0.5)
TRUE_P1D = (2.5, -TS / math.log(0.8))  # K, T; the delay is 0
FILES = ["model.json", "report.html", "run.json", "tuning.json"]

EVERY = ("where", "count", "measured", "limit")
FIELDS = {"type", "code", "text", "where", "count", "measured", "limit", "remedy", "notes"}
CLASSES = {
    "U": "UsageError",
    "D": "DataError",
    "X": "NotIdentifiable",
    "M": "NotIdentifiable",
    "N": "NumericsError",
    "R": "RunError",
    "C": "RunError",
}
EXIT = {"U": 2, "D": 2, "X": 3, "M": 3, "N": 4, "R": 5, "C": 5}


def levels(N=1000, seed=1):
    """Return +-1, switching at random."""
    return np.random.default_rng(seed).choice([-1.0, 1.0], N)


def with_values(x, value, rows):
    """Return a copy with this value in some rows."""
    x = np.array(x)
    x[rows] = value
    return x


def response(u, nk=1, sd=0.02, seed=2):
    """Return y[k] = 0.8 y[k-1] + 0.5 u[k-nk] from rest, with white noise on the output."""
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = 0.8 * y[k - 1] + (0.5 * u[k - nk] if k >= nk else 0.0)
    return y + sd * np.random.default_rng(seed).normal(size=len(u))


def b0(N=1000, seed=1, nk=1, sd=0.02):
    """Return u and y of record B0."""
    u = levels(N, seed)
    return u, response(u, nk, sd, seed + 1)


def record(u=None, y=None, Ts=TS, **fields):
    """Return B0 as a record, with other columns where given."""
    own_u, own_y = b0()
    return pt.Record(u=own_u if u is None else u, y=own_y if y is None else y, Ts=Ts, **fields)


def codes(result):
    """Return the codes of the notes of a result."""
    notes = result.all_notes() if hasattr(result, "all_notes") else result.notes
    return [note.code for note in notes]


def write(path, u, y, t=None):
    """Write a table `time,u,y`; text is written as it is, numbers in full."""
    t = TS * np.arange(len(u)) if t is None else t

    def cell(x):
        return x if isinstance(x, str) else repr(float(x))

    rows = [",".join(map(cell, row)) for row in zip(t, u, y, strict=True)]
    path.write_text("\n".join(["time,u,y", *rows]) + "\n")
    return path


def plantune(*arguments):
    """Run the command line in this process."""
    return CliRunner().invoke(app, [str(a) for a in arguments])


def strict_json(text):
    """Parse JSON without the NaN and Infinity that Python alone understands."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def refused(work, code, needs=EVERY, **wanted):
    """Return the refusal that `work(**wanted)` ends in, checked."""
    with pytest.raises(pt.PlantuneError) as caught:
        work(**wanted)
    check_refusal(caught.value, code, needs)
    return caught.value


def check_refusal(error, code, needs):
    """Check class, exit code, message and that the named fields are filled and finite."""
    assert error.code == code, error
    assert type(error).__name__ == CLASSES[code[0]]
    assert error.exit_code == EXIT[code[0]]
    assert error.remedy, error
    lines = str(error).splitlines()
    assert len(lines) <= 3, error
    assert lines[0].startswith(f"{code}: "), error
    assert lines[-1] == f"do: {error.remedy}"
    for field in needs:
        value = getattr(error, field)
        assert value is not None, f"{field} of {error}"
        if field in ("measured", "limit"):
            assert not math.isnan(value), f"{field} of {error}"
    assert (error.measured is None) == (error.limit is None), error
    if "where" in needs:
        column, row, time = error.where
        assert column in lines[0] or column in lines[1], error
        assert row is None or time is None or math.isfinite(time)
    for field in {"count", "measured", "limit"} & set(needs):
        assert field in lines[1], error


def check_cli_refusal(tmp_path, code, needs, *arguments):
    """Check the same through `plantune tune`, as text and as JSON; nothing may be left behind."""
    before = sorted(tmp_path.rglob("*"))
    out = tmp_path / "results" / "out"
    text = plantune("tune", *arguments, "--out", out)
    assert text.exit_code == EXIT[code[0]], text.output
    printed = text.stderr.strip().splitlines()
    lines = [line for line in printed if not line.startswith("found before: ")]
    assert lines == printed[: len(lines)], text.stderr
    assert 2 <= len(lines) <= 3, text.stderr
    assert lines[0].startswith(f"{code}: "), text.stderr
    assert lines[-1].startswith("do: "), text.stderr
    assert text.stdout == ""
    as_json = plantune("tune", *arguments, "--out", out, "--json")
    assert as_json.exit_code == EXIT[code[0]], as_json.output
    error = strict_json(as_json.stdout)["error"]
    assert error["code"] == code
    assert error["type"] == CLASSES[code[0]]
    assert error["text"] in lines[0]
    assert set(error) == FIELDS
    for field in (*needs, "remedy"):
        assert error[field] is not None, f"{field} of {error}"
    if "where" in needs:
        assert set(error["where"]) == {"column", "row", "time"}
    assert sorted(tmp_path.rglob("*")) == before, "something was left behind"
    return error
