"""Poles and zeros that no sampled lag has: the printed models show them, plants do not."""

from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from plantune.datasets import DRIVES, PRINTER_MOTOR, printer_motor

# Source 000, 3.1 and 3.2: a, then b; least squares twice, then recursive, each without and with
# smoothing.
PRINTED = [
    [-0.5342, -0.3999, -3.4524, 3.5661],
    [-0.5368, -0.3972, -3.4207, 3.5406],
    [-0.5321, -0.4020, -3.4500, 3.5685],
    [-0.5340, -0.4000, -3.4407, 3.5646],
    [-0.5102, -0.1761, -0.2533, -9.8145, 16.7909, -6.8623],
    [-0.5111, -0.1774, -0.2510, -9.2984, 15.7696, -6.3635],
    [-0.5151, -0.1739, -0.2505, -9.4984, 15.9896, -6.3849],
    [-0.5162, -0.1706, -0.2528, -9.6145, 16.5009, -6.7803],
]


def model(theta):
    n = len(theta) // 2
    return pt.models.PolyModel(A=[1.0, *theta[:n]], B=theta[n:], nk=1, Ts=1.0)


def codes(fit, **more):
    return [note.code for note in pt.validate.plausible(fit, **more)]


@pytest.mark.parametrize("theta", PRINTED)
def test_every_printed_model_shows_errors_in_variables(theta):
    """ERRATA 2: gain, dominant pole, other poles, zero and first sample are as stated there."""
    printed = model(theta)
    assert codes(printed) == ["V06", "V07", "V08"]
    poles = sorted(printed.poles(), key=abs)
    assert 1.72 < printed.dc_gain() < 1.90 and 0.952 < poles[-1].real < 0.966
    fast = poles[0]
    assert (
        (fast == approx(-0.42, abs=0.02))
        if len(poles) == 2
        else abs(fast) == approx(0.51, abs=0.01)
    )
    assert max(printed.zeros().real) == approx(1.035, abs=0.005)


def test_the_doubt_shows_the_numbers():
    zero, pole, pattern = pt.validate.plausible(model(PRINTED[5]))
    assert "-9.2984" in zero.text and zero.measured == approx(9.2984 / model(PRINTED[5]).dc_gain())
    assert "-0.227 ± 0.457j" in pole.text and pole.measured == approx(0.51, abs=0.01)
    assert "never y alone" in pattern.remedy
    assert {note.severity for note in (zero, pole, pattern)} == {"warning"}


@pytest.mark.parametrize("order", [2, 3])
def test_the_true_motor_is_plausible_though_sampling_gives_it_a_zero_outside(order):
    truth = PRINTER_MOTOR.model(order)
    assert pt.validate.plausible(truth) == ()
    assert (min(truth.zeros().real) < -1) == (order == 3)


@pytest.mark.parametrize("kind", DRIVES)
@pytest.mark.parametrize("order", [2, 3])
def test_a_fit_without_noise_is_plausible(kind, order):
    rec = printer_motor(kind, order=order, resolution=0.0)
    assert codes(pt.estimate.arx(rec, order, order)) == []


def test_good_fits_of_the_shipped_records_are_plausible():
    dryer, arm = pt.datasets.hair_dryer(), pt.datasets.robot_arm()
    engine = pt.datasets.engine_loop(noise_var=1.5)
    fits = [pt.estimate.arx(dryer, n, n, 3) for n in (1, 2, 3, 4)]
    fits += [pt.estimate.arx(arm, n, n, 1) for n in (2, 4, 5)]
    fits += [pt.estimate.oe(dryer, 2, 2, 3), pt.estimate.oe(engine, 1, 1, 6)]
    fits += [pt.estimate.armax(dryer, 2, 2, 2, 3), pt.estimate.process(engine, "P1D")]
    assert [codes(fit) for fit in fits] == [[]] * len(fits)


def test_least_squares_on_a_noisy_output_is_doubted_and_output_errors_are_not():
    for seed in range(20):
        rec = printer_motor(noise_var=1.0, seed=seed)
        assert codes(pt.estimate.arx(rec, 2, 2)) == ["V07"]
        assert codes(pt.estimate.oe(rec, 2, 2)) == []


def test_feedback_adds_the_zero_to_the_pole():
    """In closed loop the noise reaches u as well; the model begins two samples too early."""
    rec = pt.datasets.engine_loop(noise_var=10.0)
    assert codes(pt.estimate.arx(rec, 2, 2, 4)) == ["V06", "V07", "V08"]


def test_what_is_not_sure_is_not_doubted():
    fit = pt.estimate.arx(pt.datasets.engine_loop(noise_var=10.0), 2, 2, 4)
    assert codes(fit) == codes(fit.model) == ["V06", "V07", "V08"]
    wider = [codes(replace(fit, P=factor * fit.P)) for factor in (4.0, 25.0, 400.0)]
    assert wider == [["V06", "V07", "V08"], ["V07"], []]


def test_the_sign_of_the_gain_does_not_matter():
    a, b = PRINTED[0][:2], np.array(PRINTED[0][2:])
    down = pt.models.PolyModel(A=[1, *a], B=-b, nk=1, Ts=1.0)
    assert codes(down) == ["V06", "V07", "V08"]


def test_each_input_is_judged_and_shared_poles_once():
    a, b = PRINTED[0][:2], PRINTED[0][2:]
    two = pt.models.PolyModel(A=[1, *a], B=[b, [0.1, 0.05]], nk=[1, 1], Ts=1.0)
    assert codes(two) == ["V06", "V07", "V08"]
    other = pt.models.PolyModel(A=[1, *a], B=[[0.1, 0.05], b], nk=[1, 1], Ts=1.0)
    assert sorted(codes(other)) == ["V06", "V07", "V08"]


def test_an_inverse_response_alone_is_a_zero_alone():
    assert codes(pt.models.PolyModel(A=[1, -0.9], B=[-0.2, 0.3], nk=1, Ts=1.0)) == ["V06"]


def test_a_resonance_near_half_the_sampling_rate_is_no_doubt():
    slow = pt.models.PolyModel(A=[1, 1.2, 0.9], B=[1.0], nk=1, Ts=1.0)
    assert slow.poles().real.max() < 0 and codes(slow) == []


def test_limits_move_the_doubts():
    printed = model(PRINTED[0])
    assert codes(printed, limits=pt.Limits(V06=10.0)) == ["V07"]
    assert codes(printed, limits=pt.Limits(V07=0.5)) == ["V06"]


def test_a_verdict_carries_the_doubts_and_passes_on_its_own_grounds():
    est, val = printer_motor(noise_var=1.0).split(0.5)
    fit = pt.estimate.arx(est, 2, 2)
    found = pt.validate.plausible(fit)
    verdict = pt.validate.check(val, fit)
    assert found and all(note in verdict.notes for note in found)
    assert verdict.passed == (verdict.fit >= 50 and "V02" not in {n.code for n in verdict.notes})


def test_a_fit_without_model_is_refused():
    fit = pt.estimate.least_squares(np.eye(5)[:, :2] + 1.0, np.arange(5.0))
    with pytest.raises(pt.UsageError):
        pt.validate.plausible(fit)
