"""Instrumental variables: the plant whatever colours the noise, without a search."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import iv4 as oracle
from oracles import pem
from plantune.io import load_model, save_model

SECOND = pem.orders(nb=2, nc=1, nd=1, nf=2, nk=2)  # the noise shares nothing with the plant
THETA = [0.5, 0.2, 0.5, -0.8, -1.5, 0.7]
TRUTH = np.array([-1.5, 0.7, 0.5, 0.2])  # as a, then b


def record(seed=1, N=1000, sd=0.3, O=0.0, **fields):
    """Return a second-order plant under ARMA noise, from rest; u begins at zero."""
    rng = np.random.default_rng(seed)
    u = np.r_[0.0, np.repeat(rng.choice([-1.0, 1.0], N), 3)[: N - 1]]
    y = pem.simulate(SECOND, THETA, u, sd * rng.normal(size=N)) + O
    return pt.Record(u=u, y=y, Ts=0.1, **fields)


# The oracle's autoregression has as many lags as the model has coefficients, ours eight at least.
EIGHT = {
    "4, 4": (4, (4,), (1,)),
    "5, 3, delay": (5, (3,), (3,)),
    "two inputs": (2, (3, 3), (1, 0)),
    "more than eight": (5, (5,), (1,)),
}


@pytest.mark.parametrize("offset", [True, False])
@pytest.mark.parametrize("starts", [(0,), (0, 400)])
@pytest.mark.parametrize("case", EIGHT)
def test_it_is_the_oracle_s(case, starts, offset):
    na, nb, nk = EIGHT[case]
    rng = np.random.default_rng(3)
    N = 900
    u = np.repeat(rng.normal(size=(N, len(nb))), 2, axis=0)[:N]
    u[0] = 0.0
    w = pem.simulate(pem.orders(nb=3, nf=2, nk=1), [0.5, 0.2, -0.3, -1.2, 0.5], u[:, 0])
    noise = pem.simulate(
        pem.orders(nb=1, nc=1, nd=1), [0.0, 0.5, -0.8], 0 * u[:, :1], rng.normal(size=N)
    )
    y = w + 0.3 * noise + (u[:, -1] if len(nb) > 1 else 0.0)
    ref = oracle.iv4(u, y, na, nb, nk, starts, offset)
    rec = pt.Record(u=u, y=y, Ts=0.1, starts=starts)
    fit = pt.estimate.iv4(rec, na, [*nb], [*nk], offset=offset)
    assert fit.theta == approx(ref.theta, rel=1e-6, abs=1e-8)
    # The oracle's s^2 (Z'Z)^-1 and ours, (Z'X)^-1 Z'Z (X'Z)^-1, are the same where X is all but Z.
    if case == "two inputs":  # the plant's own orders
        assert fit.sd == approx(ref.sd, rel=0.15)
    if offset:
        assert fit.offset[0] == approx(ref.offset, rel=1e-6, abs=1e-6)


def test_iterated_it_rests_where_the_oracle_does():
    rec = record()
    ref = oracle.iv4(rec.u, rec.y, 4, 4, 2, rounds=50)
    fit = pt.estimate.iv4(rec, 4, 4, 2, iterate=50)
    assert fit.status == "converged"
    assert fit.theta == approx(ref.theta, rel=1e-4, abs=1e-5)
    assert pt.estimate.iv4(rec, 4, 4, 2).status == "exact"


def test_colour_does_not_bias_it_as_it_does_arx():
    seeds, found = 100, {"iv4": [], "arx": []}
    for seed in range(seeds):
        rec = record(seed)
        found["iv4"].append(pt.estimate.iv4(rec, 2, 2, 2).theta)
        found["arx"].append(pt.estimate.arx(rec, 2, 2, 2).theta)
    bias = {
        name: np.abs(np.mean(f, axis=0) - TRUTH) / (np.std(f, axis=0) / seeds**0.5)
        for name, f in found.items()
    }
    assert bias["iv4"].max() < 3.5
    assert bias["arx"].max() > 20


def covered(seeds):
    found = [pt.estimate.iv4(record(seed, 500, O=3.0), 2, 2, 2) for seed in seeds]
    inside = [
        np.abs(np.r_[f.theta - TRUTH, f.offset - 3.0]) < 1.96 * np.r_[f.sd, f.offset_sd]
        for f in found
    ]
    return np.mean(inside, axis=0)


def test_its_intervals_hold_the_truth():
    """200 records: 0.95 less four standard deviations of the count."""
    assert covered(range(200)).min() > 0.95 - 4 * 0.0154


@pytest.mark.slow
def test_its_intervals_hold_the_truth_in_1000_records():
    share = covered(range(1000))
    print("iv4", share.round(3))
    assert share[:-1].min() >= 0.90 and share.max() <= 0.98


def test_units_of_u_and_y_change_b_alone():
    rec = record(O=3.0)
    one = pt.estimate.iv4(rec, 2, 2, 2)
    other = pt.estimate.iv4(pt.Record(u=1000 * rec.u, y=1.8 * rec.y + 32, Ts=0.1), 2, 2, 2)
    factor = np.array([1, 1, 1.8e-3, 1.8e-3])
    assert other.theta / factor == approx(one.theta, rel=1e-9)
    assert other.sd / factor == approx(one.sd, rel=1e-8)
    assert other.offset[0] == approx(1.8 * one.offset[0] + 32, rel=1e-8)
    assert other.loss == approx(1.8**2 * one.loss, rel=1e-9)


def test_without_noise_it_is_the_plant():
    rec = record(sd=0.0, O=583.451)
    fit = pt.estimate.iv4(rec, 2, 2, 2)
    assert fit.theta == approx(TRUTH, rel=1e-9)
    assert fit.offset[0] == approx(583.451, rel=1e-9)


def test_a_hole_is_a_row_that_no_equation_reads():
    """The value there, and what a lag would make of it, change nothing."""
    valid = np.ones(1000, bool)
    valid[[300, 301, 700]] = False
    rec = record()
    fits = []
    for value in (np.nan, 1e3):
        y = np.where(valid, rec.y[:, 0], value)
        fits.append(pt.estimate.iv4(pt.Record(u=rec.u, y=y, Ts=0.1, valid=valid), 2, 2, 2))
    assert (fits[0].theta == fits[1].theta).all()
    assert (
        fits[0].N == 1000 - 3 - 3 - 2 * 2
    )  # no lags of u before row 0, holes, and lags of y behind each
    assert (np.abs(fits[0].theta - TRUTH) < 4 * fits[0].sd).all()


def test_the_model_survives_its_file(tmp_path):
    fit = pt.estimate.iv4(record(), 2, 2, 2)
    save_model(tmp_path / "model.json", fit.model)
    assert load_model(tmp_path / "model.json").same_as(fit.model)


@pytest.mark.parametrize(
    ("work", "code"),
    [
        (lambda rec: pt.estimate.iv4(rec, 2, 0), "U01"),
        (lambda rec: pt.estimate.iv4(rec, -1, 2), "U01"),
        (lambda rec: pt.estimate.iv4(rec, 2, 2, iterate=0), "U01"),
        (lambda rec: pt.estimate.iv4(rec, 2, [2, 2]), "U01"),
        (lambda rec: pt.estimate.iv4(rec.take(slice(0, 12)), 2, 2), "X03"),
        (lambda rec: pt.estimate.iv4(rec, 2, 2, 400), "X05"),
        (lambda rec: pt.estimate.iv4(pt.Record(u=0 * rec.u, y=rec.y, Ts=0.1), 2, 2), "X01"),
        (
            lambda rec: pt.estimate.iv4(
                pt.Record(u=np.c_[rec.u, 3 * rec.u], y=rec.y, Ts=0.1), 2, 2
            ),
            "X11",
        ),
    ],
)
def test_what_is_refused(work, code):
    with pytest.raises(pt.PlantuneError) as caught:
        work(record())
    assert caught.value.code == code and caught.value.remedy
