"""Reading tables of text: what is read, and what is refused with which evidence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.io import csv as reader
from plantune.io import file as source
from plantune.io.table import Wanted

N = 200
T = np.arange(N) * 0.1
U = np.where(np.arange(N) // 7 % 2, 1.0, -1.0)
Y = np.round(20 + np.cumsum(U) * 0.05, 4)


def table(columns, header="time,u,y", delimiter=","):
    """Write columns as text, one row a line."""
    lines = [header] if header else []
    lines += [delimiter.join(map(str, row)) for row in zip(*columns, strict=True)]
    return "\n".join(lines) + "\n"


PLAIN = table([T.round(1), U, Y])


@pytest.fixture
def read(tmp_path):
    """Give `read(text or bytes, ...)`, which writes a file and reads it."""

    def read(content, name="data.csv", **wanted):
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / name).write_bytes(data)
        return pt.read(tmp_path / name, **{"u": "u", "y": "y", **wanted})

    return read


@pytest.fixture
def refused(read):
    """Give `refused(content, ...)`: the exception, after the checks that hold for all of them."""

    def refused(content, **wanted):
        with pytest.raises(pt.PlantuneError) as caught:
            read(content, **wanted)
        error = caught.value
        assert str(error).count("\n") <= 2, error
        assert error.remedy
        usage = error.code == "U01"
        assert isinstance(error, pt.UsageError if usage else pt.DataError)
        assert usage or error.where is not None or error.code in ("D01", "D02", "D04"), error
        return error

    return refused


def with_cells(column, cells):
    """Write the plain table with other cells in a column, by row."""
    columns = [list(map(str, x)) for x in (T.round(1), U, Y)]
    for row, cell in cells.items():
        columns[column][row] = cell
    return table(columns)


# What is read


def test_a_plain_table(read):
    rec = read(PLAIN)
    assert np.array_equal(rec.u[:, 0], U) and np.array_equal(rec.y[:, 0], Y)
    assert rec.Ts == approx(0.1, rel=1e-12)
    assert (rec.u_names, rec.y_names, rec.t, rec.N) == (("u",), ("y",), None, N)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "   "])
@pytest.mark.parametrize("header", ["time,u,y", None])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_delimiter_header_and_line_ends_do_not_matter(read, delimiter, header, newline):
    head = header and header.replace(",", delimiter)
    text = table([T.round(1), U, Y], head, delimiter).replace("\n", newline)
    wanted = {} if header else {"u": 1, "y": "2", "time": 0}
    rec = read(text, **wanted)
    assert np.array_equal(rec.u[:, 0], U) and np.array_equal(rec.y[:, 0], Y)


def test_both_ways_through_a_file_give_the_same_bits(read, monkeypatch):
    """Files without blemish are read at once, others row by row."""
    rng = np.random.default_rng(5)
    x = rng.normal(size=(2, 500)) * 10.0 ** rng.integers(-100, 100, (2, 500))
    text = table([np.arange(500), *x])
    at_once = read(text, Ts=1.0)
    monkeypatch.setattr(reader.CsvSheet, "_at_once", lambda *_: None)
    row_by_row = read(text, Ts=1.0)
    assert at_once.same_as(row_by_row)
    assert np.array_equal(at_once.u[:, 0], x[0])


@pytest.mark.parametrize(
    ("old", "new"), [("\n5.0,", '\n"5.0,'), ("\n5.0,", "\r5.0,"), ("\n5.0,", "\n\n5.0,")]
)
@pytest.mark.parametrize("at_the_end", [False, True])
def test_a_blemish_is_seen_both_ways(old, new, at_the_end):
    """An open quote, a line end of another kind, a blank line: at most counted otherwise."""
    text = PLAIN.replace("\n19.9,", f"{new[:-4]}19.9,") if at_the_end else PLAIN.replace(old, new)
    sheet = reader.open_csv(text.encode())
    ways = (sheet.read, sheet._row_by_row)
    if '"' in new:
        for way in ways:
            with pytest.raises(pt.DataError, match="quote"):
                way(Wanted((1, 2), (0,)))
    else:
        at_once, row_by_row = (way(Wanted((1, 2), (0,))) for way in ways)
        assert np.array_equal(at_once.numbers, row_by_row.numbers) and len(at_once.numbers) == N


@given(text=st.lists(st.sampled_from([*',;\t\n\r" 01.5eu-', "\n1,2", "nan"]), max_size=60))
def test_any_text_ends_in_a_table_or_a_refusal(text):
    try:
        sheet = reader.open_csv("".join(text).encode())
        every = Wanted(range(len(sheet.columns)))
        at_once = sheet.read(every)
    except pt.DataError as error:
        assert str(error).count("\n") <= 2 and error.remedy
    else:
        row_by_row = sheet._row_by_row(every)
        assert np.array_equal(at_once.numbers, row_by_row.numbers, equal_nan=True)


@given(x=st.lists(st.floats(-1e100, 1e100), min_size=2, max_size=40))
def test_every_number_survives_its_text(x):
    sheet = reader.open_csv(table([x, x], "u,y").encode())
    for way in (sheet._at_once, sheet._row_by_row):
        assert way(Wanted((0, 1))).numbers[:, 1].tolist() == x


def test_several_inputs_reference_aux_and_units(read):
    text = table([U, 2 * U, Y, Y + 1, T], 'a [V],"b, raw",c [degC],c set,d [bar]')
    rec = read(
        text, u=["a", "b, raw"], y="c", r="c set", aux=["d [bar]"], Ts=0.1, units={"a": "mV"}
    )
    assert rec.u_names == ("a", "b, raw") and rec.nu == 2
    assert np.array_equal(rec.r[:, 0], Y + 1) and np.array_equal(rec.aux["d"], T)
    assert dict(rec.units) == {"a": "mV", "c": "degC", "d": "bar"}


def test_text_in_columns_that_are_not_asked_for_is_ignored(read):
    text = table([T.round(1), U, Y, ["手動"] * N], "time,u,y,mode")
    assert read(text).same_as(read(PLAIN)) is False  # the log counts one column more
    assert np.array_equal(read(text).y, read(PLAIN).y)


def test_blank_lines_and_quoted_line_breaks_are_logged_and_counted(read, refused):
    text = PLAIN.replace("\n", "\n\n", 3).replace("time,u", '"time",u')
    rec = read(text)
    assert rec.N == N and "3 blank lines skipped" in rec.log
    broken = text.replace("time", "ti\nme").replace(str(Y[50]), "bad", 1)
    row = next(k for k in range(N) if Y[k] == Y[50])
    error = refused(broken, Ts=0.1)
    assert f"file line {row + 2 + 3 + 1}:" in error.text  # header, 3 blank lines, 1 line break


def test_decimal_commas_between_semicolons(read):
    text = table([T.round(1), U, Y], "time;u;y", ";").replace(".", ",")
    rec = read(text)
    assert np.array_equal(rec.y[:, 0], Y) and rec.Ts == approx(0.1)
    assert "decimal commas read in u, y" in rec.log
    assert read(text.split("\n", 1)[1], u=1, y=2, time=0).N == N


@pytest.mark.parametrize("zone", ["Z", "+02:00", "-0330", ""])
@pytest.mark.parametrize("between", ["T", " "])
@pytest.mark.parametrize("trimmed", [False, True])
def test_iso_stamps(read, zone, between, trimmed):
    stamps = np.datetime64("2024-03-30T23:59:50.000") + np.arange(N) * np.timedelta64(100, "ms")
    text = [str(s).replace("T", between) for s in stamps]
    if trimmed:  # .000 left out, as many loggers do: stamps of two shapes
        text = [s.removesuffix(".000") for s in text]
    rec = read(table([[s + zone for s in text], U, Y]))
    assert rec.Ts == approx(0.1, rel=1e-12) and rec.t0 == 0.0
    said = f"time 0 is {text[0]}{zone}" + ("" if zone else ", zone not stated")
    assert said in rec.log


@pytest.mark.parametrize(
    ("title", "scale"), [("time [ms]", 1e3), ("t (min)", 1 / 60), ("time_us", 1e6), ("t/s", 1)]
)
def test_units_of_time_in_the_header(read, title, scale):
    stamps = [f"{t * scale:.17g}" for t in T]
    assert read(table([stamps, U, Y], f"{title},u,y")).Ts == approx(0.1, rel=1e-9)


def test_a_given_sample_time_is_compared_with_the_stamps(read):
    assert read(PLAIN, Ts=0.102).Ts == 0.102
    assert not any("D16" in line for line in read(PLAIN, Ts=0.102).log)
    rec = read(PLAIN, Ts=0.2)
    assert rec.Ts == 0.2 and any("D16" in line and "0.1 s apart" in line for line in rec.log)


def test_unreadable_stamps_that_are_not_needed_are_logged(read, refused):
    text = table([[f"{k // 60:02}:{k % 60:02} PM" for k in range(N)], U, Y])
    rec = read(text, Ts=0.1)
    assert any(line.startswith("time stamps not used") for line in rec.log)
    assert refused(text).code == "D16"
    assert refused(text, Ts=0.1, time="time").code == "D16"


def test_process_reaction_curve(data):
    rec = pt.read(data("process_reaction_curve") / "prc.csv", u="CV", y="PV", Ts=1.0)
    assert (rec.N, rec.u_names, rec.y_names) == (1794, ("CV",), ("PV",))
    assert rec.y[:3, 0].tolist() == [11.7, 11.7, 11.9] and rec.u.max() == 10.0


def test_step_test_with_jitter(data):
    path = data("tclab_step") / "data_step_test.csv"
    with pytest.raises(pt.DataError) as caught:
        pt.read(path, u=1, y=2, time=0)
    error = caught.value
    assert error.code == "D15" and error.where[0] == "0" and error.count > 0
    assert error.measured > 0.05 and error.limit == 0.01 and "resample" in error.remedy
    rec = pt.read(path, u=1, y=2, time=0, resample=1.0)
    assert rec.Ts == 1.0 and np.array_equal(rec.rows, np.arange(rec.N)) and len(rec.starts) == 1
    assert any("resampled 571 rows to" in line for line in rec.log)


def test_resampling_holds_inputs_and_interpolates_outputs(read):
    rng = np.random.default_rng(2)
    t = np.round(T + rng.uniform(-0.02, 0.02, N), 4)
    rec = read(table([t, U, 3 * t, U + 1, 2 * t], "time,u,y,r,a"), resample=0.05, r="r", aux="a")
    assert np.array_equal(rec.u[:, 0], U[np.searchsorted(t, rec.time + 1e-9, "right") - 1])
    assert rec.y[:, 0] == approx(3 * rec.time, abs=1e-12)
    assert np.array_equal(rec.r, rec.u + 1) and rec.aux["a"] == approx(2 * rec.time, abs=1e-12)


def test_resampling_cuts_at_gaps_and_keeps_the_time(read):
    keep = (np.arange(N) < 50) | (np.arange(N) >= 120)
    rec = read(table([T[keep].round(1), U[keep], Y[keep]]), resample=0.1)
    assert len(rec.starts) == 2 and any("cut at 1 gaps" in line for line in rec.log)
    assert rec.time[rec.starts[1]] == approx(12.0) and rec.rows[rec.starts[1]] == 120


# D01 and D02: what is no table, or too much of one


def test_d01_a_large_file_is_refused_unread(tmp_path, monkeypatch):
    path = tmp_path / "data.csv"
    path.write_text(PLAIN)
    with pytest.raises(pt.DataError) as caught:
        source.contents(path, largest=100)
    assert (caught.value.code, caught.value.limit) == ("D01", 100.0)
    assert caught.value.measured == path.stat().st_size
    assert source.LARGEST_FILE == 64 * 2**20


def test_d01_too_many_columns(refused):
    width = 100_000
    text = ",".join(f"c{i}" for i in range(width)) + "\n" + ",".join(["1"] * width) + "\n"
    error = refused(text)
    assert (error.code, error.count, error.limit) == ("D01", width, 10_000.0)


def test_d01_too_many_lines(refused, monkeypatch):
    monkeypatch.setattr(reader, "MOST_LINES", 100)
    error = refused(PLAIN)
    assert (error.code, error.count, error.limit) == ("D01", N + 1, 100.0)


@pytest.mark.parametrize("where", ["header", "body"])
def test_d01_a_field_of_a_megabyte(refused, where):
    lines = PLAIN.splitlines()
    lines[0 if where == "header" else 9] = "x" * 2**20 + ",1,2"
    error = refused("\n".join(lines))
    assert error.code == "D01" and error.measured > error.limit


@pytest.mark.parametrize(
    ("data", "format"),
    [
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "PNG"),
        (b"PAR1" + bytes(100), "Parquet"),
        (b"MATLAB 5.0 MAT-file, Platform: x" + bytes(100), "MATLAB file of version 5"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "HDF5"),
        (b"PK\x03\x04" + bytes(100), "zip"),
    ],
)
@pytest.mark.parametrize("name", ["data.csv", "data.bin"])
def test_d02_the_format_seen_is_named(refused, data, format, name):
    error = refused(data, name=name)
    assert error.code == "D02" and format in error.text and "CSV" in error.remedy


def test_d02_another_suffix(refused):
    error = refused(PLAIN, name="data.ods")
    assert error.code == "D02" and "'.ods'" in error.text


# D03: encodings


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "gb18030"])
def test_d03_declared_encodings_are_read(read, encoding):
    text = PLAIN.replace("u,y", "功率 [W],溫度 [°C]")
    rec = read(text.encode(encoding), u="功率", y="溫度")
    assert np.array_equal(rec.y[:, 0], Y) and dict(rec.units) == {"功率": "W", "溫度": "°C"}
    assert (encoding[:5] in ("utf-1", "gb180")) == any("text read as" in line for line in rec.log)


@pytest.mark.parametrize(
    ("data", "offset"),
    [
        (PLAIN.encode()[:40] + b"\xff" + PLAIN.encode()[40:], 40),
        (PLAIN.encode()[:77] + b"\0" + PLAIN.encode()[77:], 77),
        (PLAIN.encode("utf-16")[:62] + b"\0\0" + PLAIN.encode("utf-16")[62:], 62),
        (PLAIN.encode("utf-16-le"), 1),  # without the mark
        ((PLAIN + "x").encode("utf-16")[:-1], 2 * len(PLAIN) + 2),
    ],
)
def test_d03_other_bytes_are_refused_with_their_offset(refused, data, offset):
    error = refused(data)
    assert (error.code, error.where[0], error.count) == ("D03", f"byte {offset}", 1)


# D04 and D05: rows


@pytest.mark.parametrize("text", ["", "\n\n", "time,u,y\n", "time,u,y\n0,1,2\n", "0,1,2\n"])
def test_d04_fewer_than_two_rows(refused, text):
    error = refused(text, **({} if "u" in text else {"u": 1, "y": 2}))
    assert (error.code, error.limit) == ("D04", 2.0) and error.measured == error.count < 2


@pytest.mark.parametrize("cells", ["3.1,1", "3.1,1,2,3", "3.1,1,2,3,4"])
def test_d05_ragged_rows(refused, cells):
    lines = PLAIN.splitlines()
    lines[31] = lines[40] = cells
    error = refused("\n".join(lines))
    assert error.code == "D05" and "line 32 " in error.text
    assert (error.where[1], error.count, error.limit) == (30, 2, 3.0)
    assert error.measured == cells.count(",") + 1


@pytest.mark.parametrize("rows", [N, 20_000])  # the quote runs to the end; into the field limit
def test_d05_an_unclosed_quote(refused, rows):
    columns = [np.arange(rows), np.arange(rows) % 2, np.arange(rows) % 3]
    lines = table(columns).splitlines()
    lines[11] = '10,"1,2'
    error = refused("\n".join(lines))
    assert (error.code, error.where[0]) == ("D05", "line 12") and "quote" in error.text


def test_d05_a_quote_that_goes_on(refused):
    error = refused(PLAIN.replace("\n0.5,", '\n"0.5"x,'))
    assert (error.code, error.where[0]) == ("D05", "line 7")


# D06: what is no number


@pytest.mark.parametrize(
    "token", ["Bad Input", "#VALUE!", "No Data", "1 000", "1_000", "0x10", "=1+1"]
)
def test_d06_other_tokens_are_listed_with_counts(refused, token):
    error = refused(with_cells(2, {9: token, 17: token, 30: "Offline"}))
    assert (error.code, error.count, error.where[:2]) == ("D06", 3, ("y", 9))
    assert f"{token!r} 2x" in error.text and "'Offline' 1x" in error.text
    assert "file line 11:" in error.text and "comma" not in error.remedy


def test_d06_many_tokens_are_cut_short(refused):
    error = refused(with_cells(1, {k: f"tag{k}" * 20 for k in range(150)}))
    assert error.count == 150 and "at least 150" in error.text and len(error.text) < 400
    assert "and 97 others" in error.text  # from 100 on in one


@pytest.mark.parametrize("delimiter", [",", "\t", ";"])
def test_d06_decimal_commas_are_suggested_where_they_are_not_read(refused, delimiter):
    cell = '"12,5"' if delimiter == "," else "12,5"
    points = "0.5" if delimiter == ";" else "7"  # ; with commas throughout would be read
    rows = [[str(k), cell, points if k % 2 else cell] for k in range(20)]
    text = table(zip(*rows, strict=True), f"time{delimiter}u{delimiter}y", delimiter)
    error = refused(text, y="y", u="time")
    assert (error.code, error.where[0], error.count) == ("D06", "y", 10)
    assert "'12,5' 10x" in error.text and "decimal comma" in error.remedy


# D07: what is missing


@pytest.mark.parametrize("cell", ["", "NaN", " ", "N/A", "null"])
@pytest.mark.parametrize("rows", [[17], [40, 41, 90]])
def test_d07_missing_values_are_refused(refused, cell, rows):
    error = refused(with_cells(2, dict.fromkeys(rows, cell)))
    assert (error.code, error.where[:2], error.count) == ("D07", ("y", rows[0]), len(rows))
    assert error.where[2] == approx(rows[0] * 0.1) and error.limit == 0.0
    assert error.measured == approx(len(rows) / N) and "missing=" in error.remedy
    assert f"file line {rows[0] + 2}" in error.text


@pytest.mark.parametrize("column", [1, 2])
def test_d07_segments_cut_the_record(read, column):
    rec = read(with_cells(column, {0: "", 40: "", 41: "nan", 90: ""}), missing="segments")
    assert rec.starts.tolist() == [0, 39, 87] and rec.N == N - 4
    gone = np.isin(np.arange(N), (0, 40, 41, 90))
    assert np.array_equal(rec.y[:, 0], Y[~gone]) and np.array_equal(rec.rows, np.arange(N)[~gone])
    assert rec.time == approx(np.delete(T, [0, 40, 41, 90]) - 0.0)
    said = [line for line in rec.log if "dropped 4 of 200 rows" in line]
    assert said and "3 segments" in said[0]


def test_d07_mask_keeps_the_rows(read, refused):
    rec = read(with_cells(2, {40: "", 41: "", 90: "nan"}), missing="mask")
    assert np.flatnonzero(~rec.valid[:, 0]).tolist() == [40, 41, 90]
    assert rec.N == N and len(rec.starts) == 1 and np.isfinite(rec.y).all()
    assert "`y` marked as missing in 3 of 200 rows" in rec.log
    error = refused(with_cells(1, {40: ""}), missing="mask")
    assert (error.code, error.where[:2]) == ("D07", ("u", 40)) and "segments" in error.remedy


@pytest.mark.parametrize("policy", ["segments", "mask"])
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_d07_too_many_missing_are_refused_under_any_policy(refused, read, policy, share):
    text = with_cells(2, dict.fromkeys(range(5, 5 + int(share * N)) if share < 1 else range(N), ""))
    error = refused(text, missing=policy)
    assert (error.code, error.measured, error.limit) == ("D07", share, 0.2)
    if share < 1:
        rec = read(text, missing=policy, limits=pt.Limits(D07=0.5))
        assert any("limit D07 is 0.5 instead of 0.2" in line for line in rec.log)


def test_d07_gaps_survive_resampling(read):
    text = with_cells(2, {40: "", 90: ""})
    cut = read(text, resample=0.1, missing="segments")
    assert len(cut.starts) == 3 and np.isfinite(cut.y).all()
    masked = read(text, resample=0.1, missing="mask")
    assert not masked.valid[40] and not masked.valid[90] and masked.valid.sum() >= N - 4


@pytest.mark.parametrize("stamps", ["numbers", "text"])
def test_d07_a_missing_stamp(refused, read, stamps):
    cells = [str(t) for t in T.round(1)]
    if stamps == "text":
        cells = [f"2024-01-01T00:00:{t:06.3f}Z" for t in T]
    cells[7] = ""
    error = refused(table([cells, U, Y]), missing="segments")
    assert (error.code, error.where[:2], error.count) == ("D07", ("time", 7), 1)
    assert read(table([cells, U, Y]), Ts=0.1).N == N


@pytest.mark.parametrize("cell", ["inf", "-Infinity", "1e999", "1e200"])
@pytest.mark.parametrize("wanted", [{}, {"resample": 0.1, "missing": "segments"}])
def test_d08_infinite_values_are_never_taken_for_missing(refused, cell, wanted):
    error = refused(with_cells(2, {40: cell}), **wanted)
    assert (error.code, error.where[:2], error.count) == ("D08", ("y", 40), 1)


# D12: doubled columns


def test_d12_a_name_that_stands_twice(read, refused):
    text = table([T.round(1), U, Y, Y + 1], "time,u,y,y")
    error = refused(text)
    assert (error.code, error.count, error.where[0]) == ("D12", 2, "y")
    assert "numbers 2, 3" in error.text and "number" in error.remedy
    assert np.array_equal(read(text, y=3).y[:, 0], Y + 1)
    units = table([T.round(1), U, Y, Y + 1], "time,u,y [V],y [K]")
    assert refused(units).code == "D12"
    assert np.array_equal(read(units, y="y [K]").y[:, 0], Y + 1)


@pytest.mark.parametrize("same", ["column", "numbers"])
def test_d12_output_equals_input(refused, same):
    text = table([T.round(1), U, U])
    error = refused(text, y="u" if same == "column" else "y")
    assert error.code == "D12" and "output equals input" in error.text
    assert error.where[0] == ("u" if same == "column" else "y") and error.count


# D13 to D16: time stamps


@pytest.mark.parametrize("back", [0.15, 3600.0])
def test_d13_time_goes_back(refused, back):
    t = np.where(np.arange(N) >= 60, T - back, T)
    error = refused(table([t.round(4), U, Y]))
    assert (error.code, error.where[:2], error.count) == ("D13", ("time", 60), 1)
    assert "file line 62" in error.text
    assert refused(table([t.round(4), U, Y]), resample=0.1).code == "D13"


def test_d14_repeated_rows_are_dropped_and_counted(read):
    again = np.sort(np.append(np.arange(N), [30, 30, 70]))
    rec = read(table([T[again].round(1), U[again], Y[again]]))
    assert rec.N == N and np.array_equal(rec.y[:, 0], Y) and rec.time == approx(T)
    assert any(line.startswith("D14: dropped 3 rows") for line in rec.log)


@pytest.mark.parametrize("column", ["u", "y"])
def test_d14_equal_stamps_with_different_values(refused, column):
    t = T.round(1).copy()
    t[31] = t[30]
    u, y = U.copy(), Y.copy()
    (u if column == "u" else y)[31] = 99.0
    error = refused(table([t, u, y]))
    assert (error.code, error.where[:2], error.count) == ("D14", ("time", 31), 1)


@pytest.mark.parametrize("kind", ["jitter", "missing", "two rates", "compressed"])
def test_d15_stamps_that_are_not_uniform(refused, read, kind):
    rng = np.random.default_rng(3)
    t = {
        "jitter": np.sort(T + rng.uniform(-0.01, 0.01, N)),
        "missing": np.arange(N + 10)[np.sort(rng.permutation(N + 10)[:N])] * 0.1,
        "two rates": np.where(np.arange(N) < 100, T, 10 + (T - 10) * 2),
        "compressed": np.cumsum(rng.exponential(0.1, N)),
    }[kind]
    text = table([t.round(6), U, Y])
    error = refused(text)
    assert error.code == "D15" and error.measured > error.limit == 0.01 and error.count > 0
    assert error.where[0] == "time" and "median" in error.text and "resample" in error.remedy
    assert read(text, resample=0.1).Ts == 0.1


def test_d15_jitter_within_the_limit_is_fine(read):
    jitter = np.random.default_rng(4).uniform(-4e-4, 4e-4, N)
    text = table([(T + jitter).round(6), U, Y])
    assert read(text).Ts == approx(0.1, rel=1e-4)
    wide = table([(T + 10 * jitter).round(6), U, Y])
    rec = read(wide, limits=pt.Limits(D15=0.2))
    assert any("limit D15" in line for line in rec.log)


def clock(form, *others):
    """Write N stamps, minutes and seconds counted up; `others[k]` in turn at the end."""
    ends = others or ("",)
    return [form.format(k // 60, k % 60) + ends[k % len(ends)] for k in range(N)]


@pytest.mark.parametrize(
    ("stamps", "said"),
    [
        (1.7e12 + T * 1e3, "after 2100"),
        (T * 1e-6, "another unit"),
        (T * 2e6, "another unit"),
        (45000 + T * 1e-5 * 10, "days"),
        (clock("noon and {:02}:{:02}"), "no ISO 8601"),
        (clock("01/02/2024 05:{:02}:{:02}"), "two readings"),
        (clock("2024-13-01T00:{:02}:{:02}Z"), "no ISO 8601"),
        (clock("1970-01-01T00:{:02}:{:02}Z"), "outside 1990"),
        (clock("2024-01-01T00:{:02}:{:02}", "Z", "+01:00"), "mixes"),
        (clock("2024-01-01T00:{:02}:{:02}", "+02:00", "+01:00"), "mixes"),
        (clock("2024-01-01T00:{:02}:{:02}", "Z", ""), "mixes"),
    ],
)
def test_d16_stamps_in_another_unit_or_form(refused, stamps, said):
    cells = stamps if isinstance(stamps, list) else [f"{t:.12g}" for t in stamps]
    error = refused(table([cells, U, Y]), time="time")
    assert error.code == "D16" and said in error.text
    assert error.where[0] == "time" and error.count and error.measured is not None


def test_d16_a_unit_of_time_that_is_none(refused):
    assert refused(PLAIN.replace("time", "time [parsec]")).code == "D16"


# D20: text is inert


@pytest.mark.parametrize(
    "name", ["<script>alert(1)</script>", "../../etc/passwd", "=HYPERLINK(1)", "a\x1b[31mb", "a\nb"]
)
def test_d20_names_are_text(read, refused, name):
    text = PLAIN.replace(",y", f',"{name}"')
    rec = read(text, y=2)
    assert rec.y_names[0].isprintable() and rec.y_names[0].replace("\N{REPLACEMENT CHARACTER}", "")
    assert refused(text, u="nothing").code == "U01"


def test_d20_formulas_in_cells_are_bad_tokens(refused):
    error = refused(with_cells(1, {4: "=HYPERLINK(1)", 5: "@SUM(A1)"}))
    assert (error.code, error.count) == ("D06", 2)


# U01: arguments


def test_u01_columns_are_listed(refused):
    for wanted in ({"u": None}, {"y": None}, {"u": "power"}, {"y": 7}, {"aux": "none"}):
        error = refused(PLAIN, **wanted)
        assert error.code == "U01" and "0 'time', 1 'u', 2 'y'" in error.text
    assert refused(table([U, Y], "PV,CV"), u=None, y=None).code == "U01"


def test_u01_the_sample_time_is_not_guessed(refused):
    error = refused(table([U, Y], "u,y"))
    assert error.code == "U01" and "`Ts`" in error.text
    assert refused(table([U, Y], "u,y"), resample=1.0).code == "U01"
    assert refused(PLAIN, resample=1.0, Ts=0.5).code == "U01"
    for wrong in (-1.0, 0, np.nan, "fast"):
        assert refused(PLAIN, resample=wrong).code == refused(PLAIN, Ts=wrong).code == "U01"


def test_u01_no_such_file_or_policy(tmp_path, refused):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(pt.UsageError, match="cannot read"):
            pt.read(path, u=0, y=1)
    assert refused(PLAIN, missing="fill").code == "U01"
