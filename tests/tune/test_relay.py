"""The relay test: inversion against the equations of the cycle, the fit, and what is refused."""

from dataclasses import replace
from math import exp, log

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt

PLANT = pt.models.ProcessModel(K=2.0, T=3.0, L=1.0)
LEVELS = {"high": 2.0, "low": -1.0}


def simulated(plant=PLANT, **changed):
    """Return a relay test around the set point 5, which u = 0 holds."""
    L = plant.L
    usual = {**LEVELS, "hysteresis": 0.3, "Ts": L / 20, "t_end": 60 * L, "r": 5.0, "offset": 5.0}
    return pt.simulate.relay(plant, **{**usual, **changed})


def codes(result):
    return [note.code for note in result.notes]


def theta(model):
    return np.array([model.K, model.T, model.L])


@st.composite
def plants(draw):
    K = draw(st.floats(0.1, 10.0)) * draw(st.sampled_from([-1.0, 1.0]))
    T = draw(st.floats(0.1, 100.0))
    return pt.models.ProcessModel(K=K, T=T, L=T * draw(st.floats(0.1, 5.0)))


@settings(max_examples=40)
@given(plant=plants(), ratio=st.floats(1.7, 3.0), rest=st.sampled_from([0.0, 2.0]))
@pytest.mark.parametrize("per_delay", [200, 30])
def test_without_noise_the_plant_comes_back(per_delay, plant, ratio, rest):
    """METHODS 3.4 asks for 0.1 %; the equations are exact at any sample time."""
    travel = abs(plant.K) * (1 + ratio) * -np.expm1(-plant.L / plant.T)
    rec = simulated(
        plant, high=ratio, low=-1.0, hysteresis=0.03 * travel, Ts=plant.L / per_delay,
        t_end=(30 + rest) * plant.L, rest=rest * plant.L,
    )  # fmt: skip
    test = pt.tune.relay(rec)
    assert theta(test) == approx(theta(plant), rel=1e-3)
    assert test.offset == approx(5.0, abs=1e-3 * abs(plant.K))
    assert test.known == ("rest" if rest else "asymmetry")
    # Nor does a plant of first order leave anything for the fit to mend.
    assert test.fit.theta == approx(theta(plant), rel=1e-6)
    assert "T03" not in codes(test)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_half_cycles_are_those_of_the_closed_form(sign):
    """METHODS 3.4 in the relay's own terms, with the hysteresis in effect; rows of L/500."""
    plant = pt.models.ProcessModel(K=2.0 * sign, T=3.0, L=1.0)
    test = pt.tune.relay(simulated(plant, Ts=0.002, t_end=30.0))
    h, d1, d2 = test.hysteresis / 2.0, 2.0, 1.0

    def lasts(d1, d2):
        return 3.0 * log((h - d2 + exp(1.0 / 3.0) * (d1 + d2)) / (d1 - h))

    # Switching at rows alone makes the cycle uneven by up to one of them.
    assert (test.t_on, test.t_off) == approx((lasts(d1, d2), lasts(d2, d1)), abs=0.002)
    assert test.levels == (-1.0, 2.0)
    assert test.hysteresis == approx(0.3, abs=0.003)


def asynchronous(plant, Ts, phase, **more):
    """Return the record that a slower logger makes of a relay that switches between its rows."""
    fast = simulated(plant, Ts=Ts / 37, **more)
    u, y, r = (x[phase::37] for x in (fast.u, fast.y, fast.r))
    return pt.Record(u=u, y=y, r=r, Ts=Ts)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 5.0])
@pytest.mark.parametrize("per_delay", [20, 50])
def test_deviations_cover_switching_between_the_rows(ratio, per_delay):
    """The switchings lie up to a sample before their rows: uniform, so within 2 deviations."""
    plant = pt.models.ProcessModel(K=-2.0, T=1.0 / ratio, L=1.0)
    for phase in (3, 17, 31):
        test = pt.tune.relay(asynchronous(plant, 1.0 / per_delay, phase, hysteresis=0.2))
        off = (theta(test) - theta(plant)) / test.sd
        assert (np.abs(off) < 2).all(), (ratio, per_delay, phase, off)


