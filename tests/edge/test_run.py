"""A tuner at a link: what is decided live is what a replay decides, and it is written."""

from dataclasses import replace

import numpy as np
import pytest

import plantune as pt

PID = pt.models.PID(Kp=-0.018, Ti=0.018 / 0.3385, Ts=0.02)
SETTINGS = pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=PID)
ENGINE = {"K": -5.939, "T": 0.1491, "L": 0.1, "offset": 583.451, "Ts": 0.02}


def plant(t_end, **more):
    """Return the engine loop, and its set point."""
    r = pt.datasets.engine_loop(t_end=t_end, seed=2).r[:, 0]
    return pt.edge.SimulatedPlant(r, PID, u0=(400 - 583.451) / -5.939, **ENGINE, **more)


def run(link):
    """Run a new tuner at a link to its end."""
    return list(pt.edge.run(link, pt.adapt.AutoTuner(SETTINGS)))


def test_live_is_replay_to_the_last_bit():
    steps = run(plant(20.0, noise_sd=1.2, seed=4))
    live = pt.adapt.collect(steps, SETTINGS)
    rec = pt.Record(u=live.u, y=live.y, r=live.r, Ts=0.02)
    again = pt.adapt.replay(rec, SETTINGS)
    for name in live.__slots__:
        if isinstance(getattr(live, name), np.ndarray) and name != "t":
            np.testing.assert_array_equal(getattr(live, name), getattr(again, name), name)
    assert live.reasons == again.reasons
    assert live.operating_point == again.operating_point
    assert live.retuned.sum() >= 2


def test_a_live_loop_is_tuned_and_a_shadow_is_not():
    live = plant(10.0)
    run(live)
    tuned = pt.tune.imc_pi(pt.models.ProcessModel(-5.939, 0.1491, 0.1), gain_margin=3).controller
    assert live.controller.Kp == pytest.approx(tuned.Kp, rel=0.03)
    assert live.controller.Ki == pytest.approx(tuned.Ki, rel=0.03)
    loop = plant(10.0)
    shadow = pt.edge.FlaggedLink(pt.edge.Flags.shadow(), loop)
    run(shadow)
    assert loop.controller == PID and shadow.withheld


def test_a_log_reads_back_as_a_record():
    log = pt.adapt.collect(run(plant(4.0)), SETTINGS)
    rec = log.to_record()
    np.testing.assert_array_equal(rec.u[:, 0], log.u)
    np.testing.assert_array_equal(rec.aux["Kp"], log.Kp)
    again = pt.adapt.replay(rec, SETTINGS)
    np.testing.assert_array_equal(again.K, log.K)
    with pytest.raises(pt.UsageError):
        pt.adapt.collect([], SETTINGS)


def test_what_a_log_does_not_know_is_not_in_its_record():
    log = pt.adapt.collect(run(plant(4.0)), SETTINGS)
    first = np.flatnonzero(~np.isnan(log.K))[0]
    assert first > 0 and "K" not in log.to_record().aux
    rec = log.to_record(estimates=True)
    assert rec.N == len(log.K) - first and rec.time[0] == pytest.approx(log.t[first])
    np.testing.assert_array_equal(rec.aux["K"], log.K[first:])
    rest = pt.Record(u=np.full(50, 30.0), y=np.full(50, 400.0), Ts=0.02)
    still = pt.adapt.replay(rest, SETTINGS)
    assert still.to_record().N == 50
    with pytest.raises(pt.DataError) as refused:
        still.to_record(estimates=True)
    assert refused.value.code == "D07"


def test_what_is_not_read_and_gaps_come_back_from_a_log():
    rec = pt.datasets.engine_loop(noise_var=1.5, t_end=12.0)
    valid = np.ones(rec.N, bool)
    valid[[100, 250, 251]] = False
    kept = (np.arange(rec.N) < 300) | (np.arange(rec.N) >= 320)
    torn = pt.Record(
        u=rec.u[kept],
        y=rec.y[kept],
        valid=valid[kept],
        Ts=0.02,
        rows=np.flatnonzero(kept),
        starts=[0, 300],
    )
    log = pt.adapt.replay(torn, SETTINGS)
    assert np.isnan(log.r).all() and np.isnan(log.y[[100, 250, 251]]).all()
    again = log.to_record()
    assert again.r is None
    for name in ("u", "valid", "starts", "rows", "time"):
        np.testing.assert_array_equal(getattr(again, name), getattr(torn, name), name)
    np.testing.assert_array_equal(pt.adapt.replay(again, SETTINGS).K, log.K)
    assert log.accepted.any()


