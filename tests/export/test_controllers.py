"""Exported controllers, in C and in structured text, sample by sample against the core."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from export import cc
from export.cases import CONTROLLERS, near, readings
from export.law import Law
from export.st import FunctionBlock
from plantune.models import PID, ProcessModel


class C:
    """A controller compiled from C."""

    def __init__(self, tmp_path, pid, y0, u0, **options):
        self.source = cc.compiled(
            tmp_path, pt.export.c_source(pid, prefix="loop", **options), "loop"
        )
        self.source.init(y0, u0)
        self.step, self.manual = self.source.step, self.source.manual


class ST:
    """A controller as a function block; its first call is in manual, here at the equilibrium."""

    def __init__(self, tmp_path, pid, y0, u0, **options):
        self.block = FunctionBlock(pt.export.structured_text(pid, **options))
        assert self.block(sp=y0, pv=y0, u_man=u0) == u0

    def step(self, r, y):
        return self.block(sp=float(r), pv=float(y), man=False)

    def manual(self, r, y, u):
        return self.block(sp=float(r), pv=float(y), man=True, u_man=float(u))


LANGUAGES = pytest.mark.parametrize("language", [C, ST])
EACH = pytest.mark.parametrize("pid", CONTROLLERS.values(), ids=CONTROLLERS)


@LANGUAGES
@EACH
def test_every_sample_is_that_of_the_simulated_loop(tmp_path, language, pid):
    """The loop is simulated by the core; what its controller reads and gives is tried here."""
    N, Ts = 400, pid.Ts
    plant = ProcessModel(K=0.6 if pid.Kp >= 0 else -5.9, T=8 * Ts, L=2.3 * Ts)
    rng = np.random.default_rng(5)
    r = 20.0 + np.repeat(rng.normal(size=N // 40), 40)
    noise, d = 0.02 * rng.normal(size=N), np.repeat(rng.normal(size=N // 80), 80)
    loop = pt.simulate.closed_loop(plant, pid, r, d=d, noise=noise, offset=18.0, u0=1.25)
    y0 = 1.25 * plant.K + 18.0
    ours = language(tmp_path, pid, y0, 1.25)
    u = [ours.step(*reading) for reading in zip(r, loop.y[:N] + noise, strict=True)]
    assert u == approx(loop.u[:N], **near(loop.u))


@LANGUAGES
@EACH
def test_at_its_limits_the_integral_waits(tmp_path, language, pid):
    r, y = readings()
    free = Law(pid, pid.Ts, y0=0.5, u0=0.2)
    low, high = np.quantile([free.step(*reading) for reading in zip(r, y, strict=True)], [0.3, 0.7])
    law = Law(pid, pid.Ts, low, high, y0=0.5, u0=0.2)
    ours = language(tmp_path, pid, 0.5, 0.2, u_min=float(low), u_max=float(high))
    expected = [law.step(*reading) for reading in zip(r, y, strict=True)]
    assert [ours.step(*reading) for reading in zip(r, y, strict=True)] == approx(
        expected, **near(expected)
    )
    at_a_limit = np.isin(expected, [low, high]).mean()
    assert 0.1 < at_a_limit < 0.98


@LANGUAGES
@EACH
def test_manual_and_back_is_the_law_without_a_bump(tmp_path, language, pid):
    r, y = readings(600, seed=3)
    law = Law(pid, pid.Ts, -4.0, 4.0)
    ours = language(tmp_path, pid, 0.0, 0.0, u_min=-4.0, u_max=4.0)
    for k, reading in enumerate(zip(r, y, strict=True)):
        by_hand = k // 100 % 2 == 1
        u_man = 0.5 * np.sin(k / 7)
        expected = law.manual(*reading, u_man) if by_hand else law.step(*reading)
        u = ours.manual(*reading, u_man) if by_hand else ours.step(*reading)
        assert u == approx(expected, **near(4.0)), k


@LANGUAGES
def test_back_in_automatic_at_rest_the_output_stays(tmp_path, language):
    pid = CONTROLLERS["PID"]
    ours = language(tmp_path, pid, 0.0, 0.0)
    for _ in range(60):  # until the filter of the derivative has come to rest
        assert ours.manual(2.0, 2.0, 7.5) == 7.5
    assert ours.step(2.0, 2.0) == approx(7.5, abs=1e-12)
    assert ours.step(2.1, 2.0) == approx(
        7.5
        + 0.1 * pid.Kp * pid.b
        + 0.1 * pid.Ki * pid.Ts
        + 0.1 * pid.Kp * pid.Td / (pid.Tf + pid.Ts) * pid.c,
        abs=1e-12,
    )


@LANGUAGES
def test_out_of_a_limit_it_comes_back_at_once(tmp_path, language):
    """With a waiting integral the output leaves its limit with the sign of the error."""
    pid = PID(Kp=0.5, Ti=2.0, Ts=0.1)
    ours = language(tmp_path, pid, 0.0, 0.0, u_min=0.0, u_max=1.0)
    assert [ours.step(10.0, 0.0) for _ in range(500)][-1] == 1.0
    assert ours.step(-0.1, 0.0) < 1.0


@settings(max_examples=30)
@given(
    Kp=st.floats(-50, 50),
    Ti=st.floats(0.05, 1e4),
    Td=st.floats(0, 5),
    Tf=st.floats(0, 2),
    b=st.floats(0, 1.5),
    c=st.floats(0, 1.5),
    Ts=st.floats(1e-3, 10),
    seed=st.integers(0, 1000),
)
def test_any_settings_in_structured_text(Kp, Ti, Td, Tf, b, c, Ts, seed):
    pid = PID(Kp=Kp, Ti=Ti, Td=Td, Tf=Tf, b=b, c=c, Ts=Ts)
    r, y = readings(80, seed)
    law, ours = Law(pid, Ts, -10.0, 10.0), ST(None, pid, 0.0, 0.0, u_min=-10.0, u_max=10.0)
    largest = 10.0 + max(map(abs, law.terms(50.0, 0.0)))
    law = Law(pid, Ts, -10.0, 10.0)
    for k, reading in enumerate(zip(r, y, strict=True)):
        if k % 20 < 15:
            u, expected = ours.step(*reading), law.step(*reading)
        else:
            u, expected = ours.manual(*reading, 0.1 * k), law.manual(*reading, 0.1 * k)
        assert u == approx(expected, rel=1e-12, abs=1e-12 * largest)


@pytest.mark.parametrize("reading", [(np.nan, 1.0), (1.0, np.nan), (np.inf, 1.0), (1.0, -np.inf)])
def test_in_c_a_reading_that_is_none_holds_the_output(tmp_path, reading):
    pid = CONTROLLERS["PID"]
    ours = C(tmp_path, pid, 0.0, 0.0)
    law = Law(pid, pid.Ts)
    before = [ours.step(1.0, 0.5), law.step(1.0, 0.5)]
    assert ours.step(*reading) == before[0]
    assert ours.step(1.0, 0.6) == approx(law.step(1.0, 0.6), **near(5.0))


def test_a_tuning_is_exported_at_the_sample_time_of_the_controller():
    tuning = pt.tune.simc(ProcessModel(K=2.0, T=5.0, L=1.0))
    for write in (pt.export.structured_text, pt.export.c_source):
        text = write(tuning, Ts=0.2)
        sampled = pt.tune.margins(tuning.model, PID(Kp=1.25, Ti=5.0, Ts=0.2))
        assert f"gain {sampled.gain:.3g} (" in text and "SIMC, tau_c = L" in text
        assert "G(s) = 2 e^(-1 s) / (5 s + 1)" in text
