"""Crossover and phase margin as wished."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import refused
from oracles import shaping

THREE_LAGS = pt.models.ProcessModel(K=1.0, T=(1.0, 1.0, 1.0))
PLANTS = {
    "three lags": THREE_LAGS,
    "dead time, negative": pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1),
    "integrating": pt.models.ProcessModel(K=0.3, T=(2.0,), L=1.0, integrating=True),
    "resonant": pt.models.ProcessModel(K=2.0, T=1.0, L=0.2, zeta=0.3),
    "inverse response": pt.models.ProcessModel(K=1.0, T=(4.0, 1.0), L=0.5, Tz=-1.0),
}


@pytest.mark.parametrize(
    "w_c, phase, Kp, Ki", [(0.5205, 60.0, 1.14, 0.454), (1.0, 43.997, 2.83, 0.0495)]
)
def test_published_designs_are_met(w_c, phase, Kp, Ki):
    """1/(s + 1)^3, to the printed digits."""
    pid = pt.tune.loop_shape(THREE_LAGS, w_c=w_c, phase_margin=phase).controller
    assert (pid.Kp, pid.Ki) == (approx(Kp, abs=0.005), approx(Ki, rel=2e-3))


def test_what_a_pi_cannot_reach_is_said_with_what_it_can():
    error = refused(
        lambda: pt.tune.loop_shape(THREE_LAGS, w_c=1.0, phase_margin=60.0),
        "M12",
        ("measured", "limit"),
    )
    assert error.limit == approx(45.0) and 'controller="PID"' in error.remedy
    pid = pt.tune.loop_shape(THREE_LAGS, w_c=1.0, phase_margin=60.0, controller="PID")
    assert pid.margins.phase_deg == approx(60.0) and pid.margins.w_phase == approx(1.0)


@pytest.mark.parametrize("name", PLANTS)
def test_pi_is_the_closed_form(name):
    plant, checked = PLANTS[name], 0
    G = plant.transfer()

    def response(s):
        return np.polyval(G.num, s) / np.polyval(G.den, s) * np.exp(-G.L * s)

    for w_c in np.geomspace(0.02, 3.0, 12) / (sum(plant.times) + plant.L):
        for phase in (30.0, 60.0, 80.0):
            known = shaping.pi(response, w_c, np.radians(phase))
            if known is None or known[0] * plant.K < 0:
                continue
            pid = pt.tune.loop_shape(plant, w_c=w_c, phase_margin=phase).controller
            assert (pid.Kp, pid.Ki) == approx(known, rel=1e-9)
            checked += 1
    assert checked >= 3


@pytest.mark.parametrize("controller", ["PI", "PID"])
@pytest.mark.parametrize("Ts", [None, 0.05])
def test_the_loop_passes_the_point_asked_for(controller, Ts):
    for plant in PLANTS.values():
        w_c = min(0.7 / (sum(plant.times) + plant.L), 10.0)
        model = pt.models.c2d(plant, Ts) if Ts else plant
        # Where the controller must turn back by 45 degrees, which both can.
        phase = 135.0 + np.degrees(np.angle(model.freqresp([w_c])[0] * np.sign(plant.K)))
        tuning = pt.tune.loop_shape(
            plant, w_c=w_c, phase_margin=phase, controller=controller, Ts=Ts
        )
        L = pt.tune.sensitivities(model, tuning.controller, [w_c]).L[0]
        assert abs(L) == approx(1.0, rel=1e-9)
        assert np.degrees(np.angle(-L)) == approx(phase, abs=1e-6)
        assert tuning.controller.Ts == Ts


def test_a_polynomial_model_is_shaped_at_its_own_sample_time():
    model = pt.models.PolyModel(A=[1, -1.5, 0.7], B=[0.1, 0.05], nk=2, Ts=0.2)
    tuning = pt.tune.loop_shape(model, w_c=1.5, phase_margin=60.0)
    assert tuning.controller.Ts == 0.2 and tuning.margins.stable


def test_wrong_wishes_are_refused():
    for wish in ({"w_c": 0.0}, {"w_c": 100.0, "Ts": 0.1}, {"phase_margin": 0.0}):
        refused(pt.tune.loop_shape, "U01", (), model=THREE_LAGS,
                **{"w_c": 0.5, "phase_margin": 60.0, **wish})  # fmt: skip
