"""Source 003, (5) to (8): from the samples of a response back to the input that made it."""

import pickle

import numpy as np
import pytest

from oracles import idt as oracle
from plantune.errors import UsageError
from plantune.recursive import InverseTransform

DT = 0.1
T_16 = (1.25, 3.25, 5.5)
REAL = [-1 / T for T in T_16]
MANY = [*[-1.0] * 3, -0.5 + 2j, -0.5 - 2j, -0.5 + 2j, -0.5 - 2j]


def response(poles, n=200, seed=0, K=1.0):
    """Return K + sum of modes from a random initial state, repeated roots included."""
    rng = np.random.default_rng(seed)
    t, y = DT * np.arange(n), np.full(n, K)
    for p in set(poles):
        for power in range(poles.count(p)):
            c = rng.normal(scale=2) + 1j * rng.normal(scale=2) * (np.imag(p) != 0)
            y = y + (c * (0.3 * t) ** power * np.exp(p * t)).real
    return y


@pytest.mark.parametrize("poles", [REAL, MANY, [-2 + 9.8j, -2 - 9.8j], [-0.2, -0.2]])
@pytest.mark.parametrize("lag", [1, 3])
def test_a_response_turns_into_its_gain_whatever_the_initial_state(poles, lag):
    for seed in range(20):
        back = InverseTransform(poles, DT, gain=5.0, lag=lag)
        x = back.run(response(poles, seed=seed, K=5.0))
        J = len(poles) * lag
        assert np.isnan(x[:J]).all()
        assert np.abs(x[J:] - 1.0).max() < 1e-15 * 20 * back.noise_gain * 5.0 + 1e-12


def test_extra_sections_change_nothing():
    x = InverseTransform([*REAL, -0.05, -3.0], DT).run(response(REAL))
    assert np.abs(x[5:] - 1.0).max() < 1e-6


@pytest.mark.parametrize("poles", [REAL, MANY])
def test_the_oracle_gives_the_same(poles):
    y = response(poles) + np.random.default_rng(1).normal(size=200)
    back = InverseTransform(poles, DT)
    x, other = back.run(y)[len(poles) :], oracle.cascade(y, poles, DT)
    assert np.abs(x - other).max() < 1e-10 * np.abs(other).max()
    d = oracle.coefficients(poles, DT)
    assert back.coefficients == pytest.approx(d, rel=1e-9, abs=1e-9 * np.abs(d).max())
    assert back.noise_gain == pytest.approx(oracle.noise_gain(d), rel=1e-9)


def test_numerical_differentiation_is_the_operator_of_a_longer_time_constant():
    y = response([-0.5])
    back = InverseTransform([-0.5], DT, differentiation=True)
    x = back.run(y)[1:]
    assert x == pytest.approx(oracle.differentiated(y, [2.0], DT), abs=1e-12)
    # Roots 1 - dt/T are those of T' = -dt/ln(1 - dt/T): off by about dt/(2 T) of the transient.
    same = InverseTransform([np.log(1 - DT / 2.0) / DT], DT).run(y)[1:]
    assert x == pytest.approx(same, abs=1e-12)
    assert np.abs(x - 1).max() == pytest.approx(DT / 4 * np.abs(y[0] - 1), rel=0.05)


def test_the_input_comes_back_and_not_only_a_step():
    rng = np.random.default_rng(3)
    u = rng.choice([-1.0, 2.0], 60).repeat(3)
    z = np.exp(-DT / 2.0)
    y = np.zeros(len(u) + 1)
    for k in range(len(u)):
        y[k + 1] = z * y[k] + (1 - z) * u[k]
    # A sample tells of the input that was held until then.
    assert InverseTransform([-0.5], DT).run(y)[1:] == pytest.approx(u, abs=1e-12)


def test_run_is_step_in_a_loop_and_a_copy_goes_on():
    y = response(MANY)
    live = InverseTransform(MANY, DT, gain=2.0, lag=2)
    one = [live.step(value) for value in y[:120]]
    again = pickle.loads(pickle.dumps(live))
    assert np.array_equal(
        InverseTransform(MANY, DT, gain=2.0, lag=2).run(y),
        [*one, *again.run(y[120:])],
        equal_nan=True,
    )


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (([], DT), "poles"),
        (([0.0], DT), "poles"),
        (([-1 + 2j], DT), "poles"),
        (([-1 + 2j, -1.1 - 2j], DT), "poles"),
        (([-1.0], 0.0), "Ts"),
        (([-1.0], DT, 0.0), "gain"),
        (([-1.0], DT, 1.0, 0), "lag"),
        (([-1.0], DT, 1.0, -1), "lag"),
        (([-1.0], DT, 1.0, 10**12), "lag"),
        (([2j * np.pi / DT, -2j * np.pi / DT], DT), "poles"),  # a root of 1: as an integrator
        (([-1e-20], DT), "poles"),
        (([1e5], DT), "poles"),
    ],
)
def test_what_is_no_operator_is_refused(arguments, name):
    with pytest.raises(UsageError, match=f"`{name}`"):
        InverseTransform(*arguments)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_sample_that_is_none_is_refused_and_changes_nothing(bad):
    y = response(MANY)
    back, other = InverseTransform(MANY, DT), InverseTransform(MANY, DT)
    back.run(y[:50])
    other.run(y[:50])
    with pytest.raises(UsageError, match="`y`"):
        back.step(bad)
    with pytest.raises(UsageError, match="row 1"):
        back.run([1.0, bad])
    assert back.run(y[50:]).tolist() == other.run(y[50:]).tolist()


def test_after_a_gap_it_waits_for_a_full_window():
    y, J = response(MANY), len(MANY)
    back = InverseTransform(MANY, DT)
    back.run(y[:50])
    back.restart()
    x = back.run(y[90:])
    assert np.isnan(x[:J]).all()
    assert x[J:].tolist() == InverseTransform(MANY, DT).run(y[90:])[J:].tolist()
