"""D19: spikes and `robust=True`; the regression against the oracle, models against clean ones."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import b0
from oracles import robust

SEEDS = range(10)


def b0_with_spikes(seed, count=5, size=20.0):
    """Return B0 clean and with spikes of `size` deviations of its noise."""
    u, y = b0()
    rng = np.random.default_rng(seed)
    at = rng.choice(np.arange(5, len(y) - 5), count, replace=False)
    dirty = y.copy()
    dirty[at] += size * 0.02 * np.sign(rng.normal(size=count))
    return pt.Record(u=u, y=y, Ts=0.1), pt.Record(u=u, y=dirty, Ts=0.1)


FITS = {
    "ARX": lambda rec, **how: pt.estimate.arx(rec, 1, 1, 1, **how),
    "OE": lambda rec, **how: pt.estimate.oe(rec, 1, 1, 1, **how),
    "ARMAX": lambda rec, **how: pt.estimate.armax(rec, 1, 1, 1, 1, **how),
}


@pytest.mark.parametrize("size", [20.0, 2000.0])
@pytest.mark.parametrize("fit", [FITS["ARX"], FITS["OE"]], ids=["ARX", "OE"])
def test_d19_robust_brings_parameters_back_within_two_percent(fit, size):
    for seed in SEEDS:
        clean, dirty = b0_with_spikes(seed, size=size)
        known, found = fit(clean), fit(dirty, robust=True)
        assert found.theta == approx(known.theta, rel=0.02)
        assert found.sd == approx(known.sd, rel=0.12)
        (note,) = (n for n in found.notes if n.code == "D19")
        assert note.count >= 5


def test_d19_armax_keeps_a_and_b():
    for seed in SEEDS:
        clean, dirty = b0_with_spikes(seed, size=200.0)
        known, found = FITS["ARMAX"](clean), FITS["ARMAX"](dirty, robust=True)
        assert found.theta[:2] == approx(known.theta[:2], rel=0.02)


def test_d19_least_squares_alone_does_not():
    clean, dirty = b0_with_spikes(0, size=2000.0)
    assert FITS["ARX"](dirty).theta != approx(FITS["ARX"](clean).theta, rel=0.1)


def test_robust_arx_is_the_oracle_where_nothing_is_marked():
    rng = np.random.default_rng(3)
    u, e, y = np.sign(rng.normal(size=400)), rng.laplace(size=400).clip(-3, 3), np.zeros(400)
    for k in range(1, 400):
        y[k] = 0.8 * y[k - 1] + u[k - 1] + e[k]
    found = pt.estimate.arx(pt.Record(u=u, y=y, Ts=1.0), 1, 1, 1, robust=True)
    X = np.column_stack([-y[:-1], u[:-1], np.ones(399)])
    known = robust.regression(X, y[1:])
    assert "D19" not in [n.code for n in found.notes]
    assert found.theta == approx(known.theta[:2], rel=1e-6)
    # The oracle's median is the mean of the middle two, the core's the upper one.
    assert found.sd == approx(known.sd[:2], rel=0.01)


def test_a_clean_record_costs_little():
    clean, _ = b0_with_spikes(0)
    plain, found = FITS["ARX"](clean), FITS["ARX"](clean, robust=True)
    assert (np.abs(found.theta - plain.theta) < 1.5 * plain.sd).all()
