"""Results as JSON, and models back from it."""

import json
from collections import namedtuple
from dataclasses import dataclass

import numpy as np
import pytest

import plantune as pt
from plantune.io import load_model, save_model, to_json, write_json
from plantune.models import PID, PolyModel, ProcessModel

MODELS = [
    ProcessModel(K=-5.939, T=0.1491, L=0.1 + 1 / 3),
    PolyModel(A=[1, -1.273739, 0.393546], B=[0.066618, 0.044482], nk=3, Ts=0.08),
    PolyModel(A=[1, -0.5], B=[[1.0], [0.5, 0.25]], F=[[1, 0.1], [1]], nk=[1, 2], Ts=1.0),
    PID(Kp=-0.1315, Ti=0.1491),
    PID(Kp=2.0),
    PID(Kp=2.0, Ti=1e-3, Td=0.5, Tf=0.05, b=0.7, c=1.0, Ts=0.01),
    PID.integral(0.5),
]


@pytest.mark.parametrize("model", MODELS, ids=repr)
def test_a_model_survives_the_round_trip(tmp_path, model):
    save_model(tmp_path / "model.json", model)
    again = load_model(tmp_path / "model.json")
    assert type(again) is type(model) and repr(again) == repr(model)
    assert list(tmp_path.iterdir()) == [tmp_path / "model.json"]


def test_a_record_becomes_its_fields():
    rec = pt.Record(u=[0, 1], y=[2.0, 3.0], Ts=0.1, aux={"a": [4, 5]}, units={"y": "V"})
    values = json.loads(json.dumps(to_json(rec), allow_nan=False))
    assert list(values)[:3] == ["u", "y", "Ts"] and values["r"] is None
    assert values["u"] == [[0.0], [1.0]] and values["aux"] == {"a": [4.0, 5.0]}
    assert values["valid"] == [[True], [True]] and values["units"] == {"y": "V"}
    assert values["source"] == rec.source


def test_what_json_does_not_know():
    Pair = namedtuple("Pair", "low high")

    @dataclass(frozen=True)
    class Result:
        poles: np.ndarray
        bounds: Pair
        n: np.int64

    values = to_json(
        Result(np.array([1 + 2j, np.nan]), Pair(-np.inf, np.float64(1.5)), np.int64(3))
    )
    assert values["poles"][0] == [1.0, 2.0] and values["poles"][1][0] is None
    assert values["bounds"] == {"low": None, "high": 1.5}
    assert values["n"] == 3 and type(values["n"]) is int
    assert to_json((True, None, "x", range(2))) == [True, None, "x", [0, 1]]


@pytest.mark.parametrize(("longest", "kept"), [(None, True), (3, True), (2, False)])
def test_long_arrays_can_be_left_out(longest, kept):
    values = to_json({"y": np.zeros((3, 2)), "a": [np.zeros(1)]}, longest=longest)
    assert values["y"] == (np.zeros((3, 2)).tolist() if kept else {"shape": [3, 2]})
    assert values["a"] == [[0.0]]


def test_what_has_no_json_form_is_refused():
    with pytest.raises(pt.UsageError, match="object has no JSON form"):
        to_json({"x": object()})


def test_a_file_is_there_whole_or_not_at_all(tmp_path):
    path = tmp_path / "run.json"
    write_json(path, {"a": 1})
    with pytest.raises(pt.UsageError):
        write_json(path, {"a": object()})
    with pytest.raises(UnicodeEncodeError):
        write_json(path, {"a": "\ud800"})
    assert json.loads(path.read_text()) == {"a": 1} and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("value", [3, {"K": 1}, ProcessModel(K=np.nan, T=1), PID])
def test_only_finite_models_are_saved(tmp_path, value):
    with pytest.raises(pt.UsageError) as caught:
        save_model(tmp_path / "model.json", value)
    assert caught.value.remedy and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[" * 100_000,
        "3",
        "[]",
        "\x00\xff",
        '{"K": 1, "T": 2}',
        '{"kind": "tree"}',
        '{"kind": ["poly"]}',
        '{"kind": "process", "K": 1, "T": 2, "gain": 3}',
        '{"kind": "process", "K": 1}',
        '{"kind": "process", "K": "high", "T": 2}',
    ],
)
def test_d02_other_files_are_refused(tmp_path, text):
    path = tmp_path / "model.json"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(pt.DataError) as caught:
        load_model(path)
    error = caught.value
    assert (error.code, error.count) == ("D02", 1) and "save_model" in error.remedy
    assert str(error).count("\n") <= 2


def test_u01_a_missing_file_and_a_number_out_of_range(tmp_path):
    path = tmp_path / "model.json"
    with pytest.raises(pt.UsageError, match="cannot read"):
        load_model(path)
    path.write_text('{"kind": "pid", "Kp": 1, "Ti": -1}')
    with pytest.raises(pt.UsageError, match="Ti"):
        load_model(path)
