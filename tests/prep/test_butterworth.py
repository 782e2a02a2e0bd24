"""The design and the filter of one signal, against scipy."""

import doctest
import pickle

import numpy as np
import pytest
from pytest import approx
from scipy import signal

import plantune as pt
from contract.records import check_refusal

TS = 0.02
BANDS = {
    "low slow": ("low", 0.05),
    "low": ("low", 20.0),
    "low fast": ("low", 150.0),
    "high slow": ("high", 0.05),
    "high": ("high", 20.0),
    "high fast": ("high", 150.0),
    "band": ("band", (1.0, 20.0)),
    "narrow": ("band", (9.9, 10.1)),
    "wide": ("band", (0.05, 150.0)),
}
SCIPY = {"low": "lowpass", "high": "highpass", "band": "bandpass"}
ORDERS = [1, 2, 3, 4, 5, 8, 13, 20]


def both(band, order, w):
    """Return our design and scipy's sections."""
    ours = pt.prep.Butterworth(band, order, w, TS)
    theirs = signal.butter(order, w, SCIPY[band], fs=2 * np.pi / TS, output="sos")
    return ours, theirs


def noise(n=400, level=0.0, seed=5):
    return level + np.random.default_rng(seed).normal(size=n)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(("band", "w"), BANDS.values(), ids=BANDS)
def test_frequency_response_is_scipys(band, order, w):
    ours, theirs = both(band, order, w)
    grid = np.geomspace(1e-2, 157, 60)
    expected = signal.sosfreqz(theirs, grid * TS)[1]
    # Poles at 1e-3 of the unit circle know their place to 1e-13 of it, in scipy as here.
    assert ours.freqresp(grid) == approx(expected, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(("band", "w"), BANDS.values(), ids=BANDS)
def test_filtering_is_scipys_from_the_same_equilibrium(band, order, w):
    ours, theirs = both(band, order, w)
    x = noise(level=3.0)
    expected, _ = signal.sosfilt(theirs, x, zi=signal.sosfilt_zi(theirs) * x[0])
    assert ours.run(x) == approx(expected, abs=1e-7)


@pytest.mark.parametrize(("band", "w"), BANDS.values(), ids=BANDS)
def test_run_is_step_in_a_loop(band, w):
    at_once, one_by_one = (pt.prep.Butterworth(band, 5, w, TS) for _ in range(2))
    x = noise(level=400.0)
    halves = np.concatenate([at_once.run(x[:150]), at_once.run(x[150:])])
    assert halves.tolist() == [one_by_one.step(v) for v in x]


def test_a_pair_may_be_a_list():
    pair, others = (pt.prep.Butterworth("band", 2, w, TS) for w in ((1, 2), np.array([1.0, 2.0])))
    assert np.array_equal(pair.sos, others.sos)


@pytest.mark.parametrize(("band", "w"), BANDS.values(), ids=BANDS)
def test_a_level_stays_a_level(band, w):
    y = pt.prep.Butterworth(band, 5, w, TS).run(np.full(50, -1e9))
    assert y.tolist() == [-1e9 if band == "low" else 0.0] * 50


def test_a_large_level_costs_no_digits():
    plain, raised = (pt.prep.Butterworth("band", 5, (1.0, 20.0), TS) for _ in range(2))
    x = np.round(noise(), 3)
    # 1e6 + x is known to 1e-10.
    assert raised.run(x + 1e6) == approx(plain.run(x), abs=1e-8)


def test_stop_and_resume():
    design = pt.prep.Butterworth("band", 5, (1.0, 20.0), TS)
    x = noise(level=7.0)
    design.run(x[:200])
    resumed = pickle.loads(pickle.dumps(design))
    assert resumed.run(x[200:]).tolist() == design.run(x[200:]).tolist()
    assert repr(resumed) == repr(design)


@pytest.mark.parametrize("share", [0.5, 0.02, 1e-6])
def test_what_was_before_is_forgotten_when_the_impulse_response_is_over(share):
    ours, theirs = both("low", 5, 20.0)
    h = np.abs(signal.sosfilt(theirs, np.r_[1.0, np.zeros(2000)]))
    tail = h.sum() - np.cumsum(h)
    assert ours.forgets(share) == np.flatnonzero(tail <= share)[0]


def test_the_example_of_the_docstring_runs():
    examples = doctest.DocTestFinder().find(pt.prep.Butterworth, "Butterworth", globs={})
    results = [doctest.DocTestRunner().run(example) for example in examples]
    assert sum(tried for _, tried in results) == 4 and not any(failed for failed, _ in results)


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("low", 5, np.pi / TS, TS), "M10"),
        (("high", 5, 200.0, TS), "M10"),
        (("band", 5, (1.0, 160.0), TS), "M10"),
        (("low", 5, 0.0, TS), "U01"),
        (("low", 5, -3.0, TS), "U01"),
        (("low", 5, np.nan, TS), "U01"),
        (("low", 5, np.inf, TS), "U01"),
        (("low", 5, 1e-4, TS), "U01"),
        (("low", 0, 1.0, TS), "U01"),
        (("low", 21, 1.0, TS), "U01"),
        (("low", -1, 1.0, TS), "U01"),
        (("low", 2.5, 1.0, TS), "U01"),
        (("low", 5, "fast", TS), "U01"),
        (("band", 5, (1.0, 2.0, 3.0), TS), "U01"),
        (("low", 5, 1.0, 0.0), "U01"),
        (("low", 5, (1.0, 2.0), TS), "U01"),
        (("band", 5, 1.0, TS), "U01"),
        (("band", 5, (2.0, 1.0), TS), "U01"),
        (("band", 5, (2.0, 2.0), TS), "U01"),
        (("notch", 5, 1.0, TS), "U01"),
    ],
)
def test_what_no_filter_can_be_is_refused(arguments, code):
    with pytest.raises(pt.PlantuneError) as caught:
        pt.prep.Butterworth(*arguments)
    check_refusal(caught.value, code, ("where", "measured", "limit") if code == "M10" else ())


def test_a_response_of_too_many_rows_is_refused():
    with pytest.raises(pt.UsageError):
        pt.prep.Butterworth("low", 5, 20.0, TS).step_response(10**15)


@pytest.mark.parametrize("x", [np.nan, np.inf])
def test_a_sample_that_is_none_is_refused_and_changes_nothing(x):
    design, other = (pt.prep.Butterworth("low", 5, 20.0, TS) for _ in range(2))
    for each in (design, other):
        each.step(2.0)
    for refused in (lambda: design.step(x), lambda: design.run([1.0, x])):
        with pytest.raises(pt.UsageError):
            refused()
    assert design.step(3.0) == other.step(3.0)
