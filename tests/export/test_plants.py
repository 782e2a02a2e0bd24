"""Exported plants, in C and in structured text, sample by sample against the core."""

import pytest
from pytest import approx

import plantune as pt
from export import cc
from export.cases import PLANTS, near, staircase
from export.st import FunctionBlock
from plantune.models import PID, ProcessModel


def in_c(tmp_path, what, Ts=None):
    source = cc.compiled(tmp_path, pt.export.c_source(what, Ts), "plant")
    source.init()
    return source.step


def in_st(tmp_path, what, Ts=None):
    block = FunctionBlock(pt.export.structured_text(what, Ts))
    return lambda u: block(u=float(u))


LANGUAGES = pytest.mark.parametrize("language", [in_c, in_st])


@LANGUAGES
@pytest.mark.parametrize(("model", "Ts"), PLANTS.values(), ids=PLANTS)
def test_every_sample_is_that_of_the_model(tmp_path, language, model, Ts):
    """A call with u(t) gives y(t + 1), or y(t) where the input acts at once."""
    u, step = staircase(), language(tmp_path, model, Ts)
    expected = model.simulate(u, Ts)
    y = [step(x) for x in u]
    if getattr(model, "nk", 1) > 0:
        y, expected = y[:-1], expected[1:]
    assert y == approx(expected, **near(expected))


@LANGUAGES
def test_a_fit_brings_its_offset_and_its_sample_time(tmp_path, language):
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    u, step = staircase(300), language(tmp_path, fit)
    expected = fit.simulate(u, fit.Ts)
    assert [step(x) for x in u][:-1] == approx(expected[1:], rel=1e-13)
    text = pt.export.c_source(fit)
    assert fit.source in text and f"K {fit.theta[0]:.6g} +- " in text


@LANGUAGES
def test_exported_controller_and_plant_are_the_simulated_loop(tmp_path, language):
    """In the order of a scan: read, compute, write, and the plant moves on by one sample."""
    plant, pid = ProcessModel(K=2.0, T=5.0, L=1.3), PID(Kp=1.0, Ti=4.0, Td=0.5, Tf=0.2, Ts=0.5)
    r = [0.0] * 5 + [1.0] * 200
    loop = pt.simulate.closed_loop(plant, pid, r)
    plant_step = language(tmp_path, plant, 0.5)
    if language is in_c:
        controller = cc.compiled(tmp_path, pt.export.c_source(pid), "pid")
        controller.init(0.0, 0.0)
        control = controller.step
    else:
        block = FunctionBlock(pt.export.structured_text(pid))
        control = lambda r, y: block(sp=r, pv=y)  # noqa: E731 - as short as the other
    y, ys, us = 0.0, [], []
    for r_k in r:
        ys.append(y)
        us.append(control(r_k, y))
        y = plant_step(us[-1])
    assert ys == approx(loop.y[:-1], **near(loop.y))
    assert us == approx(loop.u[:-1], **near(loop.u))
