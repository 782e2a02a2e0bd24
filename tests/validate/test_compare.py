"""Models side by side: the numbers of `check` one by one, and what was assumed of each."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from pytest import approx

import plantune as pt

TRUTH = pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1)
EARLIER = pt.models.ProcessModel(K=-8.0, T=0.08, L=0.1)  # gain too high, time constant too short


@pytest.fixture(scope="module")
def halves():
    return pt.datasets.engine_loop(noise_var=1.5).split(0.5)


@pytest.fixture(scope="module")
def fits(halves):
    est, _ = halves
    return pt.estimate.process(est, "P1D"), pt.estimate.arx(est, 2, 2, 6)


@pytest.mark.parametrize("x0", ["estimate", "zero"])
@pytest.mark.parametrize("offset", ["fit", "estimate"])
def test_numbers_are_those_of_check_one_by_one(halves, fits, x0, offset):
    _, val = halves
    comparison = pt.validate.compare(val, *fits, x0=x0, offset=offset)
    for row, fit in zip(comparison.rows, fits, strict=True):
        alone = pt.validate.check(val, fit, x0=x0, offset=offset)
        for name in ("fit", "fit_1step", "rmse", "loss", "N", "offset", "offset_from", "x0"):
            assert getattr(row, name) == getattr(alone, name), name
        assert_array_equal(row.yhat, alone.yhat)
        assert row.passed == alone.passed and row.name == fit.method


def test_earlier_parameters_have_the_larger_error(halves, fits):
    """Source 001, table 3.5-9, process 1: gain too high and time constant too short."""
    comparison = pt.validate.compare(halves[1], EARLIER, fits[0], names=["earlier", "this"])
    earlier, this = comparison.rows
    assert earlier.rmse > 3 * this.rmse  # the source's ratios are 2.7 and 4.5
    assert comparison.best is this
    # What is left of this one is the noise.
    assert this.rmse == approx(np.sqrt(1.5), rel=0.05)


def test_the_offset_of_a_bare_model_is_estimated_and_the_table_says_so(halves, fits):
    comparison = pt.validate.compare(halves[1], fits[0], TRUTH)
    assert [row.offset_from for row in comparison.rows] == ["fit", "estimate"]
    assert comparison.rows[1].offset == approx(583.451, abs=0.5)
    bare = str(comparison).splitlines()[3].split()
    assert bare[0] == "ProcessModel" and "estimate" in bare


def test_bare_sampled_models_are_accepted(halves, fits):
    _, val = halves
    row = pt.validate.compare(val, fits[1].model).rows[0]
    assert row.fit == approx(pt.validate.check(val, fits[1], offset="estimate").fit, abs=1e-9)


def test_a_fit_beside_itself_is_the_same_twice(halves, fits):
    one, two = pt.validate.compare(halves[1], fits[0], fits[0]).rows
    assert (one.fit, one.fit_1step, one.rmse, one.loss) == (
        two.fit,
        two.fit_1step,
        two.rmse,
        two.loss,
    )
    assert_array_equal(one.errors, two.errors)
    assert (one.name, two.name) == ("P1D 1", "P1D 2")


def test_models_stay_in_the_order_given(halves, fits):
    forth = pt.validate.compare(halves[1], *fits, EARLIER).rows
    back = pt.validate.compare(halves[1], EARLIER, *fits[::-1]).rows
    assert [row.name for row in back] == [row.name for row in forth][::-1]
    assert [row.rmse for row in back] == [row.rmse for row in forth][::-1]


def test_a_model_that_has_seen_the_rows_is_named_and_is_not_the_best(halves, fits):
    """M11."""
    _, val = halves
    seen = pt.estimate.process(val, "P1D")
    comparison = pt.validate.compare(val, EARLIER, seen, names=["earlier", "seen"])
    assert comparison.rows[1].fit > comparison.rows[0].fit
    assert comparison.best.name == "earlier"
    assert any(n.code == "M11" and n.text.startswith("seen: ") for n in comparison.notes)
    assert str(comparison).splitlines()[3].split()[-2] == str(val.N)


def test_where_all_have_seen_the_rows_the_largest_fit_is_best(halves):
    _, val = halves
    fits = pt.estimate.arx(val, 1, 1, 1), pt.estimate.process(val, "P1D")
    assert pt.validate.compare(val, *fits).best.name == "P1D"


def test_a_model_without_relation_stays_with_its_note(halves, fits):
    """X04 of `check` becomes a note, and the row does not pass."""
    wrong = pt.models.ProcessModel(K=8.0, T=0.15, L=0.1)
    comparison = pt.validate.compare(halves[1], fits[0], wrong)
    assert comparison.rows[1].fit < 0 and not comparison.rows[1]
    assert any(n.code == "X04" and n.text.startswith("ProcessModel: ") for n in comparison.notes)


def test_changed_limits_are_said_once(halves, fits):
    comparison = pt.validate.compare(halves[1], *fits, limits=pt.Limits(V01=99.0))
    assert sum("limit V01" in note.text for note in comparison.notes) == 1
    assert not any(comparison.rows)


@pytest.mark.parametrize("names", [[], ["one"], ["one", "two", "three"]])
def test_names_are_one_per_model(halves, fits, names):
    with pytest.raises(pt.UsageError, match="names"):
        pt.validate.compare(halves[1], *fits, names=names)


def test_nothing_to_compare_is_refused(halves):
    with pytest.raises(pt.UsageError) as refusal:
        pt.validate.compare(halves[1])
    assert refusal.value.code == "U01"


def test_it_prints_as_a_table(halves, fits):
    lines = str(pt.validate.compare(halves[1], *fits)).splitlines()
    assert lines[0].endswith("best simulation: P1D")
    assert len({len(line) for line in lines[1:4]}) == 1  # columns line up


def test_rows_are_what_the_figure_of_models_takes(halves, fits):
    fig = pt.plot.compare(*pt.validate.compare(halves[1], *fits).rows)
    assert [trace.name.split(",")[0] for trace in fig.data[1:]] == ["P1D", "ARX"]
