"""`inspect` refuses nothing readable: codes of BAD_INPUTS.md are findings, the exit code is 0."""

import gzip

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import TS, b0, plantune, strict_json, write

U, Y = b0()


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


T = TS * np.arange(1000)
COLUMNS = ["--u", "u", "--y", "y"]


def with_values(x, value, rows):
    x = np.array(x)
    x[rows] = value
    return x


def table(**columns):
    """Give the maker of a file with B0 in it, some columns replaced."""
    return lambda path: write(path, **({"u": U, "y": Y, "t": T} | columns))


def text(data):
    """Give the maker of a file of these bytes."""
    return lambda path: path.write_bytes(data)


LINES = "".join(f"{TS * k:.1f},{U[k]},{float(Y[k])!r}\n" for k in range(1000))
CELLS = [float(y) for y in Y]

BAD_FILES = {
    "D01 long name": ("D01", text(f"time,u,{'y' * 500}\n{LINES}".encode())),
    "D02 a picture": ("D02", text(b"\x89PNG\r\n\x1a\n" + bytes(100))),
    "D02 an archive": ("D02", text(gzip.compress(LINES.encode()))),
    "D03 zero bytes": ("D03", text(f"time,u,y\n{LINES}".encode() + b"\0\0")),
    "D04 nothing": ("D04", text(b"")),
    "D04 header only": ("D04", text(b"time,u,y\n")),
    "D05 ragged": ("D05", text(f"time,u,y\n{LINES}100.0,1\n".encode())),
    "D05 open quote": ("D05", text(f'time,u,y\n{LINES}100.0,1,"2\n'.encode())),
    "D06 words": ("D06", table(y=[*CELLS[:9], "Bad Input", *CELLS[10:]])),
    "D06 formula": ("D06", table(y=[*CELLS[:9], '"=HYPERLINK(""x"")"', *CELLS[10:]])),
    "D07 one": ("D07", table(y=with_values(Y, np.nan, [7]))),
    "D07 30 %": ("D07", table(y=with_values(Y, np.nan, slice(7, 307)))),
    "D07 end of a column": ("D07", table(u=[*map(float, U[:-7]), *[""] * 7])),
    "D08 infinite": ("D08", table(y=with_values(Y, np.inf, [7]))),
    "D08 1e308": ("D08", table(u=with_values(U, 1e308, [7]))),
    "D12 output equals input": ("D12", table(y=U)),
    "D12 one name twice": ("D12", text(f"y,u,y\n{LINES}".encode())),
    "D13 back an hour": ("D13", table(t=T - 3600.0 * (T > 50))),
    "D14 repeated": ("D14", table(t=with_values(T, T[500], [501]))),
    "D15 jitter": ("D15", table(t=T + 0.01 * np.random.default_rng(1).uniform(-1, 1, 1000))),
    "D16 no date": ("D16", table(t=["soon"] * 1000)),
    "D16 milliseconds": ("D16", table(t=1.7e12 + 100 * np.arange(1000))),
    "D18 stuck": ("D18", table(y=np.full(1000, 2.5))),
    "D19 code": ("D19", table(y=with_values(Y, -9999.0, [7, 8]))),
    "X01 still input": ("X01", table(u=np.full(1000, 3.0))),
    "X02 a sinusoid": ("X02", table(u=np.sin(0.3 * np.arange(1000)))),
    "X05 a long delay": ("X05", table(y=np.roll(Y, 600))),
}


@pytest.mark.parametrize(("code", "make"), BAD_FILES.values(), ids=BAD_FILES)
def test_what_is_wrong_is_a_finding(tmp_path, code, make):
    path = tmp_path / "a.csv"
    make(path)
    done = plantune("inspect", path, *COLUMNS, "--json")
    assert done.exit_code == 0, done.output
    seen = strict_json(done.stdout)
    found = {note["code"]: note for note in seen["findings"]}
    assert code in found, seen["findings"]
    assert found[code]["severity"] == "error"
    assert found[code]["remedy"]
    assert set(found[code]) == set(pt.Note.__dataclass_fields__)
    printed = plantune("inspect", path, *COLUMNS)
    assert printed.exit_code == 0
    assert f"{code} " in printed.stdout
    assert printed.stderr == ""


DOUBTS = {
    "D18": table(y=with_values(Y, Y[200], slice(200, 500))),
    "D19": table(y=with_values(Y, 40.0, [300])),
}


@pytest.mark.parametrize("code", DOUBTS)
def test_doubts_are_findings_too(tmp_path, code):
    DOUBTS[code](tmp_path / "a.csv")
    seen = pt.inspect(tmp_path / "a.csv", u="u", y="y")
    assert (code, "warning") in [(note.code, note.severity) for note in seen.findings]
    assert bool(seen)


def test_a_clean_file_has_no_findings(tmp_path):
    seen = pt.inspect(write(tmp_path / "a.csv", U, Y), u="u", y="y")
    assert [note for note in seen.findings if note.severity == "error"] == []
    assert seen.excitation["u"].order == 20 and seen.excitation["u"].at_least
    assert seen.delay["u"].nk == 1
    assert str(seen.record).startswith("Record u -> y: 1000 rows, Ts 0.1 s")


