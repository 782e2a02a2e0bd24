"""MAT files: written by scipy, read from the record sets, and damaged in every way."""

import io
import os
import struct
import zlib

import numpy as np
import pytest
from pytest import approx
from scipy.io import loadmat, savemat

import plantune as pt
from plantune.io import worker
from plantune.io.mat_tags import check_tags

N = 240
T = np.arange(N) * 0.5
U = np.where(np.arange(N) // 7 % 2, 1.0, -1.0)
Y = np.round(20 + np.cumsum(U) * 0.05, 4)


def written(variables, **options):
    file = io.BytesIO()
    savemat(file, variables, **options)
    return file.getvalue()


@pytest.fixture
def read(tmp_path):
    def read(content, **wanted):
        data = content if isinstance(content, bytes) else written(content)
        (tmp_path / "a.mat").write_bytes(data)
        return pt.read(tmp_path / "a.mat", **{"u": "u", "y": "y", **wanted})

    return read


@pytest.mark.parametrize(
    "options",
    [{}, {"do_compression": True}, {"format": "4"}, {"oned_as": "column"}],
    ids=["5", "packed", "4", "column"],
)
def test_vectors_are_columns(read, options):
    rec = read(written({"t": T, "u": U.astype(np.int8), "y": Y}, **options))
    assert np.array_equal(rec.u[:, 0], U) and np.array_equal(rec.y[:, 0], Y) and rec.Ts == 0.5
    assert rec.log == ("read 240 rows of a MAT file", "time from column t")


def test_matrices_and_structures(read):
    content = {"A": np.stack([Y, U], axis=1), "W": np.stack([U, T]), "s": {"in": {"u": U}, "y": Y}}
    rec = read(content, u="A[1]", y="A[0]", Ts=0.5)
    assert np.array_equal(rec.y[:, 0], Y) and np.array_equal(rec.u[:, 0], U)
    rec = read(content, u="W[0]", y="s.y", time="W[1]")
    assert rec.Ts == 0.5 and "W: 2 rows of 240 read as columns" in rec.log
    assert np.array_equal(read(content, u="s.in.u", y="s.y", Ts=0.5).u[:, 0], U)


def test_vectors_of_other_lengths_are_not_in_the_way(read):
    content = {"time": T[:50], "u": U, "y": Y, "z": Y[:100], "note": "text", "n": 3.0}
    rec = read(content, Ts=0.5)
    assert rec.N == N  # `time` has another length
    with pytest.raises(pt.UsageError) as caught:
        read(content, u="power")
    assert "0 'time' (50 rows), 1 'u' (240 rows)" in caught.value.text
    assert "note" not in caught.value.text
    with pytest.raises(pt.DataError) as caught:
        read(content, y="z", Ts=0.5)
    error = caught.value
    assert (error.code, error.count, error.where[0]) == ("D09", 140, "z")


@pytest.mark.parametrize("wanted", [{"time": "short"}, {"quality": "short"}, {"aux": "short"}])
def test_no_column_is_cut_to_the_length_of_another(read, wanted):
    with pytest.raises(pt.DataError) as caught:
        read({"u": U, "y": Y, "short": 192.0 + 0 * T[:50]}, Ts=0.5, **wanted)
    assert caught.value.code == "D09" and caught.value.where[0] == "short"


def test_missing_and_complex_values(read):
    y = Y.copy()
    y[7] = np.nan
    assert read({"u": U, "y": y}, Ts=0.5, missing="mask").valid.sum() == N - 1
    with pytest.raises(pt.DataError) as caught:
        read({"u": U, "y": Y + 1j}, Ts=0.5)
    assert caught.value.code == "D11" and caught.value.where[0] == "y"


CALLS = {
    ("ball_and_hoop", "fixedStepSequence"): {"u": "u", "y": "y"},
    ("ball_and_hoop", "randomStepSequence"): {"u": "u", "y": "y"},
    ("coupled_drives_prbs", "drive"): {"u": "u1", "y": "z1", "Ts": 0.02},
    ("float_shield", "APRBS_R4_2"): {"u": "u", "y": "y", "Ts": 0.025},
    ("float_shield", "PRBS_R4"): {"u": "u", "y": "y", "Ts": 0.025},
    ("heat_shield", "resultID"): {"u": "resultID[1]", "y": "resultID[0]", "Ts": 2.0},
    ("hydraulic_actuator", "actuator"): {"u": "u", "y": "p", "aux": "x", "Ts": 1.0},
    ("moto_shield", "aprbsResult"): {"u": "u", "y": "y", "aux": ["i", "ifltr"], "Ts": 0.02},
    ("opto_shield", "resultID"): {"u": "resultID[1]", "y": "resultID[0]", "Ts": 0.005},
    ("piezo_kv", "MeasurementData"): {"u": "Vplus_1kv", "y": "Displacement_1kv", "Ts": 1.0},
}


@pytest.mark.parametrize("which", CALLS, ids="/".join)
def test_every_record_set_is_read(data, which):
    path = data(which[0]) / f"{which[1]}.mat"
    wanted = CALLS[which]
    rec = pt.read(path, **wanted)
    variables = loadmat(path)
    for name, column in ((wanted["u"], rec.u), (wanted["y"], rec.y)):
        variable, _, number = name.rstrip("]").partition("[")
        expected = variables[variable].astype(float)[:, int(number or 0)]
        assert np.array_equal(column[:, 0], expected)
    assert rec.Ts == approx(wanted.get("Ts", 0.1), rel=1e-9)


# --- damage ---


def elements(*parts):
    """Write a file of version 5 with these elements, each a type and its bytes."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + b"".join(struct.pack("<II", kind, len(body)) + body for kind, body in parts)


PACKED = zlib.compress(struct.pack("<II", 14, 64) + bytes(64))


@pytest.mark.parametrize(
    ("data", "code", "said"),
    [
        (elements((14, b""))[:-4], "D02", "begins an element, and the file ends"),
        (elements((14, bytes(64)))[:-1], "D02", "declares 64 bytes, and 63 are left"),
        (elements((9, bytes(8))), "D02", "has type 9, which begins no variable"),
        (elements((15, b"no zlib")), "D02", "packed bytes from 128 on are none"),
        (elements((15, PACKED[:4])), "D02", "end at once"),
        (elements((15, zlib.compress(bytes(8)))), "D02", "have type 0"),
        (elements((15, PACKED), (14, b"12"))[:-2], "D02", "declares 2 bytes, and 0 are left"),
        (elements((15, zlib.compress(struct.pack("<II", 14, 2**31)))), "D01", "2147483648 bytes"),
        (elements(*[(15, zlib.compress(struct.pack("<II", 14, 2**19)))] * 3), "D01", "1572864"),
        (struct.pack("<5I", 0, 2**31, 2**31, 0, 2) + b"a\0", "D02", "are left"),
        (struct.pack("<5I", 0, 2, 1, 7, 2) + bytes(99), "D02", "which is no matrix"),
        (b"MATLAB 5.0 MAT-file".ljust(128), "D02", "and is a MATLAB file of version 5"),
    ],
)
def test_tags_are_walked_before_anything_is_unpacked(monkeypatch, data, code, said):
    monkeypatch.setattr(worker.subprocess, "run", None)  # no worker is started
    with pytest.raises(pt.DataError) as caught:
        check_tags(data)
    assert caught.value.code == code and said in caught.value.text and caught.value.remedy


def test_truncated_anywhere():
    data = written({"u": U, "y": Y}, do_compression=True)
    for end in [*range(0, 160), *range(160, len(data) - 1, 37)]:
        if end == 128 or data[:end] == b"":
            continue  # a head without variables is D04
        try:
            check_tags(data[:end])
        except pt.DataError as error:
            assert error.code == "D02"
        else:
            first = 136 + int.from_bytes(data[132:136], "little")
            assert end == first  # between two variables


def test_flipped_tags_end_in_an_answer():
    data = written({"u": U, "y": Y, "s": {"a": Y}})
    rng = np.random.default_rng(3)
    for _ in range(2000):
        flipped = bytearray(data)
        for at in rng.integers(0, len(data), rng.integers(1, 5)):
            flipped[at] = rng.integers(256)
        try:
            check_tags(bytes(flipped))
        except pt.DataError as error:
            assert error.code in ("D01", "D02") and str(error).count("\n") <= 2


@pytest.mark.parametrize("seed", range(10))
def test_flipped_bytes_end_in_a_record_or_a_refusal(read, seed):
    rng = np.random.default_rng(seed)
    data = bytearray(written({"u": U, "y": Y, "s": {"a": Y}}))
    heads = [data.find(name) - 48 for name in (b"u\0", b"y\0", b"s\0")]
    for at in rng.choice(heads) + rng.integers(8, 64, 2 + seed % 3):  # within the matrix's own tags
        data[max(136, at)] ^= 1 << rng.integers(8)
    try:
        assert read(bytes(data), Ts=0.5).N >= 2
    except pt.PlantuneError as error:
        assert error.code in ("D01", "D02", "D04", "D09", "D11", "D12", "D07", "D08", "U01")
        assert error.remedy and str(error).count("\n") <= 2


# --- the worker ---


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """Give `reader(code)`, which has a worker run a reader of that body."""

    def reader(code):
        path = tmp_path / "plantune_strange.py"
        path.write_text(f"NEEDS = ()\ndef decode(data, wanted):\n    {code}\n")
        child = "import sys; sys.path[:] = sys.argv[1:]; import plantune_strange; "
        child += "sys.modules['plantune.io.strange'] = plantune_strange; "
        child += "from plantune.io.child import serve; serve()"
        monkeypatch.setattr(worker, "_START", child)
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.setattr(worker, "SECONDS", 1.0)
        with pytest.raises(pt.PlantuneError) as caught:
            worker.decode("strange", b"data")
        assert caught.value.remedy and str(caught.value).count("\n") <= 2
        return caught.value

    return reader


@pytest.mark.parametrize(
    ("body", "code", "said"),
    [
        ("import os; os._exit(3)", "D02", "ends its reader (code 3)"),
        ("import os; os.abort()", "D02", "ends its reader"),
        ("raise RuntimeError('strange\\ntext')", "D02", "RuntimeError 'strange'"),
        ("return [None]", "D02", "AttributeError"),
    ],
)
def test_a_reader_that_fails_is_a_refusal(reader, body, code, said):
    error = reader(body)
    assert error.code == code and said in error.text


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no limit on memory here")
def test_a_reader_that_takes_too_much_memory_is_d01(reader):
    error = reader("return [bytearray(2**29)]")
    assert (error.code, error.limit) == ("D01", 2.0**20)


@pytest.mark.parametrize("body", ["while True: pass", "import signal; signal.pause()"])
def test_a_reader_that_does_not_end_is_d01(reader, body):
    error = reader(body)
    assert error.code == "D01" and "takes more than 1 s" in error.text


def test_a_missing_package_is_u01(read, monkeypatch):
    monkeypatch.setattr(worker, "find_spec", lambda name: None)
    with pytest.raises(pt.UsageError) as caught:
        read({"u": U, "y": Y}, Ts=0.5)
    assert caught.value.remedy == "pip install plantune[io]" and "scipy" in caught.value.text
