"""Refined instruments: the plant back, the oracle's numbers, and those of `process`."""

import numpy as np
import pytest
from pytest import approx
from scipy.stats import norm

import plantune as pt
from oracles import fopdt, srivc

OP1 = np.array([-5.939, 0.1491, 0.107])  # K, T, L of METHODS 2.2, Ts 0.02
SECOND = pt.models.TransferFunction([0.3, 2.0], [0.0225, 0.12, 1.0], L=0.107)


def op1(seed, sd=2.0, N=1200, L=OP1[2], amplitude=4.5):
    """Rows behind 200 of run-in; white noise on the output."""
    u = amplitude * fopdt.hold_input(N + 200, 10, seed)
    y = pt.models.ProcessModel(K=OP1[0], T=OP1[1], L=L).simulate(u, Ts=0.02)
    e = np.random.default_rng(1000 + seed).normal(size=N)
    return pt.Record(u=u[200:], y=y[200:] + 583.451 + sd * e, Ts=0.02)


def second(seed, sd, N=700):
    u = fopdt.hold_input(N + 100, 8, seed)
    y = SECOND.simulate(u, Ts=0.02)[100:] + 4.0
    return pt.Record(u=u[100:], y=y + sd * np.random.default_rng(seed).normal(size=N), Ts=0.02)


@pytest.mark.parametrize("L", [0.0, 0.1, 0.107, 0.119])
def test_without_noise_the_plant_comes_back(L):
    fit = pt.estimate.srivc(op1(0, sd=0.0, L=L), 1, L=(0.0, 0.4))
    assert fit.names == ("K", "T", "L") and fit.status == "converged"
    assert fit.theta == approx([OP1[0], OP1[1], L], rel=1e-6, abs=1e-6)  # y is no straight line
    assert fit.offset[0] == approx(583.451, abs=1e-4)
    assert fit.model.same_as(pt.models.ProcessModel(*fit.theta))


def test_a_second_order_with_a_zero_comes_back():
    fit = pt.estimate.srivc(second(0, 0.0), 2, 2)
    assert fit.names == ("a1", "a2", "b0", "b1", "L")
    assert fit.theta == approx([0.12, 0.0225, 2.0, 0.3, 0.107], rel=1e-6)
    assert (fit.model.den, fit.model.num) == (approx([0.0225, 0.12, 1.0]), approx([0.3, 2.0]))
    assert fit.offset[0] == approx(4.0, abs=1e-6)


def test_a_third_order_comes_back():
    plant = pt.models.TransferFunction([2.0], [0.006, 0.11, 0.6, 1.0], L=0.25)
    u = fopdt.hold_input(1500, 12, 3)
    rec = pt.Record(u=u[100:], y=plant.simulate(u, Ts=0.05)[100:], Ts=0.05)
    fit = pt.estimate.srivc(rec, 3)
    assert fit.theta == approx([0.6, 0.11, 0.006, 2.0, 0.25], rel=1e-5)


def test_the_oracle_finds_the_same():
    rec = op1(1, sd=1.0, N=600, amplitude=5.0)
    fit = pt.estimate.srivc(rec, 1, L=(0.0, 0.3))

    def at(L):
        return srivc.at_delay(rec.u[:, 0], rec.y[:, 0], 0.02, 1, 1, L, np.array([0.2]))

    ref = at(fit.theta[2])
    off = (fit.theta[:2] - [ref.b[0], ref.a[0]]) / fit.sd[:2]
    assert np.abs(off).max() < 0.02  # the oracle begins a row earlier
    assert fit.loss == approx(ref.loss, rel=1e-3)
    assert ref.loss < min(at(fit.theta[2] - 0.002).loss, at(fit.theta[2] + 0.002).loss)


def test_srivc_and_process_agree_on_op1():
    """Two ways to the same numbers: within a part of their deviation, and bias below 0.5 %."""
    off, apart, z = [], [], []
    for seed in range(15):
        rec = op1(seed)
        fit = pt.estimate.srivc(rec, 1, L=(0.0, 0.4))
        other = pt.estimate.process(rec, "P1D", L=(0.0, 0.4))
        assert fit.status == "converged"
        off.append(fit.theta / OP1 - 1)
        apart.append((fit.theta - other.theta) / other.sd)
        z.append((fit.theta - OP1) / fit.sd)
        assert fit.sd == approx(other.sd, rel=0.25)
    # Rows of history differ between the two, and the kinks of the loss in L pull at both.
    assert np.abs(apart).max() < 0.7
    assert (np.abs(np.mean(off, axis=0)) < 0.005).all()
    assert (np.std(off, axis=0) < [0.006, 0.012, 0.010]).all()
    assert (np.std(z, axis=0) > 0.6).all() and (np.std(z, axis=0) < 1.4).all()


@pytest.mark.slow
def test_bands_of_a_second_order_cover():
    truth = np.array([0.12, 0.0225, 2.0, 0.3, 0.107])
    inside = []
    for seed in range(300):
        fit = pt.estimate.srivc(second(seed, 0.3), 2, 2, L=(0.0, 0.3))
        inside.append(np.abs(fit.theta - truth) < norm.ppf(0.975) * fit.sd)
    share = np.mean(inside, axis=0)
    assert (share > 0.90).all() and (share < 0.985).all()


