"""Models of hysteresis as JSON, and back."""

import json
from dataclasses import is_dataclass

import numpy as np
import pytest

import plantune as pt
from plantune import hysteresis
from plantune.io import load_model, save_model

PLAYS = hysteresis.PlayStack(r=[0, 1 / 3, 2], w=[1, 0.5, 0.25], offset=-2, z0=[0.1, 0.3, 0])
CURVED = hysteresis.AsymmetricStack(r=[0, 1], w=[1, 0.1], knots=[0.2], slopes=[1, 2], offset=0.7)
RELAYS = hysteresis.Preisach(levels=[-1, 0, 1.5], mu=[[1, 0], [2, 1 / 3]], start="negative")
CREEP = hysteresis.Creep(r=[0, 1], w=[1, 0.5], tau=[0.3, 2], c=[[0.5, 0], [0, 0.1]], Ts=0.1)
MODELS = [
    PLAYS,
    PLAYS.inverse(),
    CURVED,
    CURVED.inverse(),
    hysteresis.EvenStack(r=[0, 1], w=[1, -0.5], s=[0], v=[2], offset=1),
    hysteresis.SeriesSlip(up=[(0, 1, 0.5), (3, 4, 1)]),
    hysteresis.SeriesSlip(up=[(0, 1, 0.5)], down=[(30, 4, 0.5), (20, 1, 1 / 7)]),
    hysteresis.MaxwellSlip(k=[2, 1], f=[1, 2], spring=0.5, offset=3),
    hysteresis.MaxwellSlip(k=[], f=[], spring=0.5),
    RELAYS,
    RELAYS.inverse(),
    CREEP,
    CREEP.inverse(),
    hysteresis.ChargeLeak(C=1e-6, R=1e9, G=0.3, Ts=0.01),
    hysteresis.BoucWen(m=1, c=2, k=300, alpha=0.5, bg=0.1, bd=-0.05, nu=1.5, Ts=0.001),
    hysteresis.BoucWen(m=1, c=2, k=300, alpha=0.5, bg=0.1, bd=-0.05),
    hysteresis.BoucWenForce(k=1, alpha=2, g=0.5, d=-0.1, nu=1.2, offset=1),
]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.kind)
def test_every_model_survives_the_round_trip(tmp_path, model):
    save_model(tmp_path / "model.json", model)
    again = load_model(tmp_path / "model.json")
    assert again.same_as(model) and str(again) == str(model)


def test_none_is_left_out():
    classes = {value for value in vars(hysteresis).values() if hasattr(value, "kind")}
    assert {type(model) for model in MODELS} == {cls for cls in classes if is_dataclass(cls)}


def test_how_it_was_found_stays_behind(tmp_path):
    x = np.linspace(0, 3, 600) * np.sin(np.linspace(0, 40, 600))
    model = hysteresis.PlayStack.identify(x, PLAYS.simulate(x), n=4)
    save_model(tmp_path / "model.json", model)
    assert list(json.loads((tmp_path / "model.json").read_text())) == [
        *("kind", "r", "w", "offset", "z0")
    ]
    again = load_model(tmp_path / "model.json")
    assert again.same_as(model) and again.identified is None and again.notes == ()


def test_u01_a_parameter_out_of_its_range(tmp_path):
    (tmp_path / "model.json").write_text('{"kind": "maxwell_slip", "k": [1], "f": [-1]}')
    with pytest.raises(pt.UsageError, match="`f`"):
        load_model(tmp_path / "model.json")
