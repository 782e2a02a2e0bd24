"""Links: a simulated plant, a played record, and what each refuses."""

import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt

PID = pt.models.PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=0.02)
TUNED = pt.models.PID(Kp=-0.1315, Ti=0.1491, Ts=0.02)
ENGINE = {"K": -5.939, "T": 0.1491, "L": 0.1, "offset": 583.451, "Ts": 0.02}


def played(link):
    """Read a link to its end."""
    samples = []
    while (sample := link.read()) is not None:
        samples.append(sample)
    return samples


def columns(samples):
    """Return r, u, y as arrays."""
    return (np.array([getattr(s, name) for s in samples], float) for name in "ruy")


@pytest.mark.parametrize("noise_var", [0.0, 1.5])
def test_a_simulated_plant_is_the_shipped_engine_loop(noise_var):
    rec = pt.datasets.engine_loop(noise_var=noise_var, seed=3, t_end=4.0)
    plant = pt.edge.SimulatedPlant(
        rec.r[:, 0], PID, noise_sd=noise_var**0.5, seed=3, u0=(400 - 583.451) / -5.939, **ENGINE
    )
    r, u, y = columns(played(plant))
    np.testing.assert_array_equal(r, rec.r[:, 0])
    np.testing.assert_allclose(u, rec.u[:, 0], rtol=1e-12)
    np.testing.assert_allclose(y, rec.y[:, 0], rtol=1e-12)


def test_a_played_record_is_the_record():
    rec = pt.Record(
        u=[1.0, 2.0, 3.0, 4.0, 5.0],
        y=[0.0, np.nan, 2.0, 3.0, 4.0],
        valid=[True, False, True, True, True],
        r=[5.0] * 5,
        aux={"load": [7.0, 8.0, 9.0, 9.0, 9.0]},
        Ts=0.5,
        t0=10.0,
    )
    samples = played(pt.edge.RecordedPlant(rec))
    assert [s.t for s in samples] == [10.0, 10.5, 11.0, 11.5, 12.0]
    assert [s.y for s in samples] == [0.0, None, 2.0, 3.0, 4.0]
    assert [s.aux["load"] for s in samples] == [7.0, 8.0, 9.0, 9.0, 9.0]
    assert pt.edge.RecordedPlant(rec).capabilities.read == {"r", "u", "y", "aux"}


def test_a_simulated_plant_can_be_recorded_and_played_again():
    plant = pt.edge.SimulatedPlant(400 + 50 * np.sign(np.sin(np.arange(200))), PID, **ENGINE)
    samples = played(plant)
    r, u, y = columns(samples)
    again = played(pt.edge.RecordedPlant(pt.Record(u=u, y=y, r=r, Ts=0.02)))
    assert [(s.r, s.u, s.y) for s in again] == [(s.r, s.u, s.y) for s in samples]


def test_a_link_is_read_to_a_record():
    made = {"noise_sd": 1.0, "seed": 3, "aux": {"load": np.arange(60)}, **ENGINE}
    plant = pt.edge.SimulatedPlant(np.full(60, 410.0), PID, **made)
    r, u, y = columns(played(pt.edge.SimulatedPlant(np.full(60, 410.0), PID, **made)))
    first, rest = pt.edge.record(plant, 20), pt.edge.record(plant)
    assert (first.N, rest.N, first.Ts, rest.t0) == (20, 40, 0.02, approx(0.4))
    np.testing.assert_array_equal(np.r_[first.u, rest.u][:, 0], u)
    np.testing.assert_array_equal(np.r_[first.y, rest.y][:, 0], y)
    np.testing.assert_array_equal(rest.r[:, 0], r[20:])
    np.testing.assert_array_equal(rest.aux["load"], np.arange(20, 60))
    for wrong in ({}, {"N": 0}):
        with pytest.raises(pt.UsageError):
            pt.edge.record(plant, **wrong)


def test_a_recorded_link_is_the_record_again():
    rec = pt.Record(
        u=[1.0, 2.0, 3.0, 4.0, 5.0],
        y=[0.0, np.nan, 2.0, 3.0, 4.0],
        valid=[True, False, True, True, True],
        rows=[0, 1, 2, 7, 8],
        starts=[0, 3],
        Ts=0.5,
        t0=10.0,
    )
    again = pt.edge.record(pt.edge.RecordedPlant(rec))
    assert again.same_as(rec)


def test_a_row_without_input_is_no_row_of_a_record():
    class Patchy:
        Ts = 0.1

        def __init__(self):
            # Without u in the third row, without y in the fifth, without r in the last.
            unread = {2: "u", 4: "y", 9: "r"}
            signals = [{"r": 1.0, "u": 2.0 + k, "y": 3.0 + k} for k in range(10)]
            for k, name in unread.items():
                signals[k][name] = None
            self.samples = [pt.adapt.Sample(0.1 * k, **x) for k, x in enumerate(signals)]

        def read(self):
            return self.samples.pop(0) if self.samples else None

    rec = pt.edge.record(Patchy())
    assert rec.rows.tolist() == [0, 1, 3, 4, 5, 6, 7, 8, 9]
    assert rec.starts.tolist() == [0, 2] and rec.r is None
    assert rec.u[:, 0].tolist() == [2.0 + k for k in rec.rows]
    assert rec.valid[:, 0].tolist() == [k != 4 for k in rec.rows]


