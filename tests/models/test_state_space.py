"""Models by states: scipy, python-control, other classes there and back, reduction."""

import control
import numpy as np
import pytest
from numpy.linalg import svd
from pytest import approx
from scipy.linalg import expm
from scipy.signal import dlsim

import plantune as pt
from oracles import subspace


def random_system(seed, n=4, nu=2, ny=3, K=0.0):
    rng = np.random.default_rng(seed)
    A = np.zeros((n, n))
    for i in range(0, n, 2):
        r, angle = rng.uniform(0.3, 0.95), rng.uniform(0.05, 3)
        c, s = r * np.cos(angle), r * np.sin(angle)
        A[i : i + 2, i : i + 2] = [[c, s], [-s, c]]
    T = np.linalg.qr(rng.normal(size=(n, n)))[0]
    B, C, D = (rng.normal(size=shape) for shape in ((n, nu), (ny, n), (ny, nu)))
    gain = K * rng.normal(size=(n, ny))
    return pt.models.StateSpace(A=T @ A @ T.T, B=B, C=C, D=D, K=gain, Ts=0.5)


def test_simulation_is_scipys_from_any_state():
    model, rng = random_system(0), np.random.default_rng(1)
    u, x0 = rng.normal(size=(80, 2)), rng.normal(size=4)
    system = (model.A, model.B, model.C, model.D, 0.5)
    assert model.simulate(u) == approx(dlsim(system, u)[1], abs=1e-12)
    assert model.simulate(u, x0=x0) == approx(dlsim(system, u, x0=x0)[1], abs=1e-12)


def test_answers_are_those_of_python_control():
    model = random_system(2, nu=2, ny=2)
    other = model.to_control()
    w = np.array([0.01, 0.4, 3.0])
    assert np.moveaxis(model.freqresp(w), 0, 2) == approx(other.frequency_response(w).complex)
    assert np.sort_complex(model.poles()) == approx(np.sort_complex(other.poles()))
    assert model.dc_gain() == approx(other.dcgain())
    assert np.sort_complex(model.zeros()) == approx(np.sort_complex(other.zeros()), rel=1e-6)
    data = model.to_control(delay="frd", w=w)
    assert data.complex == approx(np.moveaxis(model.freqresp(w), 0, 2))


def test_zeros_of_a_pair_make_its_response_vanish():
    model = random_system(3)
    for output, input in ((0, 0), (2, 1)):
        zeros = model.zeros(input, output)
        assert len(zeros) == 4
        for z in zeros:
            X = np.linalg.solve(z * np.eye(4) - model.A, model.B[:, input])
            size = np.abs(model.C[output] * X).sum()
            assert abs(model.C[output] @ X + model.D[output, input]) < 1e-8 * size
    with pytest.raises(pt.UsageError, match="2 inputs and 3 outputs"):
        model.zeros()


def test_prediction_is_the_kalman_filter():
    model, rng = random_system(4, K=0.1), np.random.default_rng(2)
    u, e = rng.normal(size=(60, 2)), 0.1 * rng.normal(size=(60, 3))
    x, y = np.zeros(4), []
    for t in range(60):
        y.append(model.C @ x + model.D @ u[t] + e[t])
        x = model.A @ x + model.B @ u[t] + model.K @ e[t]
    y, level = np.array(y), np.array([1.0, 2.0, 3.0])
    rec = pt.Record(u=u, y=y + level, Ts=0.5)
    # the initial state is estimated, so the errors are a little less than the truth
    errors = rec.y - model.predict(rec, 1, level)
    assert errors[30:] == approx(e[30:], abs=0.02)
    verdict = pt.validate.check(rec, model, output="y2", offset="estimate")
    assert verdict.fit_1step > 90
    far = model.predict(rec, 5, level)
    x = np.zeros(4)
    for t in range(40):
        x = model.A @ x + model.B @ u[t] + model.K @ (y[t] - model.C @ x - model.D @ u[t])
    for t in range(40, 44):
        x = model.A @ x + model.B @ u[t]
    assert far[44] - level == approx(model.C @ x + model.D @ u[44], abs=0.05)


