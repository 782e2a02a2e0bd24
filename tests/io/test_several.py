"""Several files as one record."""

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import plantune as pt

U = np.where(np.arange(100) // 7 % 2, 1.0, -1.0)
Y = np.sin(np.arange(100))


@pytest.fixture
def write(tmp_path):
    def write(name, rows=slice(None), header="time,u [V],y", Ts=0.5, change=None):
        t = np.arange(100)[rows] * Ts
        cells = [[repr(float(v)) for v in row] for row in zip(t, U[rows], Y[rows], strict=True)]
        if change:
            cells[change[0]][2] = change[1]
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join([header, *map(",".join, cells)]))
        return path

    return write


def test_files_are_segments(write):
    paths = [write("a.csv", slice(0, 60)), write("b.csv", slice(60, 100)), write("c.csv")]
    rec = pt.read(paths, u="u", y="y")
    assert rec.starts.tolist() == [0, 60, 100] and rec.N == 200
    assert np.array_equal(rec.u[:100, 0], U) and np.array_equal(rec.y[100:, 0], Y)
    assert np.array_equal(rec.rows, np.arange(200))  # no row is taken for another file's
    assert [line for line in rec.log if " rows " in line and line.startswith("b.csv: rows")] == [
        "b.csv: rows 60 to 99, 40 kept, Ts 0.5 s"
    ]
    assert "c.csv: time from column time" in rec.log and dict(rec.units) == {"u": "V"}


def test_one_file_in_a_list_is_the_file(write):
    path = write("a.csv")
    assert pt.read([path], u="u", y="y").source == pt.read(path, u="u", y="y").source


def test_gaps_and_notes_are_kept_with_their_file(write):
    paths = [write("a.csv"), write("b.csv", change=(50, ""))]
    rec = pt.read(paths, u="u", y="y", Ts=1.0, missing="segments")
    assert rec.starts.tolist() == [0, 100, 150] and rec.N == 199 and rec.rows[150] == 151
    assert [note.text.split(":")[0] for note in rec.notes if note.code == "D16"] == [
        "a.csv",
        "b.csv",
    ]


def test_formats_may_differ(write, tmp_path):
    parquet.write_table(pa.table({"u [V]": U, "y": Y}), tmp_path / "b.parquet")
    rec = pt.read([write("a.csv"), tmp_path / "b.parquet"], u="u", y="y", Ts=0.5)
    assert rec.starts.tolist() == [0, 100] and np.array_equal(rec.y[:100], rec.y[100:])


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"header": "time,u [mV],y"}, "in its units: u [mV] instead of u [V]"),
        ({"Ts": 0.25}, "in its sample time: 0.25 s instead of 0.5 s"),
    ],
)
def test_what_differs_is_named(write, other, said):
    with pytest.raises(pt.UsageError) as caught:
        pt.read([write("a.csv"), write("b.csv", **other)], u="u", y="y")
    assert f"b.csv differs from a.csv {said}" in caught.value.text and caught.value.remedy


def test_other_columns_under_one_number_are_named(write):
    paths = [write("a.csv"), write("b.csv", header="time,valve,y")]
    with pytest.raises(pt.UsageError, match="in its inputs: valve instead of u"):
        pt.read(paths, u=1, y=2)


def test_a_refusal_names_its_file(write):
    paths = [write("a.csv"), write("more/a.csv", change=(3, "Bad"))]
    with pytest.raises(pt.DataError) as caught:
        pt.read(paths, u="u", y="y")
    error = caught.value
    assert error.code == "D06" and error.text.startswith(f"{paths[1]}: `y` holds")
    assert error.where == ("y", 3, None) and error.count == 1


def test_no_file_is_u01():
    with pytest.raises(pt.UsageError):
        pt.read([], u="u", y="y")
