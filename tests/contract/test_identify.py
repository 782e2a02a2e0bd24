"""`plantune identify`: command line, JSON, figure and refusals."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import plantune, strict_json


@pytest.fixture
def step(tmp_path):
    """A step response of two lags, as a file."""
    u = np.repeat([0.0, 4.0], [50, 650])
    plant = pt.models.ProcessModel(K=2.0, T=(3.0, 10.0), L=4.0)
    y = 20 + plant.simulate(u, Ts=0.1) + 0.01 * np.random.default_rng(0).normal(size=700)
    path = tmp_path / "step.csv"
    np.savetxt(path, np.c_[u, y], delimiter=",", header="power,temp", comments="")
    return path


def test_the_modes_of_a_step_response(step, tmp_path):
    given = ("identify", step, "--u", "power", "--y", "temp", "--Ts", 0.1, "--model", "idt")
    done = plantune(*given, "--out", tmp_path / "step.html")
    assert done.exit_code == 0, done.output
    assert "The data support two time constants, told apart" in done.stdout
    page = (tmp_path / "step.html").read_text(encoding="utf-8")
    assert "plotly.js" in page and "cdn" not in page.split("<body>")[1][:500]
    fields = strict_json(plantune(*given, "--json").stdout)
    rec = pt.read(step, u="power", y="temp", Ts=0.1)
    assert fields["theta"] == approx(pt.estimate.idt(rec).theta.tolist())
    assert [mode["kind"] for mode in fields["modes"]] == ["lag", "lag"]
    one = strict_json(plantune(*given, "--order", 1, "--json").stdout)
    assert one["order"] == 1


@pytest.fixture
def stage(tmp_path):
    """Two cycles of a piezo stage, as a file."""
    rec = pt.datasets.piezo_stage(cycles=2)
    path = tmp_path / "stage.csv"
    columns = np.c_[rec.u, rec.y]
    np.savetxt(path, columns, delimiter=",", header="volt,um", comments="", fmt="%.17g")
    return path


def test_loops_are_modelled_drawn_and_saved(stage, tmp_path):
    given = ("identify", stage, "--u", "volt", "--y", "um", "--Ts", 0.01, "--model", "hysteresis")
    more = ("--kind", "series", "--out", tmp_path / "x.html", "--save", tmp_path / "x.json")
    done = plantune(*given, *more)
    assert done.exit_code == 0, done.output
    assert "loops counter-clockwise, kind series" in done.stdout
    assert "2 cycles differ by" in done.stdout
    assert "plotly.js" in (tmp_path / "x.html").read_text(encoding="utf-8")
    back = pt.io.load_model(tmp_path / "x.json")
    rec = pt.datasets.piezo_stage(cycles=2)
    ours = pt.hysteresis.identify(rec.u[:, 0], rec.y[:, 0], "series").model
    assert np.array_equal(back.up, ours.up) and np.array_equal(back.down, ours.down)
    fields = strict_json(plantune(*given, "--elements", 8, "--skip", 400, "--json").stdout)
    assert fields["kind"] == "asymmetric"
    assert fields["model"]["identified"]["rms"] < fields["repeatability"]["largest"]


@pytest.mark.parametrize("wrong", [("--kind", "magic"), ("--elements", "few")])
def test_loops_refuse_what_they_do_not_know(stage, wrong):
    given = ("identify", stage, "--u", "volt", "--y", "um", "--Ts", 0.01, "--model", "hysteresis")
    done = plantune(*given, *wrong, "--json")
    assert done.exit_code == 2
    assert strict_json(done.stdout)["error"]["code"] == "U01"


@pytest.mark.parametrize(
    "wrong, code, exit_code",
    [
        (("--model", "magic"), "U01", 2),
        (("--model", "idt", "--order", "two"), "U01", 2),
        (("--model", "idt", "--step-at", 999), "U01", 2),
        (("--model", "idt", "--limit", "X01=0.9", "--y", "power"), "D12", 2),
    ],
)
def test_refusals_have_their_code(step, wrong, code, exit_code):
    given = ("identify", step, "--u", "power", "--y", "temp", "--Ts", 0.1)
    done = plantune(*given, *wrong, "--json")
    assert done.exit_code == exit_code
    assert strict_json(done.stdout)["error"]["code"] == code
