"""check finds feedback (X09), change (M07) and noisy regressors (V08) without being asked."""

import numpy as np
import pytest
from scipy.signal import lfilter

import plantune as pt
from contract.records import codes
from plantune.datasets import printer_motor

PLANTS = {
    "first": ([0, 0.3], [1, -0.85]),
    "second": ([0, 0.05, 0.04], [1, -1.4, 0.49]),
    "resonant": ([0, 0.1, 0.1], [1, -1.6, 0.8]),
}
NOISES = {
    "at the output": lambda e, a: e,
    "through the plant": lambda e, a: lfilter([1], a, e),
    "slow": lambda e, a: lfilter([1], [1, -0.8], e),
}


def held(rng, N):
    return np.repeat(rng.choice([-1.0, 1.0], N // 8 + 1), 8)[:N]


def open_loop(plant, noise, seed, N=1000, after=1.0):
    """Simulate a plant whose input counts `after` times as much in the second half."""
    rng = np.random.default_rng([seed, len(plant), len(noise)])
    b, a = PLANTS[plant]
    u = held(rng, N + 200)
    factor = np.where(np.arange(N + 200) < 200 + N // 2, 1.0, after)
    y, v = lfilter(b, a, factor * u), NOISES[noise](rng.normal(size=N + 200), a)
    y += 0.2 * np.std(y) / np.std(v) * v
    return pt.Record(u=u[200:], y=y[200:] + 3, Ts=1.0)


def loop(seed, N=1200, c=0.0):
    """Simulate a first-order plant under a PI controller; noise 1 + c q^-1 of the equation."""
    rng = np.random.default_rng([seed, 5])
    r = np.repeat(rng.choice([-1.0, 1.0], N // 20), 20)
    e, u, y, integral = rng.normal(size=N), np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        y[k] = (0.85 * y[k - 1] + 0.3 * u[k - 1] + 0.3 * c * e[k - 1] if k else 0.0) + 0.3 * e[k]
        integral += 0.1 * (r[k] - y[k])
        u[k] = 0.8 * (r[k] - y[k]) + integral
    return pt.Record(u=u, y=y, Ts=1.0)


def judged(rec, estimate):
    est, val = rec.split(0.5)
    return pt.validate.check(val, estimate(est))


def oe(rec):
    return pt.estimate.oe(rec, 1, 1, 1)


def arx(rec):
    return pt.estimate.arx(rec, 1, 1, 1)


@pytest.mark.parametrize("estimate", [oe, pt.estimate.process])
def test_x09_is_said_of_fits_without_noise_model(estimate):
    for seed in range(15):
        verdict = judged(loop(seed), estimate)
        (note,) = [note for note in verdict.notes if note.code == "X09"]
        assert note.severity == "warning" and note.measured < note.limit
        assert "no noise model" in note.text and "ARMAX" in note.remedy


def test_x09_is_said_of_a_noise_model_that_is_not_true_only():
    """An ARX of noise 1 + 0.9 q^-1 has coloured errors in three records of four."""
    said = 0
    for seed in range(20):
        assert "X09" not in codes(judged(loop(seed), arx))
        wrong = codes(judged(loop(seed, c=0.9), arx))
        assert ("X09" in wrong) == ("M08" in wrong)
        said += "X09" in wrong
    assert said >= 8


def test_a_process_model_with_noise_is_free_of_x09():
    est, _ = loop(1).split(0.5)
    fit = pt.estimate.process(est, "P1D", noise="arma")
    assert "X09" not in codes(pt.validate.check(loop(1).split(0.5)[1], fit))


def test_an_answer_in_the_same_row_is_no_feedback():
    """With a direct term u(t) moves with e(t) of any model that begins at u(t-1)."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        u = lfilter([1], [1, -0.9], rng.normal(size=1200))
        y = lfilter([0.5, 0.2], [1, -0.7], u) + 0.1 * rng.normal(size=1200)
        rec = pt.Record(u=u, y=y, Ts=1.0)
        assert not pt.validate.closed_loop(rec, direct=True)
        assert "X09" not in codes(judged(rec, lambda est: pt.estimate.oe(est, 2, 1, 0)))
    assert all(pt.validate.closed_loop(loop(seed), direct=True).p[0] < 1 for seed in range(3))


def test_rounding_answers_nothing():
    est, val = pt.datasets.engine_loop().split(0.5)
    assert pt.validate.check(val, pt.estimate.process(est)).notes == ()


@pytest.mark.parametrize("runs", [8, pytest.param(120, marks=pytest.mark.slow)])
def test_false_alarms_are_one_in_a_hundred(runs):
    """Of nine kinds of open-loop records, OE of the true order; three deviations allowed."""
    count = {"X09": 0, "M07": 0}
    for plant in PLANTS:
        for noise in NOISES:
            for seed in range(runs):
                n = len(PLANTS[plant][0]) - 1
                verdict = judged(
                    open_loop(plant, noise, seed), lambda est, n=n: pt.estimate.oe(est, n, n, 1)
                )
                for code in count:
                    count[code] += code in codes(verdict)
    most = 0.01 * 9 * runs
    assert max(count.values()) <= most + 3 * np.sqrt(most)


def test_m07_a_change_is_said_with_its_time():
    for seed in range(10):
        rec = open_loop("first", "at the output", seed, after=2.0)
        (note,) = [n for n in pt.validate.check(rec, oe(rec)).notes if n.code == "M07"]
        assert note.where.time == pytest.approx(500, abs=30)


def test_the_job_says_once_when_the_plant_changed():
    run = pt.job.run(open_loop("first", "at the output", 3, after=1.6))
    (note,) = [note for note in run.all_notes() if note.code == "M07"]
    assert note.where.time == pytest.approx(500, abs=30)
    assert note in run.notes


@pytest.mark.parametrize("runs", [5, pytest.param(60, marks=pytest.mark.slow)])
def test_v08_is_said_of_noise_in_the_regressor(runs):
    for seed in range(runs):
        est, val = printer_motor(noise_var=1.0, seed=seed).split(0.5)
        verdict = pt.validate.check(val, pt.estimate.arx(est, 2, 2))
        (note,) = [n for n in verdict.notes if n.code == "V08"]
        assert note.measured > note.limit == 1.1
        assert "never y alone" in note.remedy and "OE" in note.remedy
        assert "V08" not in codes(pt.validate.check(val, pt.estimate.oe(est, 2, 2)))


@pytest.mark.parametrize("runs", [8, pytest.param(120, marks=pytest.mark.slow)])
def test_v08_is_not_said_of_true_arx(runs):
    alarms = 0
    for plant, (b, _) in PLANTS.items():
        n = len(b) - 1
        for seed in range(runs):
            rec = open_loop(plant, "through the plant", seed)
            verdict = judged(rec, lambda est, n=n: pt.estimate.arx(est, n, n, 1))
            alarms += "V08" in codes(verdict)
    assert alarms <= 0.01 * 3 * runs


def test_two_inputs_are_named_in_v06_and_v07():
    a, b = [-0.5342, -0.3999], [-3.4524, 3.5661]
    two = pt.models.PolyModel(A=[1, *a], B=[[0.1, 0.05], b], nk=[1, 1], Ts=1.0)
    zero, pole = (
        next(n for n in pt.validate.plausible(two, inputs=["heat", "flow"]) if n.code == code)
        for code in ("V06", "V07")
    )
    assert zero.text.startswith("from flow: a zero") and zero.where.column == "flow"
    assert pole.text.startswith("a pole")  # inputs share those of A
    assert pt.validate.plausible(two)[-1].code == "V08"
    (unnamed,) = [n for n in pt.validate.plausible(two) if n.code == "V06"]
    assert unnamed.text.startswith("from input 2: ")
