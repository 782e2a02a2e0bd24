"""Historian compression (D15): found, refused when reading, never seen in what was measured."""

import numpy as np
import pytest

import plantune as pt
from contract.records import write
from oracles import compression as oracle
from plantune.io import open_sheet
from plantune.io.table import Wanted

N = 1500
KINDS = ("slow", "steps", "loop")


def signal(kind, seed):
    rng = np.random.default_rng(seed)
    e = rng.normal(size=N)
    y = np.empty(N)
    x = 0.0
    for k in range(N):
        push = {"slow": 0.31 * e[k], "steps": 0.1 * (k // 150 % 3 - 1), "loop": 0.2 * np.sin(k / 9)}
        x = 0.95 * x + push[kind]
        y[k] = 50 + x + 0.05 * e[k]
    return y


def looked(y):
    return pt.analyze.compression(pt.Record(u=np.zeros(N), y=y, Ts=1.0)).outputs[0]


def untouched(y):
    sd = y.std()
    yield "raw", y
    for share in (0.01, 0.1, 0.5):
        yield f"read in {share} sd", np.round(y / (share * sd)) * share * sd
    yield "float32", y.astype(np.float32).astype(float)
    yield "printed", np.round(y, 3)


def compressed(y):
    sd = y.std()
    for limit in (0.1 * sd, 0.3 * sd):
        door = oracle.swinging_door(y, limit)
        line = oracle.refilled(y, door, "line")
        yield "line", line
        yield "line", np.round(line, 4)
        yield "line", line.astype(np.float32).astype(float)
        yield "hold", oracle.refilled(y, door, "hold")
        kept = oracle.exception(y, limit)
        yield "hold", oracle.refilled(y, kept, "hold")
        yield "line", oracle.refilled(y, kept, "line")


def count(seeds):
    false = missed = 0
    for kind in KINDS:
        for seed in seeds:
            y = signal(kind, seed)
            false += sum(looked(x).refilled is not None for _, x in untouched(y))
            missed += sum(looked(x).refilled is None for _, x in compressed(y))
    return false, missed


def test_nothing_measured_is_called_compressed_and_what_is_compressed_is_found():
    false, missed = count(range(6))  # of 108 and of 216
    assert false == 0 and missed <= 2


@pytest.mark.parametrize("seed", range(4))
def test_what_is_said_is_what_the_oracle_says(seed):
    for kind in KINDS:
        y = signal(kind, seed)
        for _, x in (*untouched(y), *compressed(y)):
            assert looked(x).refilled == oracle.compressed(x)


@pytest.mark.slow
def test_the_same_of_900_and_1800():
    false, missed = count(range(100, 150))
    assert false == 0 and missed <= 10


@pytest.mark.parametrize("seed", range(3))
def test_shares_are_those_of_the_oracle(seed):
    y = signal("slow", seed)
    for x in (y, oracle.refilled(y, oracle.swinging_door(y, 0.3), "line")):
        found, (s1, s2, q) = looked(x), oracle.shares(x)
        assert (found.repeated, found.in_line) == pytest.approx((s1, s2), abs=2 / N)
        assert found.step == (pytest.approx(q) if q else None)


def test_reading_refuses_it_and_keeps_it_when_asked(tmp_path):
    y = signal("slow", 1)
    thin = oracle.refilled(y, oracle.swinging_door(y, 0.3), "line")
    path = write(tmp_path / "a.csv", np.sign(y - 50), thin)
    with pytest.raises(pt.DataError, match="compressed by a historian") as caught:
        pt.read(path, u="u", y="y")
    error = caught.value
    assert (error.code, error.where[0]) == ("D15", "y") and error.measured > error.limit
    assert 'compressed="keep"' in error.remedy
    rec = pt.read(path, u="u", y="y", compressed="keep")
    assert [(note.code, note.severity) for note in rec.notes] == [("D15", "warning")]
    assert [note.code for note in pt.analyze.health(rec).notes].count("D15") == 0
    assert "D15" in {n.code for n in pt.analyze.health(pt.Record(u=rec.u, y=rec.y, Ts=1.0)).notes}
    seen = pt.inspect(path, u="u", y="y")
    assert "--compressed keep" in " ".join(seen.steps)


def test_shipped_records_are_as_they_were_measured():
    for name in ("hair_dryer", "robot_arm", "engine_loop", "printer_motor"):
        assert pt.analyze.compression(getattr(pt.datasets, name)()), name


def test_one_straight_line_is_no_history():
    assert looked(np.arange(N) * 0.1).refilled is None


MEASURED = [
    ("process_reaction_curve/prc.csv", "PV"),
    ("heat_shield/resultID.mat", "resultID[0]"),
    ("opto_shield/resultID.mat", "resultID[0]"),
    ("hair_dryer/dryer.dat", "1"),
    ("plant_flow_loop/FIC-211_20241121-27.csv", "FT_211"),
    ("ball_beam/ballbeam.dat", "1"),
    ("cstr_sim/cstr.dat", "2"),
    ("industrial_dryer/dryer2.dat", "4"),
    ("coupled_drives_prbs/drive.mat", "z1"),
    ("float_shield/PRBS_R4.mat", "y"),
    ("buck_converter/buck_id.csv", "y"),
]


@pytest.mark.parametrize(("path", "name"), MEASURED, ids=[path for path, _ in MEASURED])
def test_measured_outputs_are_taken_as_measured(data, path, name):
    sheet = open_sheet(data(path.split("/")[0]) / path.split("/")[1])
    (i,) = [i for i, column in enumerate(sheet.columns) if column.name == name]
    y = sheet.read(Wanted((i,))).numbers[:, 0]
    rec = pt.Record(u=np.zeros(len(y)), y=np.nan_to_num(y), valid=~np.isnan(y)[:, None], Ts=1.0)
    assert pt.analyze.compression(rec), pt.analyze.compression(rec).outputs
