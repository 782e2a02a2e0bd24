"""Flags: the four modes, and where each signal and each write goes."""

import pytest

import plantune as pt

Flags, FlaggedLink = pt.edge.Flags, pt.edge.FlaggedLink
PID = pt.models.PID(Kp=0.5, Ti=1.0)
TUNED = pt.models.PID(Kp=2.0, Ti=0.7, Td=0.1, Tf=0.05)


def plant():
    """Return a plant at rest at 1."""
    return pt.edge.SimulatedPlant([1.0] * 5, PID, K=2.0, T=1.0, L=0.1, Ts=0.1)


def record():
    """Return a record of three rows that the plant would not give."""
    rec = pt.Record(u=[7.0] * 3, y=[8.0] * 3, r=[9.0] * 3, aux={"load": [3.0] * 3}, Ts=0.1)
    return pt.edge.RecordedPlant(rec, TUNED)


@pytest.mark.parametrize(
    ("flags", "mode"),
    [
        (Flags.full_simulation(), "full simulation"),
        (Flags("record", "record", "record"), "full simulation"),
        (Flags.partial_simulation("u"), "full simulation"),
        (Flags.partial_simulation("u", rest="plant"), "partial simulation"),
        (Flags(y="record"), "partial simulation"),
        (Flags.partial_simulation("y", rest="plant"), "partial simulation"),
        (Flags.shadow(), "shadow"),
        (Flags(Kp="simulated", Ti="simulated", Td="simulated", aux="record"), "shadow"),
        (Flags.live(), "live"),
        (Flags(write={"Kp"}), "live"),
    ],
)
def test_the_four_modes(flags, mode):
    assert flags.mode == mode


def test_each_signal_comes_from_where_its_flag_says():
    link = FlaggedLink(Flags(u="record", aux="record"), plant(), record())
    sample = link.read()
    assert (sample.t, sample.r, sample.u, sample.y, sample.aux) == (
        0.0,
        1.0,
        7.0,
        1.0,
        {"load": 3.0},
    )
    assert [link.read() is None for _ in range(3)] == [
        False,
        False,
        True,
    ]  # the shorter one ends it
    sample = FlaggedLink(Flags.full_simulation(), record=record()).read()
    assert (sample.r, sample.u, sample.y) == (9.0, None, None)
    sample = FlaggedLink(Flags.partial_simulation("y"), record=record()).read()
    assert (sample.r, sample.u, sample.y) == (9.0, 7.0, None)


def test_live_writes_and_shadow_withholds():
    loop = plant()
    FlaggedLink(Flags.live(), loop).write(TUNED)
    assert loop.controller == TUNED
    loop = plant()
    shadow = FlaggedLink(Flags.shadow(), loop)
    shadow.read(), shadow.read()
    shadow.write(TUNED)
    assert loop.controller == PID and shadow.withheld == [(0.1, TUNED)]
    with pytest.raises(pt.RunError, match="C09"):
        shadow.write(r=3.0)


def test_single_settings_are_put_among_those_at_work():
    loop = plant()
    link = FlaggedLink(Flags(write={"Kp", "r"}), loop)
    link.write(TUNED, r=2.0)
    assert loop.controller == pt.models.PID(Kp=2.0, Ti=1.0)
    assert link.withheld == [(0.0, TUNED)]
    assert link.read().r == 2.0


def test_settings_come_from_where_their_flag_says():
    link = FlaggedLink(Flags(Kp="record", Td="simulated"), plant(), record())
    assert (link.controller.Kp, link.controller.Ti) == (2.0, 1.0)
    own = FlaggedLink(Flags(Kp="simulated", Ti="simulated", Td="simulated"), plant())
    assert own.controller is None
    own.write(TUNED)
    assert own.controller == TUNED


@pytest.mark.parametrize(
    "make",
    [
        lambda: Flags(u="elsewhere"),
        lambda: Flags(write={"y"}),
        lambda: Flags(r="simulated", y="simulated"),
        lambda: Flags.partial_simulation("x"),
        lambda: FlaggedLink(Flags.shadow()),
        lambda: FlaggedLink(Flags(y="record"), plant()),
        lambda: FlaggedLink(Flags.live(), record()),
        lambda: FlaggedLink(Flags(r="record"), plant(), no_set_point()),
    ],
)
def test_flags_that_cannot_be_are_refused(make):
    with pytest.raises(pt.UsageError):
        make()


def no_set_point():
    """Return a record without a reference."""
    return pt.edge.RecordedPlant(pt.Record(u=[1.0] * 3, y=[1.0] * 3, Ts=0.1))
