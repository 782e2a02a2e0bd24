"""The shipped records hold the numbers of their sources, and the simulated loop its equations."""

import math

import numpy as np
import pytest
from pytest import approx
from scipy.signal import cont2discrete

import plantune as pt
from plantune.datasets import (
    DRIVES,
    ENGINE_LOOP,
    PRINTER_MOTOR,
    engine_loop,
    hair_dryer,
    printer_motor,
    robot_arm,
)


@pytest.mark.parametrize(
    ("make", "file", "N"),
    [
        (hair_dryer, "hair_dryer/slicot_IB01AD.dat", 1000),
        (robot_arm, "robot_arm/slicot_IB03AD.dat", 1024),
    ],
)
def test_measured_records_hold_the_numbers_of_their_source(data, make, file, N):
    """The same example files, stored beside the repository: title, parameters, N u, N y."""
    folder, name = file.split("/")
    lines = (data(folder) / name).read_text().splitlines()[2:]
    numbers = np.array([float(cell) for line in lines for cell in line.split()])
    rec = make()
    assert np.array_equal(rec.u[:, 0], numbers[:N])
    assert np.array_equal(rec.y[:, 0], numbers[N : 2 * N])


def test_hair_dryer():
    rec = hair_dryer()
    assert (rec.Ts, rec.N, rec.u_names, rec.y_names) == (0.08, 1000, ("power",), ("temp",))
    assert dict(rec.units) == {"power": "V", "temp": "V"}
    assert set(np.unique(rec.u)) == {3.41, 6.41}


def test_robot_arm_says_that_its_sampling_time_is_not_known():
    rec = robot_arm()
    assert (rec.Ts, rec.N, rec.units["time"]) == (1.0, 1024, "sample")
    assert "does not state the sampling time" in rec.log[-1]


def recursion(u, u0, K, T, offset, lag, Ts):
    """`x' = (K v - x)/T` with `v = u(t - lag Ts)` held: exact for a delay of whole samples."""
    a = math.exp(-Ts / T)
    x, y = K * u0, []
    for k in range(len(u)):
        y.append(x + offset)
        x = a * x + K * (1 - a) * (u[k - lag] if k >= lag else u0)
    return np.array(y)


@pytest.mark.parametrize("lag", [0, 1, 5])
def test_engine_loop_obeys_plant_and_controller(lag):
    rec = engine_loop(L=0.02 * lag, t_end=20.0)
    u, y, r = rec.u[:, 0], rec.y[:, 0], rec.r[:, 0]
    u0 = (400 - ENGINE_LOOP.offset) / ENGINE_LOOP.K
    K, T, _, offset = ENGINE_LOOP
    # 1e-9 of 400: rounding over 1000 steps
    assert y == approx(recursion(u, u0, K, T, offset, lag, 0.02), rel=1e-9)
    e = r - y
    integral = u0 - 0.3385 * 0.02 * np.cumsum(e)  # backward Euler
    assert u == approx(-0.018 * e + integral, rel=1e-9)


def test_engine_loop_begins_in_equilibrium_and_follows_a_switching_set_point():
    rec = engine_loop()
    assert rec.y[0, 0] == approx(400.0) and rec.N == 3000 and rec.Ts == 0.02
    assert set(np.unique(rec.r)) == {350.0, 450.0}
    switches = np.flatnonzero(np.diff(rec.r[:, 0])) + 1
    assert (switches % 15 == 0).all() and len(switches) > 50
    assert 350 < rec.y.mean() < 450


def test_engine_loop_noise_is_white_and_passes_the_controller():
    noisy = engine_loop(noise_var=1.5, seed=7)
    u = noisy.u[:, 0]
    u0 = (400 - ENGINE_LOOP.offset) / ENGINE_LOOP.K
    noise = noisy.y[:, 0] - recursion(u, u0, *ENGINE_LOOP[:2], ENGINE_LOOP.offset, 5, 0.02)
    drawn = np.random.default_rng(7).normal(0.0, 1.5**0.5, noisy.N)
    assert noise == approx(drawn, abs=1e-8)
    e = noisy.r[:, 0] - noisy.y[:, 0]
    assert u == approx(-0.018 * e + u0 - 0.3385 * 0.02 * np.cumsum(e), rel=1e-9)


