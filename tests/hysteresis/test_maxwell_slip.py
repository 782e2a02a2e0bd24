"""Maxwell slip, its inverse and fit, and which way a loop turns."""

import numpy as np
import pytest
from pytest import approx
from scipy.io import loadmat

import plantune as pt
from oracles import play as oracle
from plantune.errors import DataError, NotIdentifiable, UsageError

MaxwellSlip, Force = pt.hysteresis.MaxwellSlip, pt.hysteresis.BoucWenForce
direction = pt.hysteresis.loop_direction
MODEL = MaxwellSlip(k=[3.0, 2.0, 1.0], f=[0.3, 1.0, 2.0], spring=0.4)


def walk(seed, N=800, step=0.2):
    return np.cumsum(np.random.default_rng(seed).normal(0, step, N))


def test_the_forces_are_those_printed():
    for seed in range(5):
        x = walk(seed)
        y = oracle.maxwell(x, MODEL.k, MODEL.f) + 0.4 * x
        # Sums of another order.
        assert abs(MODEL.simulate(x) - y).max() < 1e-12 * np.ptp(y)


def test_the_inverse_gives_the_input_back():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        n = rng.integers(1, 30)
        model = MaxwellSlip(
            k=rng.random(n) + 0.05, f=rng.random(n) + 0.01, spring=rng.random() + 0.1
        )
        x = walk(seed, 2000, rng.random())
        inverse = model.inverse()
        assert abs(inverse.simulate(model.simulate(x)) - x).max() < 1e-12 * np.ptp(x)
        assert abs(model.simulate(inverse.simulate(x)) - x).max() < 1e-12 * np.ptp(x)


def test_elements_of_one_threshold_are_one():
    double = MaxwellSlip(k=[1.0, 2.0], f=[0.5, 1.0], spring=1.0)
    single = MaxwellSlip(k=[3.0], f=[1.5], spring=1.0)
    x = walk(1)
    assert double.simulate(x) == approx(single.simulate(x), abs=1e-12)
    assert double.inverse().simulate(x) == approx(single.inverse().simulate(x), abs=1e-12)


def test_the_fit_is_that_of_another_solver():
    x = walk(2, 500)
    y = Force(k=0.2, alpha=2, g=1.5, d=0.3, nu=1.5).simulate(x)
    r = np.abs(x).max() * np.arange(1, 9) / 9
    ours = MaxwellSlip.identify(x, y, r=r, offset=False)
    theirs = oracle.fit_stops(x, y, np.r_[0.0, r])
    assert ours.simulate(x) == approx(theirs.y, abs=1e-9 * np.ptp(y))
    assert ours.k == approx(theirs.w[1:][theirs.w[1:] > 0], rel=1e-6)


def test_a_stack_comes_back_with_its_elements_and_uncertainty():
    x = 4 * np.sin(np.arange(1500) / 30) * np.linspace(0.1, 1, 1500)
    y = MODEL.simulate(x) + 0.3
    model = MaxwellSlip.identify(x, y, r=[0.1, 0.25, 0.5, 1.0, 2.0, 3.0])
    assert model.k == approx([3, 2, 1], rel=1e-9) and model.f == approx([0.3, 1, 2], rel=1e-9)
    assert (model.spring, model.offset) == approx((0.4, 0.3), rel=1e-9)
    assert model.identified.names == ("k0", "k1", "k2", "spring", "offset")
    z = []
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0, 0.02, len(x))
        model = MaxwellSlip.identify(x, y + noise, r=[0.1, 0.5, 2.0])
        z.append(
            (np.r_[model.k, model.spring, model.offset] - [3, 2, 1, 0.4, 0.3]) / model.identified.sd
        )
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.3


def test_as_many_elements_as_rows_not_used_ask_for():
    x = 4 * np.sin(np.arange(1500) / 30) * np.linspace(0.2, 1, 1500)
    y = Force(k=0.2, alpha=2, g=1.5, d=0.5, nu=1.0).simulate(x)
    noise = np.random.default_rng(0).normal(0, 0.05 * np.ptp(y), len(x))
    exact, noisy = MaxwellSlip.identify(x, y), MaxwellSlip.identify(x, y + noise)
    assert len(noisy.k) < len(exact.k)
    errors = dict(exact.identified.tried)
    assert errors[1] > 3 * min(errors.values())
    assert MaxwellSlip.identify(x, y, n=4).identified.tried == ()


