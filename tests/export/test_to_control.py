"""Objects of python-control against the models that they stand for."""

import builtins

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import check_refusal
from plantune.models import PID, PolyModel, ProcessModel

control = pytest.importorskip("control")
W = np.geomspace(1e-2, 3.0, 40)
PLANT = ProcessModel(K=-2.0, T=5.0, L=1.3)
POLY = PolyModel(A=[1, -0.5], B=[1.0, 0.2], F=[1, 0.2, 0.1], nk=3, Ts=1.0)
TWO = PolyModel(A=[1, -0.5], B=[[1.0], [0.5, 0.25]], F=[[1, 0.1], [1]], nk=[1, 2], Ts=1.0)
PIDS = [
    PID(Kp=2.0, Ti=10.0),
    PID(Kp=2.0),
    PID.integral(0.5),
    PID(Kp=2.0, Ti=3.0, Td=0.5, Tf=0.05),
    PID(Kp=2.0, Ti=3.0, Td=0.5, Tf=0.0),
]


@pytest.mark.parametrize("order", [1, 3, 5, 10])
def test_a_process_model_by_its_pade_form(order):
    ours = pt.export.to_control(PLANT, order=order)
    assert ours.isctime() and len(ours.poles()) == order + 1
    below = np.geomspace(1e-2, order / PLANT.L, 40)
    assert abs(ours(1j * below) / PLANT.freqresp(below) - 1).max() < 0.08


def test_without_delay_there_is_nothing_to_approximate():
    ours = pt.export.to_control(ProcessModel(K=2.0, T=5.0, L=0.0))
    assert ours(1j * W) == approx(2.0 / (5j * W + 1), rel=1e-14)


@pytest.mark.parametrize("nk", [0, 1, 3])
def test_a_polynomial_model_is_exact_in_z(nk):
    model = PolyModel(A=POLY.A, B=POLY.B, F=POLY.F, nk=nk, Ts=1.0)
    ours = pt.export.to_control(model)
    assert ours.dt == 1.0
    assert ours(np.exp(1j * W)) == approx(model.freqresp(W), rel=1e-12)
    u = np.random.default_rng(1).normal(size=60)
    assert control.forced_response(ours, inputs=u).outputs == approx(model.simulate(u), abs=1e-12)


def test_several_inputs_are_columns():
    ours = pt.export.to_control(TWO)
    assert ours.ninputs == 2
    for i in range(2):
        assert ours(np.exp(1j * W))[0, i] == approx(TWO.freqresp(W, input=i), rel=1e-12)


@pytest.mark.parametrize("model", [PLANT, POLY, TWO], ids=lambda m: m.kind)
def test_frequency_data_hold_the_exact_delay(model):
    ours = pt.export.to_control(model, delay="frd", w=W)
    inputs = 2 if model is TWO else 1
    for i in range(inputs):
        response = ours.frdata[0, i]
        assert response == approx(model.freqresp(W, input=i), rel=1e-15)
    assert ours.omega == approx(W) and ours.dt == getattr(model, "Ts", 0)


@pytest.mark.parametrize("pid", PIDS, ids=str)
@pytest.mark.parametrize("Ts", [None, 0.2])
def test_a_controller_is_what_the_margins_are_computed_with(pid, Ts):
    pid = PID(**{k: getattr(pid, k) for k in ("Kp", "Ti", "Td", "Tf", "pure_Ki")}, Ts=Ts)
    model = pt.models.c2d(PLANT, Ts) if Ts else PLANT
    loop = pt.tune.sensitivities(model, pid, W).L / model.freqresp(W)
    ours = pt.export.to_control(pid)
    assert ours(1j * W if Ts is None else np.exp(1j * W * Ts)) == approx(loop, rel=1e-11)
    data = pt.export.to_control(pid, delay="frd", w=W)
    assert data.frdata[0, 0] == approx(loop, rel=1e-11)


def test_values_give_their_own_and_results_what_they_hold():
    fit = pt.estimate.process(pt.datasets.engine_loop(), "P1D")
    tuning = pt.tune.simc(PLANT)
    for one, other in (
        (pt.export.to_control(fit), fit.model.to_control()),
        (pt.export.to_control(tuning), tuning.controller.to_control()),
        (PLANT.to_control(order=2), pt.export.to_control(PLANT, order=2)),
    ):
        assert one(0.3j) == other(0.3j)


@pytest.mark.parametrize(
    "arguments",
    [
        {"what": "plant"},
        {"what": PLANT, "delay": "exact"},
        {"what": PLANT, "delay": "frd"},
        {"what": PLANT, "order": 0},
        {"what": PLANT, "order": 11},
        {"what": PLANT, "order": 2.5},
    ],
    ids=str,
)
def test_what_has_no_such_form_is_refused(arguments):
    with pytest.raises(pt.UsageError) as caught:
        pt.export.to_control(**arguments)
    check_refusal(caught.value, "U01", ())


@pytest.mark.parametrize("Ts", [None, 0.1])
def test_a_filter_on_y_is_the_controllers_own(Ts):
    pid = PID(Kp=2.0, Ti=3.0, Td=0.5, Tf=0.2, filter="y2", Ts=Ts)
    w = np.array([0.1, 1.0, 9.0])
    plant = PolyModel(A=[1, -0.5], B=[1.0], nk=1, Ts=0.1) if Ts else ProcessModel(K=1.0, T=1.0)
    point = np.exp(1j * w * Ts) if Ts else 1j * w
    own = pt.tune.sensitivities(plant, pid, w).L / plant.freqresp(w)
    assert pt.export.to_control(pid)(point) == approx(own, rel=1e-12)


def test_a_filter_that_is_not_written_is_refused_and_not_dropped():
    pid = PID(Kp=2.0, Ti=3.0, Td=0.5, Tf=0.05, filter="y2")
    for export in (pt.export.structured_text, pt.export.c_source):
        with pytest.raises(pt.UsageError, match="'y2'"):
            export(pid, Ts=0.1)


def test_without_python_control_it_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def absent(name, *rest):
        if name == "control":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(pt.UsageError) as caught:
        pt.export.to_control(PLANT)
    assert caught.value.remedy == "pip install plantune[control]"
