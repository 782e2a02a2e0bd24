"""A tuning as JSON and back."""

import json
from dataclasses import replace
from math import inf, isnan

import pytest

import plantune as pt
from contract.records import check_refusal
from plantune.io import to_json
from plantune.models import PID, ProcessModel
from plantune.tune import load_tuning, save_tuning


@pytest.fixture(scope="module")
def tuning():
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    return pt.tune.imc_pi(fit, gain_margin=1.7, limits=pt.Limits(C07=2.5))


def written(tmp_path, values):
    path = tmp_path / "tuning.json"
    path.write_text(json.dumps(values))
    return path


def test_the_round_trip_loses_nothing(tmp_path, tuning):
    save_tuning(tmp_path / "tuning.json", tuning)
    again = load_tuning(tmp_path / "tuning.json")
    assert tuning.notes and tuning.bands  # so that these are tried as well
    assert repr(again) == repr(tuning) and str(again) == str(tuning)
    assert json.loads((tmp_path / "tuning.json").read_text())["kind"] == "tuning"


def test_what_is_not_finite_comes_back(tmp_path):
    tuning = pt.tune.ziegler_nichols(ProcessModel(K=2.0, T=5.0, L=1.0))
    endless = replace(tuning, bands={"delay": (0.1, inf), "gain": (-inf, 3.0)})
    save_tuning(tmp_path / "tuning.json", endless)
    again = load_tuning(tmp_path / "tuning.json")
    assert again.bands == endless.bands and isnan(again.tau_c)


def test_a_file_of_an_older_version_has_no_kind(tmp_path, tuning):
    values = to_json(tuning)
    del values["kind"]
    assert load_tuning(written(tmp_path, values)).rule == tuning.rule


@pytest.mark.parametrize(
    "change",
    [
        lambda v: v.pop("controller"),
        lambda v: v.pop("bands"),
        lambda v: v.update(controller=to_json(ProcessModel(K=1.0, T=1.0))),
        lambda v: v.update(model=to_json(PID(Kp=1.0))),
        lambda v: v.update(controller={"kind": "pid", "Kp": "much"}),
        lambda v: v.update(rule=None),
        lambda v: v.update(source=["x"]),
        lambda v: v.update(notes=[{"code": "C07", "severity": "warning"}]),
        lambda v: v.update(notes=7),
        lambda v: v.update(bands={"gain": [1.0]}),
        lambda v: v.update(tau_c="0.1"),
        lambda v: v["controller"].update(Kp=2 * v["controller"]["Kp"]),
        lambda v: v["margins"].update(Ms=None),
        lambda v: v["margins"].pop("gain"),
    ],
)
def test_what_is_no_tuning_is_refused(tmp_path, tuning, change):
    values = to_json(tuning)
    change(values)
    with pytest.raises(pt.DataError) as caught:
        load_tuning(written(tmp_path, values))
    check_refusal(caught.value, "D02", ())


@pytest.mark.parametrize("values", [[], "tuning", 3, None, {}])
def test_other_json_is_refused(tmp_path, values):
    with pytest.raises(pt.DataError) as caught:
        load_tuning(written(tmp_path, values))
    check_refusal(caught.value, "D02", ())