@pytest.mark.parametrize("gamma", [1.5, 2.0, 3.0])
@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0, 2.0, 5.0])
def test_the_ratio_of_half_cycles_follows_the_published_approximation(ratio, gamma):
    """tau = (gamma - rho)/((gamma - 1)(0.35 rho + 0.65)), Berner 2017: to 0.03."""
    plant = pt.models.ProcessModel(K=1.0, T=1.0, L=ratio)
    h = 0.1 * -np.expm1(-ratio)
    rec = simulated(plant, high=gamma, hysteresis=h, Ts=ratio / 100, t_end=30 * ratio)
    test = pt.tune.relay(rec)
    rho = test.t_off / test.t_on
    tau = (gamma - rho) / ((gamma - 1) * (0.35 * rho + 0.65))
    assert tau == approx(test.L / (test.L + test.T), abs=0.03)


def test_the_ultimate_point_is_that_of_the_model():
    test = pt.tune.relay(simulated())
    at = test.model.freqresp([2 * np.pi / test.Tu])[0]
    assert at * test.Ku == approx(-1.0, abs=1e-9)
    assert pt.tune.margins(PLANT, pt.models.PID(Kp=1.0)).gain == approx(test.Ku, rel=1e-4)


def test_an_equilibrium_may_be_given():
    rec = simulated()
    test = pt.tune.relay(rec, rest=(0.0, 5.0))
    assert test.known == "rest" and test.offset == approx(5.0, abs=1e-9)
    assert theta(test) == approx(theta(PLANT), rel=1e-5)
    with pytest.raises(pt.UsageError, match="rest"):
        pt.tune.relay(rec, rest=(0.0, float("nan")))


def test_units_scale_through():
    rec = simulated(noise_sd=0.05)
    scaled = pt.Record(u=rec.u * 4 + 7, y=rec.y * -10 + 3, Ts=rec.Ts * 60)
    one, two = pt.tune.relay(rec), pt.tune.relay(scaled)
    assert (two.K, two.T, two.L) == approx((one.K * -2.5, one.T * 60, one.L * 60), rel=1e-9)
    assert two.sd == approx(one.sd * [2.5, 60, 60], rel=1e-6)


def test_a_record_may_begin_and_end_anywhere():
    rec = simulated()
    for cut in range(0, 60, 7):
        part = rec.take(slice(cut, rec.N - 2 * cut))
        assert theta(pt.tune.relay(part)) == approx(theta(PLANT), rel=1e-4)


def test_a_set_point_reached_late_leaves_its_first_periods_out():
    """Second order, started away from its cycle: the first half-cycles are longer."""
    rec = of_second_order(T=(3.0, 3.0), y0=6.0, hysteresis=0.1, noise=0.0)
    test = pt.tune.relay(rec, rest=(0.0, 0.0))
    assert test.t[0] > 10.0
    lengths = np.diff(np.flatnonzero(np.diff(test.u) != 0))
    assert max(lengths[::2]) - min(lengths[::2]) <= 0.1 * (test.t_on + test.t_off) / test.Ts


def of_second_order(T, y0=0.0, hysteresis=0.3, noise=0.05, rest=0, L=0.5, Ts=0.05, N=1200, seed=0):
    """Simulate 2 e^(-L s)/((T1 s + 1)(T2 s + 1)) under a relay, its state y0 at the start."""
    e = noise * np.random.default_rng(seed).standard_normal(N)
    u, y, x, lag = np.zeros(N), np.zeros(N), [y0, y0], round(L / Ts)
    for k in range(N):
        if k > 0:
            v = u[k - 1 - lag] if k > lag else 0.0
            keep = [exp(-Ts / t) for t in T]
            x[1] = keep[1] * x[1] + (1 - keep[1]) * x[0]
            x[0] = keep[0] * x[0] + (1 - keep[0]) * 2.0 * v
        y[k] = x[1] + e[k]
        if k >= rest:
            before = u[k - 1] if k > rest else 2.0
            u[k] = -1.0 if y[k] > hysteresis else 2.0 if y[k] < -hysteresis else before
    return pt.Record(u=u, y=y, Ts=Ts)