def test_the_look_goes_on_behind_gaps_and_jitter(tmp_path):
    y = with_values(with_values(Y, np.nan, [7]), -9999.0, [20])
    t = T + 0.01 * np.random.default_rng(1).uniform(-1, 1, 1000)
    seen = pt.inspect(write(tmp_path / "a.csv", U, y, t), u="u", y="y")
    assert {"D07", "D15", "D19"} <= {note.code for note in seen.findings}
    assert seen.stamps.step == approx(TS, rel=0.02)


def test_the_newest_row_may_come_first(tmp_path):
    path = write(tmp_path / "a.csv", U[::-1], Y[::-1], T[::-1])
    seen = pt.inspect(path, u="u", y="y")
    assert (seen.stamps.step, seen.stamps.back, seen.stamps.gaps) == (approx(TS), 0, 0)
    assert "the newest row comes first" in seen.stamps.said
    (note,) = [note for note in seen.findings if note.code == "D13"]
    assert note.text == "the newest row comes first" and "sort=True" in note.remedy
    sorted_rows = pt.read(path, u="u", y="y", sort=True)
    assert np.array_equal(seen.record.y, sorted_rows.y)


def test_the_look_goes_on_behind_ragged_rows_and_a_clock_set_back(tmp_path):
    path = tmp_path / "a.csv"
    rows = LINES.splitlines(keepends=True)
    path.write_text("time,u,y\n" + "".join([*rows[500:], "100.0,1\n", *rows[:500]]))
    seen = pt.inspect(path, u="u", y="y")
    assert {"D05", "D13"} <= {note.code for note in seen.findings}
    assert [c.values for c in seen.columns] == [1000, 1000, 1000]
    assert seen.record
    assert seen.delay["u"].nk == 1


def test_several_files_are_seen_one_by_one_and_as_one_record(tmp_path):
    first = write(tmp_path / "a.csv", U, Y)
    second = write(tmp_path / "b.csv", U, with_values(Y, np.nan, [7]))
    done = plantune("inspect", first, second, *COLUMNS, "--json")
    seen = strict_json(done.stdout)
    assert (done.exit_code, seen["name"], [f["name"] for f in seen["others"]]) == (
        0,
        "a.csv",
        ["b.csv"],
    )
    assert [f["columns"][2]["missing"] for f in (seen, *seen["others"])] == [0, 1]
    assert [n["text"][:6] for n in seen["findings"] if n["code"] == "D07"] == ["b.csv:"]
    assert seen["record"]["u"] == {"shape": [1999, 1]}


def test_parquet_and_mat_are_inspected_as_text_is(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    mat = pytest.importorskip("scipy.io")
    parquet.write_table(arrow.table({"time": T, "u": U, "y": Y}), tmp_path / "a.parquet")
    mat.savemat(tmp_path / "a.mat", {"time": T, "u": U, "y": Y, "short": [1.0, 2.0]})
    for path in (tmp_path / "a.parquet", tmp_path / "a.mat"):
        seen = pt.inspect(path, u="u", y="y")
        assert [c.holds for c in seen.columns[:3]] == ["stamps", "numbers", "numbers"]
        assert (seen.stamps.step, seen.delay["u"].nk) == (approx(TS), 1)
        assert bool(seen)


def test_columns_are_listed_and_nothing_is_guessed(tmp_path):
    rows = "".join(f"{TS * k:.1f},{U[k]:.0f},Good,{k % 5 or ''}\n" for k in range(100))
    (tmp_path / "a.csv").write_text("time [s],power [V],status,level\n" + rows)
    done = plantune("inspect", tmp_path / "a.csv", "--json")
    seen = strict_json(done.stdout)
    assert (done.exit_code, seen["findings"], seen["record"]) == (0, [], None)
    columns = {c["name"]: c for c in seen["columns"]}
    assert [c["holds"] for c in columns.values()] == ["stamps", "numbers", "text", "numbers"]
    assert (columns["power"]["unit"], columns["power"]["low"], columns["power"]["high"]) == (
        "V",
        -1,
        1,
    )
    assert "'Good' 100x" in columns["status"]["text"]
    assert [columns["level"][k] for k in ("values", "missing", "distinct")] == [80, 20, 4]
    assert seen["stamps"]["step"] == approx(TS)
    assert (seen["stamps"]["gaps"], seen["stamps"]["back"]) == (0, 0)


def test_gaps_and_jumps_of_the_stamps_are_counted(tmp_path):
    t = T + 5.0 * (T > 30) - 40.0 * (T > 60)
    stamps = pt.inspect(write(tmp_path / "a.csv", U, Y, t)).stamps
    assert (stamps.gaps, stamps.back) == (1, 1)


@pytest.mark.parametrize("more", [["--u", "nosuch", "--y", "y"], ["--u", "u"]], ids=" ".join)
def test_columns_that_are_not_there_are_findings(tmp_path, more):
    done = plantune("inspect", write(tmp_path / "a.csv", U, Y), *more, "--json")
    assert done.exit_code == 0
    assert "U01" in [note["code"] for note in strict_json(done.stdout)["findings"]]


@pytest.mark.parametrize("more", [[], ["--json"]], ids=["text", "json"])
def test_a_file_that_is_not_there_is_u01(tmp_path, more):
    assert plantune("inspect", tmp_path / "nosuch.csv", *more).exit_code == 2


def test_a_wrong_limit_is_u01(tmp_path):
    path = write(tmp_path / "a.csv", U, Y)
    assert plantune("inspect", path, *COLUMNS, "--limit", "Q9=1").exit_code == 2
