"""Parquet: written by pyarrow, read as the same record, and damaged in every way."""

import io
from decimal import Decimal

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from pytest import approx

import plantune as pt
from plantune.io.parquet import open_parquet

N = 240
T = np.arange(N) * 0.5
U = np.where(np.arange(N) // 7 % 2, 1.0, -1.0)
Y = np.round(20 + np.cumsum(U) * 0.05, 4)


def written(columns, **options):
    file = io.BytesIO()
    table = columns if isinstance(columns, pa.Table) else pa.table(columns)
    parquet.write_table(table, file, **options)
    return file.getvalue()


PLAIN = {"time [s]": T, "u [V]": U, "y": Y}


@pytest.fixture
def read(tmp_path):
    def read(content, name="a.parquet", **wanted):
        data = content if isinstance(content, bytes) else written(content)
        (tmp_path / name).write_bytes(data)
        return pt.read(tmp_path / name, **{"u": "u", "y": "y", **wanted})

    return read


@pytest.mark.parametrize("compression", ["none", "snappy", "gzip", "zstd"])
@pytest.mark.parametrize("name", ["a.parquet", "a.PQ"])
def test_the_same_record_as_from_text(read, tmp_path, compression, name):
    rec = read(written(PLAIN, compression=compression, row_group_size=100), name)
    rows = zip(T, U, Y, strict=True)
    lines = ["time [s],u [V],y", *(",".join(repr(float(v)) for v in row) for row in rows)]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    text = pt.read(tmp_path / "a.csv", u="u", y="y")
    assert rec.source == text.source and rec.Ts == 0.5
    assert dict(rec.units) == dict(text.units) == {"u": "V"}
    assert rec.log[0] == "read 240 rows of a Parquet file of 3 columns"


def test_all_kinds_of_numbers_in_one_file(read):
    whole = np.arange(N) % 100
    kinds = {
        **{
            str(kind): pa.array(whole).cast(kind) for kind in (pa.int8(), pa.uint64(), pa.float32())
        },
        "decimal": pa.array([Decimal(int(k)) / 4 for k in whole]),
        "dictionary": pa.array(whole * 1.5).dictionary_encode(),
        "bool": pa.array(whole % 3 == 0),
        "text": pa.array([str(k / 8) for k in whole]),
    }
    rec = read({**PLAIN, **kinds}, u="u [V]", aux=list(kinds))
    factors = {"decimal": 0.25, "dictionary": 1.5, "text": 0.125}
    for name in kinds:
        expected = whole % 3 == 0 if name == "bool" else whole * factors.get(name, 1.0)
        assert np.array_equal(rec.aux[name], expected), name
    assert "`text` is string, read as numbers" in rec.log


def test_nulls_are_missing(read):
    y = pa.array([None if k in (5, 9) else float(k) for k in range(N)])
    rec = read({**PLAIN, "y": y}, missing="mask")
    assert np.flatnonzero(~rec.valid[:, 0]).tolist() == [5, 9]
    with pytest.raises(pt.DataError) as caught:
        read({**PLAIN, "y": y})
    error = caught.value
    assert (error.code, error.where, error.count) == ("D07", ("y", 5, 2.5), 2)
    assert "first in row 5" in error.text


STAMPS = np.datetime64("2024-03-30T23:59:50", "ms") + np.arange(N) * np.timedelta64(500, "ms")


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
@pytest.mark.parametrize("zone", [None, "UTC", "+02:00"])
def test_timestamps_in_any_unit(read, unit, zone):
    rec = read({**PLAIN, "time [s]": pa.array(STAMPS).cast(pa.timestamp(unit, zone))})
    assert rec.Ts == approx(0.5, rel=1e-12) and rec.t0 == 0.0
    assert any(line.startswith("time 0 is 2024-03-30T23:59:50") for line in rec.log)
    assert any("timestamp[" in line and (zone or "[") in line for line in rec.log)


def test_dates_and_stamps_in_text(read):
    days = pa.array(np.datetime64("2024-01-01") + np.arange(N))
    assert read({**PLAIN, "time [s]": days}).Ts == 86400.0
    assert read({"Date": days.cast(pa.string()), "u": U, "y": Y}).Ts == 86400.0


def test_a_missing_stamp_is_d07(read):
    stamps = pa.array([None, *STAMPS[1:].tolist()], pa.timestamp("ms"))
    with pytest.raises(pt.DataError) as caught:
        read({**PLAIN, "time [s]": stamps})
    assert (caught.value.code, caught.value.where[1]) == ("D07", 0)


def test_quality_in_words_and_numbers(read):
    words = pa.array(["Good"] * 235 + ["Bad"] * 5).dictionary_encode()
    numbers = [192] * 235 + [0] * 5
    for q in (words, numbers):
        rec = read({**PLAIN, "q": q}, quality={"y": "q"}, missing="segments")
        assert rec.N == 235


def test_names_that_stand_twice(read):
    twice = pa.table([pa.array(x) for x in (U, Y, Y + 1, Y + 2)], names=["u", "y", "y", "z.z"])
    with pytest.raises(pt.DataError) as caught:
        read(twice, Ts=1.0)
    assert caught.value.code == "D12" and "numbers 1, 2" in caught.value.text
    assert np.array_equal(read(twice, y=2, Ts=1.0).y[:, 0], Y + 1)
    assert np.array_equal(read(twice, y=["z.z", 1], Ts=1.0).y, np.stack([Y + 2, Y], axis=1))


@pytest.mark.parametrize(
    ("column", "code"),
    [
        (["on"] * N, "D06"),
        ([[1.0, 2.0]] * N, "D11"),
        ([{"a": 1.0}] * N, "D11"),
        (STAMPS, "D11"),
        ([b"\0\1"] * N, "D11"),
    ],
    ids=["words", "lists", "structures", "times", "bytes"],
)
def test_what_is_no_number_is_named(read, column, code):
    with pytest.raises(pt.DataError) as caught:
        read({**PLAIN, "y": column})
    error = caught.value
    assert error.code == code and error.where[:2] == ("y", 0) and error.count == N
    other = read({**PLAIN, "odd": column})  # it does not matter where it is not asked for
    assert np.array_equal(other.y[:, 0], Y)


def test_more_numbers_than_fit_are_refused_before_they_are_read(read):
    data = written({"u": np.zeros(4_000_000), "y": np.zeros(4_000_000)})
    with pytest.raises(pt.DataError) as caught:
        read(data, Ts=1.0)
    error = caught.value
    assert (error.code, error.measured, error.limit) == ("D01", 64e6, 100.0 * len(data))


def test_truncated_anywhere(read):
    data = written(PLAIN)
    for end in range(0, len(data), 97):
        with pytest.raises(pt.DataError) as caught:
            open_parquet(data[:end])
        assert caught.value.code == "D02"


def test_flipped_bytes_of_the_footer_end_in_a_table_or_a_refusal():
    data = written(PLAIN)
    footer = int.from_bytes(data[-8:-4], "little")
    rng = np.random.default_rng(7)
    for _ in range(500):
        flipped = bytearray(data)
        for at in rng.integers(len(data) - 8 - footer, len(data), rng.integers(1, 4)):
            flipped[at] = rng.integers(256)
        try:
            open_parquet(bytes(flipped))
        except pt.DataError as error:
            assert error.code in ("D01", "D02", "D04") and error.remedy
            assert str(error).count("\n") <= 2


@pytest.mark.parametrize("seed", range(8))
def test_flipped_bytes_of_the_pages_end_in_a_record_or_a_refusal(read, seed):
    rng = np.random.default_rng(seed)
    data = bytearray(written({**PLAIN, "y": pa.array(Y).dictionary_encode()}))
    footer = int.from_bytes(data[-8:-4], "little")
    for at in rng.integers(4, len(data) - 8 - footer, 3 + seed):
        data[at] ^= 1 << rng.integers(8)
    try:
        assert read(bytes(data), Ts=0.5, time="time [s]").N == N
    except pt.PlantuneError as error:
        assert error.code[0] == "D" and error.remedy and str(error).count("\n") <= 2
