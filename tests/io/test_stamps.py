"""Time stamps: every form is read as another library or plain arithmetic reads it."""

from datetime import datetime, timedelta

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.io.dates import seconds_of_text
from plantune.io.table import Places

N = 300
U = np.where(np.arange(N) // 7 % 2, 1.0, -1.0)
Y = np.sin(np.arange(N))
START = datetime(2024, 1, 30, 23, 58)


def stamps(form, step=1.0, start=START, n=N):
    return [(start + timedelta(seconds=step * k)).strftime(form) for k in range(n)]


def table(*columns, header="time,u,y"):
    rows = zip(*[*columns, map(str, U), map(repr, Y.tolist())], strict=True)
    return "\n".join([header, *(",".join(row) for row in rows)]) + "\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **wanted):
        (tmp_path / "a.csv").write_text(text, encoding="utf-8")
        return pt.read(tmp_path / "a.csv", u="u", y="y", **wanted)

    return read


def seconds(texts):
    return seconds_of_text([np.array(texts, "S40")], "time", Places(np.arange(len(texts))))


# --- one column of text ---

FORMS = [
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%d %H:%M:%S.%f",
    "%Y/%m/%d %H:%M:%S",
    "%Y-%m-%d %I:%M:%S %p",
    "%d-%b-%Y %H:%M:%S",
    "%d %B %Y %H:%M:%S",
    "%d-%b-%y %I:%M:%S %p",
    "%d.%m.%Y %H:%M:%S",
    "%d/%m/%Y %H:%M:%S",
    "%m/%d/%Y %I:%M:%S %p",
    "%m-%d-%Y %H:%M:%S",
]


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_seconds(read, form):
    rec = read(table(stamps(form)))
    assert (rec.Ts, rec.t0, len(rec.starts)) == (1.0, 0.0, 1)
    assert any(line.startswith(f"time 0 is {START.strftime(form)}") for line in rec.log)


def test_fields_without_leading_zeros(read):
    moments = [START + timedelta(seconds=601 * k) for k in range(N)]
    text = [f"{m.month}/{m.day}/{m.year} {m.hour % 12 or 12}:{m:%M:%S %p}" for m in moments]
    assert read(table(text)).Ts == 601.0


def test_dates_alone(read):
    rec = read(table(stamps("%Y-%m-%d", step=86400.0)))
    assert rec.Ts == 86400.0


@given(
    start=st.datetimes(datetime(1990, 1, 1), datetime(2100, 1, 1)),
    steps=st.lists(st.integers(1, 10**6), min_size=1, max_size=30),
    form=st.sampled_from(
        ["%Y-%m-%dT%H:%M:%S.%f", "%d-%b-%Y %I:%M:%S.%f %p", "%d.%m.%Y %H:%M:%S.%f"]
    ),
)
def test_seconds_agree_with_the_standard_library(start, steps, form):
    moments = [start + timedelta(milliseconds=int(s)) for s in np.cumsum(steps)]
    t, _ = seconds([m.strftime(form) for m in moments])
    assert t == approx([(m - moments[0]).total_seconds() for m in moments], abs=1e-9)


@given(texts=st.lists(st.text("0123456789-/.: TZ+APMJan", max_size=25), min_size=1, max_size=20))
def test_any_text_ends_in_seconds_or_a_refusal(texts):
    try:
        t, _ = seconds([text.encode() for text in texts])
    except pt.DataError as error:
        assert error.code in ("D07", "D16") and error.remedy and error.where[0] == "time"
    else:
        assert len(t) == len(texts) and t.min() == 0.0


@pytest.mark.parametrize("first", [12, 13])
def test_the_day_is_told_by_any_row(read, first):
    """The thirteenth of a month is the first day that cannot be a month."""
    start = datetime(2024, 3, 10 if first == 13 else 1)
    text = stamps("%d/%m/%Y %H:%M", step=3600.0, start=start, n=N)
    if first == 13:
        rec = read(table(text))
        assert rec.Ts == 3600.0
        assert "dates read with the day first: no other reading fits" in rec.log
    else:
        with pytest.raises(pt.DataError) as caught:
            read(table(text[:200] + ["01/03/2024 00:00"] * 100))
        assert caught.value.code == "D16"
        assert "2024-03-01 with the day first and 2024-01-03 with the month" in caught.value.text


def test_a_clock_of_12_hours_passes_noon_and_midnight(read):
    text = stamps("%Y-%m-%d %I:%M:%S %p", step=600.0)
    rec = read(table(text))
    assert rec.Ts == 600.0 and "clock of 12 hours read with AM and PM" in rec.log


@pytest.mark.parametrize(
    "stamp", ["2024-02-30 10:00:00", "31.04.2024 10:00:00", "2024-01-01 24:00:00"]
)
def test_what_is_not_on_the_calendar_is_refused(stamp):
    good = stamp.replace("30 1", "20 1").replace("31.", "30.").replace("24:", "23:")
    with pytest.raises(pt.DataError) as caught:
        seconds([good, good, stamp])
    assert caught.value.code == "D16" and caught.value.where[1] == 2 and caught.value.count == 1


# --- two columns ---


@pytest.mark.parametrize("form", [("%Y-%m-%d", "%H:%M:%S"), ("%d-%b-%Y", "%I:%M:%S %p")])
@pytest.mark.parametrize("named", [False, True])
def test_a_date_and_a_clock_time_in_two_columns(read, form, named):
    columns = [stamps(form[0]), stamps(form[1])]
    wanted = {"time": ("Date", "Time")} if named else {}
    rec = read(table(*columns, header="Date,Time,u,y"), **wanted)
    assert rec.Ts == 1.0 and "time from columns Date Time" in rec.log  # over midnight


def test_dates_and_times_under_chinese_names(read):
    rec = read(table(stamps("%Y-%m-%d"), stamps("%H:%M:%S"), header="日期,时间,u,y"))
    assert rec.Ts == 1.0


def test_a_whole_stamp_beside_a_date_is_enough(read):
    rec = read(table(stamps("%Y-%m-%d"), stamps("%Y-%m-%dT%H:%M:%S"), header="Date,Time,u,y"))
    assert rec.Ts == 1.0 and "time from column Time" in rec.log
    rec = read(table(stamps("%Y-%m-%d %H:%M:%S"), stamps("%H:%M:%S"), header="Date,Time,u,y"))
    assert rec.Ts == 1.0 and "time from column Date" in rec.log
    rec = read(table(stamps("%Y-%m-%d"), [str(k) for k in range(N)], header="Date,Time,u,y"))
    assert rec.Ts == 1.0 and "time from column Time" in rec.log


# --- numbers ---


def test_an_epoch_is_recognised(read):
    rec = read(table([f"{1.7e9 + k:.1f}" for k in range(N)]))
    assert rec.Ts == 1.0 and rec.t0 == 1.7e9
    assert "time counts from 1970: the first stamp is 2023-11-14T22:13:20Z" in rec.log


def test_an_epoch_in_milliseconds_is_read_with_its_unit(read):
    text = [f"{1_700_000_000_000 + 1000 * k}" for k in range(N)]
    with pytest.raises(pt.DataError) as caught:
        read(table(text))
    assert caught.value.code == "D16" and "[ms]" in caught.value.remedy
    rec = read(table(text, header="time [ms],u,y"))
    assert rec.Ts == approx(1.0) and any("2023-11-14T22:13:20Z" in line for line in rec.log)


def test_serials_are_read_with_their_unit(read):
    rec = read(table([f"{45000 + k / 1440:.12f}" for k in range(N)], header="time [d],u,y"))
    assert rec.Ts == approx(60.0, rel=1e-6)


def test_a_logger_that_began_hours_ago_is_no_spreadsheet(read):
    assert read(table([f"{45000 + 0.1 * k:.1f}" for k in range(N)])).Ts == approx(0.1)
    assert read(table([f"{45000 + 1e-4 * k:.4f}" for k in range(N)], header="time [s],u,y")).Ts > 0


# --- order ---


def shuffled(seed):
    order = np.random.default_rng(seed).permutation(N)
    lines = table([str(k) for k in range(N)]).splitlines()
    return "\n".join([lines[0], *(lines[1 + k] for k in order)]) + "\n", order


@pytest.mark.parametrize("seed", range(3))
def test_sorting_any_order_gives_the_sorted_record(read, seed):
    text, order = shuffled(seed)
    rec, plain = read(text, sort=True), read(table([str(k) for k in range(N)]))
    assert np.array_equal(rec.y, plain.y) and np.array_equal(rec.u, plain.u)
    assert rec.source == plain.source
    assert np.array_equal(rec.rows, np.argsort(order)) and np.array_equal(rec.time, np.arange(N))
    assert f"D13: sorted by time, {(order != np.arange(N)).sum()} of {N} rows moved" in rec.log


def test_sorted_rows_are_not_touched(read):
    plain = read(table([str(k) for k in range(N)]))
    assert read(table([str(k) for k in range(N)]), sort=True).same_as(plain)
    assert read(table([str(k) for k in range(N)]), sort="segments").same_as(plain)


def test_a_clock_set_back_cuts_segments(read):
    t = np.arange(N) - 60.0 * (np.arange(N) >= 100) - 7.5 * (np.arange(N) >= 250)
    rec = read(table([f"{x:.1f}" for x in t]), sort="segments")
    assert rec.starts.tolist() == [0, 100, 250] and rec.Ts == 1.0 and rec.N == N
    assert np.array_equal(rec.time, t) and np.array_equal(rec.rows, np.arange(N))
    assert "D13: cut where time goes back, 2 times" in rec.log
    grid = read(table([f"{x:.1f}" for x in t]), sort="segments", resample=1.0)
    assert grid.starts.tolist() == [0, 100, 250] and np.array_equal(np.unique(grid.rows), grid.rows)


@pytest.mark.parametrize("wanted", [{}, {"resample": 1.0}])
def test_segments_of_one_row_are_d04(read, wanted):
    lines = table([str(N - k) for k in range(N)]).splitlines()
    with pytest.raises(pt.DataError) as caught:
        read("\n".join(lines[:4]), sort="segments", **wanted)
    assert caught.value.code == "D04" and caught.value.remedy


def test_segments_of_another_step_are_refused(read):
    t = np.where(np.arange(N) < 200, np.arange(N), 0.5 * np.arange(N))
    with pytest.raises(pt.DataError) as caught:
        read(table([f"{x:.1f}" for x in t]), sort="segments")
    error = caught.value
    assert (error.code, error.where[1]) == ("D15", 200) and error.measured == approx(0.5)


def test_sorting_needs_stamps(read):
    text = table(["x"] * N, header="name,u,y")
    with pytest.raises(pt.UsageError, match="needs a column of time stamps"):
        read(text, Ts=1.0, sort=True)


def test_skipped_rows_cut_the_record(read):
    lines = table([str(k) for k in range(N)]).splitlines()
    lines[41] += ",1"
    lines[91] = "90"
    rec = read("\n".join(lines), ragged="skip")
    assert rec.N == N - 2 and rec.starts.tolist() == [0, 40, 89]
    assert 40 not in rec.rows and 90 not in rec.rows and rec.rows[-1] == N - 1
    said = "D05: skipped 2 ragged rows, first file line 42 with 4 fields instead of 3"
    assert said in rec.log
    assert read("\n".join(lines), ragged="skip", Ts=1.0, time="time").starts.tolist() == [0, 40, 89]


# --- notes ---


def test_repeats_leave_a_note(read):
    again = np.sort(np.append(np.arange(N), [30, 70]))
    lines = table([str(k) for k in range(N)]).splitlines()
    rec = read("\n".join([lines[0], *(lines[1 + k] for k in again)]))
    (note,) = rec.notes
    assert (note.code, note.severity, note.count) == ("D14", "warning", 2)
    assert note.where == ("time", 31, 30.0) and note.remedy
    assert any(line.startswith("D14: dropped 2 rows") for line in rec.log)


def test_another_sample_time_leaves_a_note(read):
    rec = read(table([str(k) for k in range(N)]), Ts=2.0)
    (note,) = rec.notes
    assert (note.code, note.severity, note.measured) == ("D16", "warning", approx(0.5))
    assert rec.Ts == 2.0 and any(line.startswith("D16: ") for line in rec.log)
    assert read(table([str(k) for k in range(N)]), Ts=1.01).notes == ()