def test_an_integral_controller_is_tuned_to_a_pi():
    first = pt.models.PID.integral(-0.3385)
    settings = pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=first)
    r = pt.datasets.engine_loop(t_end=12.0, seed=2).r[:, 0]
    link = pt.edge.SimulatedPlant(r, first, **ENGINE)
    live = pt.adapt.collect(pt.edge.run(link, pt.adapt.AutoTuner(settings)), settings)
    assert (live.Kp[0], live.Ki[0]) == (0.0, -0.3385)
    assert (live.Kp[-1], live.Ki[-1]) == pytest.approx((-0.1315, -0.8816), rel=0.01)
    again = pt.adapt.replay(live.to_record(), settings)
    np.testing.assert_array_equal(again.Ki, live.Ki)


def test_a_live_log_holds_what_the_tuner_simulates():
    pid = pt.models.PID(Kp=-0.1, Ti=0.15, Ts=0.02)
    model = pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1)
    settings = pt.adapt.Settings(
        Ts=0.02, nk=(3, 11), controller=pid, simulated_plant=model, simulated_controller=True
    )
    steps = [pt.adapt.Sample(0.02 * k, r=float(k // 50 % 2)) for k in range(200)]
    tuner = pt.adapt.AutoTuner(settings)
    live = pt.adapt.collect([(sample, tuner.step(sample)) for sample in steps], settings)
    assert np.ptp(live.u) > 0.05 and np.ptp(live.y) > 0.5
    assert live.to_record().N == 200


def test_a_gain_schedule_is_written_where_the_plant_goes():
    speed = np.where(np.arange(1000) < 500, 1000.0, 3000.0)
    table = pt.simulate.Table([1000.0, 3000.0], [0.1, 0.05])
    first = pt.models.PID(Kp=0.1, Ti=1.0)
    settings = pt.adapt.Settings(
        Ts=0.02,
        nk=(1, 12),
        controller=first,
        break_points={"speed": [1000.0, 3000.0]},
        margins={"speed": 200.0},
        schedule=(table, table),
    )
    rest = np.full(1000, 10.0)
    link = pt.edge.SimulatedPlant(rest, first, K=2.0, T=0.3, Ts=0.02, aux={"speed": speed})
    at_work = [link.controller.Kp for _ in pt.edge.run(link, pt.adapt.AutoTuner(settings))]
    assert set(at_work[:500]) == {0.1} and set(at_work[500:]) == {0.05}


def test_a_change_starts_from_the_settings_that_are_read_back():
    """In shadow the loop stays as it is, and every proposal is the first step away from it."""
    loop = plant(10.0)
    shadow = pt.edge.FlaggedLink(pt.edge.Flags.shadow(), loop)
    log = pt.adapt.collect(run(shadow), SETTINGS)
    assert log.retuned.sum() > 2 and len(shadow.withheld) == log.retuned.sum()
    for _, pid in shadow.withheld:
        assert max(pid.Kp / PID.Kp, pid.Ki / PID.Ki) == pytest.approx(2.0)
    assert log.Kp[~log.retuned] == pytest.approx(PID.Kp)
    assert log.target[-1] == pytest.approx((-0.1315, -0.8816), rel=0.03)


def test_settings_that_somebody_else_wrote_stay_and_are_judged():
    loop, tuner = plant(20.0), pt.adapt.AutoTuner(SETTINGS)
    other = pt.models.PID(Kp=-0.1, Ti=0.14)
    for sample, decision in pt.edge.run(loop, tuner):
        if sample.t == 0.1:
            loop.write(other)
        if sample.t == 0.12:
            assert (decision.controller.Kp, decision.controller.Ti) == (-0.1, pytest.approx(0.14))
    assert loop.controller.Kp == pytest.approx(-0.1315, rel=0.01)


def test_what_may_not_be_written_stays_and_the_loop_is_judged_with_it():
    loop = plant(20.0)
    link = pt.edge.FlaggedLink(pt.edge.Flags.live(write=["Kp"]), loop)
    with pytest.raises(pt.UsageError, match="a loop that nobody judged"):
        run(link)
    tuner = pt.adapt.AutoTuner(replace(SETTINGS, write=["Kp"]))
    log = pt.adapt.collect(pt.edge.run(link, tuner), tuner.settings)
    assert loop.controller.Ti == PID.Ti and link.withheld == []
    assert log.Kp / log.Ki == pytest.approx(PID.Ti)
    true = pt.models.ProcessModel(-5.939, 0.1491, 0.1)
    assert pt.tune.margins(true, loop.controller).Ms < 1.85
    assert abs(loop.controller.Kp) > 1.5 * abs(PID.Kp)
    assert any(note.code == "C07" for _, notes in log.reasons for note in notes)
    with pytest.raises(pt.UsageError, match="write"):
        replace(SETTINGS, write=["Ki"])
