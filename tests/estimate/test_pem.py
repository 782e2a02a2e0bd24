"""OE and ARMAX: the minimum that an independent search finds, in any units and segments."""

import re

import numpy as np
import pytest
from pytest import approx
from scipy import signal

import plantune as pt
from oracles import lsq, pem

# Both searches end where the residual is at right angles to the gradient: 1e-7 in its cosine
# moves theta by 1e-7 sqrt(N) of a standard deviation, and the loss by the square of it.
SAME = {"rel": 1e-7, "abs": 1e-7}

PLANTS = {
    "oe 1": (pem.orders(nb=1, nf=1, nk=1), [0.5, -0.8]),
    "oe 2, delay": (pem.orders(nb=2, nf=2, nk=3), [0.5, 0.2, -1.5, 0.7]),
    "oe 3, direct": (pem.orders(nb=3, nf=3, nk=0), [0.3, 0.1, -0.2, -1.9, 1.33, -0.351]),
    "oe, wide numerator": (pem.orders(nb=4, nf=1, nk=2), [0.5, 0.2, -0.1, 0.3, -0.8]),
    "oe, two inputs": (
        pem.orders(2, nb=(1, 2), nf=(1, 2), nk=(4, 0)),
        [0.5, 0.3, 0.1, -0.8, -1.1, 0.4],
    ),
    "oe, one input without f": (
        pem.orders(2, nb=(2, 1), nf=(0, 1), nk=(1, 1)),
        [0.5, 0.3, 0.4, -0.8],
    ),
    "armax 1": (pem.orders(na=1, nb=1, nc=1, nk=1), [-0.8, 0.5, 0.6]),
    "armax 2, delay": (
        pem.orders(na=2, nb=2, nc=2, nk=3),
        [-1.5, 0.7, 0.5, 0.2, -0.9, 0.3],
    ),
    "armax 3, direct": (
        pem.orders(na=3, nb=3, nc=3, nk=0),
        [-1.9, 1.33, -0.351, 0.3, 0.1, -0.2, 0.7, 0.4, 0.3],
    ),
    "armax, long c": (pem.orders(na=1, nb=1, nc=3, nk=2), [-0.9, 0.5, 0.8, 0.5, 0.3]),
    "armax, two inputs": (
        pem.orders(2, na=2, nb=(1, 2), nc=1, nk=(4, 0)),
        [-1.1, 0.4, 0.5, 0.3, 0.1, -0.7],
    ),
    "moving average": (pem.orders(na=0, nb=2, nc=2, nk=1), [0.5, 0.2, -1.0, 0.5]),
}

EXPERIMENTS = [
    # rows of each segment, O, x0
    ([400], 583.451, "estimate"),
    ([400], None, "estimate"),
    ([120, 200], 583.451, "estimate"),
    ([150, 90, 130], -4.0, "estimate"),
    ([400], 4.0, "zero"),
    ([150, 90, 130], None, "zero"),
]

both = pytest.mark.parametrize("name", ["oe 2, delay", "armax 2, delay"])


