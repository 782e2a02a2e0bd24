"""N01, N02, N04 to N06 and N08 of BAD_INPUTS.md: what numbers do to a model."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import (
    TRUE_ARX,
    TRUE_P1D,
    b0,
    check_cli_refusal,
    check_refusal,
    levels,
    plantune,
    record,
    strict_json,
    write,
)
from plantune.errors import refusal

U, Y = b0()
OFFSETS = {"y": (0, 1e9), "u": (1e6, 0), "both": (1e6, 1e9), "negative": (-1e6, -1e9)}
SCALES = {
    "small": (1e-12, 1e-12),
    "large": (1e12, 1e12),
    "mixed": (1e-6, 1e6),
    "other": (1e6, 1e-6),
}
EVERY = ("where", "count", "measured", "limit")


def assert_finite(fit):
    """R1: a success has finite numbers and a finite, positive covariance."""
    assert np.isfinite(fit.theta).all()
    assert np.isfinite(fit.P).all()
    assert np.isfinite(fit.sd).all()
    assert (fit.sd > 0).all()
    assert np.isfinite([fit.loss, fit.fpe, fit.aic, fit.bic, *fit.offset]).all()


# --- N01 ---


@pytest.mark.parametrize("offset", OFFSETS.values(), ids=OFFSETS)
def test_n01_arx_is_within_one_percent(offset):
    fit = pt.estimate.arx(record(U + offset[0], Y + offset[1]), 1, 1, 1)
    assert fit.theta == approx(TRUE_ARX, rel=0.01)
    assert_finite(fit)
    K, sd = TRUE_P1D[0], fit.offset_sd
    assert fit.offset[0] == approx(offset[1] - K * offset[0], abs=5 * sd)


@pytest.mark.parametrize("offset", OFFSETS.values(), ids=OFFSETS)
def test_n01_process_is_within_one_percent(offset):
    fit = pt.estimate.process(record(U + offset[0], Y + offset[1]))
    assert fit.theta[:2] == approx(TRUE_P1D, rel=0.01)
    assert fit.theta[2] == approx(0, abs=0.001)  # 1 % of Ts
    assert_finite(fit)
    assert fit.offset[0] == approx(offset[1] - TRUE_P1D[0] * offset[0], abs=5 * fit.offset_sd)


@pytest.mark.parametrize("offset", OFFSETS.values(), ids=OFFSETS)
def test_n01_the_main_job_gives_the_same_settings(offset):
    run = pt.job.run(record(U + offset[0], Y + offset[1]))
    plain = pt.job.run(record())
    assert run.findings["delay"].nk == plain.findings["delay"].nk == 1
    assert run.chosen.theta[:2] == approx(plain.chosen.theta[:2], rel=1e-5)  # y keeps 7 digits
    assert run.tunings[0].controller.Kp == approx(plain.tunings[0].controller.Kp, rel=1e-5)


def test_n01_on_the_command_line(tmp_path):
    path, out = write(tmp_path / "a.csv", U + 1e6, Y + 1e9), tmp_path / "out"
    done = plantune("tune", path, "--u", "u", "--y", "y", "--out", out, "--json")
    assert done.exit_code == 0, done.output
    K, T, _ = strict_json(done.stdout)["chosen"]["theta"]
    assert (K, T) == approx(TRUE_P1D, rel=0.01)


# --- N02 ---


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
def test_n02_arx_has_the_same_dimensionless_parameters(scale):
    fit, plain = (
        pt.estimate.arx(r, 1, 1, 1) for r in (record(U * scale[0], Y * scale[1]), record())
    )
    unit = np.array([1, scale[1] / scale[0]])
    assert fit.theta / unit == approx(plain.theta, rel=1e-9)
    assert fit.sd / unit == approx(plain.sd, rel=1e-9)
    assert fit.loss / scale[1] ** 2 == approx(plain.loss, rel=1e-9)
    assert_finite(fit)


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
def test_n02_process_has_the_same_dimensionless_parameters(scale):
    fit, plain = (pt.estimate.process(r) for r in (record(U * scale[0], Y * scale[1]), record()))
    unit = np.array([scale[1] / scale[0], 1, 1])
    assert fit.theta / unit == approx(plain.theta, rel=1e-9, abs=1e-9)  # L is 0
    assert fit.sd / unit == approx(plain.sd, rel=1e-6)  # from differences near the optimum
    assert_finite(fit)


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
def test_n02_the_main_job_has_the_same_margins(scale):
    run, plain = pt.job.run(record(U * scale[0], Y * scale[1])), pt.job.run(record())
    assert run.findings["delay"].nk == plain.findings["delay"].nk
    a, b = run.tunings[0], plain.tunings[0]
    assert a.controller.Kp * scale[1] / scale[0] == approx(b.controller.Kp, rel=1e-9)
    assert a.controller.Ti == approx(b.controller.Ti, rel=1e-9)
    assert a.margins.Ms == approx(b.margins.Ms, rel=1e-6)
    for name, verdict in run.verdicts.items():
        assert verdict.fit == approx(plain.verdicts[name].fit, rel=1e-9)


@pytest.mark.parametrize("scale", [(1e160, 1e160), (1e160, 1), (1, 1e160)])
def test_n02_1e160_is_refused(tmp_path, scale):
    with pytest.raises(pt.DataError) as caught:
        record(U * scale[0], Y * scale[1])
    check_refusal(caught.value, "D08", EVERY)
    path = write(tmp_path / "a.csv", U * scale[0], Y * scale[1])
    check_cli_refusal(tmp_path, "D08", EVERY, path, "--u", "u", "--y", "y")


EXTREME = {
    "1e140": (1e140, 1e140),
    "1e149": (1e149, 1e149),
    "1e-150": (1e-150, 1e-150),
    "gain 1e280": (1e-140, 1e140),
    "gain 1e-298": (1e149, 1e-149),
}
ESTIMATORS = {"arx": lambda r: pt.estimate.arx(r, 1, 1, 1), "process": pt.estimate.process}


@pytest.mark.parametrize("fit", ESTIMATORS.values(), ids=ESTIMATORS)
@pytest.mark.parametrize("scale", EXTREME)
def test_n02_what_passes_the_door_ends_finite_or_refused(fit, scale):
    a, b = EXTREME[scale]
    try:
        result = fit(record(U * a, Y * b))
    except (pt.NumericsError, pt.DataError):
        return
    assert_finite(result)


@pytest.mark.parametrize("scale", [1e140, 1e-150])
def test_n02_the_check_holds_at_any_scale(scale):
    est, val = record(U * scale, Y * scale).split(0.5)
    assert pt.validate.check(val, pt.estimate.arx(est, 1, 1, 1)).fit > 90


def test_n_codes_leave_with_4():
    error = refusal("N05", "the search did not converge")
    assert isinstance(error, pt.NumericsError)
    assert error.exit_code == 4


# --- N04 ---


def nearly_equal(apart):
    """Two columns that differ by so much."""
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 100))
    return np.column_stack([a, a + apart * b]), a + rng.normal(size=100)


def test_n04_digits_are_said_and_too_few_refused():
    fit = pt.estimate.least_squares(*nearly_equal(1e-6))
    assert (fit.expected_digits > 3).all()
    with pytest.raises(pt.NumericsError) as caught:
        pt.estimate.least_squares(*nearly_equal(5e-14))
    check_refusal(caught.value, "N04", ("measured", "limit"))
    assert caught.value.measured < caught.value.limit == 3.0


# --- N05 ---


def test_n05_a_search_that_stopped_is_no_success():
    """Whatever the orders: a status, a note where it is not converged, and never one without."""
    stopped = 0
    for seed in range(10):
        rec = record(*b0(N=60, seed=seed, sd=0.5))
        for nc, nd, nf in ((4, 4, 4), (6, 6, 6)):
            try:
                fit = pt.estimate.bj(rec, 2, nc, nd, nf, 1)
            except (pt.NotIdentifiable, pt.NumericsError):
                continue
            assert (fit.status == "converged") == ("N05" not in [n.code for n in fit.notes])
            stopped += fit.status != "converged"
    assert stopped >= 1  # so the case occurs


# --- N06 ---

RESONANT = pt.models.PolyModel(B=[1.0, 0.5], F=[1, -1.6, 0.9], nk=1, Ts=1.0)


def resonant(seed, N=500):
    """A plant that rings, damping 0.1, and white noise on it."""
    rng = np.random.default_rng([seed, 6])
    u = rng.choice([-1.0, 1.0], N // 4).repeat(4)
    y = RESONANT.simulate(u)
    return pt.Record(u=u, y=y + 0.5 * y.std() * rng.normal(size=N), Ts=1.0)


def found(seeds):
    """Count on how many records OE reaches the plant's minimum, or says that it did not."""
    count = 0
    for seed in seeds:
        rec = resonant(seed)
        fit = pt.estimate.oe(rec, 2, 2, 1)
        near = np.abs(fit.theta - [1.0, 0.5, -1.6, 0.9]) < 5 * fit.sd
        count += near.all() or "N05" in [n.code for n in fit.notes]
    return count


