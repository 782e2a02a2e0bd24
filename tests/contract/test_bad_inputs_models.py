"""M01, M02, M08 and X10 of BAD_INPUTS.md: integrating and unstable plants, coloured errors."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import TS, b0, codes, levels, plantune, record, refused, strict_json, write

COLUMNS = ["--u", "u", "--y", "y"]
K = np.arange(1000)


def first_order(pole, seed=1, N=1000, feedback=0.0, sd=0.02):
    """y[k] = pole y[k-1] + 0.5 u[k-1] + e[k]; with feedback -C y[k] is added to the levels."""
    rng = np.random.default_rng([seed, 3])
    r, u, y = levels(N, seed), np.zeros(N), np.zeros(N)
    for k in range(N):
        y[k] = (pole * y[k - 1] + 0.5 * u[k - 1] if k else 0.0) + sd * rng.normal()
        u[k] = r[k] - feedback * y[k]
    return record(u, y)


VERBS = {
    "arx": lambda rec: pt.estimate.arx(rec, 1, 1, 1),
    "oe": lambda rec: pt.estimate.oe(rec, 1, 1, 1),
    "armax": lambda rec: pt.estimate.armax(rec, 1, 1, 1, 1),
    "iv4": lambda rec: pt.estimate.iv4(rec, 1, 1, 1),
}


def said(fit, code):
    return [note for note in fit.notes if note.code == code and note.severity == "warning"]


# --- M01 ---


def summed(seed, pole=1.0, N=1000):
    """The same plant with white noise on the output, as output-error models have it."""
    rec = first_order(pole, seed, N, sd=0.0)
    return record(rec.u, rec.y[:, 0] + 0.3 * np.random.default_rng([seed, 4]).normal(size=N))


INTEGRATING = {name: verb for name, verb in VERBS.items() if name != "oe"}


@pytest.mark.parametrize("verb", INTEGRATING.values(), ids=INTEGRATING)
def test_m01_an_integrating_plant_is_named_and_no_gain_quoted(verb):
    """Within 1.96 deviations: of 10, at least 8."""
    named = 0
    for seed in range(10):
        fit = verb(first_order(1.0, seed))
        for note in said(fit, "M01"):
            assert "no steady-state gain" in note.text
            assert note.measured < note.limit == approx(1.96, abs=0.01)
            assert fit.derived().names == ("slope",)
            slope, sd = fit.derived()["slope"]
            assert abs(slope - 0.5 / TS) < 4 * sd < 0.3
            named += 1
    assert named >= 8


@pytest.mark.slow
@pytest.mark.parametrize("verb", INTEGRATING.values(), ids=INTEGRATING)
def test_m01_integrators_are_named_in_95_of_100(verb):
    """Counted on 200 seeds, less two standard deviations of the count."""
    assert sum(bool(said(verb(first_order(1.0, seed)), "M01")) for seed in range(200)) >= 184


def test_m01_output_error_models_stop_at_the_border_and_say_so():
    """F is kept stable, so that its pole lies just below 1: integrating, or not shown whole."""
    for seed in range(10):
        fit = pt.estimate.oe(summed(seed), 1, 1, 1)
        assert said(fit, "M01") or said(fit, "X07")


def test_m01_holds_without_noise():
    fit = pt.estimate.arx(first_order(1.0, sd=0.0), 1, 1, 1)
    assert said(fit, "M01")
    assert fit.derived()["slope"][0] == approx(5.0, rel=1e-9)


@pytest.mark.parametrize("pole", [0.5, 0.9, 0.98])
@pytest.mark.parametrize("verb", VERBS.values(), ids=VERBS)
def test_m01_a_plant_that_settles_is_left_in_peace(verb, pole):
    for seed in range(3):
        fit = verb(first_order(pole, seed))
        assert not said(fit, "M01") and not said(fit, "M02")
        assert fit.derived().names[0] == "K"


def test_m01_a_cancelling_pole_does_not_hide_a_known_gain():
    """Second order asked of a first-order plant: K is known, whatever the second pole."""
    for seed in range(10):
        fit = pt.estimate.oe(record(*b0(seed=seed)), 2, 2, 1)
        assert not said(fit, "M01")
        assert fit.derived()["K"][0] == approx(2.5, rel=0.02)


@pytest.mark.parametrize("of", [first_order, lambda pole, seed: summed(seed, pole)])
def test_m01_the_main_job_names_it_and_does_not_tune(tmp_path, of):
    for seed in range(4):
        rec = of(1.0, seed)
        error = refused(lambda rec=rec: pt.job.run(rec), "M01", ("where",))
        assert "P0DI" in error.remedy and error.result.tunings == ()
    path = write(tmp_path / "a.csv", rec.u[:, 0], rec.y[:, 0])
    done = plantune("tune", path, *COLUMNS, "--out", tmp_path / "out", "--json")
    assert done.exit_code == 3
    assert strict_json(done.stdout)["error"]["code"] == "M01"


def test_m01_tuning_goes_by_integrating_rules():
    fit = pt.estimate.process(first_order(1.0), "P0I")
    assert "M01" in codes(fit)
    refused(lambda: pt.tune.imc_pi(fit, gain_margin=3.0), "M01", ("remedy",))
    assert pt.tune.simc(fit, tau_c=1.0).margins.stable


# --- M02 ---


@pytest.mark.parametrize("verb", [VERBS["arx"], VERBS["armax"]], ids=["arx", "armax"])
def test_m02_an_unstable_plant_is_estimated_with_a_warning(verb):
    for seed in range(5):
        fit = verb(first_order(1.15, seed, feedback=0.8))
        assert (np.abs(fit.theta[:2] - [-1.15, 0.5]) < 4 * fit.sd[:2]).all()
        (note,) = said(fit, "M02")
        assert "unstable" in note.text and note.measured == approx(1.15, abs=0.01)


def test_m02_a_simulation_that_overflows_is_refused_by_name():
    model = pt.models.PolyModel(A=[1, -1.15], B=[0.5], nk=1, Ts=TS)
    assert np.isfinite(model.simulate(np.ones(2000))).all()
    error = refused(lambda: model.simulate(np.ones(10_000)), "M02", ("count", "measured", "limit"))
    assert "1.15" in error.text
    assert np.isfinite(model.simulate(np.ones(int(error.limit)))).all()
    fit = pt.estimate.arx(first_order(1.15, feedback=0.8), 1, 1, 1)
    refused(lambda: fit.simulate(np.ones(10_000)), "M02", ("count", "measured", "limit"))


def test_m02_a_stable_model_never_is():
    assert np.isfinite(pt.models.PolyModel(A=[1, -0.99], B=[1e3], Ts=TS).simulate(K + 1.0)).all()


def test_m02_a_verdict_is_by_one_step_predictions():
    est, val = first_order(1.15, feedback=0.8).split(0.5)
    verdict = pt.validate.check(val, pt.estimate.arx(est, 1, 1, 1))
    assert verdict.passed and verdict.fit == verdict.fit_1step > 90
    assert said(verdict, "M02")
    assert np.isfinite(verdict.yhat).all()


def test_m02_the_main_job_does_not_tune_such_a_plant():
    needs = ("measured", "limit")
    error = refused(lambda: pt.job.run(first_order(1.15, feedback=0.8)), "M02", needs)
    assert error.result.tunings == ()
    assert "M02" in codes(error.result)


# --- M08 ---


def disturbed(kind, seed=1):
    u, y = b0(seed=seed)
    if kind == "wave":
        y = y + 0.2 * np.sin(2 * np.pi * 1.3 * TS * K + seed)
    if kind == "load at 60 %":
        y = y + np.where(K < 600, 0.0, 0.5 * (1 - 0.8 ** np.maximum(K - 600, 0)))
    return record(u, y)


@pytest.mark.parametrize("verb", [VERBS["oe"], pt.estimate.process], ids=["oe", "process"])
def test_m08_a_periodic_disturbance_is_named_with_its_frequency(verb):
    for seed in range(5):
        est, val = disturbed("wave", seed).split(0.5)
        (note,) = said(pt.validate.check(val, verb(est)), "M08")
        assert "lag" in note.text
        w = float(note.text.split(" rad/s")[0].split()[-1])
        assert w == approx(2 * np.pi * 1.3, rel=0.01)
        assert "a period of 0.76" in note.text


def test_m08_the_alias_of_the_mains_is_named():
    """50 Hz sampled at 80 ms: 4 whole periods a row, the alias is at 0; at 83 ms 1.81 Hz."""
    Ts = 0.083
    y = b0()[1] + 0.3 * np.sin(2 * np.pi * 50 * Ts * K)
    est, val = record(y=y, Ts=Ts).split(0.5)
    (note,) = said(pt.validate.check(val, pt.estimate.oe(est, 1, 1, 1)), "M08")
    alias = abs(50 - round(50 * Ts) / Ts)
    assert float(note.text.split(" rad/s")[0].split()[-1]) == approx(2 * np.pi * alias, rel=0.01)


def test_m08_colour_without_a_line_names_its_lag_alone():
    e = np.random.default_rng(5).normal(size=1000)
    v = np.zeros(1000)
    for k in range(1, 1000):
        v[k] = 0.9 * v[k - 1] + 0.05 * e[k]
    est, val = record(y=b0()[1] + v).split(0.5)
    (note,) = said(pt.validate.check(val, pt.estimate.oe(est, 1, 1, 1)), "M08")
    assert "most at lag 1" in note.text and "rad/s" not in note.text


@pytest.mark.parametrize("kind", ["wave", "load at 60 %"])
def test_m08_the_gain_is_within_two_deviations_or_there_is_a_warning(tmp_path, kind):
    for seed in range(5):
        run = pt.job.run(disturbed(kind, seed))
        near = abs(run.chosen.theta[0] - 2.5) <= 2 * run.chosen.sd[0]
        warned = {"M08", "V13", "M07"} & {
            n.code for n in run.all_notes() if n.severity == "warning"
        }
        assert near or warned
        assert warned
    rec = disturbed(kind)
    path = write(tmp_path / "a.csv", rec.u[:, 0], rec.y[:, 0])
    done = plantune("tune", path, *COLUMNS, "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.output
    printed = strict_json(done.stdout)
    notes = [n["code"] for v in printed["verdicts"].values() for n in v["notes"]]
    assert {"M08", "V13"} & set(notes)


# --- X10 ---


def test_x10_is_refused_with_the_order_that_is_there():
    rec = record(y=pt.models.PolyModel(A=[1, -0.8], B=[0.5], nk=1, Ts=TS).simulate(b0()[0]))
    error = refused(lambda: pt.estimate.oe(rec, 5, 5, 1), "X10", ("where",))
    assert error.remedy == "ask for nb = 1, nf = 1"
