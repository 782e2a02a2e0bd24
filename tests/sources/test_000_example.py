"""Source 000, 2.2.1: y(t) + a y(t-1) = b1 sin(u(t)) + b2 u(t-1) + e(t) by least squares.

a = -0.8, b1 = -0.3, b2 = 0.5, a square wave, 1000 rows.  The text takes `rand` for the noise,
which has mean 0.5, and prints -0.8002, -0.3043, 0.4978, which need a mean of zero and about
0.1 peak to peak.  How many samples a half wave lasts is not said: five give the known biases.
"""

import numpy as np
import pytest
from pytest import approx

import plantune as pt

THETA = np.array([-0.8, -0.3, 0.5])
PRINTED = np.array([-0.8002, -0.3043, 0.4978])


def wave(levels, hold, N=1001):
    """Go through the levels in turn, each for `hold` samples."""
    return np.tile(np.repeat(levels, hold), N)[:N].astype(float)


SQUARE = wave([1, -1], 5)
THREE_LEVELS = wave([1, -1, 2], 5)


def problem(u, e=0.0, constant=False):
    """Simulate from y = 0; return the regressor [-y(t-1), sin u(t), u(t-1)] and y(t)."""
    a, b1, b2 = THETA
    y, e = np.zeros(len(u)), np.broadcast_to(e, len(u))
    for t in range(1, len(u)):
        y[t] = -a * y[t - 1] + b1 * np.sin(u[t]) + b2 * u[t - 1] + e[t]
    columns = [-y[:-1], np.sin(u[1:]), u[:-1]] + [np.ones(len(u) - 1)] * constant
    return np.column_stack(columns), y[1:]


def errors(u, low, high, constant=False):
    """Return the errors of theta with uniform noise, one row for each of 100 seeds."""
    found = []
    for seed in range(100):
        e = np.random.default_rng(seed).uniform(low, high, len(u))
        found.append(pt.estimate.least_squares(*problem(u, e, constant)).theta[:3])
    return np.array(found) - THETA


@pytest.mark.parametrize("u", [SQUARE, THREE_LEVELS])
def test_without_noise_the_parameters_come_back(u):
    assert pt.estimate.least_squares(*problem(u)).theta == approx(THETA, rel=1e-12)


def test_centred_noise_of_a_tenth_gives_numbers_like_the_printed_ones():
    found = errors(SQUARE, -0.05, 0.05)
    spread = np.std(found, axis=0)
    assert np.abs(np.mean(found, axis=0)).max() < 4 * spread.max() / 10  # of 100 seeds
    assert np.all(np.abs(PRINTED - THETA) < 4 * spread)
    assert np.all(spread < 0.005)


@pytest.mark.parametrize("amplitude, bias", [(1.0, -0.19), (0.1, -0.063)])
def test_the_mean_of_rand_biases_the_pole(amplitude, bias):
    """ERRATA 2."""
    assert np.mean(errors(SQUARE, 0, amplitude)[:, 0]) == approx(bias, abs=0.005)


@pytest.mark.parametrize("amplitude", [1.0, 0.1])
def test_a_constant_regressor_takes_up_the_mean_of_rand(amplitude):
    found = errors(SQUARE, 0, amplitude, constant=True)
    assert np.all(np.abs(np.mean(found, axis=0)) < 4 * np.std(found, axis=0) / 10)


@pytest.mark.parametrize("e", [0.0, 0.1])
def test_a_level_that_changes_every_sample_is_refused(e):
    """u(t-1) = -u(t) and sin(u) = u sin(1): two columns are one."""
    noise = e * np.random.default_rng(0).uniform(-1, 1, 1001)
    with pytest.raises(pt.NotIdentifiable) as refusal:
        pt.estimate.least_squares(*problem(wave([1, -1], 1), noise))
    assert refusal.value.code == "X02" and "rank 2" in str(refusal.value)


def test_levels_off_zero_that_change_every_sample_are_refused_with_a_constant():
    """u(t-1) = 1 - u(t) is no multiple of u(t), but becomes one beside a constant."""
    noise = np.random.default_rng(0).uniform(-1, 1, 1001)
    every = wave([1, 0], 1)
    assert pt.estimate.least_squares(*problem(every, noise)).N == 1000
    with pytest.raises(pt.NotIdentifiable):
        pt.estimate.least_squares(*problem(every, noise, constant=True))


def test_two_levels_cannot_tell_the_sine_from_a_gain_and_three_can():
    """sin(u(t)) and u(t) are the same column on two levels, however long they are held."""
    for u, identifiable in ((SQUARE, False), (THREE_LEVELS, True)):
        phi, y = problem(u)
        both = np.column_stack([phi, u[1:]])
        if identifiable:
            found = pt.estimate.least_squares(both, y).theta
            assert found == approx([*THETA, 0.0], abs=1e-12)
        else:
            with pytest.raises(pt.NotIdentifiable):
                pt.estimate.least_squares(both, y)