def test_a_plant_of_second_order_shows_in_the_disagreement():
    """From a true rest the cycle keeps the gain; the fit leans on the waveform and loses it."""
    test = pt.tune.relay(of_second_order(T=(3.0, 1.0), rest=100))
    assert test.known == "rest" and test.K == approx(2.0, rel=0.05)
    assert "T03" in codes(test)
    assert abs(test.fit.theta[0] - 2.0) > 1.0
    tuning = pt.tune.simc(test.model)
    assert tuning.margins.stable and "T03" not in codes(tuning)


def test_where_the_fit_is_refused_the_cycle_stands():
    """Without noise the cycle of another plant foretells itself, so that u adds nothing (X04)."""
    test = pt.tune.relay(of_second_order(T=(3.0, 1.0), rest=100, noise=0.0))
    assert test.fit is None and "X04" in codes(test)
    assert test.K == approx(2.0, rel=0.05)
    assert "fit" not in str(test).splitlines()[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "K, T, L", [(2.0, 10.0, 1.0), (-2.0, 3.0, 1.0), (2.0, 1.0, 1.0), (-2.0, 1.0, 5.0)]
)
def test_intervals_cover_the_truth(K, T, L):
    """Noise of a third of the hysteresis; 95 % intervals of the fit, 100 seeds."""
    plant = pt.models.ProcessModel(K=K, T=T, L=L)
    sd = 6.0 * -np.expm1(-L / T) / 60
    inside, cycle, told = np.zeros(3), [], 0
    for seed in range(100):
        rec = simulated(
            plant, hysteresis=3 * sd, Ts=L / 25, noise_sd=sd, seed=seed, rest=5 * L, t_end=65 * L
        )
        test = pt.tune.relay(rec)
        inside += np.abs(test.fit.theta - theta(plant)) < 1.96 * test.fit.sd
        cycle.append((theta(test) - theta(plant)) / test.sd)
        told += "T03" in codes(test)
    assert ((inside >= 90) & (inside <= 99)).all(), inside
    # The sample time counts as unknown in the cycle's deviations, so they are on the wide side.
    assert (np.abs(cycle) < 2).mean() > 0.98
    assert told == 0


def refused(rec, code, **more):
    with pytest.raises(pt.PlantuneError) as caught:
        pt.tune.relay(rec, **more)
    assert caught.value.code == code and caught.value.remedy
    assert len(str(caught.value).splitlines()) <= 3
    return caught.value


def test_a_symmetric_relay_is_refused():
    for rest in (0.0, 5.0):
        error = refused(simulated(low=-2.0, rest=rest), "X02")
        assert "symmetric" in error.text and "process(rec" in error.remedy
    # What the remedy says does work; beyond, half a period and the other sign would do as well.
    fit = pt.estimate.process(simulated(low=-2.0), "P1D", L=(0, 2.1))
    assert fit.theta == approx(theta(PLANT), rel=1e-6)


def test_too_few_periods_are_refused():
    assert refused(simulated(t_end=12.0), "X03").measured == 1
    refused(simulated(t_end=3.0), "X03")


def test_no_oscillation_is_refused():
    refused(simulated(hysteresis=1e3), "X01")


def test_more_than_two_levels_are_refused():
    rec = simulated()
    u = np.array(rec.u[:, 0])
    u[300:310] = 0.5
    error = refused(replace(rec, u=u), "U01")
    assert error.where[:2] == ("u", 300)


