"""What is wrong with a record: found where it was put, and not found anywhere else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx
from scipy.io import loadmat

import plantune as pt
from contract.records import TS, b0, levels, record
from plantune.analyze.health import Sentinel, Spike, Stretch

U, Y = b0()


def with_values(x, value, rows):
    x = np.array(x)
    x[rows] = value
    return x


# --- stuck outputs ---


@pytest.mark.parametrize("rows", [slice(300, 600), slice(0, 250), slice(700, 1000)])
def test_a_held_value_is_found_with_its_rows(rows):
    found = pt.analyze.health(record(y=with_values(Y, Y[rows.start], rows)))
    assert found.stuck == (Stretch("y", rows.start, rows.stop - 1),)
    (note,) = found.notes
    assert (note.code, note.severity) == ("D18", "warning")
    assert note.where == ("y", rows.start, approx(TS * rows.start))
    assert (note.measured, note.limit) == (rows.stop - rows.start, 200)
    assert bool(found)  # doubtful, not forbidden


@pytest.mark.parametrize("length", [50, 150, 199])
def test_shorter_stretches_are_let_pass(length):
    y = with_values(Y, Y[300], slice(300, 300 + length))
    assert pt.analyze.health(record(y=y)).notes == ()


@given(
    T=st.floats(5, 80),
    L=st.integers(0, 60),
    at=st.integers(20, 900),
    quantum=st.sampled_from([0.0, 0.001, 0.05, 0.3]),
    down=st.booleans(),
)
def test_rest_before_a_step_and_after_settling_is_not_stuck(T, L, at, quantum, down):
    """Noise-free and of few levels: most rows of such an output repeat the one before."""
    u = np.zeros(1000)
    u[at:] = 2.0
    if down:
        u[(at + 1000) // 2 :] = 0.5
    y = pt.models.ProcessModel(K=3.0, T=T, L=float(L)).simulate(u, 1.0)
    y = np.round(y / quantum) * quantum if quantum else y
    found = pt.analyze.health(pt.Record(u=u, y=y, Ts=1.0))
    assert found.stuck == ()
    assert found.spikes == ()


def test_a_sensor_that_dies_before_the_second_step_is_found():
    u = np.zeros(1000)
    u[100:500] = 1.0
    y = pt.models.ProcessModel(K=3.0, T=20.0, L=5.0).simulate(u, 1.0)
    y[400:] = y[400]
    (stretch,) = pt.analyze.health(pt.Record(u=u, y=y, Ts=1.0)).stuck
    assert (stretch.first, stretch.last) == (400, 999)


def test_rows_are_those_of_the_file_and_segments_end_a_stretch():
    y = with_values(Y, Y[300], slice(300, 700))
    part = record(y=y).take(slice(200, 1000))
    assert pt.analyze.health(part).stuck == (Stretch("y", 300, 699),)
    cut = pt.Record(u=U, y=y, Ts=TS, starts=[0, 480])
    assert pt.analyze.health(cut).stuck == (Stretch("y", 480, 699),)  # 180 and 220 rows


# --- spikes ---


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("hold", [1, 7])
def test_five_spikes_of_twenty_sd_are_found_and_no_other(seed, hold):
    rng = np.random.default_rng(seed)
    u = np.repeat(levels(1000, seed), hold)[:1000]
    y = pt.models.PolyModel(A=[1, -0.8], B=[0.5], nk=1, Ts=TS).simulate(u)
    y += 0.02 * rng.normal(size=1000)
    rows = np.sort(rng.choice(np.arange(1, 999, 3), 5, replace=False))
    y[rows] += 20 * y.std() * rng.choice([-1, 1], 5)
    found = pt.analyze.health(record(u, y))
    assert [s.row for s in found.spikes] == rows.tolist()
    (note,) = found.notes
    assert (note.code, note.severity, note.count, note.limit) == ("D19", "warning", 5, 20)
    assert all(str(row) in note.text for row in rows)


def test_scaling_the_output_changes_nothing():
    y = with_values(Y, 40.0, [100, 102, 500])
    plain, scaled = (pt.analyze.health(record(y=y * c)) for c in (1.0, -1e-9))
    assert [s.row for s in plain.spikes] == [100, 102, 500]
    for a, b in zip(plain.spikes, scaled.spikes, strict=True):
        assert isinstance(a, Spike)
        assert (a.signal, a.row) == (b.signal, b.row)
        assert a.size == approx(b.size, rel=1e-9)


def test_a_limit_decides_and_is_noted():
    y = with_values(Y, 40.0, [100])
    found = pt.analyze.health(record(y=y), limits=pt.Limits(D19=1e3))
    assert found.spikes == ()
    assert [note.severity for note in found.notes] == ["info"]


# --- sentinels ---


@pytest.mark.parametrize("code", [-9999, 65535, 32767, -999, 9999])
@pytest.mark.parametrize("column", ["u", "y"])
def test_codes_are_errors_that_name_value_and_count(code, column):
    x = {"u": U, "y": Y}
    x[column] = with_values(x[column], code, [7, 300, 301])
    found = pt.analyze.health(record(**x))
    assert found.sentinels == (Sentinel(column, code, 3),)
    assert not found
    (note,) = found.notes
    assert (note.code, note.severity, note.count) == ("D19", "error", 3)
    assert note.where == (column, 7, approx(7 * TS))
    assert str(code) in note.text
    assert note.remedy == f"read it as missing: read(..., sentinels=({code},))"


@pytest.mark.parametrize(
    "y",
    [
        np.linspace(0, 65535, 1000).round(),  # a counter
        np.minimum(100.0 * np.arange(1000), 32767),  # a converter at its end
        np.where(U > 0, 65535.0, 0.0),  # two levels
        np.linspace(9000, 9999, 1000).round(),
        np.full(1000, 9999.0),
    ],
)
def test_codes_among_their_like_are_values(y):
    assert pt.analyze.health(record(U + 0.001 * np.arange(1000), y)).sentinels == ()


def test_a_code_that_does_not_count_is_not_looked_at():
    y = with_values(Y, -9999.0, [7, 300])
    assert pt.analyze.health(record(y=y, valid=y > -9999)).notes == ()


# --- measured records ---


def test_shipped_records_are_healthy():
    for rec in (pt.datasets.hair_dryer(), pt.datasets.robot_arm(), pt.datasets.engine_loop()):
        found = pt.analyze.health(rec)
        assert found.notes == ()
        assert str(found) == "nothing wrong"


TABLES = {  # file: inputs, outputs, what a table needs
    "ball_beam/ballbeam.dat": ([0], [1], {}),
    "industrial_dryer/dryer2.dat": ([1, 2, 3], [4, 5, 6], {}),
    "power_plant/powerplant.dat": ([1, 2, 3, 4, 5], [6, 7, 8], {}),
    "glass_furnace/glassfurnace.dat": ([1, 2, 3], [4, 5, 6, 7, 8, 9], {}),
    "winding/winding.dat": ([0, 1, 2, 3, 4], [5, 6], {}),
    "cstr_sim/cstr.dat": ([1], [2, 3], {}),
    "ph_neutralisation_sim/pHdata.dat": ([1, 2], [3], {}),
    "wing_flutter/flutter.dat": ([0], [1], {}),
    "gas_furnace/gas-furnace.csv": ([0], [1], {}),
    "process_reaction_curve/prc.csv": ([1], [0], {}),
    "buck_converter/buck_id.csv": ([1], [2], {}),
    "tclab_mimo/data_no_headers.csv": ([1, 2], [3, 4], {}),
    "tclab_step/data_step_test.csv": ([1], [2], {"time": 0, "resample": 1.0}),
}


@pytest.mark.parametrize("path", TABLES)
def test_measured_records_raise_no_alarm(data, path):
    folder, name = path.split("/")
    u, y, more = TABLES[path]
    rec = pt.read(data(folder) / name, u=u, y=y, **(more or {"Ts": 1.0}))
    assert pt.analyze.health(rec).notes == ()


@pytest.mark.parametrize(
    ("path", "u", "y"),
    [
        ("heat_shield/resultID.mat", 1, 0),  # 380 levels, longest stretch 159 of 8100 rows
        ("opto_shield/resultID.mat", 1, 0),
    ],
)
def test_measured_records_of_few_levels_raise_no_alarm(data, path, u, y):
    folder, name = path.split("/")
    x = loadmat(data(folder) / name)["resultID"]
    assert pt.analyze.health(pt.Record(u=x[:, u], y=x[:, y], Ts=1.0)).notes == ()