def experiment(model, theta, rows=(400,), O=None, x0="estimate", sd=0.1, seed=1):
    """Simulate the segments one by one; u, y and the first row of each.

    With `x0="zero"` each starts from zero, as it stands in the record: its offset too enters
    as a constant drive from the first row on.
    """
    rng = np.random.default_rng(seed)
    A = model.polynomials(theta)[0]
    parts = []
    for N in rows:
        before = 0 if x0 == "zero" else 60
        # Every level is held for three samples, so that an error of one in nk is seen as such.
        u = rng.normal(size=(-(-(N + before) // 3), len(model.nb))).repeat(3, axis=0)[: N + before]
        y = pem.simulate(model, theta, u, sd * rng.normal(size=N + before))
        drive = (O or 0.0) * A.sum()
        y += signal.lfilter([1.0], A, np.full(N + before, drive)) if x0 == "zero" else O or 0.0
        parts.append((u[before:], y[before:]))
    u, y = (np.concatenate(p) for p in zip(*parts, strict=True))
    return u, y, np.cumsum([0, *rows[:-1]])


def estimate(model, rec, **options):
    """Call the estimator that the orders ask for."""
    nb, nf, nk = ([*n] if len(n) > 1 else n[0] for n in (model.nb, model.nf, model.nk))
    if any(model.nf):
        return pt.estimate.oe(rec, nb, nf, nk, **options)
    return pt.estimate.armax(rec, model.na, nb, model.nc, nk, **options)


def fitted(name, rows=(400,), seed=1):
    """Simulate one of the plants with an offset and fit it."""
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta, rows, O=4.0, seed=seed)
    return estimate(model, pt.Record(u=u, y=y, Ts=0.1))


def assert_same(fit, ref):
    assert fit.status == "converged"
    assert fit.N == ref.N
    assert fit.theta == approx(ref.theta, **SAME)
    assert fit.loss == approx(ref.loss, rel=1e-10)
    criteria = lsq.criteria(ref.loss, ref.N, len(ref.theta))
    assert (fit.fpe, fit.aic, fit.bic) == approx(criteria, rel=1e-9)
    m = len(fit.P)
    sd = np.sqrt(np.diag(ref.P))
    assert m == len(ref.P) and len(fit.theta) == len(fit.names) == len(fit.sd)
    assert fit.P / np.outer(sd, sd) == approx(ref.P / np.outer(sd, sd), abs=1e-5)
    assert fit.sd == approx(sd[: len(fit.theta)], rel=1e-5)
    if m > len(fit.theta):
        assert fit.offset[0] == approx(ref.offset, **SAME)


TOO_SMALL = {
    "one pole for two": (pem.orders(nb=1, nf=1, nk=3), "oe 2, delay"),
    "output noise through one c": (pem.orders(na=2, nb=2, nc=1, nk=3), "oe 2, delay"),
    "equation noise left out": (pem.orders(nb=2, nf=2, nk=3), "armax 2, delay"),
}


@pytest.mark.parametrize("rows, O, x0", EXPERIMENTS)
@pytest.mark.parametrize("name", PLANTS)
def test_the_minimum_is_that_of_an_independent_search(name, rows, O, x0):
    """The other search starts at the truth, ours from what it finds in the data."""
    model, theta = PLANTS[name]
    u, y, starts = experiment(model, theta, rows, O, x0)
    offset = O is not None
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=starts)
    fit = estimate(model, rec, offset=offset, x0=x0)
    ref = pem.fit(model, u, y, theta, starts, offset, x0)
    assert ref.cosine < 1e-9
    assert fit.N == len(y) - (0 if x0 == "zero" else len(rows) * model.history)
    assert_same(fit, ref)


@pytest.mark.parametrize("case", TOO_SMALL)
def test_a_model_too_small_for_the_plant_converges_too(case):
    """Its residual is no noise, so that plain Gauss-Newton steps overshoot; MINPACK needs 60."""
    model, plant = TOO_SMALL[case]
    for seed in range(10):
        u, y, _ = experiment(*PLANTS[plant], O=4.0, seed=seed)
        fit = estimate(model, pt.Record(u=u, y=y, Ts=0.1))
        ref = pem.fit(model, u, y, pem.arx_start(model, u, y))
        assert fit.status == "converged"
        assert fit.loss <= ref.loss * (1 + 1e-10)


@pytest.mark.parametrize("name", PLANTS)
def test_the_model_of_the_fit_holds_its_theta(name):
    model, _ = PLANTS[name]
    fit = fitted(name)
    A, B, C, _, F = model.polynomials(fit.theta)
    several = len(B) > 1
    assert fit.model.A == approx(A) and fit.model.C == approx(C)
    for mine, theirs in ((fit.model.B, B), (fit.model.F, F)):
        for p, q in zip(mine if several else [mine], theirs, strict=True):
            assert p == approx(q)
    assert np.ravel(fit.model.nk).tolist() == list(model.nk)


@both
@pytest.mark.parametrize("power_u, power_y", [(-9, 0), (9, 0), (0, -9), (0, 9), (6, -6), (12, 12)])
def test_units_change_b_and_the_offset_and_nothing_else(name, power_u, power_y):
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta, O=4.0)
    plain = estimate(model, pt.Record(u=u, y=y, Ts=0.1))
    scale_u, scale_y = 10.0**power_u, 10.0**power_y
    other = estimate(model, pt.Record(u=scale_u * u, y=scale_y * y, Ts=0.1))
    is_b = np.array([p.startswith("b") for p in plain.names])
    assert other.theta == approx(plain.theta * np.where(is_b, scale_y / scale_u, 1.0), rel=1e-7)
    assert other.offset[0] == approx(plain.offset[0] * scale_y, rel=1e-7)
    assert other.loss == approx(plain.loss * scale_y**2, rel=1e-9)


