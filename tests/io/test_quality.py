"""What a historian says of its values, and values that mean missing."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from plantune.io.quality import BAD, GOOD, UNCERTAIN, grades
from plantune.io.table import Places

N = 100


def graded(cells):
    kind = "S40" if isinstance(cells[0], str | bytes) else None
    return grades(np.array(cells, kind), "q", Places(np.arange(len(cells)))).tolist()


@pytest.mark.parametrize(
    ("words", "grade"),
    [
        (["Good", "GOOD", "ok", " good ", "GoodClamped", "Good, non-specific", "192", "219"], GOOD),
        (["Uncertain", "uncertain_LastUsable", "Questionable", "64", "127"], UNCERTAIN),
        (["Bad", "BAD", "BadSensorFailure", "", "NaN", "No Data", "0", "63", "192"], BAD),
    ],
)
def test_words_and_opc_numbers(words, grade):
    found = graded(words)
    assert found[:-1] == [grade] * (len(words) - 1)


@pytest.mark.parametrize(
    ("code", "grade"),
    [
        (0x00000000, GOOD),
        (0x00300000, GOOD),  # GoodClamped
        (0x40000000, UNCERTAIN),
        (0x40900000, UNCERTAIN),  # UncertainLastUsableValue
        (0x80000000, BAD),
        (0x808C0000, BAD),  # BadSensorFailure
        (0x80310000 - 2**32, BAD),  # BadNoCommunication as a signed number
    ],
)
@pytest.mark.parametrize("write", [float, str, hex])
def test_status_codes_of_opc_ua(code, grade, write):
    """The codes are those of OPC 10000-4, 7.39 and OPC 10000-6, A.2."""
    if write is hex and code < 0:
        code += 2**32
    other = 0x80000000
    assert graded([write(code), write(other)]) == [grade, BAD]


@pytest.mark.parametrize("cells", [[150.0], [300.0], [192.5], [float("inf")], [0xC0000000], ["?"]])
def test_what_is_no_quality_is_listed(cells):
    with pytest.raises(pt.DataError) as caught:
        graded([*cells, cells[0]])
    error = caught.value
    assert (error.code, error.count, error.where) == ("D17", 2, ("q", 0, None))
    assert "2x" in error.text and error.remedy


@pytest.mark.parametrize("cells", [[0.0, 0.0], [0.0, 1.0], ["0", "0"]])
def test_zeros_have_two_readings(cells):
    with pytest.raises(pt.DataError, match="0 is Good as an OPC UA code") as caught:
        graded(cells)
    assert caught.value.code == "D17"


U = np.where(np.arange(N) // 7 % 2, 1.0, -1.0)
Y = np.round(np.sin(np.arange(N)), 3)
Q = np.where(np.isin(np.arange(N), [5, 50]), "Bad", "Good")
Q = np.where(np.isin(np.arange(N), [70, 71, 72]), "Uncertain", Q)


@pytest.fixture
def read(tmp_path):
    rows = zip(U.tolist(), Y.tolist(), Q.tolist(), ["Good"] * N, strict=True)
    lines = ["u,y,q,all good", *(",".join(map(str, row)) for row in rows)]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    return lambda **wanted: pt.read(tmp_path / "a.csv", u="u", y="y", Ts=1.0, **wanted)


def test_bad_is_missing_and_uncertain_is_doubtful(read):
    rec = read(quality={"y": "q"}, missing="mask")
    assert np.flatnonzero(~rec.valid[:, 0]).tolist() == [5, 50, 70, 71, 72]
    assert "quality of `y` from q: 95 Good, 3 Uncertain dropped, 2 Bad dropped" in rec.log
    (note,) = rec.notes
    assert (note.code, note.severity, note.count, note.measured) == ("D17", "warning", 3, 0.03)
    assert note.where == ("y", 70, 70.0) and "dropped" in note.text


def test_uncertain_values_are_kept_by_option(read):
    rec = read(quality={"y": "q"}, missing="mask", uncertain="keep")
    assert np.flatnonzero(~rec.valid[:, 0]).tolist() == [5, 50]
    (note,) = rec.notes
    assert note.code == "D17" and note.count == 3 and "kept" in note.text


def test_one_column_grades_all_others(read):
    rec = read(quality="q", missing="segments")
    assert rec.N == N - 5 and rec.starts.tolist() == [0, 5, 49, 68]
    assert sum(line.startswith("quality of ") for line in rec.log) == 2
    plain = read(quality="all good")
    assert plain.notes == () and np.array_equal(plain.y[:, 0], Y)


def test_the_refusal_says_that_quality_took_the_values(read):
    with pytest.raises(pt.DataError) as caught:
        read(quality={"y": "q"})
    error = caught.value
    assert (error.code, error.count, error.where) == ("D07", 5, ("y", 5, 5.0))
    assert "y: 2 of quality Bad, y: 3 of quality Uncertain" in error.text
    with pytest.raises(pt.DataError) as caught:
        read(quality="q", missing="mask", limits=pt.Limits(D07=0.01))
    assert caught.value.code == "D07"


def test_wrong_names_are_u01(read):
    for wanted in ({"quality": "nothing"}, {"quality": {"q": "q"}}, {"uncertain": "perhaps"}):
        with pytest.raises(pt.UsageError):
            read(**wanted)


# --- sentinels ---


def test_sentinels_are_missing(read, tmp_path):
    path = tmp_path / "s.csv"
    y = Y.copy()
    y[[3, 9]], y[12] = -9999.0, 65535.0
    path.write_text("u,y\n" + "\n".join(f"{a},{b}" for a, b in zip(U, y, strict=True)))
    plain = pt.read(path, u="u", y="y", Ts=1.0)
    assert plain.y.min() == -9999
    rec = pt.read(path, u="u", y="y", Ts=1.0, sentinels=(-9999, 65535), missing="mask")
    assert np.flatnonzero(~rec.valid[:, 0]).tolist() == [3, 9, 12]
    assert "-9999 read as missing (y 2)" in rec.log and "65535 read as missing (y 1)" in rec.log
    assert rec.y[~rec.valid].max() == approx(Y.max(), abs=1)  # held, no sentinel is left
    with pytest.raises(pt.DataError) as caught:
        pt.read(path, u="u", y="y", Ts=1.0, sentinels=-9999)
    assert caught.value.code == "D07" and "(-9999 2x)" in caught.value.text
    with pytest.raises(pt.UsageError):
        pt.read(path, u="u", y="y", Ts=1.0, sentinels=("none",))