def test_loops_of_plays_and_butterflies_are_sent_on():
    x = 3 * np.sin(np.arange(600) / 20)
    lagging = pt.hysteresis.PlayStack(r=[0, 0.5, 1], w=[1, 0.5, 0.5]).simulate(x)
    with pytest.raises(NotIdentifiable, match="counter-clockwise") as refused:
        MaxwellSlip.identify(x, lagging)
    assert refused.value.code == "M06" and "PlayStack" in refused.value.remedy
    butterfly = pt.hysteresis.PlayStack(r=[0, 0.5, 1], w=[1, 0.5, 0.5]).simulate(abs(x))
    assert direction(x, butterfly).direction == "butterfly"
    with pytest.raises(NotIdentifiable, match="butterfly"):
        MaxwellSlip.identify(x, butterfly)


@pytest.mark.parametrize(
    ("call", "error", "code"),
    [
        (lambda x: MaxwellSlip.identify(x, 2 * x[:-1]), DataError, "D09"),
        (lambda x: MaxwellSlip.identify(np.arange(50.0), np.arange(50.0)), NotIdentifiable, "X01"),
        (lambda x: MaxwellSlip.identify(0 * x, x), NotIdentifiable, "X01"),
        (lambda x: MaxwellSlip.identify(x[:15], x[:15] ** 3, n=1), NotIdentifiable, "X01"),
        (lambda x: MaxwellSlip.identify(x, x**3, n=300), NotIdentifiable, "X03"),
        (lambda x: MaxwellSlip.identify(x, x, n=0), UsageError, "U01"),
        (lambda x: MaxwellSlip.identify(x, x, r=[1, 0.5]), UsageError, "U01"),
        (lambda x: MaxwellSlip.identify(x, np.full(600, np.nan)), UsageError, "U01"),
        (lambda x: MaxwellSlip(k=[1, 2], f=[1]), UsageError, "U01"),
        (lambda x: MaxwellSlip(k=[1], f=[0]), UsageError, "U01"),
        (lambda x: MaxwellSlip(k=[1], f=[1], spring=-1), UsageError, "U01"),
        (lambda x: MaxwellSlip(k=[1], f=[1]).inverse(), UsageError, "U01"),
    ],
)
def test_what_cannot_be_is_refused(call, error, code):
    with pytest.raises(error) as refused:
        call(3 * np.sin(np.arange(600) / 20))
    assert refused.value.code == code and refused.value.remedy


# --- the way a loop turns ------------------------------------------------------------------------


def test_a_loop_is_known_by_its_area():
    t = np.linspace(0.3, 0.3 + 12 * np.pi, 4001)
    x = np.sin(t)
    for sign, name in ((1, "clockwise"), (-1, "counter-clockwise")):
        found = direction(x, x**3 + sign * 0.1 * np.cos(t))
        assert found.direction == name
        # Six ellipses of 0.1 pi; chords take 1e-5 of each.
        assert found.area == approx(sign * 6 * 0.1 * np.pi, rel=1e-4)
        assert found.upper == approx(found.lower, rel=1e-2)
    assert direction(x, x**3).direction == "none"
    noise = np.random.default_rng(0).normal(0, 0.01, len(x))
    assert direction(x, x + noise).direction == "none"


def test_measured_loops_turn_as_they_are_known_to(data):
    x, y = np.loadtxt(data("seismic_damper") / "xyTestData.csv", delimiter=",").T
    assert direction(x, y).direction == "clockwise"
    loops = loadmat(data("piezo_kv") / "MeasurementData.mat")
    for kv in ("08", "1", "11", "15", "19"):
        found = direction(loops[f"Vplus_{kv}kv"].ravel(), loops[f"Displacement_{kv}kv"].ravel())
        assert found.direction == "counter-clockwise", kv


# --- the damper ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def damper(data):
    x, y = np.loadtxt(data("seismic_damper") / "xyTestData.csv", delimiter=",").T
    return x[:-1], y[:-1]  # the last row jumps to (0, 0)


def relative(model, x, y, rows=slice(None)):
    return 100 * np.linalg.norm((model.simulate(x) - y)[rows]) / np.linalg.norm(y[rows])


def foretold(x, y, **how):
    """Give the errors of a fit, and of fits on the first 186 and 244 rows over the rest."""
    yield relative(MaxwellSlip.identify(x, y, **how), x, y)
    for first in (186, 244):
        early = MaxwellSlip.identify(x[:first], y[:first], **how)
        yield relative(early, x, y, slice(first, None))


def test_the_damper_is_fitted_and_foretold(damper):
    x, y = damper
    # Measured apart from this code, with scipy's solver on these thresholds.
    r = np.geomspace(0.01, 0.95 * abs(x).max(), 19)
    assert list(foretold(x, y, r=r, offset=False)) == approx([4.15, 4.71, 3.54], abs=0.01)
    # An offset, and as many elements as rows not used ask for.
    assert list(foretold(x, y)) == approx([3.75, 4.49, 3.24], abs=0.1)


def test_the_damper_is_no_bouc_wen(damper):
    x, y = damper
    model = Force.identify(x, y)
    assert relative(model, x, y) == approx(7.74, abs=0.02)
