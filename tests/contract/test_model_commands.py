"""`plantune tune MODEL.json` and `plantune simulate`: command line, JSON and refusals."""

import json

import pytest
from pytest import approx

import plantune as pt
from contract.records import plantune, strict_json
from plantune.io import save_model

PLANT = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)


@pytest.fixture
def model(tmp_path):
    save_model(tmp_path / "model.json", PLANT)
    return tmp_path / "model.json"


def test_a_model_file_is_tuned_by_several_rules(model, tmp_path):
    done = plantune("tune", model, "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.output
    fields = strict_json(done.stdout)
    rules = [row["tuning"]["rule"] for row in fields["rows"]]
    assert rules[0] == "IMC-PI, gain_margin = 3" and any("optimal PID" in rule for rule in rules)
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"report.html", "comparison.json", "tuning.json"}
    tuning = pt.tune.load_tuning(tmp_path / "out" / "tuning.json")
    assert tuning.controller == pt.tune.imc_pi(PLANT, gain_margin=3).controller


def test_the_wishes_of_the_command_line_reach_the_rules(model, tmp_path):
    done = plantune(
        "tune", model, "--gain-margin", 4, "--Ms", 1.4, "--out", tmp_path / "o", "--json"
    )
    rows = strict_json(done.stdout)["rows"]
    assert rows[0]["tuning"]["margins"]["gain"] == approx(4.0)
    assert rows[-1]["tuning"]["margins"]["Ms"] <= 1.4


def test_the_page_of_a_comparison_works_off_line(model, tmp_path):
    plantune("tune", model, "--out", tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "src=" not in page.split("<body>")[1].split("<script>")[0]
    assert page.count('data-figure="plot-') == 3 and "SIMC" in page


@pytest.mark.parametrize(
    "content, code, exit_code",
    [
        ("{", "D02", 2),
        ('{"kind": "pid", "Kp": 1.0}', "U01", 2),
        ('{"kind": "process", "K": 0.0, "T": 1.0}', "M12", 3),
    ],
)
def test_what_is_no_model_is_refused(tmp_path, content, code, exit_code):
    path = tmp_path / "model.json"
    path.write_text(content)
    done = plantune("tune", path, "--out", tmp_path / "out", "--json")
    assert done.exit_code == exit_code
    assert strict_json(done.stdout)["error"]["code"] == code
    assert not (tmp_path / "out").exists()


def test_a_tuning_is_simulated_with_its_own_model(model, tmp_path):
    plantune("tune", model, "--out", tmp_path / "out")
    tuning = tmp_path / "out" / "tuning.json"
    done = plantune("simulate", tuning, "--out", tmp_path / "step.csv", "--json")
    assert done.exit_code == 0, done.output
    assert strict_json(done.stdout)["indices"]["overshoot"] == approx(5.643, abs=1e-3)
    header, first, *_ = (tmp_path / "step.csv").read_text().splitlines()
    assert header == "t,r,y,u" and first.startswith("0.0,1.0,0.0,")
    load = strict_json(plantune("simulate", tuning, "--load", "--json").stdout)
    assert load["indices"]["iae"] == approx(3.82, abs=0.01) and load["indices"]["overshoot"] is None


def test_a_model_is_simulated_with_settings_or_alone(model):
    loop = strict_json(plantune("simulate", model, "--Kp", 1.0, "--Ti", 5.0, "--json").stdout)
    again = pt.simulate.step(PLANT, pt.models.PID(1.0, 5.0))
    assert loop["y"] == approx(again.y.tolist())
    alone = strict_json(plantune("simulate", model, "--t-end", 50, "--json").stdout)
    assert alone["t"][-1] == 50.0 and alone["y"][-1] == approx(2.0, abs=1e-3)
    assert alone["indices"] is None
    assert "overshoot" in plantune("simulate", model, "--Kp", 1.0, "--Ti", 5.0).stdout


@pytest.mark.parametrize(
    "options", [["--t-end", -1], ["--Kp", 1.0, "--controller", "absent.json"], ["--Kp", "x"]]
)
def test_wrong_wishes_are_refused(model, options):
    done = plantune("simulate", model, *options, "--json")
    assert done.exit_code == 2
    assert json.loads(done.stdout)["error"]["code"] == "U01"


@pytest.mark.parametrize("other", [pt.models.PID(1.0), pt.hysteresis.PlayStack(r=[0], w=[1])])
def test_what_is_no_plant_is_refused_by_its_name(other, tmp_path):
    save_model(tmp_path / "other.json", other)
    done = plantune("simulate", tmp_path / "other.json", "--json")
    assert done.exit_code == 2
    assert f"holds a {type(other).__name__}" in json.loads(done.stdout)["error"]["text"]