def test_n06_the_global_minimum_of_a_resonant_plant_is_found():
    assert found(range(20)) >= 19


@pytest.mark.slow
def test_n06_it_is_found_in_95_of_100():
    assert found(range(100)) >= 95


# --- N08 ---

FAMILY = {
    "arx": lambda r: pt.estimate.arx(r, 1, 1, 1),
    "oe": lambda r: pt.estimate.oe(r, 1, 1, 1),
    "iv4": lambda r: pt.estimate.iv4(r, 1, 1, 1),
    "armax": lambda r: pt.estimate.armax(r, 1, 1, 1, 1),
    "bj": lambda r: pt.estimate.bj(r, 1, 1, 1, 1, 1),
    "ararx": lambda r: pt.estimate.ararx(r, 1, 1, 1, 1),
    "ararmax": lambda r: pt.estimate.ararmax(r, 1, 1, 1, 1, 1),
    "poly": lambda r: pt.estimate.poly(r, na=1, nb=1, nf=0, nk=1),
    "process": pt.estimate.process,
}


@pytest.mark.parametrize("verb", FAMILY.values(), ids=FAMILY)
@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_n08_data_without_noise_give_exact_parameters_and_a_word(verb, scale):
    """Where a noise model has nothing to say, its parameters cannot be told: X10 may refuse it."""
    u = levels()
    y = scale * pt.models.PolyModel(A=[1, -0.8], B=[0.5], nk=1, Ts=0.1).simulate(u)
    rec = record(u, y)
    try:
        fit = verb(rec)
    except pt.NotIdentifiable as error:
        assert error.code in ("X10", "X08") and error.remedy
        return
    gain, *_ = fit.derived()["K"]
    assert gain == approx(2.5 * scale, rel=1e-8)
    assert fit.loss <= 1e-16 * scale**2
    assert np.isfinite([fit.fpe, fit.aic, fit.bic]).all()
    assert np.isfinite(fit.P).all()
    if fit.method != "P1D":
        assert "N08" in [note.code for note in fit.notes]
    verdict = pt.validate.check(rec, fit)
    assert verdict.fit > 99.999 and np.isfinite(verdict.residuals.autocorr).all()


@pytest.mark.parametrize("verb", FAMILY.values(), ids=FAMILY)
def test_n08_subnormal_outputs_end_finite_or_refused(verb):
    u = levels()
    y = 1e-310 * pt.models.PolyModel(A=[1, -0.8], B=[0.5], nk=1, Ts=0.1).simulate(u)
    try:
        fit = verb(record(u, y))
    except pt.PlantuneError as error:
        assert error.code in ("N02", "N08", "X04", "X08", "X10")
        return
    assert np.isfinite(fit.theta).all() and np.isfinite(fit.P).all()
