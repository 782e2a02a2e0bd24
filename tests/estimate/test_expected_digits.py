"""Digits that a search promises, parameter by parameter."""

import numpy as np
import pytest

import plantune as pt
from plantune import _core
from plantune.estimate.fit import refit_arguments
from plantune.notes import DEFAULT_LIMITS


def record(seed):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 100), 5)
    plant = pt.models.PolyModel(A=[1], B=[0.5, 0.2], F=[1, -1.5, 0.7], nk=1, Ts=1.0)
    return pt.Record(u=u, y=plant.simulate(u) + 0.3 * rng.normal(size=500), Ts=1.0)


def polished(rec, fit, model_of):
    """Return theta after half steps of Gauss and Newton until nothing is left to go.

    Where the model does not describe its data, whole steps overshoot: some by more than twice.
    """
    theta, (_, offset, x0) = np.r_[fit.theta, fit.offset], refit_arguments(rec, fit)
    for _ in range(200):
        psi, eps, _ = _core.scores(rec, model_of(theta), theta[-1], x0, DEFAULT_LIMITS)
        theta = theta + 0.5 * np.linalg.lstsq(psi, eps, rcond=None)[0]
    assert abs(theta[-1] - offset) < 1e-3 * fit.offset_sd
    return theta[:-1]


def oe(t):
    return pt.models.PolyModel(A=[1], B=t[:2], F=np.r_[1, t[2:4]], nk=1, Ts=1.0)


def armax(t):
    return pt.models.PolyModel(A=np.r_[1, t[:2]], B=t[2:4], C=np.r_[1, t[4]], nk=1, Ts=1.0)


@pytest.mark.parametrize("model_of", [oe, armax])
def test_promised_digits_are_those_of_the_minimum(model_of):
    gaps = []
    for seed in range(10):
        rec = record(seed)
        is_oe = model_of is oe
        fit = pt.estimate.oe(rec, 2, 2) if is_oe else pt.estimate.armax(rec, 2, 2, 1)
        assert len(set(fit.expected_digits.round(3))) > 1
        error = np.maximum(abs(fit.theta / polished(rec, fit, model_of) - 1), 1e-16)
        gaps.extend(-np.log10(error) - fit.expected_digits)
    # DESIGN 6: never overstated by more than 0.5, understated by at most 2 in the median.
    assert min(gaps) > -0.5, min(gaps)
    assert np.median(gaps) < 2.0, np.median(gaps)
