"""A model at work: live is replay, and it goes on where it was."""

import pickle

import numpy as np
import pytest

import plantune as pt
from oracles import play as oracle
from plantune.errors import UsageError

STACK = pt.hysteresis.PlayStack(r=[0, 0.3, 1.1], w=[1.0, 0.5, 0.2], offset=-2.0)
X = np.random.default_rng(3).standard_normal(500).cumsum() / 5


def test_the_oracle_gives_the_same():
    y = oracle.stack(X, STACK.r, STACK.w) - 2.0
    assert np.abs(STACK.simulate(X) - y).max() < 1e-14


def test_run_is_step_in_a_loop():
    stream = STACK.stream()
    assert np.array_equal([stream.step(x) for x in X], STACK.simulate(X))


def test_a_pickled_stream_goes_on():
    stream = STACK.stream()
    stream.run(X[:200])
    again = pickle.loads(pickle.dumps(stream))
    assert np.array_equal(again.run(X[200:]), stream.run(X[200:]))
    assert again.model.same_as(STACK)


def test_a_state_of_another_model_is_refused():
    with pytest.raises(UsageError, match="state"):
        STACK.stream().state = np.zeros(2)


@pytest.mark.parametrize("fields", [{"r": [0], "w": []}, {"r": [1, 0], "w": [1, 1]}])
def test_parameters_that_are_none_are_refused(fields):
    with pytest.raises(UsageError):
        pt.hysteresis.PlayStack(**fields)
