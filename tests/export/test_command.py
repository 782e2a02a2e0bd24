"""`plantune export`: the same texts as from Python, printed or written."""

import json

import control
import numpy as np
import pytest
from pytest import approx
from typer.testing import CliRunner

import plantune as pt
from plantune.cli import main as cli  # noqa: F401 - loads every command
from plantune.cli.main import app
from plantune.io import save_model
from plantune.models import PID, ProcessModel

PLANT = ProcessModel(K=2.0, T=5.0, L=1.0)
TUNING = pt.tune.simc(PLANT)


@pytest.fixture
def files(tmp_path):
    save_model(tmp_path / "model.json", PLANT)
    save_model(tmp_path / "pid.json", PID(Kp=1.0, Ti=5.0))
    pt.tune.save_tuning(tmp_path / "tuning.json", TUNING)
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(app, ["export", *map(str, arguments)])


def test_it_prints_what_python_returns(files):
    limits = ("--Ts", 0.1, "--u-min", 0, "--u-max", 100, "--u-unit", "%", "--name", "loop")
    for to, write, named in (
        ("st", pt.export.structured_text, {"name": "loop"}),
        ("c", pt.export.c_source, {"prefix": "loop"}),
    ):
        done = run(files / "tuning.json", "--to", to, *limits)
        assert done.exit_code == 0, done.output
        assert done.stdout == write(TUNING, 0.1, u_min=0.0, u_max=100.0, u_unit="%", **named)
        done = run(files / "model.json", "--to", to, "--Ts", 0.5)
        assert done.stdout == write(PLANT, 0.5)
        assert run(files / "pid.json", "--to", to, "--Ts", 0.5).exit_code == 0


def test_it_writes_a_file(files):
    done = run(files / "tuning.json", "--to", "st", "--Ts", 0.1, "--out", files / "loop.st")
    assert done.exit_code == 0 and done.stdout == f"{files / 'loop.st'}\n"
    assert (files / "loop.st").read_text() == pt.export.structured_text(TUNING, 0.1)


def test_json_is_one_object(files):
    done = run(files / "model.json", "--to", "c", "--Ts", 0.1, "--json")
    assert json.loads(done.stdout) == {
        "to": "c",
        "out": None,
        "text": pt.export.c_source(PLANT, 0.1),
    }


def test_python_control_takes_the_transfer_function(files):
    done = run(files / "model.json", "--to", "control-json", "--order", 5)
    fields = json.loads(done.stdout)
    system = control.TransferFunction(fields["num"], fields["den"], fields["dt"])
    assert system(0.3j) == approx(PLANT.freqresp(0.3)[0], rel=1e-6)
    assert np.asarray(system.poles()).size == 6


@pytest.mark.parametrize(
    ("arguments", "exit_code", "code"),
    [
        (["absent.json", "--to", "st", "--Ts", "0.1"], 2, "U01"),
        (["model.json", "--to", "st"], 2, "U01"),
        (["model.json", "--to", "basic"], 2, "U01"),
        (["model.json", "--to", "control-json", "--Ts", "0.1"], 2, "U01"),
        (["text.json", "--to", "st", "--Ts", "0.1"], 2, "D02"),
        (["list.json", "--to", "st", "--Ts", "0.1"], 2, "D02"),
        (["tuning.json", "--to", "c", "--Ts", "5"], 5, "C07"),
        (["model.json", "--to", "c", "--Ts", "1", "--out", "no/where.c"], 5, "R08"),
    ],
)
def test_refusals_have_their_code_and_leave_nothing(files, arguments, exit_code, code, monkeypatch):
    monkeypatch.chdir(files)
    (files / "text.json").write_text("{")
    (files / "list.json").write_text("[1]")
    before = sorted(files.iterdir())
    plain, as_json = run(*arguments), run(*arguments, "--json")
    assert plain.exit_code == as_json.exit_code == exit_code, plain.output
    assert plain.stdout == "" and f"{code}: " in plain.stderr
    assert json.loads(as_json.stdout)["error"]["code"] == code
    assert sorted(files.iterdir()) == before