def test_engine_loop_is_repeatable_and_its_seed_counts():
    assert engine_loop(1.5, seed=3).same_as(engine_loop(1.5, seed=3))
    assert not np.array_equal(engine_loop(seed=3).r, engine_loop(seed=4).r)


def test_engine_loop_takes_a_fractional_dead_time():
    whole, more = engine_loop(L=0.1), engine_loop(L=0.107)
    assert 0 < np.abs(whole.y - more.y).max() < 20
    assert engine_loop(L=0.1 + 1e-9).y == approx(whole.y, abs=1e-4)


@pytest.mark.parametrize(
    "wrong",
    [{"noise_var": -1.0}, {"seed": -1}, {"t_end": 0.0}, {"hold": 0.31}, {"hold": 0.0}],
)
def test_engine_loop_refuses_arguments_out_of_range(wrong):
    with pytest.raises(pt.UsageError, match=next(iter(wrong))) as caught:
        engine_loop(**wrong)
    assert caught.value.code == "U01" and str(caught.value).count("\n") <= 2


def test_engine_loop_refuses_a_negative_dead_time():
    with pytest.raises(pt.PlantuneError):
        engine_loop(L=-0.1)


@pytest.mark.parametrize("order", [2, 3])
def test_printer_motor_samples_its_lags(order):
    """Against scipy's zero-order hold."""
    truth = PRINTER_MOTOR.model(order)
    lags = [PRINTER_MOTOR.Tm, PRINTER_MOTOR.Te, PRINTER_MOTOR.Tb][:order]
    denominator = [1.0]
    for T in lags:
        denominator = np.polymul(denominator, [T, 1.0])
    b, a, _ = cont2discrete(([PRINTER_MOTOR.K], denominator), PRINTER_MOTOR.Ts)
    assert approx(a, abs=1e-12) == truth.A
    assert approx(b[0][1:], abs=1e-12) == truth.B and truth.nk == 1
    assert truth.dc_gain() == approx(1.8) and truth.poles().real.max() == approx(0.96, abs=1e-3)


@pytest.mark.parametrize("kind", DRIVES)
def test_printer_motor_without_noise_is_its_truth(kind):
    rec = printer_motor(kind, resolution=0.0)
    assert (rec.N, rec.Ts, rec.u_names, rec.y_names) == (2000, 0.002, ("voltage",), ("speed",))
    assert np.array_equal(rec.y[:, 0], PRINTER_MOTOR.model().simulate(rec.u))
    assert np.abs(rec.u).max() == approx(12.0, rel=1e-3) and rec.y[0, 0] == 0
    for half in rec.split(0.5):
        assert np.ptp(half.u) > 10


def test_printer_motor_is_read_by_an_encoder():
    rec = printer_motor()
    exact = printer_motor(resolution=0.0)
    counts = rec.y / PRINTER_MOTOR.resolution
    assert counts == approx(np.round(counts), abs=1e-12)
    assert np.abs(rec.y - exact.y).max() <= PRINTER_MOTOR.resolution / 2 + 1e-12


def test_printer_motor_noise_is_where_it_says():
    """On the speed, or on the right side of A y = B u + e; 2 % is three standard errors."""
    truth, n = PRINTER_MOTOR.model(), 20.0
    exact = printer_motor(resolution=0.0, t_end=n)
    noisy = printer_motor(resolution=0.0, noise_var=2.0, seed=0, t_end=n)
    assert np.var(noisy.y - exact.y) == approx(2.0, rel=0.05)
    driven = printer_motor(resolution=0.0, equation_var=2.0, seed=0, t_end=n)
    e = np.convolve((driven.y - exact.y)[:, 0], truth.A)[: exact.N]
    assert np.var(e) == approx(2.0, rel=0.05) and abs(np.mean(e[1:] * e[:-1])) < 0.1
    again = printer_motor(resolution=0.0, equation_var=2.0, seed=0, t_end=n)
    assert again.same_as(driven)


@pytest.mark.parametrize(
    "wrong",
    [
        {"kind": "saw"},
        {"order": 4},
        {"noise_var": -1.0},
        {"equation_var": -1.0},
        {"resolution": -0.1},
        {"seed": -1},
        {"t_end": 0.0},
        {"t_end": math.inf},
    ],
)
def test_printer_motor_refuses_what_it_cannot_simulate(wrong):
    with pytest.raises(pt.UsageError) as refusal:
        printer_motor(**wrong)
    assert refusal.value.code == "U01"