def test_scales_follow_the_units():
    rec = second(1, 0.1)
    fit = pt.estimate.srivc(rec, 2)
    other = pt.Record(u=1e3 * rec.u - 7, y=1e-4 * rec.y, Ts=20.0)
    scaled = pt.estimate.srivc(other, 2)
    unit = np.array([1e3, 1e6, 1e-7, 1e3])
    assert scaled.theta == approx(unit * fit.theta, rel=1e-5)
    assert scaled.sd == approx(unit * fit.sd, rel=1e-4)


def test_the_offset_varies_as_other_levels_say():
    """A shift of u by v changes O by -K v: its deviation follows from P."""
    rec = op1(3)
    a = pt.estimate.srivc(rec, 1, L=(0.0, 0.3))
    b = pt.estimate.srivc(pt.Record(u=rec.u + 2.0, y=rec.y, Ts=0.02), 1, L=(0.0, 0.3))
    g = np.array([-2.0, 0.0, 0.0, 1.0])
    assert b.offset[0] == approx(a.offset[0] - 2.0 * a.theta[0], abs=1e-4)
    assert b.offset_sd == approx(np.sqrt(g @ a.P @ g), rel=1e-3)


def test_segments_and_holes_have_states_of_their_own():
    a, b = op1(0, sd=0.0, N=500), op1(1, sd=0.0, N=400)
    fit = pt.estimate.srivc(pt.Record.join([a, b]), 1, L=(0.0, 0.3))
    assert fit.theta == approx(OP1, rel=1e-5)
    valid = np.ones(500, bool)
    valid[200:215] = False
    holed = pt.Record(u=a.u, y=np.where(valid, a.y[:, 0], np.nan), Ts=0.02, valid=valid)
    fit = pt.estimate.srivc(holed, 1, L=(0.0, 0.3))
    assert fit.theta == approx(OP1, rel=1e-5)
    assert fit.N < 485


def test_its_fits_are_values_like_others():
    fit = pt.estimate.srivc(second(2, 0.2), 2, 2, L=(0.0, 0.3))
    verdict = pt.validate.check(second(3, 0.2), fit)
    assert verdict.passed and verdict.fit > 85
    assert "s + 2.00" in str(fit) and "e^(-0.10" in str(fit)
    low, high = pt.tune.step_band(fit, [0.5, 1.0])
    assert (low < fit.model.step([0.5, 1.0])).all() and (fit.model.step([0.5, 1.0]) < high).all()
    (low, high), _ = pt.tune.bode_band(fit, [3.0])
    assert low[0] < abs(fit.model.freqresp([3.0])[0]) < high[0]
    assert pt.plot.step(fit) and pt.plot.bode(fit)


def test_unrelated_signals_are_no_plant():
    for seed in range(6):
        rng = np.random.default_rng(seed)
        e = rng.normal(size=500)
        y = e if seed % 2 else np.cumsum(e)
        with pytest.raises(pt.NotIdentifiable) as refused:
            pt.estimate.srivc(pt.Record(u=fopdt.hold_input(500, 8, seed), y=y, Ts=0.1), 1)
        assert refused.value.code == "X04"


def test_refusals():
    rec = op1(0)
    two = pt.Record(u=np.column_stack([rec.u, rec.u[::-1]]), y=rec.y, Ts=0.02)
    short = pt.Record(u=np.arange(10) % 3, y=rec.y[:10], Ts=0.02)
    wave = pt.Record(u=np.sin(0.2 * np.arange(600)), y=np.sin(0.2 * np.arange(600) - 1), Ts=0.1)
    cases = [
        ("X01", pt.Record(u=np.ones(1200), y=rec.y, Ts=0.02), (1,), {}),
        ("X02", wave, (2,), {}),
        ("X03", short, (2,), {"L": (0.0, 0.06)}),
        ("X05", rec, (1,), {"L": (0.0, 20.0)}),
        ("U01", rec, (1,), {"L": (0.3, 0.1)}),
        ("U01", rec, (0,), {}),
        ("U01", rec, (5,), {}),
        ("U01", rec, (2, 3), {}),
        ("U01", two, (1,), {}),
    ]
    for code, given, orders, further in cases:
        with pytest.raises(pt.PlantuneError) as refused:
            pt.estimate.srivc(given, *orders, **further)
        assert refused.value.code == code, (code, orders)


def test_a_delay_at_the_end_of_the_range_is_doubted():
    fit = pt.estimate.srivc(op1(0), 1, L=(0.0, 0.06))
    assert "X05" in [note.code for note in fit.notes]


def test_a_reference_is_a_warning_of_closed_loop():
    fit = pt.estimate.srivc(pt.datasets.engine_loop(noise_var=1.5), 1, L=(0.0, 0.3))
    assert "X09" in [note.code for note in fit.notes]
    without = pt.estimate.srivc(op1(0), 1, L=(0.0, 0.3))
    assert without.notes == ()