@both
def test_a_level_of_y_is_all_offset(name):
    """At 1e6 the numbers of y keep 1e-10, against noise of 0.1."""
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta)
    plain = estimate(model, pt.Record(u=u, y=y, Ts=0.1))
    high = estimate(model, pt.Record(u=u, y=y + 1e6, Ts=0.1))
    assert high.theta == approx(plain.theta, **SAME)
    assert high.offset[0] - 1e6 == approx(plain.offset[0], abs=1e-6)
    assert high.offset_sd == approx(plain.offset_sd, rel=1e-5)


@both
def test_a_level_of_u_moves_the_offset_by_its_gain(name):
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta)
    plain = estimate(model, pt.Record(u=u, y=y, Ts=0.1))
    high = estimate(model, pt.Record(u=u + 1e6, y=y, Ts=0.1))
    assert high.theta == approx(plain.theta, **SAME)
    A, B, _, _, F = model.polynomials(high.theta)
    gain = B[0].sum() / (A.sum() * F[0].sum())
    assert high.offset[0] + 1e6 * gain == approx(plain.offset[0], abs=1e-4)  # 1e6 times 1e-10


@both
def test_a_later_input_raises_nk_by_one(name):
    """The same rows and lags under other numbers: the same problem."""
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta, O=4.0)
    nb, nk = model.nb[0], model.nk[0]
    sizes = dict(na=model.na, nb=nb, nc=model.nc, nf=model.nf)
    fit = estimate(model, pt.Record(u=u, y=y, Ts=0.1))
    early = estimate(pem.orders(nk=nk - 1, **sizes), pt.Record(u=u[:-1], y=y[1:], Ts=0.1))
    assert fit.N == early.N
    assert fit.theta == approx(early.theta, rel=1e-7)  # each search ends within 1e-8 of an sd
    assert fit.loss == approx(early.loss, rel=1e-12)


@pytest.mark.parametrize("O", [None, 583.451])
@pytest.mark.parametrize("x0", ["estimate", "zero"])
@pytest.mark.parametrize("name", [name for name in PLANTS if name.startswith("oe")])
def test_data_without_noise_give_the_truth(name, x0, O):
    model, theta = PLANTS[name]
    u, y, starts = experiment(model, theta, [150, 150], O, x0, sd=0.0)
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=starts)
    fit = estimate(model, rec, offset=O is not None, x0=x0)
    assert fit.theta == approx(theta, rel=1e-8, abs=1e-8)
    assert fit.loss <= (1e-8 * np.std(y)) ** 2
    if O is not None:
        assert fit.offset[0] == approx(O, abs=1e-7)


def refused_or_noted(model, rec):
    """Whether an estimate that the data do not support is never returned silently."""
    try:
        fit = estimate(model, rec)
    except (pt.NotIdentifiable, pt.NumericsError):
        return True
    return len(fit.notes) > 0 or fit.status != "converged"


@pytest.mark.parametrize(
    "model",
    [
        pem.orders(nb=3, nf=3, nk=3),  # a root of B cancels one of F
        pem.orders(nb=4, nf=4, nk=3),
        pem.orders(na=3, nb=3, nc=1, nk=3),  # a root of B cancels one of A, and eps is zero
        pem.orders(na=2, nb=2, nc=1, nk=3),  # right orders: nothing is left to show C
    ],
)
def test_orders_that_data_without_noise_cannot_show_are_not_returned_silently(model):
    u, y, _ = experiment(*PLANTS["oe 2, delay"], O=4.0, sd=0.0)
    assert refused_or_noted(model, pt.Record(u=u, y=y, Ts=0.1))


@both
def test_an_input_that_stands_still_is_refused(name):
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta)
    with pytest.raises(pt.NotIdentifiable):
        estimate(model, pt.Record(u=np.full_like(u, 2.0), y=y, Ts=0.1))


@both
def test_fewer_rows_than_parameters_are_refused(name):
    """Start values count: 6 rows with history against 4 or 6 parameters, offset, 2 states."""
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta)
    with pytest.raises((pt.NotIdentifiable, pt.DataError)) as refusal:
        estimate(model, pt.Record(u=u[:10], y=y[:10], Ts=0.1))
    assert refusal.value.code == "X03"


@both
def test_orders_and_options_that_do_not_exist_are_wrong_arguments(name):
    model, theta = PLANTS[name]
    u, y, _ = experiment(model, theta)
    rec = pt.Record(u=u, y=y, Ts=0.1)
    with pytest.raises(pt.UsageError):
        estimate(pem.orders(na=model.na, nb=0, nc=model.nc, nf=model.nf), rec)
    with pytest.raises(pt.UsageError):
        estimate(pem.orders(na=model.na, nb=1, nc=model.nc, nf=model.nf, nk=-1), rec)
    with pytest.raises(pt.UsageError):
        estimate(model, rec, x0="guess")


