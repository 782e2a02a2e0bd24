"""The half rule: printed reductions, its invariants, and what it has no answer for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.models import ProcessModel, TransferFunction
from plantune.tune import controllability_ratio, half_rule

lags = st.lists(st.floats(0.01, 100.0), min_size=1, max_size=6)


def transfer(K, lags, zeros=(), L=0.0, integrators=0):
    """Make K prod (z s + 1) e^(-L s) / (s^i prod (T s + 1))."""
    num, den = np.array([K]), np.array([1.0])
    for z in zeros:
        num = np.polymul(num, [z, 1.0])
    for T in lags:
        den = np.polymul(den, [T, 1.0])
    return TransferFunction(num, np.append(den, np.zeros(integrators)), L=L)


# Skogestad, J. Process Control 13 (2003), table 4: gain, dead time, lags of each order.  The
# author prints the settings; these are what he names in the text or what follows from them.
PRINTED = {
    "E1": (transfer(1, [1, 0.2]), (1, 0.1, 1.1), None),
    "E2": (
        transfer(1, [2, 1, 0.4, 0.2, 0.05, 0.05, 0.05], [-0.3, 0.08]),
        (1, 1.47, 2.5),
        (1, 0.77, 2, 1.2),
    ),
    "E3": (transfer(2, [20, 1, 0.1, 0.1], [15]), (1.5, 0.15, 1.05), (1.5, 0.05, 1, 0.15)),
    "E4": (transfer(1, [1, 1, 1, 1]), (1, 2.5, 1.5), (1, 1.5, 1.5, 1)),
    "E5": (transfer(1, [1, 0.2, 0.04, 0.008]), (1, 0.148, 1.1), (1, 0.028, 1, 0.22)),
    "E6": (transfer(1, [1, 1, 0.028], [0.17, 0.17], 0, 1), None, (1, 0.358, 1.33)),
    "E7": (transfer(1, [1, 1, 1], [-2]), (1, 3.5, 1.5), (1, 2.5, 1.5, 1)),
    "E8": (transfer(1, [1, 1], [], 0, 1), (1, 1.5), (1, 0.5, 1.5)),
    "E9": (transfer(1, [1, 1], [], 1), (1, 1.5, 1.5), (1, 1, 1, 1)),
    "E10": (transfer(1, [20, 2], [], 1), (1, 2, 21), (1, 1, 20, 2)),
    "E11": (transfer(1, [6, 2, 2], [-1], 1), (1, 5, 7), (1, 3, 6, 3)),
    "E12": (transfer(1, [10, 8, 1], [6, 3], 0.3), (0.225, 0.3, 1), None),
    "E13": (transfer(1, [10, 0.5], [2], 1), (0.625, 1.25, 4.5), None),
    "E14": (transfer(1, [], [-1], 0, 1), (1, 1), None),
    "E15": (transfer(1, [1], [-1]), (1, 1, 1), None),
}


@pytest.mark.parametrize("case", PRINTED)
def test_printed_reductions_come_out(case):
    """Roots of equal factors lose digits: four equal poles are known to 1e-4."""
    G, *orders = PRINTED[case]
    for order, printed in zip((1, 2), orders, strict=True):
        if printed is not None:
            model = half_rule(G, order)
            assert (model.K, model.L, *model.times) == approx(printed, rel=1e-3), order
            assert model.integrating == (G.den[-1] == 0)


@given(T=lags, L=st.floats(0.0, 10.0), order=st.sampled_from([1, 2]))
def test_gain_and_mean_residence_time_are_kept(T, L, order):
    """Lags and delays alone: G(0) and -G'(0)/G(0) = sum T + L do not change."""
    model = half_rule(ProcessModel(K=-2.0, T=tuple(T), L=L), order)
    assert model.K == -2.0
    assert sum(model.times) + model.L == approx(sum(T) + L, rel=1e-12)
    assert model.L >= L and list(model.times) == sorted(model.times, reverse=True)


@given(T=lags, Tz=st.floats(-10.0, 10.0), scale=st.floats(1e-3, 1e3))
def test_units_of_time_and_gain_carry_over(T, Tz, scale):
    plain = ProcessModel(K=3.0, T=(*T, 0.5), L=1.0, Tz=Tz)
    times = tuple(scale * t for t in plain.times)
    other = ProcessModel(K=-6.0, T=times, L=scale, Tz=scale * Tz)
    try:
        ours = half_rule(plain)
    except pt.NotIdentifiable:
        with pytest.raises(pt.NotIdentifiable):
            half_rule(other)
        return
    theirs = half_rule(other)
    assert theirs.K == approx(-2 * ours.K, rel=1e-9)
    assert (theirs.L, *theirs.times) == approx([scale * x for x in (ours.L, *ours.times)], rel=1e-9)


