"""Exported models of hysteresis and their inverses, compiled, sample by sample against the core."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from export import cc
from oracles.series_slip import TABLE_4_1
from plantune.hysteresis import AsymmetricStack, MaxwellSlip, PlayStack, Preisach, SeriesSlip

TABLE = SeriesSlip(up=TABLE_4_1.up, down=TABLE_4_1.down)
PLAYS = PlayStack(r=np.arange(30) / 2, w=1 / np.arange(1, 31), offset=-7.3, z0=np.full(30, 50.0))
CURVED = AsymmetricStack(
    r=[0, 1.5, 4], w=[0.8, 0.3, 0.4], knots=[-20, 55, 80], slopes=[0.5, 1.2, 0.9, 1.4], offset=3.1
)
STRAIGHT = AsymmetricStack(r=[0, 2], w=[1, 0.5], knots=[], slopes=[0.7], offset=2)
BLOCKS = MaxwellSlip(k=[2, 0.7, 0.1], f=[3, 0.7, 0.5], spring=0.4)
MODELS = {
    "table 4.1": TABLE,
    "its inverse": TABLE.inverse(),
    "closed": TABLE.closed(),
    "inverse of that": TABLE.closed().inverse(),
    "rising alone": SeriesSlip(up=[(0, 1, 0.5), (3, 4, 1)]),
    "falling alone": SeriesSlip(down=[(30, 4, 0.5)]),
    "plays": PLAYS,
    "inverse of plays": PLAYS.inverse(),
    "one play": PlayStack(r=[2], w=[-0.5]),
    "asymmetric": CURVED,
    "inverse of asymmetric": CURVED.inverse(),
    "asymmetric without knots": STRAIGHT,
    "inverse of that one": STRAIGHT.inverse(),
    "blocks": BLOCKS,
    "inverse of blocks": BLOCKS.inverse(),
    "blocks and offset": MaxwellSlip(k=[2, 0.7], f=[1, 3], offset=-4.5),
    "no block": MaxwellSlip(k=[], f=[], spring=2, offset=1),
}
WALK = 50 + np.random.default_rng(5).standard_normal(3000).cumsum()


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_sample_is_that_of_the_model(tmp_path, model):
    source = cc.compiled(tmp_path, pt.export.c_source(model, prefix="slip"), "slip")
    source.init()
    assert [source.step(x) for x in WALK] == approx(model.simulate(WALK), rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_what_is_no_reading_holds_the_output(tmp_path, model):
    source = cc.compiled(tmp_path, pt.export.c_source(model, prefix="held"), "held")
    source.init()
    held = source.step(50.0)
    assert held == approx(model.simulate([50.0])[0], rel=1e-12)
    assert source.step(float("nan")) == held == source.step(float("inf")) == source.step(50.0)


@pytest.mark.parametrize("model", [PLAYS, CURVED, STRAIGHT, BLOCKS], ids=lambda m: m.kind)
def test_the_inverse_in_c_undoes_the_model_in_c(tmp_path, model):
    forward = cc.compiled(tmp_path, pt.export.c_source(model, prefix="stage"), "stage")
    inverse = cc.compiled(tmp_path, pt.export.c_source(model.inverse(), prefix="ff"), "ff")
    forward.init(), inverse.init()
    assert [inverse.step(forward.step(x)) for x in WALK] == approx(WALK, rel=1e-12, abs=1e-11)
    forward.init(), inverse.init()
    assert [forward.step(inverse.step(y)) for y in WALK] == approx(WALK, rel=1e-12, abs=1e-11)


def test_feed_forward_in_c_leaves_the_gaps_only(tmp_path):
    """The inverse in front of the model, both compiled."""
    forward = cc.compiled(tmp_path, pt.export.c_source(TABLE, prefix="stage"), "stage")
    inverse = cc.compiled(tmp_path, pt.export.c_source(TABLE.inverse(), prefix="ff"), "ff")
    forward.init(), inverse.init()
    r = 23 - 20 * np.cos(np.linspace(0, 2 * np.pi, 500))
    y = np.array([forward.step(inverse.step(x)) for x in r])
    assert np.abs(y - r)[np.abs(r - 43) > 0.1].max() <= 0.87


def test_head_says_what_it_is():
    stage = pt.datasets.piezo_stage(cycles=1)
    model = SeriesSlip.identify(stage.u[:, 0], stage.y[:, 0], 0.5)
    text = pt.export.c_source(model, u_unit="V", y_unit="um")
    head = text[: text.index("*/")]
    assert "x in V, y in um" in head and "element  input" in head and "2001 rows" in head


@pytest.mark.parametrize("wrong", [{"Ts": 0.1}, {"u_min": 0.0, "u_max": 1.0}, {"prefix": "2"}])
def test_what_does_not_belong_is_refused(wrong):
    with pytest.raises(pt.UsageError):
        pt.export.c_source(TABLE, **wrong)


def test_a_model_that_has_no_c_yet_says_which_have():
    relays = Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
    with pytest.raises(pt.UsageError, match="Preisach cannot be exported") as caught:
        pt.export.c_source(relays)
    assert "maxwell_slip, play_stack, series_slip" in caught.value.remedy
