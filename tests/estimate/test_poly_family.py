"""BJ, ARARX, ARARMAX and the whole family: no search finds a lower minimum, in any units."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import pem, poly_family, wnsf
from plantune.io import load_model, save_model

PLANTS = {
    "bj 1": (poly_family.bj(nb=1, nc=1, nd=1, nf=1, nk=1), [0.5, 0.6, -0.7, -0.8]),
    "bj 2, delay": (
        poly_family.bj(nb=2, nc=1, nd=1, nf=2, nk=3),
        [0.5, 0.2, 0.5, -0.8, -1.5, 0.7],
    ),
    "bj, no c": (poly_family.bj(nb=1, nc=0, nd=2, nf=1, nk=2), [0.5, -1.2, 0.5, -0.8]),
    "bj, two inputs": (
        poly_family.bj(2, nb=(1, 2), nc=1, nd=1, nf=(1, 2), nk=(4, 0)),
        [0.5, 0.3, 0.1, 0.5, -0.7, -0.8, -1.1, 0.4],
    ),
    "ararx 2, delay": (
        poly_family.ararx(na=2, nb=2, nd=1, nk=3),
        [-1.5, 0.7, 0.5, 0.2, 0.6],
    ),
    "ararx, two inputs": (
        poly_family.ararx(2, na=1, nb=(1, 2), nd=1, nk=(2, 0)),
        [-0.8, 0.5, 0.3, 0.1, 0.6],
    ),
    "ararmax": (
        poly_family.ararmax(na=1, nb=1, nc=1, nd=1, nk=2),
        [-0.8, 0.5, 0.5, 0.6],
    ),
    "a and f": (pem.orders(2, na=1, nb=(1, 1), nf=(0, 1), nk=(1, 2)), [-0.8, 0.5, 0.4, 0.5]),
}

EXPERIMENTS = [
    # rows of each segment, O, x0
    ([600], 583.451, "estimate"),
    ([600], None, "estimate"),
    ([250, 120, 230], -4.0, "estimate"),
    ([600], 4.0, "zero"),
]


def experiment(name, rows=(600,), O=4.0, x0="estimate", sd=0.1, seed=1):
    """Simulate the segments one by one, run in where nothing is known of their start."""
    model, theta = PLANTS[name]
    rng = np.random.default_rng(seed)
    parts = []
    for N in rows:
        before = 0 if x0 == "zero" else 80
        u = rng.normal(size=(-(-(N + before) // 3), len(model.nb))).repeat(3, axis=0)[: N + before]
        e = sd * rng.normal(size=N + before)
        A = model.polynomials(theta)[0]
        # From rest the offset enters as a constant of the equation, behind the noise model.
        drive = (O or 0.0) if x0 == "estimate" else 0.0
        y = pem.simulate(model, theta, u, e) + drive
        if x0 == "zero" and O:
            y += (
                O
                * A.sum()
                * pem.simulate(pem.orders(na=model.na, nb=1, nk=0), [*A[1:], 1.0], np.ones(N))
            )
        parts.append((u[before:], y[before:]))
    u, y = (np.concatenate(p) for p in zip(*parts, strict=True))
    return u, y, tuple(int(k) for k in np.cumsum([0, *rows[:-1]]))


def one_or_list(n):
    return [*n] if len(n) > 1 else n[0]


def estimate(name, rec, **options):
    """Call the verb of the structure."""
    model, _ = PLANTS[name]
    nb, nf, nk = (one_or_list(n) for n in (model.nb, model.nf, model.nk))
    if name.startswith("bj"):
        return pt.estimate.bj(rec, nb, model.nc, model.nd, nf, nk, **options)
    if name.startswith("ararx"):
        return pt.estimate.ararx(rec, model.na, nb, model.nd, nk, **options)
    if name.startswith("ararmax"):
        return pt.estimate.ararmax(rec, model.na, nb, model.nc, model.nd, nk, **options)
    return pt.estimate.poly(
        rec, na=model.na, nb=nb, nc=model.nc, nd=model.nd, nf=nf, nk=nk, **options
    )


def fitted(name, **options):
    u, y, starts = experiment(name, **options)
    return estimate(name, pt.Record(u=u, y=y, Ts=0.1, starts=starts))


@pytest.mark.parametrize("rows, O, x0", EXPERIMENTS)
@pytest.mark.parametrize("name", PLANTS)
def test_no_independent_search_ends_lower(name, rows, O, x0):
    """MINPACK from the truth and from our end; where they meet, all else agrees as well."""
    model, theta = PLANTS[name]
    u, y, starts = experiment(name, rows, O, x0)
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=starts)
    fit = estimate(name, rec, offset=O is not None, x0=x0)
    assert fit.status == "converged"
    refs = [pem.fit(model, u, y, start, starts, O is not None, x0) for start in (theta, fit.theta)]
    assert fit.N == refs[0].N
    assert fit.loss <= min(ref.loss for ref in refs) * (1 + 1e-9)
    ref = refs[1]
    assert fit.theta == approx(ref.theta, abs=1e-5 * ref.sd.max(), rel=1e-6)
    sd = np.sqrt(np.diag(ref.P))
    assert fit.P / np.outer(sd, sd) == approx(ref.P / np.outer(sd, sd), abs=1e-4)
    if O is not None:
        assert fit.offset[0] == approx(ref.offset, abs=1e-4 * sd[-1])


@pytest.mark.parametrize("name", PLANTS)
def test_the_loss_is_that_of_the_errors_row_by_row(name):
    """From rest and without offset: the predictor written as a loop."""
    model, _ = PLANTS[name]
    u, y, _ = experiment(name, [200], None, "zero")
    fit = estimate(name, pt.Record(u=u, y=y, Ts=0.1), offset=False, x0="zero")
    eps = poly_family.errors(model, fit.theta, u, y)
    assert fit.loss == approx(np.mean(eps**2), rel=1e-10)
    slope = poly_family.gradient(model, fit.theta, u, y)[:, :-1]
    cosine = eps @ slope / np.linalg.norm(slope, axis=0) / np.linalg.norm(eps)
    assert np.abs(cosine).max() < 1e-6


@pytest.mark.parametrize("name", PLANTS)
def test_the_truth_lies_within_its_intervals(name):
    """Five records of 600 rows, no parameter further than four standard deviations."""
    _, theta = PLANTS[name]
    for seed in range(5):
        fit = fitted(name, seed=seed)
        assert (np.abs(fit.theta - theta) < 4 * fit.sd).all(), seed
        assert abs(fit.offset[0] - 4.0) < 4 * fit.offset_sd


@pytest.mark.parametrize("name", ["bj 1", "bj 2, delay"])
def test_weighted_null_space_fitting_comes_near(name):
    """It is efficient without a search, in long records: no lower, and within a deviation."""
    model, _ = PLANTS[name]
    u, y, _ = experiment(name, [2000], None, sd=0.3)
    rec = pt.Record(u=u, y=y, Ts=0.1)
    fit = estimate(name, rec)
    orders = (model.nb[0], model.nc, model.nd, model.nf[0], model.nk[0])
    near = wnsf.fit(u[:, 0], y, *orders, n=30)
    assert (np.abs(fit.theta - near.theta) < 1.0 * fit.sd).all()
    assert near.sd == approx(fit.sd, rel=0.1)


@pytest.mark.parametrize("name", PLANTS)
def test_units_of_u_and_y_change_b_alone(name):
    """u in thousandths, y from Celsius to Fahrenheit."""
    u, y, _ = experiment(name)
    one = estimate(name, pt.Record(u=u, y=y, Ts=0.1))
    other = estimate(name, pt.Record(u=1000 * u, y=1.8 * y + 32, Ts=0.1))
    factor = np.array([1.8e-3 if n.startswith("b") else 1.0 for n in one.names])
    assert other.theta / factor == approx(one.theta, rel=1e-6, abs=1e-8)
    assert other.sd / factor == approx(one.sd, rel=1e-5)
    assert other.loss == approx(1.8**2 * one.loss, rel=1e-9)
    assert other.offset[0] == approx(1.8 * one.offset[0] + 32, abs=1e-5 * one.offset_sd)


@pytest.mark.parametrize("name", ["bj 2, delay", "ararx 2, delay", "ararmax"])
def test_a_hole_ends_a_segment(name):
    """The rows behind a missing output are a segment of their own."""
    u, y, _ = experiment(name)
    valid = np.ones(600, bool)
    valid[200] = False
    holed = estimate(name, pt.Record(u=u, y=np.where(valid, y, np.nan), Ts=0.1, valid=valid))
    cut = pt.Record(u=u[valid], y=y[valid], Ts=0.1, starts=(0, 200))
    ref = estimate(name, cut)
    assert holed.N == ref.N
    assert holed.theta == approx(ref.theta, rel=1e-7, abs=1e-8)
    assert holed.loss == approx(ref.loss, rel=1e-10)


@pytest.mark.parametrize("name", ["bj 2, delay", "ararmax"])
def test_a_sample_later_is_a_delay_more(name):
    model, _ = PLANTS[name]
    u, y, _ = experiment(name)
    one = estimate(name, pt.Record(u=u[:-1], y=y[:-1], Ts=0.1))
    nk = model.nk[0] + 1
    rec = pt.Record(u=u[1:], y=y[:-1], Ts=0.1)
    if name == "ararmax":
        other = pt.estimate.ararmax(rec, 1, 1, 1, 1, nk)
    else:
        other = pt.estimate.bj(rec, 2, 1, 1, 2, nk)
    # One row more is history.
    assert (np.abs(other.theta - one.theta) < 0.2 * one.sd).all()


def test_a_start_far_from_rest_is_no_obstacle():
    """A first response of 300 times the noise; with states a step behind, one in twenty stopped."""
    model = pt.models.PolyModel(B=[[0.5], [1.0]], F=[[1, -0.8], [1, -0.5]], nk=[2, 0], Ts=0.5)
    for seed in range(100):
        rng = np.random.default_rng(seed)
        N = (60, 150, 300, 600)[seed % 4]
        u = 40 + 3 * np.repeat(rng.normal(size=N), 4)[:N]
        y = 500 + model.simulate(np.column_stack([u, 0.3 * rng.normal(size=N)]))
        valid = np.arange(N) != N // 4
        for starts, holes in (((0,), None), ((0, N // 2 - 5), None), ((0, N // 2 - 5), valid)):
            rec = pt.Record(u=u, y=y, Ts=0.5, starts=starts, valid=holes)
            assert pt.estimate.bj(rec, 1, 0, 1, 1, 2).status == "converged", (seed, starts)


def test_all_verbs_are_cases_of_poly():
    u, y, _ = experiment("bj 2, delay")
    rec = pt.Record(u=u, y=y, Ts=0.1)
    pairs = {
        "BJ": (pt.estimate.bj(rec, 2, 1, 1, 2, 3), dict(nb=2, nc=1, nd=1, nf=2, nk=3)),
        "ARARX": (pt.estimate.ararx(rec, 2, 2, 1, 3), dict(na=2, nb=2, nd=1, nk=3)),
        "ARARMAX": (pt.estimate.ararmax(rec, 2, 2, 1, 1, 3), dict(na=2, nb=2, nc=1, nd=1, nk=3)),
        "OE": (pt.estimate.oe(rec, 2, 2, 3), dict(nb=2, nf=2, nk=3)),
        "ARMAX": (pt.estimate.armax(rec, 2, 2, 1, 3), dict(na=2, nb=2, nc=1, nk=3)),
        "ARX": (pt.estimate.arx(rec, 2, 2, 3), dict(na=2, nb=2, nk=3)),
    }
    for method, (fit, orders) in pairs.items():
        same = pt.estimate.poly(rec, **orders)
        assert same.method == fit.method == method
        assert (same.theta == fit.theta).all() and same.names == fit.names


def test_ararx_without_d_is_arx_and_bj_without_noise_model_is_oe():
    u, y, _ = experiment("ararx 2, delay")
    rec = pt.Record(u=u, y=y, Ts=0.1)
    assert pt.estimate.ararx(rec, 2, 2, 0, 3).theta == approx(
        pt.estimate.arx(rec, 2, 2, 3).theta, rel=1e-9
    )
    assert (pt.estimate.bj(rec, 2, 0, 0, 2, 3).theta == pt.estimate.oe(rec, 2, 2, 3).theta).all()


@pytest.mark.parametrize("name", PLANTS)
def test_a_model_survives_its_file_and_gives_its_errors_back(name, tmp_path):
    u, y, starts = experiment(name)
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=starts)
    fit = estimate(name, rec)
    save_model(tmp_path / "model.json", fit.model)
    model = load_model(tmp_path / "model.json")
    assert model.same_as(fit.model)
    verdict = pt.validate.check(rec, fit)
    assert verdict.loss == approx(fit.loss, rel=1e-6)


REFUSED = [
    (lambda rec: pt.estimate.bj(rec, 0, 1, 1, 1), "U01"),
    (lambda rec: pt.estimate.bj(rec, 1, -1, 1, 1), "U01"),
    (lambda rec: pt.estimate.bj(rec, 1, 1, 1.5, 1), "U01"),
    (lambda rec: pt.estimate.bj(rec, [1, 1], 1, 1, 1), "U01"),
    (lambda rec: pt.estimate.ararx(rec, -1, 1, 1), "U01"),
    (lambda rec: pt.estimate.ararmax(rec, 1, 1, 1, -2), "U01"),
    (lambda rec: pt.estimate.poly(rec, na=1, nb=0), "U01"),
    (lambda rec: pt.estimate.bj(rec, 1, 1, 1, 1, x0="rest"), "U01"),
    (lambda rec: pt.estimate.bj(rec.take(slice(0, 8)), 2, 2, 2, 2), "X03"),
    (lambda rec: pt.estimate.ararx(rec, 1, 1, 1, 500), "X05"),
    (lambda rec: pt.estimate.bj(pt.Record(u=0 * rec.u, y=rec.y, Ts=0.1), 1, 1, 1, 1), "X01"),
    (lambda rec: pt.estimate.ararmax(pt.Record(u=0 * rec.u, y=rec.y, Ts=0.1), 1, 1, 1, 1), "X01"),
    (
        lambda rec: pt.estimate.bj(pt.Record(u=rec.u, y=np.c_[rec.y, rec.y], Ts=0.1), 1, 1, 1, 1),
        "U01",
    ),
]


@pytest.mark.parametrize(("work", "code"), REFUSED)
def test_what_is_refused(work, code):
    u, y, _ = experiment("bj 1")
    with pytest.raises(pt.PlantuneError) as caught:
        work(pt.Record(u=u, y=y, Ts=0.1))
    assert caught.value.code == code and caught.value.remedy


def test_copied_inputs_are_named():
    u, y, _ = experiment("bj 1")
    rec = pt.Record(u=np.c_[u, 3 * u], y=y, Ts=0.1)
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.estimate.bj(rec, 1, 1, 1, 1)
    assert caught.value.code == "X11"
