"""X08, X09, X11, X12 and N03 of BAD_INPUTS.md: loops, copies of inputs, signs and units."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import (
    TRUE_P1D,
    b0,
    check_cli_refusal,
    codes,
    levels,
    plantune,
    record,
    refused,
    strict_json,
    write,
)

COLUMNS = ["--u", "u", "--y", "y"]
U, Y = b0()


def loop(seed, C, r=None, N=1000, sd=0.05):
    """The plant of B0 with white equation errors, u = C(past errors of control) plus a dither."""
    rng = np.random.default_rng([seed, 9])
    r = np.zeros(N) if r is None else r
    u, y, integral = np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        if k:
            y[k] = 0.8 * y[k - 1] + 0.5 * u[k - 1] + sd * rng.normal()
        integral += C[1] * (r[k] - y[k])
        u[k] = C[0] * (r[k] - y[k]) + integral
    return record(u, y)


# --- X08: feedback without excitation ---


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("verb", [pt.estimate.arx, pt.estimate.iv4], ids=["arx", "iv4"])
def test_x08_plain_proportional_feedback_is_refused(verb, order):
    for seed in range(3):
        error = refused(lambda s=seed: verb(loop(s, (0.6, 0.0)), order, order, 1), "X08")
        assert error.measured < error.limit == 1e-10
        assert "record with more changes" in error.remedy or "dither" in error.remedy


def test_x08_pi_feedback_from_the_second_order_on_is_refused():
    for seed in range(3):
        rec = loop(seed, (0.6, 0.1))
        refused(lambda rec=rec: pt.estimate.arx(rec, 2, 2, 1), "X08")


def test_x08_minus_one_over_c_is_never_returned_as_a_plant():
    """A PI loop passes the rank test at (1, 1): true within its intervals, with a warning."""
    for seed in range(20):
        fit = pt.estimate.arx(loop(seed, (0.6, 0.1)), 1, 1, 1)
        assert (np.abs(fit.theta - [-0.8, 0.5]) < 4 * fit.sd).all()


@pytest.mark.parametrize("C", [(0.6, 0.0), (0.6, 0.1)], ids=["P", "PI"])
def test_x08_plain_feedback_is_detected(C):
    for seed in range(3):
        found = pt.validate.closed_loop(loop(seed, C))
        assert codes(found) == ["X09"] and found.p == (0.0,)


@pytest.mark.parametrize("C", [(0.6, 0.0), (0.6, 0.1)], ids=["P", "PI"])
def test_x08_the_main_job_never_tunes_on_it_without_a_word(C):
    for seed in range(3):
        try:
            run = pt.job.run(loop(seed, C))
        except pt.NotIdentifiable:
            continue
        assert run.chosen.theta[0] > 0  # -1/C is negative
        assert any(note.severity == "warning" for note in run.all_notes())


# --- X09: feedback with excitation ---


def r_of(seed, N=1000):
    """A set point that moves now and then."""
    return np.random.default_rng([seed, 5]).choice([-1.0, 1.0], N // 20).repeat(20)


def excited(seed, N=1000):
    """The loop with it."""
    return loop(seed, (0.6, 0.1), r_of(seed, N), N)


def within_two_sd(seeds):
    """Count per verb over the seeds how often K lies within 2 sd; of the main job, T too."""
    names = {"ARMAX": 0, "BJ": 0, "P1D with its noise": 0}
    for seed in seeds:
        rec = excited(seed)
        fits = {
            "ARMAX": pt.estimate.armax(rec, 1, 1, 1, 1),
            "BJ": pt.estimate.bj(rec, 1, 1, 1, 1, 1),
            "P1D with its noise": pt.estimate.process(rec, "P1D", noise="arma"),
        }
        for name, fit in fits.items():
            K, sd = fit.derived()["K"]
            names[name] += abs(K - TRUE_P1D[0]) <= 2 * sd
    return names


def test_x09_feedback_is_named_with_the_method_for_it():
    for seed in range(10):
        (note,) = pt.validate.closed_loop(excited(seed)).notes
        assert (note.code, note.severity) == ("X09", "warning")
        assert "feedback detected" in note.text and "ARMAX" in note.remedy


def test_x09_the_bias_is_within_two_deviations():
    """95 of 100 asked; of 20 at least 17, which 1 in 60 such tests misses at that rate."""
    assert min(within_two_sd(range(20)).values()) >= 17


@pytest.mark.slow
def test_x09_the_bias_is_within_two_deviations_in_95_of_100():
    """Counted on 300 seeds: 285 less two standard deviations of the count."""
    counts = within_two_sd(range(300))
    assert min(counts.values()) >= 277, counts


def test_x09_the_main_job_trusts_a_model_whose_noise_takes_up_the_feedback():
    for seed in range(5):
        rec = excited(seed)
        run = pt.job.run(record(rec.u, rec.y, r=r_of(seed)))
        assert run.trusted in ("ARX", "ARMAX")
        assert any("noise model takes up" in note.text for note in run.notes)


# --- X11: inputs that copy each other ---

COPIES = {"three times": 3 * U, "with 1e-9 of noise": U + 1e-9 * levels(seed=8)}


@pytest.mark.parametrize("copy", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize(
    "verb",
    [
        lambda rec: pt.estimate.arx(rec, 1, [1, 1], [1, 1]),
        lambda rec: pt.estimate.iv4(rec, 1, [1, 1], [1, 1]),
        lambda rec: pt.estimate.oe(rec, [1, 1], [1, 1], [1, 1]),
        lambda rec: pt.estimate.armax(rec, 1, [1, 1], 1, [1, 1]),
    ],
    ids=["arx", "iv4", "oe", "armax"],
)
def test_x11_names_the_two_columns(verb, copy):
    rec = record(np.column_stack([U, copy]), u_names=["valve", "pump"])
    error = refused(lambda: verb(rec), "X11", ("where",))
    assert "valve" in str(error) and "pump" in str(error)


# --- X12: the sign, and the action of the loop ---


@pytest.mark.parametrize(("sign", "action"), [(1, "reverse"), (-1, "direct")])
def test_x12_either_sign_is_served_and_reported(tmp_path, sign, action):
    run = pt.job.run(record(y=sign * Y), action=action)
    assert run.chosen.theta[0] == approx(sign * TRUE_P1D[0], rel=0.01)
    assert np.sign(run.tunings[0].controller.Kp) == sign
    path = write(tmp_path / "a.csv", U, sign * Y)
    done = plantune("tune", path, *COLUMNS, "--action", action, "--out", tmp_path / "o", "--json")
    assert done.exit_code == 0, done.output
    assert strict_json(done.stdout)["chosen"]["theta"][0] * sign > 0


@pytest.mark.parametrize(("sign", "action"), [(-1, "reverse"), (1, "direct")])
def test_x12_a_mismatch_is_refused_before_any_tuning(tmp_path, sign, action):
    rec = record(y=sign * Y)
    needs = ("where", "measured", "limit")
    error = refused(lambda: pt.job.run(rec, action=action), "X12", needs)
    assert error.measured == approx(sign * TRUE_P1D[0], rel=0.01)
    assert error.result.tunings == () and error.result.chosen.theta[0] * sign > 0
    path = write(tmp_path / "a.csv", U, sign * Y)
    out = tmp_path / "out"
    done = plantune("tune", path, *COLUMNS, "--action", action, "--out", out, "--json")
    assert done.exit_code == 3
    assert strict_json(done.stdout)["error"]["code"] == "X12"
    assert not (out / "tuning.json").exists()


def test_x12_an_action_is_one_of_two_words():
    refused(lambda: pt.job.run(record(), action="left"), "U01", ())


def test_x12_an_inverse_response_is_said():
    """(1 - 2 s) / ((3 s + 1) (s + 1)): a zero in the right half-plane."""
    plant = pt.models.ProcessModel(K=2.0, T=(3.0, 1.0), L=0.0, Tz=-2.0)
    u = levels(200, 3).repeat(10)
    y = plant.simulate(u, 0.2) + 0.02 * np.random.default_rng(3).normal(size=len(u))
    fit = pt.estimate.process(pt.Record(u=u, y=y, Ts=0.2), "P2Z")
    (note,) = (note for note in fit.notes if note.code == "X12")
    assert "inverse response" in note.text
    assert fit.theta[fit.names.index("Tz")] == approx(-2.0, rel=0.05)


# --- N03: units ---

MIXED = {
    "valve in parts of one": ({"u": (0, 100)}, "u"),
    "output in Pa": ({"y": (0, 1e-3)}, "y"),
    "gain per percent": ({"K": (0.01, 0.03)}, "K"),
    "minutes": ({"T": (0.002, 0.008)}, "T"),
}


@pytest.mark.parametrize(("expected", "name"), MIXED.values(), ids=MIXED)
def test_n03_far_from_what_is_expected_is_a_warning(tmp_path, expected, name):
    run = pt.job.run(record(), expected=expected)
    (note,) = (note for note in run.all_notes() if note.code == "N03")
    assert note.severity == "warning"
    assert note.measured > note.limit == 50
    assert note.where.column == name and "units" in note.text
    ((key, (low, high)),) = expected.items()
    path = write(tmp_path / "a.csv", U, Y)
    more = ["--expected", f"{key}={low}:{high}", "--out", tmp_path / "out", "--json"]
    done = plantune("tune", path, *COLUMNS, *more)
    assert done.exit_code == 0, done.output
    assert "N03" in [n["code"] for n in strict_json(done.stdout)["notes"]]


def test_n03_is_silent_within_a_factor_of_fifty():
    known = {"u": (-2, 2), "y": (-10, 10), "K": (1, 3), "T": (0.01, 0.1), "L": (0, 1)}
    assert "N03" not in codes(pt.job.run(record(), expected=known))


def test_n03_another_sign_is_said_and_a_loosened_limit_decides():
    fit = pt.estimate.process(record())
    (note,) = pt.validate.plausible(fit, expected={"K": (-3, -1)})
    assert (note.code, note.measured) == ("N03", None) and "another sign" in note.text
    far = {"K": (200, 300)}
    assert [n.code for n in pt.validate.plausible(fit, expected=far)] == ["N03"]
    assert pt.validate.plausible(fit, expected=far, limits=pt.Limits(N03=100.0)) == ()


@pytest.mark.parametrize("wrong", [(3, 1), (1, 1)])
def test_n03_a_range_ascends(wrong):
    refused(lambda: pt.job.run(record(), expected={"K": wrong}), "U01", ())


def test_n03_on_the_command_line_a_range_is_two_numbers(tmp_path):
    path = write(tmp_path / "a.csv", U, Y)
    check_cli_refusal(tmp_path, "U01", (), path, *COLUMNS, "--expected", "K=high")
