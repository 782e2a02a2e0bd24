"""X09: feedback is seen in a loop and nowhere else, as the oracle sees it."""

import numpy as np
import pytest

import plantune as pt
from contract.records import codes
from oracles import feedback


def loop(seed, N=600, level=0.3):
    """A first-order plant under PI control, its set point moved now and then."""
    rng = np.random.default_rng(seed)
    r = np.repeat(rng.choice([-1.0, 1.0], N // 20), 20)
    e, u, y, integral = rng.normal(size=N), np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        y[k] = (0.85 * y[k - 1] + 0.3 * u[k - 1] if k else 0.0) + level * e[k]
        integral += 0.1 * (r[k] - y[k])
        u[k] = 0.8 * (r[k] - y[k]) + integral
    return pt.Record(u=u, y=y, Ts=1.0)


def open_loop(kind, seed, N=600):
    rng = np.random.default_rng(seed)
    held = np.repeat(np.sign(rng.normal(size=N // 8)), 8)
    u = held if kind == "held" else np.cumsum(rng.normal(size=N))
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = 0.85 * y[k - 1] + 0.3 * u[k - 1] + 0.3 * rng.normal()
    return pt.Record(u=u, y=y, Ts=1.0)


def test_x09_a_loop_is_detected():
    for seed in range(20):
        found = pt.validate.closed_loop(loop(seed))
        assert codes(found) == ["X09"]
        assert "ARMAX" in found.notes[0].remedy


@pytest.mark.parametrize("kind", ["held", "walk"])
def test_x09_an_open_loop_is_not(kind):
    """At most p = 0.001 each; of 40 records at most one."""
    assert sum(bool(pt.validate.closed_loop(open_loop(kind, s))) for s in range(40)) <= 1


def test_the_chance_is_of_the_size_that_the_oracle_gives():
    """The oracle leaves out ten rows more, so the two agree in size only."""
    for seed in range(5):
        rec = open_loop("walk", seed)
        ours = pt.validate.closed_loop(rec).p[0]
        assert abs(np.log10(ours) - np.log10(feedback.p_of_feedback(rec.u, rec.y))) < 0.7


def test_few_rows_say_nothing():
    assert pt.validate.closed_loop(loop(0, N=60)).p == (1.0,)