def test_a_prediction_leaps_over_what_does_not_count():
    model = random_system(5, K=0.1, ny=1)
    rng = np.random.default_rng(3)
    u = rng.normal(size=(50, 2))
    y = model.simulate(u)
    valid = np.ones((50, 1), bool)
    valid[20:23] = False
    y[20:23] = 99.0
    rec = pt.Record(u=u, y=y, Ts=0.5, valid=valid)
    assert model.predict(rec)[valid] == approx(model.simulate(u)[valid], abs=1e-9)


@pytest.mark.parametrize(
    "model",
    [
        pt.models.PolyModel(A=[1, -1.5, 0.7], B=[0.5, 0.2], C=[1, 0.4], nk=2, Ts=0.5),
        pt.models.PolyModel(B=[2.0, 1.0], F=[1, -0.5], nk=0, Ts=0.5),
        pt.models.PolyModel(
            A=[1, -0.5],
            B=[[0.5, 0.2], [-0.3]],
            C=[1, 0.4],
            D=[1, -0.6],
            F=[[1, -1.5, 0.7], [1, -0.9]],
            nk=[2, 1],
            Ts=0.5,
        ),
    ],
)
def test_polynomials_there_and_back(model):
    states = pt.models.StateSpace.of(model)
    back = states.polynomial()
    inputs = len(model.nk) if isinstance(model.nk, list) else 1
    w = np.array([0.0, 0.3, 2.0])
    for i in range(inputs):
        assert states.freqresp(w)[:, 0, i] == approx(model.freqresp(w, i), abs=1e-11)
        assert back.freqresp(w, i) == approx(model.freqresp(w, i), abs=1e-8)
    rng = np.random.default_rng(6)
    u = rng.normal(size=(80, inputs))
    rec = pt.Record(u=u, y=model.simulate(u) + 0.1 * rng.normal(size=80), Ts=0.5)
    ours, theirs = states.predict(rec)[:, 0], model.predict(rec)
    assert ours[60:] == approx(theirs[60:], abs=1e-3)  # the starts differ, and die away


def test_matrix_polynomials_carry_their_noise():
    A = np.array([np.eye(2), [[-0.8, 0.1], [0.2, -0.5]]])
    model = pt.models.MatrixPolyModel(A=A, B=np.ones((2, 2, 3)), nk=[1, 0, 2], Ts=0.5)
    states = pt.models.StateSpace.of(model)
    rng = np.random.default_rng(7)
    rec = pt.Record(u=rng.normal(size=(60, 3)), y=rng.normal(size=(60, 2)), Ts=0.5)
    assert states.predict(rec)[20:] == approx(model.predict(rec)[20:], abs=1e-9)


def test_sampling_is_the_exponential_and_comes_back():
    A, B, C = [[-0.3, 1.0], [-1.0, -0.3]], [[0.0], [2.0]], [[1.0, 0.5]]
    plant = pt.models.StateSpace(A=A, B=B, C=C)
    model = pt.models.c2d(plant, 0.4)
    E = expm(0.4 * np.block([[np.array(A), np.array(B)], [np.zeros((1, 3))]]))
    assert E[:2, :2] == approx(model.A, abs=1e-13)
    assert E[:2, 2:] == approx(model.B, abs=1e-13)
    again = pt.models.d2c(model)
    assert again.A == approx(plant.A, abs=1e-12)
    assert again.B == approx(plant.B, abs=1e-12)
    t = np.array([-1.0, 0.0, 0.4, 0.8])
    assert plant.step(t)[1:, 0] == approx(model.step(t)[1:, 0], abs=1e-12)
    assert plant.step([-1.0])[0, 0] == 0.0
    assert plant.dc_gain() == approx(model.dc_gain())
    u = np.arange(5.0)
    assert plant.simulate(u, Ts=0.4) == approx(model.simulate(u))


