"""Exported models of hysteresis and their inverses, compiled, sample by sample against the core."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from export import cc
from oracles.series_slip import TABLE_4_1
from plantune.hysteresis import SeriesSlip

TABLE = SeriesSlip(up=TABLE_4_1.up, down=TABLE_4_1.down)
MODELS = {
    "table 4.1": TABLE,
    "its inverse": TABLE.inverse(),
    "closed": TABLE.closed(),
    "inverse of that": TABLE.closed().inverse(),
    "rising alone": SeriesSlip(up=[(0, 1, 0.5), (3, 4, 1)]),
    "falling alone": SeriesSlip(down=[(30, 4, 0.5)]),
}
WALK = 50 + np.random.default_rng(5).standard_normal(3000).cumsum()


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_sample_is_that_of_the_model(tmp_path, model):
    source = cc.compiled(tmp_path, pt.export.c_source(model, prefix="slip"), "slip")
    source.init()
    assert [source.step(x) for x in WALK] == approx(model.simulate(WALK), rel=1e-15, abs=1e-14)


def test_what_is_no_reading_holds_the_output(tmp_path):
    source = cc.compiled(tmp_path, pt.export.c_source(TABLE), "series_slip")
    source.init()
    held = source.step(50.0)
    assert held == approx(21.8741, abs=1e-4)
    assert source.step(float("nan")) == held == source.step(float("inf")) == source.step(50.0)


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
    class Other(pt.hysteresis.SeriesSlip):
        kind = "other"

    model = object.__new__(Other)
    with pytest.raises(pt.UsageError, match="series_slip"):
        pt.export.c_source(model)
