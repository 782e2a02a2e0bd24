"""M07: a change of the plant is seen, its time told, and nothing is seen where nothing changes."""

import numpy as np
import pytest

import plantune as pt
from contract.records import codes, refused


def record(seed, change=None, factor=1.0, N=1000):
    rng = np.random.default_rng([seed, 7])
    u, e, y = np.repeat(np.sign(rng.normal(size=N // 5)), 5), rng.normal(size=N), np.zeros(N)
    for k in range(1, N):
        b = 0.5 * (factor if change is not None and k >= change * N else 1.0)
        y[k] = 0.8 * y[k - 1] + b * u[k - 1] + 0.2 * e[k]
    return pt.Record(u=u, y=y, Ts=0.1)


@pytest.mark.parametrize(("at", "factor"), [(0.3, 2.0), (0.5, 2.0), (0.8, 2.0), (0.5, 1.3)])
def test_m07_a_change_is_found_with_its_time(at, factor):
    for seed in range(10):
        found = pt.validate.time_varying(record(seed, at, factor), order=2)
        assert codes(found) == ["M07"]
        assert abs(found.row - 1000 * at) < (20 if factor == 2.0 else 60)
        assert found.time == pytest.approx(found.row * 0.1)
        assert found.gains[1] / found.gains[0] == pytest.approx(factor, rel=0.25)


def test_m07_is_silent_where_nothing_changes():
    """At the 0.5 % of the limit, 100 records: two or more in 9 of 100 such tests."""
    assert sum(bool(pt.validate.time_varying(record(s), order=2)) for s in range(100)) <= 2


@pytest.mark.slow
def test_m07_false_alarms_are_at_most_one_percent():
    for order in (1, 2, 4):
        count = sum(bool(pt.validate.time_varying(record(s), order=order)) for s in range(1000))
        assert count <= 10


def test_m07_needs_rows():
    refused(lambda: pt.validate.time_varying(record(0, N=50)), "X03", ())


@pytest.mark.parametrize("wrong", [{"order": 0}, {"nk": [1, 2]}])
def test_what_is_no_order_is_u01(wrong):
    refused(lambda: pt.validate.time_varying(record(0), **wrong), "U01", ())
