"""Models of several outputs: simulation, prediction, frequency response, round trips."""

import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import matrix_arx
from plantune.io import load_model, save_model

A = np.array([np.eye(2), [[-0.8, 0.1], [0.2, -0.5]], [[0.1, 0.0], [0.05, 0.1]]])
B = np.array([[[0.5, 0.2, 1.0], [-0.3, 0.0, 0.7]], [[0.1, 0.0, -0.4], [0.2, 0.3, 0.0]]])


def model(nk=1):
    return pt.models.PolyModel(A=A, B=B, nk=nk, Ts=0.1)


def test_matrices_make_a_matrix_model():
    G = model()
    assert type(G) is pt.models.MatrixPolyModel
    assert pt.models.PolyModel(A, B, nk=1, Ts=0.1).same_as(G)
    assert type(pt.models.PolyModel(A=[1, -0.5], B=[1.0])) is pt.models.PolyModel
    assert (G.ny, G.nu, G.nk) == (2, 3, [1, 1, 1])
    with pytest.raises(TypeError):
        pt.models.PolyModel(A=A, B=B, C=[1, 0.5])


def test_simulation_is_the_difference_equation():
    U = np.random.default_rng(1).normal(size=(120, 3))
    assert model().simulate(U) == approx(matrix_arx.simulate(A, B, 1, U), abs=1e-12)
    apart = model([0, 1, 3]).simulate(U)
    late = [matrix_arx.simulate(A, B[:, :, [i]], nk, U[:, i]) for i, nk in enumerate((0, 1, 3))]
    assert apart == approx(sum(late), abs=1e-12)


def test_frequency_response_poles_and_gain():
    G, w = model(2), np.array([0.0, 1.0, 20.0])
    exact = [matrix_arx.transfer(A, B, 2, np.exp(1j * x * 0.1)) for x in w]
    assert G.freqresp(w).shape == (3, 2, 3)
    assert G.freqresp(w) == approx(np.array(exact), abs=1e-12)
    assert np.sort_complex(G.poles()) == approx(np.sort_complex(matrix_arx.poles(A)), abs=1e-12)
    assert G.dc_gain() == approx(G.freqresp([0.0])[0].real)
    drifting = pt.models.PolyModel(A=[np.eye(2), -np.eye(2)], B=B, Ts=0.1)
    assert np.isinf(drifting.dc_gain()).all()


def test_a_prediction_starts_from_what_was_measured():
    rng = np.random.default_rng(3)
    U, E = rng.normal(size=(60, 3)), rng.normal(size=(60, 2))
    Y = matrix_arx.simulate(A, B, 1, U, E) + np.array([2.0, -3.0])
    rec = pt.Record(u=U, y=Y, Ts=0.1)
    H = np.zeros((3, 2, 2))
    H[0] = np.eye(2)
    H[1] = -A[1]
    H[2] = -A[1] @ H[1] - A[2]
    for steps in (1, 2, 3):
        off = rec.y - model().predict(rec, steps, [2.0, -3.0])
        exact = [sum(H[j] @ E[t - j] for j in range(steps)) for t in range(10, 60)]
        assert off[10:] == approx(np.array(exact), abs=1e-10)
    assert np.isnan(model().predict(rec)[:2]).all()


def test_a_simulation_estimates_the_start():
    U = np.random.default_rng(4).normal(size=(200, 3))
    Y = matrix_arx.simulate(A, B, 1, U)
    rec = pt.Record(u=U[70:], y=Y[70:] + 1.0, Ts=0.1)
    assert model().predict(rec, None, 1.0)[2:] == approx(rec.y[2:], abs=1e-9)


def test_an_output_that_does_not_count_is_predicted_past():
    U = np.random.default_rng(5).normal(size=(80, 3))
    Y = matrix_arx.simulate(A, B, 1, U)
    valid = np.ones((80, 2), bool)
    valid[30:34, 1] = False
    rec = pt.Record(u=U, y=np.where(valid, Y, 1e3), Ts=0.1, valid=valid)
    assert model().predict(rec)[2:] == approx(Y[2:], abs=1e-9)


def test_round_trips(tmp_path):
    G = model([1, 0, 2])
    save_model(tmp_path / "G.json", G)
    assert load_model(tmp_path / "G.json").same_as(G)
    assert pickle.loads(pickle.dumps(G)).same_as(G)
    assert not G.same_as(model())


def test_python_control_answers_the_same():
    control = pytest.importorskip("control")
    G = model([0, 1, 3])
    ss, w = G.to_control(), np.array([0.1, 3.0, 20.0])
    assert ss.dt == 0.1
    assert np.moveaxis(ss(np.exp(1j * w * 0.1)), 2, 0) == approx(G.freqresp(w), abs=1e-9)
    assert isinstance(ss, control.StateSpace)
    frd = pt.export.to_control(G, delay="frd", w=w)
    assert np.moveaxis(frd.complex, 2, 0) == approx(G.freqresp(w), abs=1e-12)


@pytest.mark.parametrize(
    "fields",
    [
        {"A": A[1:], "B": B},
        {"A": A, "B": B[:, :1]},
        {"A": A, "B": [1.0]},
        {"A": A, "B": B, "nk": [1, 1]},
        {"A": A, "B": B, "nk": -1},
        {"A": A * np.nan, "B": B},
    ],
)
def test_what_is_no_model_is_refused(fields):
    with pytest.raises(pt.UsageError) as refused:
        pt.models.PolyModel(**fields)
    assert refused.value.code == "U01"


def test_verbs_for_one_output_refuse_it():
    with pytest.raises(pt.UsageError):
        pt.tune.margins(model(), pt.models.PID(Kp=1.0, Ti=1.0))
    with pytest.raises(pt.UsageError):
        model().simulate(np.ones((5, 2)))
