"""`plantune design`: JSON, the written input, refusals."""

from dataclasses import fields

import pytest

import plantune as pt
from contract.records import plantune, strict_json
from plantune.analyze import Experiment

PLANT = ("--K", 2, "--T", 10, "--L", 3, "--Ts", 1, "--noise-sd", 0.2)


def test_json_is_strict_and_has_the_names_of_the_plan():
    done = plantune("design", *PLANT, "--time", 600, "--json")
    assert done.exit_code == 0, done.output
    found = strict_json(done.stdout)
    assert {field.name for field in fields(Experiment)} <= found.keys()
    assert found["sd"].keys() == found["relative"].keys() == set("KTL")
    assert found["shape"] == found["trials"][0]["shape"] and found["out"] is None
    plan = pt.analyze.experiment((2.0, 10.0, 3.0), 1.0, 0.2, time=600.0)
    assert found["amplitude"] == pytest.approx(plan.amplitude)
    assert found["sd"] == pytest.approx(dict(plan.sd))


def test_the_table_shows_each_shape():
    done = plantune("design", *PLANT, "--time", 600)
    assert done.exit_code == 0, done.output
    for shape in ("prbs", "gbn", "stairs", "step", "multisine"):
        assert shape in done.stdout


def test_the_written_input_is_read_again(tmp_path):
    out = tmp_path / "plan.csv"
    wishes = ("--u-limits", 45, 55, "--y-limits", 10, 30, "--at", 50, 20, "--time", 600)
    done = plantune("design", *PLANT, *wishes, "--shape", "prbs", "--out", out, "--json")
    assert done.exit_code == 0, done.output
    assert strict_json(done.stdout)["out"] == str(out)
    rec = pt.read(out, u="u", y="y", compressed="keep")  # the response has no noise
    assert (rec.N, rec.Ts) == (600, 1.0)
    assert rec.u[0, 0] == 50 and rec.y[0, 0] == pytest.approx(20)
    assert 45 <= rec.u.min() and rec.u.max() <= 55


def test_limits_that_leave_too_little_exit_3():
    done = plantune("design", *PLANT, "--u-limits", -0.01, 0.01, "--time", 100, "--json")
    assert done.exit_code == 3
    error = strict_json(done.stdout)
    error = error.get("error", error)
    assert error["code"] == "X07" and "more time needed" in error["text"]


def test_neither_time_nor_limits_exit_2():
    done = plantune("design", *PLANT, "--json")
    assert done.exit_code == 2 and '"U01"' in done.stdout
