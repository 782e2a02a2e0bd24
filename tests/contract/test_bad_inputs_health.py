"""D18, D19, M03, M04, M09 and M11 of BAD_INPUTS.md, in Python and on the command line."""

import pickle
import sys
import traceback
from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import (
    EVERY,
    TRUE_P1D,
    TS,
    b0,
    check_cli_refusal,
    codes,
    levels,
    plantune,
    record,
    refused,
    strict_json,
    with_values,
    write,
)

COLUMNS = ["--u", "u", "--y", "y"]
U, Y = b0()


def tuned(tmp_path, u, y, *more):
    """Run `plantune tune --json` on a table; give the notes of its health and its exit code."""
    path = write(tmp_path / "a.csv", u, y)
    done = plantune("tune", path, *COLUMNS, "--out", tmp_path / "out", "--json", *more)
    assert done.exit_code == 0, done.output
    return strict_json(done.stdout)


# --- D18: stuck ---


@pytest.mark.parametrize("first", [0, 10], ids=["all rows", "all but ten"])
def test_d18_an_output_that_never_moves_is_refused(tmp_path, first):
    y = with_values(Y, 3.25, slice(first, 1000))
    error = refused(lambda: pt.job.run(record(y=y)), "D18", EVERY)
    assert error.where[:2] == ("y", first)
    assert (error.count, error.measured, error.limit) == (1000 - first, 1000 - first, 200)
    assert error.result.stuck[0].first == first
    found = check_cli_refusal(tmp_path, "D18", EVERY, write(tmp_path / "a.csv", U, y), *COLUMNS)
    assert "3.25" in found["text"]


@pytest.mark.parametrize("rows", [slice(200, 450), slice(650, 1000)], ids=["middle", "end"])
def test_d18_a_stretch_is_a_warning_with_its_rows(tmp_path, rows):
    y = with_values(Y, Y[rows.start], rows)
    run = pt.job.run(record(y=y))
    (stretch,) = run.findings["health"].stuck
    assert (stretch.first, stretch.last) == (rows.start, rows.stop - 1)
    assert "D18" in codes(run)
    printed = tuned(tmp_path, U, y)["findings"]["health"]
    assert printed["stuck"] == [{"signal": "y", "first": rows.start, "last": rows.stop - 1}]
    assert [note["severity"] for note in printed["notes"]] == ["warning"]


def test_d18_is_no_matter_of_a_bare_estimator():
    y = with_values(Y, Y[200], slice(200, 450))
    assert "D18" not in codes(pt.estimate.arx(record(y=y), 1, 1, 1))


def test_d18_a_loosened_limit_decides_and_is_noted(tmp_path):
    y = with_values(Y, Y[200], slice(200, 450))
    found = tuned(tmp_path, U, y, "--limit", "D18=0.4")["findings"]["health"]
    assert found["stuck"] == []
    assert [note["text"] for note in found["notes"]] == ["limit D18 is 0.4 instead of 0.2"]


@pytest.mark.parametrize("rows", [slice(200, 450), slice(250, 600), slice(650, 1000)])
def test_d18_stuck_rows_are_left_out_of_the_main_job(tmp_path, rows):
    y = with_values(Y, Y[rows.start], rows)
    run = pt.job.run(record(y=y))
    lost = rows.stop - rows.start
    assert run.record.N == 1000 - lost
    assert run.record.log[-1] == f"excluded {lost} of 1000 rows: y stuck"
    assert run.chosen.theta[:2] == approx(TRUE_P1D, rel=0.01)
    assert tuned(tmp_path, U, y)["record"]["log"][-1] == run.record.log[-1]