def test_no_plant_has_a_negative_pole_behind_a_hold():
    with pytest.raises(pt.NotIdentifiable, match=r"a pole at -0\.5000") as refused:
        pt.models.d2c(pt.models.StateSpace(A=[[-0.5]], B=[1.0], C=[1.0], Ts=1.0))
    assert refused.value.code == "M12"


@pytest.mark.parametrize("seed", range(6))
def test_reduction_keeps_its_bound(seed):
    model = random_system(seed, n=6, nu=2, ny=2)
    w = np.linspace(0.0, np.pi / 0.5, 500)
    whole = model.freqresp(w)
    for n in range(1, 7):
        small, hankel, bound = model.reduce(n)
        error = svd(small.freqresp(w) - whole, compute_uv=False).max()
        assert error <= bound * (1 + 1e-9) + 1e-10
        assert error >= hankel[n] if n < 6 else error < 1e-9  # no model of n states does better
        assert small.n == n
    h = subspace.balanced(model.A, model.B, model.C, 2)[3]
    assert hankel == approx(h, rel=1e-8)


def test_an_unstable_model_has_no_gramian():
    model = pt.models.StateSpace(A=np.diag([1.1, 0.5]), B=[1, 1], C=[1, 1], Ts=1.0)
    with pytest.raises(pt.NotIdentifiable, match="1 of 2 poles") as refused:
        model.reduce(1)
    assert refused.value.code == "M02"


def test_a_single_output_is_tuned_as_its_polynomials():
    plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    sampled = pt.models.c2d(plant, 0.5)
    states = pt.models.StateSpace.of(sampled)
    pid = pt.tune.simc(plant).controller
    ours, known = pt.tune.margins(states, pid), pt.tune.margins(sampled, pid)
    assert ours.gain == approx(known.gain, rel=1e-6)
    assert ours.phase_deg == approx(known.phase_deg, rel=1e-6)
    with pytest.raises(pt.UsageError, match="of 3 outputs"):
        pt.tune.margins(random_system(0), pid)


def test_saved_and_loaded(tmp_path):
    model = random_system(8, K=0.2)
    pt.io.save_model(tmp_path / "model.json", model)
    assert pt.io.load_model(tmp_path / "model.json").same_as(model)


@pytest.mark.parametrize(
    "fields, message",
    [
        ({"B": [[1.0, 2.0]]}, "`B` has shape"),
        ({"C": [[1.0]]}, "`C` has shape"),
        ({"D": [[1.0, 0.0]]}, "`D` has shape"),
        ({"K": [[1.0]]}, "`K` has shape"),
        ({"A": [[np.nan, 0], [0, 0]]}, "`A` has shape"),
        ({"Ts": 0.0}, "`Ts` is 0.0"),
    ],
)
def test_shapes_that_do_not_agree_are_refused(fields, message):
    good = {"A": [[0.5, 0], [0, 0.2]], "B": [1.0, 1.0], "C": [1.0, 1.0], "Ts": 1.0}
    with pytest.raises(pt.UsageError, match=message):
        pt.models.StateSpace(**(good | fields))


def test_other_sample_times_and_inputs_are_refused():
    model = random_system(0)
    with pytest.raises(pt.UsageError, match="Ts"):
        model.simulate(np.zeros((3, 2)), Ts=1.0)
    with pytest.raises(pt.UsageError, match="columns"):
        model.simulate(np.zeros((3, 1)))
    with pytest.raises(pt.UsageError, match="`x0`"):
        model.simulate(np.zeros((3, 2)), x0=[1.0])
    with pytest.raises(pt.UsageError, match="Ts"):
        model.predict(pt.Record(u=np.ones((9, 2)), y=np.ones((9, 3)), Ts=1.0))


def test_python_control_is_where_it_comes_from():
    system = control.ss([[0.5]], [[1.0]], [[2.0]], [[0.0]], 0.5)
    model = pt.models.StateSpace(A=system.A, B=system.B, C=system.C, D=system.D, Ts=system.dt)
    assert model.dc_gain() == approx(system.dcgain())