def test_parameters_and_signals_follow_their_rows():
    N = 400
    K = np.where(np.arange(N) < 200, 2.0, 4.0)
    plant = pt.edge.SimulatedPlant(
        np.full(N, 10.0),
        pt.models.PID(Kp=0.2, Ti=0.5),
        K=K,
        T=0.2,
        offset=np.linspace(0.0, 2.0, N),
        Ts=0.05,
        aux={"load": np.arange(N)},
    )
    samples = played(plant)
    assert samples[0].y == 10.0 and samples[0].u == 5.0
    assert samples[-1].y == approx(10.0, abs=0.1)
    assert samples[-1].u == approx(8.0 / 4.0, abs=0.1)
    assert samples[-1].aux == {"load": N - 1}
    assert plant.truth == (4.0, 0.2, 0.0, 2.0)


def test_writes_act_from_the_next_sample_on_without_a_bump():
    plant = pt.edge.SimulatedPlant(np.full(100, 400.0), PID, **ENGINE)
    for _ in range(10):
        before = plant.read()
    plant.write(TUNED)
    assert plant.controller == TUNED
    assert plant.read().u == approx(before.u, abs=1e-9)
    plant.write(r=410.0)
    assert plant.read().r == 410.0
    plant.write(u=20.0)
    assert plant.read().u == 20.0 and plant.read().u == 20.0
    plant.write(PID)  # automatic again: it goes on from 20
    assert plant.read().u == approx(20.0, abs=1.0)


def test_what_was_written_does_not_change_the_noise():
    def outputs(u):
        plant = pt.edge.SimulatedPlant(np.full(50, 400.0), PID, noise_sd=2.0, seed=5, **ENGINE)
        if u is not None:
            plant.write(u=u)
        return np.array([s.y for s in played(plant)])

    rest = (400 - 583.451) / -5.939
    assert outputs(rest)[:3] == approx(outputs(None)[:3], abs=1e-9)


def test_a_simulated_plant_goes_on_from_a_pickle():
    plant = pt.edge.SimulatedPlant(np.full(60, 410.0), PID, noise_sd=1.0, u0=30.0, **ENGINE)
    for _ in range(30):
        plant.read()
    copy = pickle.loads(pickle.dumps(plant))
    assert played(copy) == played(plant)


def test_limits_hold():
    actuator = pt.simulate.Actuator(low=28.0, high=32.0)
    plant = pt.edge.SimulatedPlant(
        np.full(200, 350.0), TUNED, u0=30.0, actuator=actuator, y_step=0.5, **ENGINE
    )
    samples = played(plant)
    assert max(s.u for s in samples) == 32.0
    assert all(s.y == 0.5 * round(s.y / 0.5) for s in samples)


def test_a_record_refuses_writes_or_counts_them_in_shadow():
    rec = pt.datasets.engine_loop(t_end=1.0)
    link = pt.edge.RecordedPlant(rec, PID)
    with pytest.raises(pt.RunError, match="C09"):
        link.write(TUNED)
    shadow = pt.edge.RecordedPlant(rec, PID, shadow=True)
    shadow.read(), shadow.read()
    shadow.write(TUNED)
    assert shadow.written == [(0.02, TUNED)] and shadow.controller == PID
    with pytest.raises(pt.RunError, match="C09"):
        shadow.write(r=1.0)


def test_every_link_fits_the_protocol():
    rec = pt.datasets.engine_loop(t_end=1.0)
    plant = pt.edge.SimulatedPlant([400.0], PID, **ENGINE)
    record = pt.edge.RecordedPlant(rec)
    for link in (plant, record, pt.edge.FlaggedLink(pt.edge.Flags(), plant)):
        assert isinstance(link, pt.edge.Link)
        assert link.Ts == 0.02


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: pt.edge.SimulatedPlant([1.0, 2.0], PID, **{**ENGINE, "K": [1.0] * 3}), "U01"),
        (lambda: pt.edge.SimulatedPlant([1.0], PID, **{**ENGINE, "T": -1.0}), "M12"),
        (lambda: pt.edge.SimulatedPlant([1.0], PID, noise_sd=-1.0, **ENGINE), "U01"),
        (lambda: pt.edge.Capabilities(read={"x"}), "U01"),
        (lambda: pt.edge.RecordedPlant(pt.Record(u=np.eye(4)[:, :2], y=range(4), Ts=1.0)), "U01"),
    ],
)
def test_what_is_no_link_is_refused(make, code):
    with pytest.raises(pt.PlantuneError) as refused:
        make()
    assert refused.value.code == code
