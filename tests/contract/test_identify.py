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
        (("--model", "idt", "--save", "x.json"), "U01", 2),
        (("--model", "idt", "--limit", "X01=0.9", "--y", "power"), "D12", 2),
    ],
)
def test_refusals_have_their_code(step, wrong, code, exit_code):
    given = ("identify", step, "--u", "power", "--y", "temp", "--Ts", 0.1)
    done = plantune(*given, *wrong, "--json")
    assert done.exit_code == exit_code
    assert strict_json(done.stdout)["error"]["code"] == code


@pytest.fixture
def dryer(tmp_path):
    """The hair dryer as a file, and the options that name its columns."""
    rec = pt.datasets.hair_dryer()
    path = tmp_path / "dryer.csv"
    columns = np.c_[rec.u, rec.y]
    np.savetxt(path, columns, delimiter=",", header="volt,temp", comments="", fmt="%.17g")
    return ("identify", path, "--u", "volt", "--y", "temp", "--Ts", 0.08)


@pytest.mark.parametrize(
    "model, orders, fit",
    [
        ("arx", "2,2", lambda rec: pt.estimate.arx(rec, 2, 2, 3)),
        ("armax", "2,2,1", lambda rec: pt.estimate.armax(rec, 2, 2, 1, 3)),
        ("oe", "2,2", lambda rec: pt.estimate.oe(rec, 2, 2, 3)),
        ("process", "P1D", lambda rec: pt.estimate.process(rec, "P1D")),
        ("subspace", "3", lambda rec: pt.estimate.subspace(rec, 3)),
    ],
)
def test_a_structure_is_that_of_its_verb(dryer, tmp_path, model, orders, fit):
    given = (*dryer, "--model", model, "--orders", orders, "--nk", 3)
    done = plantune(*given, "--split", 0.5, "--out", tmp_path / "model.json")
    assert done.exit_code == 0, done.output
    est, val = pt.datasets.hair_dryer().split(0.5)
    ours = fit(est)
    assert ours.equation() in done.stdout
    assert f"on fresh rows: {str(pt.validate.check(val, ours)).splitlines()[0]}" in done.stdout
    assert pt.io.load_model(tmp_path / "model.json").same_as(ours.model)
    fields = strict_json(plantune(*given, "--split", 0.5, "--json").stdout)
    assert fields["fit"]["theta"] == approx(ours.theta.tolist())
    assert fields["verdict"]["N"] > 400 and fields["equation"] == ours.equation()
    assert strict_json(plantune(*given, "--json").stdout)["verdict"] is None


def test_a_regressor_of_one_s_own(dryer, tmp_path):
    given = (*dryer, "--model", "arx", "--orders", "2,1", "--nk", 3)
    more = ("--regressor", "volt(t-4)", "--out", tmp_path / "x.html", "--save", tmp_path / "x.json")
    done = plantune(*given, *more)
    assert done.exit_code == 0, done.output
    assert "volt(t-4)" in done.stdout
    assert "plotly.js" in (tmp_path / "x.html").read_text(encoding="utf-8")
    model = pt.io.load_model(tmp_path / "x.json")
    plain = pt.estimate.arx(pt.datasets.hair_dryer(), 2, 2, 3)
    assert model.g[0] == approx(plain.theta[3], rel=1e-9)


@pytest.mark.parametrize(
    "wrong",
    [
        ("--model", "arx", "--orders", "2"),
        ("--model", "arx", "--orders", "2,x"),
        ("--model", "arx", "--orders", "2,2", "--nk", "-1"),
        ("--model", "arx", "--orders", "2,2", "--regressor", "exp(u(t-1))"),
        ("--model", "oe", "--orders", "2,2", "--regressor", "sign(y(t-1))"),
        ("--model", "process"),
    ],
)
def test_a_structure_refuses_orders_that_are_none(dryer, wrong):
    done = plantune(*dryer, *wrong, "--json")
    assert done.exit_code == 2, done.output
    assert strict_json(done.stdout)["error"]["code"] == "U01"