@pytest.mark.parametrize("hysteresis, noise", [(0.02, 0.1), (0.0, 0.03), (0.15, 0.1)])
def test_a_relay_that_noise_switches_is_refused(hysteresis, noise):
    error = refused(simulated(hysteresis=hysteresis, noise_sd=noise), "X04")
    assert "chatters" in error.text and error.count > 0
    pt.tune.relay(simulated(hysteresis=0.3, noise_sd=noise))


def test_an_oscillation_that_changes_is_refused():
    rng = np.random.default_rng(1)
    u = rng.choice([-1.0, 2.0], 100).repeat(10)
    assert refused(pt.Record(u=u, y=PLANT.simulate(u, Ts=0.05), Ts=0.05), "X07").count > 0


def test_an_output_that_does_not_follow_is_refused():
    rec = simulated()
    y = np.random.default_rng(1).normal(size=rec.N)
    refused(pt.Record(u=rec.u, y=y, Ts=rec.Ts), "M12")


def test_several_columns_are_refused():
    u, y = np.zeros((99, 2)), np.zeros(99)
    u[::9] = 1.0
    refused(pt.Record(u=u, y=y, Ts=1.0), "U01")


def test_an_output_that_drifts_before_the_test_is_no_equilibrium():
    rec = simulated(rest=5.0)
    y = np.array(rec.y[:, 0])
    y[:100] += np.linspace(-1.0, 0.0, 100)
    test = pt.tune.relay(replace(rec, y=y))
    assert test.known == "asymmetry" and "X07" in codes(test)


def test_a_cycle_that_says_little_says_so():
    plant = pt.models.ProcessModel(K=2.0, T=10.0, L=1.0)
    test = pt.tune.relay(simulated(plant, hysteresis=0.1))
    (note,) = [note for note in test.notes if note.code == "X02"]
    assert note.measured > note.limit and "rest" in note.remedy
    assert "X02" not in codes(pt.tune.relay(simulated(plant, hysteresis=0.1, rest=5.0)))


def test_of_several_segments_the_longest_is_inverted():
    one, two = simulated(t_end=20.0), simulated(t_end=60.0, rest=5.0)
    both = pt.Record(u=np.r_[one.u, two.u], y=np.r_[one.y, two.y], Ts=one.Ts, starts=[0, one.N])
    test = pt.tune.relay(both)
    assert test.t[0] >= one.N * one.Ts and test.known == "rest"
    assert theta(test) == approx(theta(PLANT), rel=1e-5)


def test_limits_that_differ_are_said():
    assert any(
        "X05" in note.text for note in pt.tune.relay(simulated(), limits=pt.Limits(X05=0.3)).notes
    )


def test_the_simulated_relay_switches_beyond_its_thresholds():
    for K in (2.0, -2.0):
        rec = simulated(pt.models.ProcessModel(K=K, T=3.0, L=1.03), noise_sd=0.1, seed=3, rest=1.0)
        u, ahead = rec.u[:, 0], np.sign(K) * (rec.y[:, 0] - 5.0)  # 19 rows at rest
        assert (u[:19] == 0.0).all() and u[19] in (-1.0, 2.0)
        below, above = ahead[19:] < -0.3, ahead[19:] > 0.3
        assert (u[19:][below] == 2.0).all() and (u[19:][above] == -1.0).all()
        assert (np.diff(u[19:])[~(below | above)[1:]] == 0).all()


WRONG = {
    "high": -2.0,
    "hysteresis": -0.1,
    "Ts": 0.0,
    "t_end": -1.0,
    "noise_sd": -1.0,
    "rest": -1.0,
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_relay_that_cannot_be_simulated_is_refused(wrong):
    with pytest.raises(pt.UsageError) as caught:
        simulated(**{wrong: WRONG[wrong]})
    assert caught.value.code == "U01"
