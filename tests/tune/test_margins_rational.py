"""Margins and peaks of rational loops, against python-control and against roots of polynomials."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import peaks

pytest.importorskip("control")


def loop_of(seed, zeta):
    """Return a random stable loop of the oracle, and the same as our model and controller."""
    nG, dG, nC, dC = peaks.random_loop(seed, zeta=zeta)
    Kp = nC[-1]
    if len(dC) == 2:
        pid = pt.models.PID(Kp, Ti=dC[0])
    else:
        Tf = dC[0] / dC[1]
        pid = pt.models.PID(Kp, Ti=dC[1], Td=nC[0] / Kp / dC[1] - Tf, Tf=Tf)
    return (nG, dG, nC, dC), pt.models.TransferFunction(nG, dG), pid


@pytest.mark.parametrize("hundred", range(5))
def test_margins_agree_with_python_control_on_500_loops(hundred):
    """Damping from 0.05 up, where python-control's own roots hold 1e-8."""
    for seed in range(100 * hundred, 100 * hundred + 100):
        (nG, dG, nC, dC), model, pid = loop_of(seed, zeta=(0.05, 0.7))
        ours = pt.tune.margins(model, pid)
        theirs = peaks.with_control(np.polymul(nG, nC), np.polymul(dG, dC))
        assert ours.stable
        assert ours.gain == approx(theirs.gain, rel=1e-8), seed
        assert ours.phase_deg == approx(theirs.phase_deg, rel=1e-8, abs=1e-7), seed
        assert ours.Ms == approx(theirs.Ms, rel=1e-8), seed


@pytest.mark.parametrize("seed", range(16))
def test_peaks_narrower_than_any_grid_are_found(seed):
    """Damping down to 1e-6: the peak is a millionth of its frequency wide."""
    (nG, dG, nC, dC), model, pid = loop_of(seed, zeta=(1e-6, 1e-2))
    ours, exact = pt.tune.margins(model, pid), peaks.sensitivities(nG, dG, nC, dC)
    assert ours.Ms == approx(exact.Ms, rel=1e-8)
    assert ours.Mt == approx(exact.Mt, rel=1e-8)
    assert ours.noise_gain == approx(exact.Mks, rel=1e-8)


@pytest.mark.parametrize("Ts", [0.1, 0.3])
def test_a_sampled_loop_has_the_peaks_of_its_pulse_transfer_function(Ts):
    for seed in range(5):
        _, model, pid = loop_of(seed, zeta=(0.05, 0.7))
        sampled = pt.models.c2d(model, Ts)
        digital = pt.models.PID(pid.Kp, pid.Ti, pid.Td, pid.Tf, Ts=Ts)
        ours = pt.tune.margins(sampled, digital)
        if not ours.stable:
            continue
        num, den = (np.array(p) for p in pt._core.pulse_transfer(sampled, 0))
        nC, dC = (np.array(p) for p in pt._core.pid_transfer(digital))
        exact = peaks.sensitivities(num, den, nC, dC, Ts)
        assert (ours.Ms, ours.Mt) == approx((exact.Ms, exact.Mt), rel=1e-6)
