"""N01 and N02 of BAD_INPUTS.md: large offsets and any units give the same model."""

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