@pytest.mark.parametrize("seeds", [200, pytest.param(1000, marks=pytest.mark.slow)])
@both
def test_intervals_cover_the_truth(name, seeds):
    theta, inside = PLANTS[name][1], []
    for seed in range(seeds):
        fit = fitted(name, rows=[1000], seed=seed)
        found, sd = np.r_[fit.theta, fit.offset], np.r_[fit.sd, fit.offset_sd]
        inside.append(np.abs(found - [*theta, 4.0]) < 1.96 * sd)
    share = np.mean(inside, axis=0)
    assert share == approx(0.95, abs=0.025)  # sd of one share 1.5 % on 200 seeds, 0.7 % on 1000


def largest_root(*polynomials):
    return max(np.abs(np.roots(p)).max(initial=0.0) for p in polynomials)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_an_output_that_runs_away_never_gives_an_unstable_f(order):
    """Its least-squares start has roots outside the unit circle; so has its best F."""
    returned = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = rng.normal(size=80)
        y = signal.lfilter([0.0, 1.0], [1.0, -1.04], u) + 0.1 * rng.normal(size=80)
        model = pem.orders(nb=1, nf=order)
        start = pem.arx_start(model, u, y)
        assert largest_root(np.r_[1, start[1:]]) > 1
        try:
            fit = estimate(model, pt.Record(u=u, y=y, Ts=1.0))
        except pt.NotIdentifiable:
            continue
        returned += 1
        assert largest_root(fit.model.F) < 1
    assert returned > 0


@pytest.mark.parametrize("nc", [1, 2, 3])
def test_noise_differenced_once_too_often_never_gives_an_unstable_c(nc):
    """C has its roots on the unit circle, the estimate is drawn to and over it."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u, e = rng.normal(size=100), rng.normal(size=100)
        noise = signal.lfilter(np.poly(np.ones(nc)), [1.0], e)
        y = signal.lfilter([0.0, 1.0], [1.0, -0.5], u) + signal.lfilter([1.0], [1.0, -0.5], noise)
        fit = estimate(pem.orders(na=1, nb=1, nc=nc), pt.Record(u=u, y=y, Ts=1.0))
        assert largest_root(fit.model.C) < 1


# --- orders that are too high ---


@pytest.mark.parametrize(
    ("fit", "lower"),
    [
        (lambda rec: pt.estimate.oe(rec, 3, 3, 6), "nb = 1, nf = 1"),
        (lambda rec: pt.estimate.oe(rec, 2, 3, 6), "nb = 1, nf = 1"),
        (lambda rec: pt.estimate.armax(rec, 2, 2, 2, 6), "na = 1, nb = 1, nc = 1"),
    ],
)
def test_orders_too_high_name_lower_ones_that_can_be_fitted(fit, lower):
    """BAD_INPUTS, X10: the engine without noise is of first order."""
    rec = pt.datasets.engine_loop()
    with pytest.raises(pt.NotIdentifiable) as caught:
        fit(rec)
    assert (caught.value.code, caught.value.remedy) == ("X10", f"ask for {lower}")


def test_lower_orders_are_named_per_input():
    rng = np.random.default_rng(1)
    u = rng.choice([-1.0, 1.0], (600, 2))
    plants = [
        pt.models.PolyModel(B=[0.5], F=[1, -0.8, 0.3], nk=1, Ts=1.0),
        pt.models.PolyModel(B=[-2.0, 1.0], F=[1, -0.6], nk=2, Ts=1.0),
    ]
    y = sum(plant.simulate(u[:, i]) for i, plant in enumerate(plants))
    rec = pt.Record(u=u, y=y, Ts=1.0)
    assert pt.estimate.oe(rec, [1, 2], [2, 1], [1, 2]).loss < 1e-20
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.estimate.oe(rec, [3, 3], [3, 3], [1, 2])
    assert caught.value.code == "X10"
    nb, nf = (int(n) for n in re.findall(r"\[(\d), \d\]", caught.value.remedy))
    assert caught.value.remedy == f"ask for nb = [{nb}, {nb}], nf = [{nf}, {nf}]"
    assert pt.estimate.oe(rec, nb, nf, [1, 2]).status == "converged"
