"""The frequency response as a value."""

import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

import plantune as pt

FR = pt.models.FrequencyResponse
W = np.array([0.1, 0.5, 2.0])


def test_siso_may_be_flat_and_is_kept_as_three_axes():
    fr = FR(w=W, G=[1, 2j, 3], sd=[0.1, 0.2, 0.3], Ts=0.5)
    assert fr.G.shape == fr.sd.shape == (3, 1, 1)
    assert_allclose(fr.radius, fr.sd * np.sqrt(np.log(20)))
    assert fr.u_names == ("u",) and fr.y_names == ("y",)


def test_the_disc_of_one_sd_holds_95_percent():
    rng = np.random.default_rng(1)
    error = (rng.normal(size=40_000) + 1j * rng.normal(size=40_000)) * 0.3 / np.sqrt(2)
    radius = FR(w=[1.0], G=[0.0], sd=0.3).radius[0, 0, 0]
    assert np.mean(np.abs(error) < radius) == approx(0.95, abs=0.005)


def test_several_outputs_and_inputs():
    G = np.arange(12).reshape(3, 2, 2) + 1j
    fr = FR(w=W, G=G, radius=0.2)
    assert (fr.n, fr.ny, fr.nu) == (3, 2, 2) and fr.u_names == ("u1", "u2")
    assert_array_equal(fr.take([0, 2]).G, G[[0, 2]])
    assert "2 outputs, 2 inputs" in str(fr)


def test_it_is_frozen_and_survives_pickling():
    fr = FR(w=W, G=[1, 2j, 3], radius=0.1, coherence=[1, 0.9, 0.2])
    with pytest.raises(ValueError, match="read-only"):
        fr.G[0] = 0
    again = pickle.loads(pickle.dumps(fr))
    assert again.same_as(fr) and not fr.same_as(fr.take([0, 1]))


def test_bode_turns_on_and_blanks_what_is_not_coherent():
    w = np.linspace(0.05, 3, 100)
    G = 2 * np.exp(-4j * w)
    fr = FR(w=w, G=G, radius=0.2, coherence=np.where(w < 2, 0.9, 0.1))
    magnitude, phase = fr.bode()
    kept = w < 2
    assert_allclose(phase.value[kept], np.degrees(-4 * w[kept]))
    assert np.isnan(phase.value[~kept]).all() and np.isnan(magnitude.low[~kept]).all()
    assert_allclose(magnitude.high[kept] - magnitude.low[kept], 0.4)
    assert_allclose((phase.high - phase.value)[kept], np.degrees(np.arcsin(0.1)))


def test_a_negative_gain_begins_at_minus_180_on_either_side():
    for side in (1e-3j, -1e-3j):
        assert FR(w=[0.1], G=[-2 + side]).bode()[1].value[0] == approx(-180, abs=0.1)


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"w": [1, 1, 2]}, "U01"),
        ({"w": [3, 2, 1]}, "U01"),
        ({"w": [-1, 1, 2]}, "U01"),
        ({"w": [1, 2, np.nan]}, "U01"),
        ({"w": [1, 2]}, "U01"),
        ({"w": [], "G": []}, "U01"),
        ({"Ts": 2.0}, "U01"),  # 2 rad/s is beyond pi/2
        ({"Ts": 0.0}, "U01"),
        ({"G": [1, np.nan, 2]}, "D07"),
        ({"G": [1, np.inf, 2]}, "D08"),
        ({"G": np.ones((3, 2))}, "U01"),
        ({"radius": -0.1}, "U01"),
        ({"sd": [0.1, 0.2]}, "U01"),
        ({"coherence": [0.5, 1.5, 0.5]}, "U01"),
        ({"share": 0.0}, "U01"),
        ({"u_names": ["a", "b"]}, "U01"),
    ],
)
def test_what_is_no_response_is_refused(wrong, code):
    with pytest.raises(pt.PlantuneError, match=code):
        FR(**{"w": W, "G": [1, 2, 3], **wrong})
