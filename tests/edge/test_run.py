"""A tuner at a link: what is decided live is what a replay decides, and it is written."""

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
    with pytest.raises(pt.UsageError):
        pt.adapt.collect([], SETTINGS)


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