def test_d18_more_than_half_is_refused_and_the_stretch_is_said_beside_it(tmp_path):
    y = with_values(Y, Y[250], slice(250, 950))
    error = refused(lambda: pt.job.run(record(y=y)), "D18", EVERY)
    assert (error.count, error.measured, error.limit) == (700, 0.7, 0.5)
    note = error.notes[0]
    assert (note.code, note.severity, note.where.row) == ("D18", "warning", 250)
    assert "from row 250 to 949" in note.text
    assert f"found before: {note}" in "".join(traceback.format_exception(error)).splitlines() or (
        sys.version_info < (3, 11)  # later than the notes that a traceback shows
    )
    again = pickle.loads(pickle.dumps(error))
    assert (again.notes, str(again)) == (error.notes, str(error))
    path = write(tmp_path / "a.csv", U, y)
    printed = plantune("tune", path, *COLUMNS, "--out", tmp_path / "out")
    assert printed.stderr.startswith("D18: ")
    assert f"found before: {note}" in printed.stderr.splitlines()
    found = check_cli_refusal(tmp_path, "D18", EVERY, path, *COLUMNS)
    assert found["notes"][0]["text"] == note.text


def test_d18_is_not_said_twice_where_it_is_the_refusal():
    error = refused(lambda: pt.job.run(record(y=with_values(Y, 3.25, slice(0, 1000)))), "D18", ())
    assert error.notes == ()


# --- D19: spikes and sentinels ---


@pytest.mark.parametrize("sign", [-1, 1])
def test_d19_spikes_are_a_warning_with_their_rows(tmp_path, sign):
    rows = [50, 52, 333, 600, 901]
    y = Y.copy()
    y[rows] += sign * 20 * Y.std()
    run = pt.job.run(record(y=y))
    assert [s.row for s in run.findings["health"].spikes] == rows
    assert "D19" in codes(run)
    (note,) = tuned(tmp_path, U, y)["findings"]["health"]["notes"]
    assert (note["code"], note["severity"], note["count"]) == ("D19", "warning", 5)
    assert "50, 52, 333, 600, 901" in note["text"]
    assert "despike" in note["remedy"]


@pytest.mark.parametrize("code", [-9999, 65535, 32767])
@pytest.mark.parametrize("column", ["u", "y"])
def test_d19_sentinels_are_refused(tmp_path, code, column):
    x = {"u": U, "y": Y}
    x[column] = with_values(x[column], code, [5, 77])
    error = refused(lambda: pt.job.run(record(**x)), "D19", EVERY)
    assert error.where == (column, 5, approx(5 * TS))
    assert error.count == 2
    found = check_cli_refusal(tmp_path, "D19", EVERY, write(tmp_path / "a.csv", **x), *COLUMNS)
    assert f"holds {code} in 2 of 1000 rows" in found["text"]
    assert f"sentinels=({code},)" in found["remedy"]


ROBUST = {
    "arx": lambda rec, robust: pt.estimate.arx(rec, 1, 1, 1, robust=robust),
    "oe": lambda rec, robust: pt.estimate.oe(rec, 1, 1, 1, robust=robust),
    "armax": lambda rec, robust: pt.estimate.armax(rec, 1, 1, 1, 1, robust=robust),
}


@pytest.mark.parametrize("verb", ROBUST.values(), ids=ROBUST)
def test_d19_robust_fits_come_back_to_within_2_percent_of_the_clean_one(verb):
    y = Y.copy()
    y[[50, 180, 333, 600, 901]] += 20 * Y.std()
    clean = verb(record(), False).theta[:2]
    assert verb(record(y=y), True).theta[:2] == approx(clean, rel=0.02)
    assert verb(record(y=y), False).theta[:2] != approx(clean, rel=0.02)  # so it must be asked for
    assert verb(pt.prep.despike(record(y=y)), False).theta[:2] == approx(clean, rel=0.02)


def test_d19_a_clean_record_has_none():
    assert not {"D18", "D19"} & set(codes(pt.job.run(record())))


# --- M03: saturated actuators ---


