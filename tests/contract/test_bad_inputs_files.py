"""D01 to D06, D12 to D14, D16, D17 and D20 of BAD_INPUTS.md: one table, in Python and in the shell.

D07 to D11 and D15 are in test_bad_inputs_data.py.
"""

import io
import struct
import zlib
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from scipy.io import savemat

import plantune as pt
from contract.records import TS, b0, check_cli_refusal, check_refusal, plantune, strict_json

N = 300
U, Y = b0(N)
T = TS * np.arange(N)
EVERY = ("where", "count", "measured", "limit")
SIZE = ("count", "measured", "limit")


def text(t=T, u=U, y=Y, header="time,u,y", **more):
    """Write a table; columns may hold text."""
    columns = [[x if isinstance(x, str) else repr(float(x)) for x in c] for c in (t, u, y)]
    columns += more.values()
    rows = [",".join(row) for row in zip(*columns, strict=True)]
    return "\n".join([",".join([header, *more]), *rows]) + "\n"


def cells(x, changed):
    """Return a column with other cells in some rows."""
    return [changed.get(k, repr(float(v))) for k, v in enumerate(x)]


def clock(form, *ends):
    """Write one stamp a second; the ends in turn."""
    ends = ends or ("",)
    return [form.format(k // 60, k % 60) + ends[k % len(ends)] for k in range(N)]


def mat(**variables):
    file = io.BytesIO()
    savemat(file, variables or {"u": U, "y": Y}, do_compression=True)
    return file.getvalue()


def bomb(declared):
    """Write a MAT file whose one element says that it unpacks to so many bytes."""
    packed = zlib.compress(struct.pack("<II", 14, declared) + bytes(min(declared, 2**22)), 9)
    return mat()[:128] + struct.pack("<II", 15, len(packed)) + packed


def pq(**columns):
    file = io.BytesIO()
    parquet.write_table(pa.table(columns or {"time": T, "u": U, "y": Y}), file)
    return file.getvalue()


def constant(rows):
    """Write a Parquet file of a few bytes and many rows."""
    return pq(u=np.zeros(rows), y=np.zeros(rows))


class Row(NamedTuple):
    """A bad input: its code, the file, what to say of it, and what the refusal must fill."""

    code: str
    what: str
    content: Any
    wanted: dict[str, Any] = {}  # noqa: RUF012 - never changed
    needs: tuple[str, ...] = EVERY
    suffix: str = ".csv"


def changed(data, at, new):
    return data[:at] + new + data[at + len(new) :]


BACK = np.where(np.arange(N) < 200, T, T - 3600.0)
STEP_BACK = np.where(np.arange(N) < 200, T, T - 1.5 * TS)
TWICE = np.where(np.arange(N) == 31, T[30], T)
SWAP = "".join(text().splitlines(keepends=True)[k] for k in (0, 2, 1, *range(3, N + 1)))

TABLE = [
    Row("D01", "100,000 columns", ",".join(f"c{i}" for i in range(100_000)) + "\n", {}, SIZE),
    Row("D01", "a field of a megabyte", text(u=cells(U, {9: "x" * 2**20}))),
    Row("D01", "a line of three megabytes", text() + "," * 3 * 2**20 + "\n"),
    Row("D01", "65 MiB", bytes(65 * 2**20), {}, SIZE),
    Row("D01", "mat: says 1 GB", bomb(2**30), {}, SIZE, ".mat"),
    Row("D01", "mat: 1 MB of zeros in 1 kB", mat(u=np.zeros(200_000), y=Y), {}, SIZE, ".mat"),
    Row("D01", "parquet: five million rows", constant(4_900_000), {"Ts": 1.0}, SIZE, ".parquet"),
    Row("D01", "parquet: six million rows", constant(5_100_000), {"Ts": 1.0}, SIZE, ".pq"),
    Row("D02", "a PNG", b"\x89PNG\r\n\x1a\n" + bytes(99), {}, ("where",)),
    Row("D02", "Parquet called csv", pq(), {}, ("where",)),
    Row("D02", "an unknown suffix", text(), {}, ("where",), ".ods"),
    Row("D02", "parquet: truncated", pq()[:-100], {}, ("where",), ".parquet"),
    Row("D02", "parquet: a text", text(), {}, ("where",), ".parquet"),
    Row("D02", "parquet: footer of zeros", changed(pq(), -400, bytes(300)), {}, ("where",), ".pq"),
    Row("D02", "mat: truncated", mat()[:-50], {}, ("where",), ".mat"),
    Row(
        "D02", "mat: wild length", changed(mat(), 132, b"\xf0\xff\xff\x7f"), {}, ("where",), ".mat"
    ),
    Row("D02", "mat: wild type", changed(mat(), 128, b"\x63\0\0\0"), {}, ("where",), ".mat"),
    Row("D02", "mat: 7.3", b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF", {}, ("where",), ".mat"),
    Row("D02", "mat: a text", text(), {}, ("where",), ".mat"),
    Row(
        "D03", "a byte of no encoding", text().encode()[:50] + b"\xff\xff,", {}, ("where", "count")
    ),
    Row("D03", "NUL", text().encode().replace(b"1.0", b"1\x000", 1), {}, ("where", "count")),
    Row("D03", "UTF-16 cut short", text().encode("utf-16")[:-1], {}, ("where", "count")),
    Row("D04", "nothing", "", {}, SIZE),
    Row("D04", "a header", "time,u,y\n", {}, SIZE),
    Row("D04", "one row", "time,u,y\n0,1,2\n", {}, SIZE),
    Row("D04", "mat: no vector", mat(u=3.0, y="text"), {}, SIZE, ".mat"),
    Row("D04", "parquet: no row", pq(u=[], y=[]), {"Ts": 1.0}, SIZE, ".parquet"),
    Row("D05", "a field missing", text() + "30.0,1\n"),
    Row("D05", "a field more", text() + "30.0,1,2,3\n"),
    Row("D05", "an open quote", text() + '30.0,"1,2\n', {}, ("where", "count")),
    Row(
        "D05", "most rows, skipped", text() + "30.0,1\n" * N + "31,1,1\n", {"ragged": "skip"}, SIZE
    ),
    Row("D06", "decimal commas", text(y=[f'"{v:.3f}"'.replace(".", ",") for v in Y])),
    Row("D06", "words", text(y=cells(Y, {5: "Bad Input", 9: "#VALUE!"}))),
    Row("D06", "parquet: words", pq(time=T, u=U, y=["No Data"] * N), {}, EVERY, ".parquet"),
    Row("D12", "two columns of one name", text(header="time,u,y").replace("time,u,y", "y,u,y")),
    Row("D12", "y is u", text(y=U), {}, ("where", "count")),
    Row("D12", "mat: y is u", mat(u=U, y=U), {"Ts": TS}, ("where", "count"), ".mat"),
    Row("D13", "an hour back", text(BACK), {}, ("where", "count")),
    Row("D13", "less than a step back", text(STEP_BACK), {}, ("where", "count")),
    Row("D13", "two rows swapped", SWAP, {}, ("where", "count")),
    Row("D13", "parquet: an hour back", pq(time=BACK, u=U, y=Y), {}, ("where", "count"), ".pq"),
    Row("D14", "other values at one time", text(TWICE), {}, ("where", "count")),
    Row("D14", "sorted", text(np.where(T == T[31], T[3], T)), {"sort": True}, ("where", "count")),
    Row("D16", "epoch milliseconds", text([f"{1.7e12 + 100 * k:.0f}" for k in range(N)])),
    Row("D16", "a spreadsheet's days", text([f"{45000 + k / 86400:.9f}" for k in range(N)])),
    Row("D16", "MATLAB's days", text([f"{739000 + k / 86400:.9f}" for k in range(N)])),
    Row("D16", "day or month first", text(clock("03/04/2024 10:{:02}:{:02}"))),
    Row("D16", "neither", text(clock("13/14/2024 10:{:02}:{:02}"))),
    Row("D16", "AM or not", text(clock("2024-05-06 10:{:02}:{:02}", " AM", ""))),
    Row(
        "D16",
        "12 hours",
        text([f"2024-05-06 {11 + k // 60 - 12 * (k >= 120):02}:{k % 60:02}" for k in range(N)]),
    ),
    Row("D16", "two zones", text(clock("2024-05-06T10:{:02}:{:02}", "Z", "+01:00"))),
    Row("D16", "1970", text(clock("1970-05-06T10:{:02}:{:02}Z"))),
    Row("D16", "two columns, one of numbers", text(), {"time": ("time", "u")}, ("where", "count")),
    Row("D16", "parquet: 1970", pq(time=np.arange(N).astype("M8[s]"), u=U, y=Y), {}, EVERY, ".pq"),
    Row("D17", "unknown words", text(q=["Good", "Fine", "So-so"] * (N // 3)), {"quality": "q"}),
    Row("D17", "numbers of no meaning", text(q=["192", "150"] * (N // 2)), {"quality": "q"}),
    Row("D17", "zeros", text(q=["0"] * N), {"quality": "q"}),
    Row("D07", "quality Bad", text(q=["Good", "Bad"] * (N // 2)), {"quality": "q"}),
    Row("D07", "quality Uncertain", text(q=["192", "64"] * (N // 2)), {"quality": "q"}),
    Row("D07", "a sentinel", text(y=cells(Y, {7: "-9999"})), {"sentinels": (-9999,)}),
    Row("D20", "formulas", text(u=cells(U, {5: "=HYPERLINK(1)", 6: "@SUM(A1)"})), {}),
    Row("D20", "a name of a megabyte", text(header="time,u," + "y" * 2**20), {}),
]
SEEN = {"formulas": "D06", "a name of a megabyte": "D01"}  # D20 has no code of its own


def arguments(path, wanted):
    """Write the options of `read` as those of the command line."""
    found = [path, "--u", "u", "--y", "y"]
    for name, value in wanted.items():
        several = value if isinstance(value, tuple) else (value,)
        for one in several:
            found += [f"--{name.removesuffix('s') if name == 'sentinels' else name}"]
            found += [] if one is True else [one]
    return found


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row.code} {row.what}")
def test_every_row_through_python_and_the_command_line(tmp_path, row):
    path = tmp_path / f"a{row.suffix}"
    path.write_bytes(row.content if isinstance(row.content, bytes) else row.content.encode())
    code = SEEN.get(row.what, row.code)
    with pytest.raises(pt.PlantuneError) as caught:
        pt.read(path, u="u", y="y", **row.wanted)
    check_refusal(caught.value, code, row.needs)
    found = check_cli_refusal(tmp_path, code, row.needs, *arguments(path, row.wanted))
    assert found["text"] == caught.value.text
    assert len(found["text"]) < 600


@pytest.mark.parametrize(
    "code", [f"D{k:02}" for k in (1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 16, 17, 20)]
)
def test_every_code_has_two_variants(code):
    assert sum(row.code == code for row in TABLE) >= 2


FINE = {
    "sorted": (SWAP, ["--sort"], "D13: sorted by time, 2 of 300 rows moved"),
    "cut": (text(BACK), ["--sort-segments"], "D13: cut where time goes back, 1 times"),
    "skipped": (text() + "30.0,1\n", ["--ragged", "skip"], "D05: skipped 1 ragged rows"),
    "uncertain": (
        text(q=["Good"] * 290 + ["Uncertain"] * 10),
        ["--quality", "q", "--uncertain", "keep"],
        "quality of `y` from q: 290 Good, 10 Uncertain kept, 0 Bad dropped",
    ),
    "one quality": (
        text(q=["OK"] * 298 + ["Bad", "Bad"]),
        ["--quality", "y=q", "--missing", "segments"],
        "quality of `y` from q: 298 Good, 0 Uncertain dropped, 2 Bad dropped",
    ),
    "sentinel": (
        text(y=cells(Y, {7: "-9999", 9: "65535"})),
        ["--sentinel", "-9999", "--sentinel", "65535", "--missing", "mask"],
        "65535 read as missing (y 1)",
    ),
    "date and time": (
        text(["2024-01-01"] * N, header="Date,u,y", Time=clock("10:{:02}:{:02}")),
        ["--time", "Date", "--time", "Time"],
        "time from columns Date Time",
    ),
}


@pytest.mark.parametrize("case", FINE)
def test_options_on_the_command_line_reach_the_log(tmp_path, case):
    content, options, said = FINE[case]
    path = tmp_path / "a.csv"
    path.write_text(content)
    done = plantune(
        "tune", path, "--u", "u", "--y", "y", *options, "--json", "--out", tmp_path / "out"
    )
    assert done.exit_code == 0, done.output
    assert any(line.startswith(said) for line in strict_json(done.stdout)["record"]["log"])


def test_several_files_on_the_command_line(tmp_path):
    for name in "ab":
        (tmp_path / f"{name}.csv").write_text(text())
    options = ["--u", "u", "--y", "y", "--json", "--out", tmp_path / "out"]
    done = plantune("tune", tmp_path / "a.csv", tmp_path / "b.csv", *options)
    assert done.exit_code == 0, done.output
    run = strict_json(done.stdout)
    assert run["record"]["starts"] == [0, N]
    assert run["title"] == "a and 1 more"


def test_several_files_that_differ_are_refused_by_name(tmp_path):
    (tmp_path / "a.csv").write_text(text())
    (tmp_path / "b.csv").write_text(text(t=2 * T))
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    found = check_cli_refusal(tmp_path, "U01", ("measured",), *paths, "--u", "u", "--y", "y")
    assert "b.csv differs from a.csv in its sample time" in found["text"]
    (tmp_path / "b.csv").write_text(text(y=cells(Y, {4: ""})))
    found = check_cli_refusal(tmp_path, "D07", EVERY, *paths, "--u", "u", "--y", "y")
    assert found["text"].startswith("b.csv: `y` is missing")
