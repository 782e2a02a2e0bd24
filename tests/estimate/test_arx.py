"""ARX: the same numbers as an explicit regressor, over inputs, segments and gaps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from oracles import fopdt, lsq

# Both sides are backward stable; the regressors here have condition numbers below 1e4.
SAME = {"rel": 1e-9, "abs": 1e-11}


def plant(N=300, seed=1, sd=0.05, a=(-1.2, 0.4), b=(0.5, 0.1), nk=2, d=0.6):
    """Simulate a noisy second-order ARX plant on a seeded two-level input."""
    rng = np.random.default_rng(seed)
    u = fopdt.hold_input(N, 3, seed) + 0.3
    e = sd * rng.normal(size=N)
    y = np.zeros(N)
    for t in range(N):
        y[t] = d + e[t]
        y[t] -= sum(a[i] * y[t - i - 1] for i in range(len(a)) if t > i)
        y[t] += sum(b[i] * u[t - nk - i] for i in range(len(b)) if t >= nk + i)
    return u, y


def assert_same(fit, ref):
    """Compare every number that both give."""
    assert fit.N == ref.N
    assert fit.theta == approx(ref.theta, **SAME)
    assert fit.sd == approx(ref.sd, rel=1e-8)
    assert fit.loss == approx(ref.loss, rel=1e-8)
    assert (fit.fpe, fit.aic, fit.bic) == approx((ref.fpe, ref.aic, ref.bic), rel=1e-8)
    if np.size(fit.offset) and np.shape(fit.P)[0] == len(fit.theta) + 1:
        assert fit.offset[0] == approx(ref.offset, rel=1e-8, abs=1e-10)
        assert approx(ref.P, rel=1e-7, abs=1e-10 * np.abs(ref.P).max()) == fit.P


@pytest.mark.parametrize("na, nb, nk", [(2, 2, 2), (1, 1, 1), (3, 1, 0), (0, 4, 2), (1, 2, 7)])
@pytest.mark.parametrize("offset", [True, False])
def test_arx_equals_the_explicit_regressor(na, nb, nk, offset):
    u, y = plant()
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), na, nb, nk, offset=offset)
    assert_same(fit, lsq.arx(u, y, na, nb, nk, offset=offset))
    assert np.shape(fit.P) == (na + nb + offset,) * 2
    assert len(fit.sd) == len(fit.names) == na + nb


def test_hair_dryer_gives_the_known_numbers(data):
    """The vector and V of the MATLAB demonstration of this record, samples 1 to 300."""
    u, y = np.loadtxt(data("hair_dryer") / "dryer.dat").T[:, :300]
    if np.std(u) < np.std(y):
        u, y = y, u
    rec = pt.Record(u=u - u.mean(), y=y - y.mean(), Ts=0.08)
    fit = pt.estimate.arx(rec, 2, 2, 3, offset=False)
    assert fit.N == 296
    assert fit.theta == approx([-1.273739, 0.393546, 0.066618, 0.044482], abs=5e-7)  # as printed
    assert fit.loss == approx(0.00168531, abs=5e-9)


def test_several_inputs_have_their_own_orders():
    rng = np.random.default_rng(4)
    u = rng.normal(size=(200, 2))
    y = np.zeros(200)
    for t in range(4, 200):
        y[t] = 0.7 * y[t - 1] + u[t - 1, 0] + 0.2 * u[t - 2, 0] - 0.5 * u[t - 4, 1] + 0.1
    y += 0.01 * rng.normal(size=200)
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=1.0), 1, [2, 1], [1, 4])
    assert_same(fit, lsq.arx(u, y, 1, [2, 1], [1, 4]))


def test_segments_lend_each_other_no_history():
    (u1, y1), (u2, y2) = plant(150, seed=2), plant(90, seed=3)
    both = pt.Record.join([pt.Record(u=u1, y=y1, Ts=0.1), pt.Record(u=u2, y=y2, Ts=0.1)])
    fit = pt.estimate.arx(both, 2, 2, 3)
    ref = lsq.arx(np.r_[u1, u2], np.r_[y1, y2], 2, 2, 3, starts=(0, 150))
    assert ref.N == 240 - 2 * 4  # max(na, nb + nk - 1) = 4 rows a segment are history
    assert_same(fit, ref)


def test_outputs_that_do_not_count_are_never_read():
    u, y = plant(200, seed=5)
    valid = np.ones(200, bool)
    valid[[0, 37, 90, 91, 199]] = False
    ref = lsq.arx(u, y, 2, 2, 2, valid=valid)
    y = np.where(valid, y, 77.0)
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1, valid=valid), 2, 2, 2)
    assert_same(fit, ref)


def test_fast_sampling_with_an_offset_keeps_its_digits():
    """SPEED: condition near 3e8, where normal equations are lost; 1e-6 leaves a factor 1000."""
    u, y = plant(2000, sd=0.0, a=(-1.9980, 0.998002), b=(1e-6,), nk=1, d=0.0)
    fit = pt.estimate.arx(pt.Record(u=u, y=y + 1e3, Ts=1e-3), 2, 1, 1)
    assert fit.theta == approx([-1.9980, 0.998002, 1e-6], rel=1e-6)


@given(
    a=st.floats(-0.95, 0.95),
    b=st.floats(0.1, 10.0),
    nk=st.integers(0, 6),
    O=st.floats(-1e3, 1e3),
)
def test_simulate_then_identify_returns_the_truth(a, b, nk, O):
    u = fopdt.hold_input(120, 2, 6)
    model = pt.models.PolyModel(A=[1.0, a], B=[b], nk=nk, Ts=0.5)
    y = np.ravel(model.simulate(u)) + O
    fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.5), 1, 1, nk)
    assert fit.theta == approx([a, b], rel=1e-8, abs=1e-9)  # y carries 1e3 * 2e-16 of rounding
    assert fit.offset[0] == approx(O, abs=1e-7)


@given(scale=st.sampled_from([1e-12, 1e-6, 1e-3, 7.0, 1e6, 1e12]))
def test_units_change_b_and_nothing_else(scale):
    u, y = plant()
    plain = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 2, 2, 2)
    other = pt.estimate.arx(pt.Record(u=u * scale, y=y, Ts=0.1), 2, 2, 2)
    both = pt.estimate.arx(pt.Record(u=u * scale, y=y * scale, Ts=0.1), 2, 2, 2)
    assert other.theta * [1, 1, scale, scale] == approx(plain.theta, rel=1e-9)  # N02
    assert both.theta == approx(plain.theta, rel=1e-9)
    assert both.offset[0] / scale == approx(plain.offset[0], rel=1e-9)


def test_a_later_input_raises_nk_by_one():
    u, y = plant()
    fit = pt.estimate.arx(pt.Record(u=u[1:], y=y[1:], Ts=0.1), 2, 2, 2)
    early = pt.estimate.arx(pt.Record(u=u[:-1], y=y[1:], Ts=0.1), 2, 2, 1)
    assert fit.theta == approx(early.theta, rel=0.02)  # one row differs in about 300


def test_huge_offsets_do_not_move_the_dynamics():
    u, y = plant(1000, seed=1, sd=0.02, a=(-0.8,), b=(0.5,), nk=1, d=0.0)
    fit = pt.estimate.arx(pt.Record(u=u + 1e6, y=y + 1e9, Ts=0.1), 1, 1, 1)
    assert fit.theta == approx([-0.8, 0.5], rel=0.01)  # BAD_INPUTS N01


def test_intervals_cover_the_truth():
    inside = []
    for seed in range(1000):
        u, y = plant(300, seed=seed, sd=0.1)
        fit = pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 2, 2, 2)
        inside.append(np.abs(fit.theta - [-1.2, 0.4, 0.5, 0.1]) < 1.96 * np.asarray(fit.sd))
    share = np.mean(inside, axis=0)
    assert share == approx(0.95, abs=0.025)  # sd of one share 0.7 %; 300 rows: bias below 0.5 %


def test_a_constant_input_is_refused():
    _, y = plant()
    with pytest.raises(pt.NotIdentifiable) as refusal:
        pt.estimate.arx(pt.Record(u=np.full(300, 2.0), y=y, Ts=0.1), 1, 1, 1)
    assert refusal.value.code == "X01"


def test_too_few_rows_are_refused():
    u, y = plant(8)
    with pytest.raises((pt.NotIdentifiable, pt.DataError)) as refusal:
        pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 4, 4, 1)
    assert refusal.value.code == "X03"


def test_collinear_inputs_are_refused():
    u, y = plant()
    with pytest.raises(pt.NotIdentifiable) as refusal:
        pt.estimate.arx(pt.Record(u=np.column_stack([u, 3 * u]), y=y, Ts=0.1), 1, [1, 1], [1, 1])
    assert refusal.value.code == "X11"


def test_a_regressor_without_full_rank_is_refused():
    """A noise-free first-order plant cannot tell three a coefficients from three b."""
    u, y = plant(sd=0.0, a=(-0.8,), b=(0.5,), nk=1, d=0.0)
    with pytest.raises(pt.NotIdentifiable):
        pt.estimate.arx(pt.Record(u=u, y=y, Ts=0.1), 3, 3, 1)