def saturating(low, high, logged, seed=1, N=1000):
    """A wish for the actuator, cut at its limits; the record holds the wish or what is left."""
    rng = np.random.default_rng(seed)
    wish, y = np.repeat(rng.uniform(0, 100, N // 10), 10), np.zeros(N)
    given = np.clip(wish, low, high)
    for k in range(1, N):
        y[k] = 0.8 * y[k - 1] + 0.5 * given[k - 1] + 0.05 * rng.normal()
    return record(wish if logged == "wish" else given, y)


def test_m03_an_input_at_its_limits_is_a_warning_with_ranges(tmp_path):
    rec = saturating(20.0, 80.0, "position")
    at = (rec.u[:, 0] == 20) | (rec.u[:, 0] == 80)
    run = pt.job.run(rec)
    (note,) = (n for n in run.findings["health"].notes if n.code == "M03")
    assert (note.severity, note.limit) == ("warning", 0.05)
    assert note.measured == approx(at.mean(), abs=0.02)  # a stretch at an end may be rest
    assert "20 and 80" in note.text and "more stretches" in note.text
    first = run.findings["health"].saturated[0]
    assert at[first.first : first.last + 1].all()
    assert run.chosen.theta[:2] == approx(TRUE_P1D, rel=0.01)  # modelled: u is what the plant got
    path = write(tmp_path / "a.csv", rec.u[:, 0], rec.y[:, 0])
    listed = plantune("inspect", path, *COLUMNS, "--out", tmp_path / "page")
    assert listed.exit_code == 0 and "M03" in listed.stdout


def test_m03_rows_at_known_limits_are_left_out_and_logged(tmp_path):
    rec = saturating(20.0, 80.0, "wish")
    lost = int(((rec.u <= 20) | (rec.u >= 80)).sum())
    run = pt.job.run(rec, u_limits=(20.0, 80.0))
    assert run.record.log[-1] == f"excluded {lost} of 1000 rows: u at a limit"
    assert "M03" in codes(run)
    assert run.chosen.theta[:2] == approx(TRUE_P1D, rel=0.01)
    assert pt.job.run(rec).chosen.theta[0] < 0.8 * TRUE_P1D[0]  # so it must be told
    printed = tuned(tmp_path, rec.u[:, 0], rec.y[:, 0], "--u-limits", 20, 80)
    assert printed["record"]["log"][-1] == run.record.log[-1]


@pytest.mark.parametrize("logged", ["wish", "position"])
def test_m03_more_than_half_is_refused(tmp_path, logged):
    rec = saturating(40.0, 60.0, logged)
    limits = {"u_limits": (40.0, 60.0)} if logged == "wish" else {}
    error = refused(lambda: pt.job.run(rec, **limits), "M03", EVERY)
    assert error.measured > error.limit == 0.5
    more = ["--u-limits", 40, 60] if limits else []
    path = write(tmp_path / "a.csv", rec.u[:, 0], rec.y[:, 0])
    check_cli_refusal(tmp_path, "M03", EVERY, path, *COLUMNS, *more)


def test_m03_is_silent_on_test_signals():
    rng = np.random.default_rng(4)
    steps = np.repeat(rng.integers(0, 6, 50), 20).astype(float)
    ramp = np.clip(np.arange(1000.0), 450, 550)
    for u in (U, steps, np.r_[np.zeros(500), steps[:500] + 1], ramp):
        assert "M03" not in codes(pt.analyze.health(record(u, Y)))


# --- M04: an output read too coarsely ---


@pytest.mark.parametrize(("step", "said"), [(0.2, False), (0.8, False), (2.0, True), (2.5, True)])
def test_m04_few_values_are_a_warning_with_the_resolution(tmp_path, step, said):
    y = step * np.round(Y / step)
    health = pt.job.run(record(y=y)).findings["health"]
    assert ("M04" in codes(health)) == said
    if said:
        (note,) = (n for n in health.notes if n.code == "M04")
        assert (note.severity, note.limit) == ("warning", 0.25)
        assert f"{step:g} apart" in note.text and note.measured == approx(step / np.ptp(y), rel=0.3)
        assert "M04" in [n["code"] for n in tuned(tmp_path, U, y)["findings"]["health"]["notes"]]


def test_m04_one_value_is_refused():
    """By D18 where the input moves long enough; else by M04."""
    assert refused(lambda: pt.job.run(record(y=np.full(1000, 7.0))), "D18", EVERY)
    refused(lambda: pt.job.run(record(U[:40], np.full(40, 7.0))), "M04", EVERY)


# --- M09: sampling ---


def sampled(T, L=0.3, Ts=1.0, N=600, seed=1, sd=0.02):
    """Simulate a first-order plant whose input moves every third row."""
    u = np.repeat(levels(N // 3, seed), 3)
    y = pt.models.ProcessModel(K=2.0, T=T, L=L).simulate(u, Ts)
    return u, y + sd * np.random.default_rng(seed).normal(size=N)


def of(u, y, Ts=1.0):
    return pt.Record(u=u, y=y, Ts=Ts)


NEEDS = ("where", "measured", "limit")


@pytest.mark.parametrize("T", [0.02, 0.1, 0.3, 0.6, 1.5])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_m09_too_slow_sampling_is_refused_with_a_proposal(T, seed):
    rec = of(*sampled(T, seed=seed))
    for verb in (pt.estimate.process, pt.job.run):
        error = refused(lambda verb=verb: verb(rec), "M09", NEEDS)
        assert error.measured > error.limit == 0.5
        assert "record with Ts = " in error.remedy
    proposed = float(error.remedy.split("Ts = ")[1].split()[0])
    assert T < 0.5 or proposed == approx(T / 10, rel=0.1)


@pytest.mark.parametrize("T", [0.3, 0.6])
def test_m09_on_the_command_line(tmp_path, T):
    u, y = sampled(T)
    path = write(tmp_path / "a.csv", u, y, np.arange(600.0))
    check_cli_refusal(tmp_path, "M09", NEEDS, path, *COLUMNS)


@pytest.mark.parametrize("T", [0.02, 0.6])
def test_m09_holds_without_noise(T):
    rec = of(*sampled(T, sd=0.0))
    assert refused(lambda: pt.estimate.process(rec), "M09", NEEDS).measured > 1


@pytest.mark.parametrize("T", [2.2, 5.0, 20.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_m09_is_silent_where_sampling_suits(T, seed):
    rec = of(*sampled(T, seed=seed))
    assert "M09" not in codes(pt.estimate.process(rec))
    assert "M09" not in codes(pt.job.run(rec))


def test_m09_an_interval_that_reaches_two_samples_is_a_doubt():
    """T = 1.9 Ts under much noise: refused, doubted, or estimated above 2 Ts; never bare below."""
    doubts = 0
    for seed in range(12):
        rec = of(*sampled(1.9, seed=seed, sd=0.3))
        try:
            fit = pt.estimate.process(rec)
        except pt.NotIdentifiable as error:
            assert error.code == "M09"
            continue
        assert ("M09" in codes(fit)) == (fit.model.T < 2)
        doubts += fit.model.T < 2
        assert pt.tune.imc_pi(fit, tau_c=3.0).controller.Ti == pytest.approx(fit.model.T)
    assert doubts >= 3


def test_m09_too_fast_sampling_is_a_doubt_with_a_proposal():
    u = np.repeat(levels(15, 4), 1000)
    y = pt.models.ProcessModel(K=2.0, T=2000.0, L=50.0).simulate(u, 1.0)
    (note,) = (n for n in pt.estimate.process(of(u, y)).notes if n.code == "M09")
    assert note.severity == "warning"
    assert note.measured < note.limit == 1e-3
    assert float(note.remedy.split("Ts = ")[1].split()[0]) == approx(200, rel=0.1)


def test_m09_an_arx_model_is_not_refused():
    assert "M09" not in codes(pt.estimate.arx(of(*sampled(0.3)), 1, 2, 1))


@pytest.mark.parametrize("how", ["gain_margin", "tau_c"])
def test_m09_such_a_fit_is_not_tuned_on(how):
    fit = pt.estimate.process(of(*sampled(5.0)))
    T = 0.6
    short = replace(fit, model=replace(fit.model, T=T), theta=np.array([2.0, T, 0.3]))
    wish = {how: 3.0}
    refused(lambda: pt.tune.imc_pi(short, **wish), "M09", NEEDS)
    assert pt.tune.imc_pi(short, **wish, limits=pt.Limits(M09=2.0)).controller.Ti == T
    assert pt.tune.imc_pi(short.model, **wish).controller.Ti == T  # its sampling is not known


def test_m09_a_loosened_limit_decides_and_is_noted(tmp_path):
    u, y = sampled(1.5)
    limits = pt.Limits(M09=1.0)
    assert "limit M09 is 1 instead of 0.5" in [
        note.text for note in pt.job.run(of(u, y), limits=limits).chosen.notes
    ]
    path = write(tmp_path / "a.csv", u, y, np.arange(600.0))
    done = plantune("tune", path, *COLUMNS, "--out", tmp_path / "out", "--limit", "M09=1")
    assert done.exit_code == 0, done.output


# --- M11: validation on the rows of the fit ---


def judged(val, fit):
    verdict = pt.validate.check(val, fit)
    return [note for note in verdict.notes if note.code == "M11"]


@pytest.mark.parametrize("part", [slice(0, 500), slice(100, 300)], ids=["all", "a part"])
def test_m11_rows_of_the_fit_are_not_validation(part):
    rec = record()
    est, val = rec.split(0.5)
    fit = pt.estimate.arx(est, 1, 1, 1)
    (note,) = judged(rec.take(part), fit)
    assert note.severity == "warning"
    assert note.text.startswith("not validated: ")
    assert note.count == part.stop - part.start
    assert judged(val, fit) == []


def test_m11_counts_overlapping_rows():
    rec = record()
    fit = pt.estimate.arx(rec.take(slice(0, 600)), 1, 1, 1)
    (note,) = judged(rec.take(slice(450, 1000)), fit)
    assert note.count == 150


@pytest.mark.parametrize("prepare", [pt.prep.despike, pt.prep.detrend])
def test_m11_preparation_does_not_make_rows_fresh(prepare):
    rec = record(y=with_values(Y, 40.0, [100, 700]))
    est, val = prepare(rec).split(0.5)
    fit = pt.estimate.arx(est, 1, 1, 1)
    assert judged(est, fit)
    assert judged(rec.take(slice(0, 500)), fit)  # the same rows before they were prepared
    assert not judged(val, fit)


@pytest.mark.parametrize("Ts", [TS / 2, 0.8 * TS])
def test_m11_resampling_does_not_make_rows_fresh(Ts):
    rec = record()
    est, val = (pt.prep.resample(part, Ts) for part in rec.split(0.5))
    fit = pt.estimate.process(est)
    assert judged(est, fit)
    assert judged(rec.take(slice(0, 500)), fit)
    assert judged(pt.prep.resample(rec, Ts), fit)
    assert not judged(val, fit)


@pytest.mark.parametrize("moves", [slice(0, 500), slice(500, 1000)], ids=["first", "second"])
def test_m11_on_the_command_line(tmp_path, moves):
    u = np.ones(1000)
    u[moves] = U[moves]
    y = pt.models.PolyModel(A=[1, -0.8], B=[0.5], nk=1, Ts=TS).simulate(u)
    y += 0.02 * np.random.default_rng(3).normal(size=1000)
    run = tuned(tmp_path, u, y)
    assert "M11" in [note["code"] for note in run["notes"]]
    for verdict in run["verdicts"].values():
        (note,) = (n for n in verdict["notes"] if n["code"] == "M11")
        assert note["text"].startswith("not validated: ")


def test_m11_is_silent_on_fresh_rows_on_the_command_line(tmp_path):
    run = tuned(tmp_path, U, Y)
    notes = [*run["notes"], *(n for v in run["verdicts"].values() for n in v["notes"])]
    assert "M11" not in [note["code"] for note in notes]