def test_what_is_of_the_order_already_is_left_alone():
    for model in (
        ProcessModel(K=2.0, T=3.0, L=0.5),
        ProcessModel(K=2.0, T=(), L=0.5, integrating=True),
    ):
        assert half_rule(model).same_as(model)
    second = ProcessModel(K=2.0, T=(3.0, 1.0), L=0.5)
    assert half_rule(second, 2).same_as(second)
    assert half_rule(second.transfer(), 2).times == approx((3.0, 1.0), rel=1e-12)


@pytest.mark.parametrize(
    "Tz, T, tau_c, K",
    [(10, 5, 1, 2), (10, 2, 5, 2), (3, 2, 5, 1)],
    ids=["T1: Tz/T", "T1a: Tz/tau_c", "T1b: 1"],
)
def test_a_zero_slower_than_its_lag_takes_it_away(Tz, T, tau_c, K):
    model = half_rule(ProcessModel(1.0, T, 0.3, Tz, integrating=True), tau_c=tau_c)
    assert (model.K, model.L, model.times) == (K, 0.3, ())


@pytest.mark.parametrize(
    "Tz, T, tau_c, K, lag",
    [(5, 8, 1, 0.625, 0), (3, 8, 1, 0.625, 2), (3, 4, 1, 1, 1)],
    ids=["T2: Tz/T", "T3 with 5 tau_c", "T3 with T"],
)
def test_a_zero_faster_than_its_lag_leaves_a_shorter_one(Tz, T, tau_c, K, lag):
    """Of what is left, half goes to the lag of 100 s and half to the dead time."""
    model = half_rule(ProcessModel(1.0, (100.0, T), 0.3, Tz), tau_c=tau_c)
    assert (model.K, model.L, *model.times) == approx((K, 0.3 + lag / 2, 100 + lag / 2))


def test_a_damped_pair_is_kept_where_it_is_the_slowest():
    slow = half_rule(ProcessModel(K=2.0, T=(3.0, 1.0), L=0.5, zeta=0.4), 2)
    assert (slow.times, slow.zeta, slow.L) == ((3.0,), 0.4, 1.5)
    fast = half_rule(ProcessModel(K=2.0, T=(0.1, 3.0), L=0.5, zeta=0.4))
    assert (fast.times, fast.zeta) == ((3.0,), None) and fast.L == approx(0.5 + 2 * 0.4 * 0.1)
    real = half_rule(ProcessModel(K=2.0, T=2.0, L=0.5, zeta=1.25), 2)  # 4 s and 1 s
    assert real.times == approx((4.0, 1.0)) and real.zeta is None


def test_a_well_damped_pair_is_one_lag_as_two_lags_of_its_mean_are():
    one = half_rule(ProcessModel(K=2.0, T=2.0, L=0.5, zeta=0.8))
    same = half_rule(ProcessModel(K=2.0, T=(1.6, 1.6), L=0.5))
    assert one.same_as(same) and one.L + one.times[0] == approx(0.5 + 2 * 0.8 * 2.0)


@pytest.mark.parametrize(
    "model, code",
    [
        (TransferFunction([1.0], [1.0, -1.0]), "M02"),
        (TransferFunction([1.0], [1.0, 0.0, 1.0]), "M02"),
        (TransferFunction([1.0], [1.0, 0.0, 0.0]), "M01"),
        (TransferFunction([1.0, 0.0], [1.0, 2.0, 1.0]), "M12"),
        (TransferFunction([1.0], [1.0]), "M12"),
        (ProcessModel(K=1.0, T=2.0, L=1.0, zeta=0.3), "M12"),
        (ProcessModel(K=0.0, T=2.0, L=1.0), "M12"),
    ],
)
def test_what_has_no_reduction_is_refused(model, code):
    with pytest.raises(pt.NotIdentifiable) as refusal:
        half_rule(model)
    assert refusal.value.code == code and refusal.value.remedy


def test_wrong_arguments_are_refused():
    plant = ProcessModel(K=1.0, T=2.0, L=1.0)
    for wrong in (
        lambda: half_rule(plant, 3),
        lambda: half_rule(plant, tau_c=-1.0),
        lambda: half_rule(pt.models.PolyModel(A=[1, -0.5], B=[1], nk=1, Ts=1.0)),
    ):
        with pytest.raises(pt.UsageError) as refusal:
            wrong()
        assert refusal.value.code == "U01"


def test_the_controllability_ratio_is_the_share_of_dead_time():
    """Source 001, (3.4-2)."""
    assert controllability_ratio(ProcessModel(K=-5.939, T=0.1491, L=0.1)) == approx(0.1 / 0.2491)
    assert controllability_ratio(ProcessModel(K=1.0, T=(1, 1, 1, 1))) == approx(2.5 / 4)
    assert controllability_ratio(ProcessModel(K=1.0, T=(), L=3.0, integrating=True)) == 0.0
