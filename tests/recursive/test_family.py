"""ARX, ARMAX, OE and BJ one sample at a time: their equations, and the batch estimators."""

import copy
import doctest
import pickle

import numpy as np
import pytest
from pytest import approx
from scipy.signal import lfilter

import plantune as pt
from contract.records import check_refusal
from oracles import pem, recursion
from recursive.records import ESTIMATORS, levels, plant

R = pt.recursive
BARE = {"clip": None, "alarm": False, "gate": False}  # the textbook


def at_rest(model, theta, seed=1, N=400, sd=0.3):
    """Return u and y of a plant at rest for its first rows, noise and all."""
    rng = np.random.default_rng(seed)
    u, e = levels(N, 4, rng, 5.0), sd * rng.normal(size=N)
    first = model.history + 6
    u[:first], e[:first] = u[0], 0.0
    return u, pem.simulate(model, theta, u - u[0], e) + 7.0


ORDERS = {
    "ARX(2, 2, 2)": (lambda **k: R.ARX(2, 2, 2, **k), {"na": 2, "nb": 2, "nk": 2}),
    "ARX(1, 1, 0)": (lambda **k: R.ARX(1, 1, 0, **k), {"na": 1, "nb": 1, "nk": 0}),
    "ARX(0, 3, 1)": (lambda **k: R.ARX(0, 3, 1, **k), {"na": 0, "nb": 3, "nk": 1}),
    "ARMAX(1, 1, 1, 2)": (
        lambda **k: R.ARMAX(1, 1, 1, 2, **k),
        {"na": 1, "nb": 1, "nc": 1, "nk": 2},
    ),
    "ARMAX(2, 2, 2)": (
        lambda **k: R.ARMAX(2, 2, 2, **k),
        {"na": 2, "nb": 2, "nc": 2, "nk": 1},
    ),
    "ARMAX(1, 2, 3)": (
        lambda **k: R.ARMAX(1, 2, 3, **k),
        {"na": 1, "nb": 2, "nc": 3, "nk": 1},
    ),
    "OE(1, 1, 2)": (lambda **k: R.OE(1, 1, 2, **k), {"nb": 1, "nf": 1, "nk": 2}),
    "OE(2, 2, 0)": (lambda **k: R.OE(2, 2, 0, **k), {"nb": 2, "nf": 2, "nk": 0}),
    "BJ(2, 1, 1, 1)": (
        lambda **k: R.BJ(2, 1, 1, 1, **k),
        {"nb": 2, "nc": 1, "nd": 1, "nf": 1, "nk": 1},
    ),
    "BJ(2, 2, 2, 2)": (
        lambda **k: R.BJ(2, 2, 2, 2, **k),
        {"nb": 2, "nc": 2, "nd": 2, "nf": 2, "nk": 1},
    ),
}


@pytest.mark.parametrize("lam", [(0.99, 0.99), (1.0, 0.95)])
@pytest.mark.parametrize("name", ORDERS)
def test_the_recursion_is_its_equations(name, lam):
    """Written out with the whole P in `oracles.recursion`; errors stay near rounding."""
    make, given = ORDERS[name]
    model = pem.orders(**given)
    roots = {"na": [0.75], "nf": [0.75], "nc": [-0.4], "nd": [0.3]}
    monic = {n: np.poly([*r, 0.1, -0.2][: given.get(n, 0) or -3]) for n, r in roots.items()}
    monic = {n: np.atleast_1d(p)[1:] for n, p in monic.items()}
    b = [0.5, 0.3, 0.2][: given["nb"]]
    theta = np.r_[monic["na"], b, monic["nc"], monic["nd"], monic["nf"]]
    u, y = at_rest(model, theta)
    # Steps so small that no root is brought back: for two coefficients and more the rules differ.
    P0 = 0.01 if max(given.get("nc", 0), given.get("nf", 0)) > 1 else 2.0
    ours = make(P0=P0, lam=lam[0], lam0=lam[1], rho=0.99, **BARE)
    ref = recursion.PredictionError(
        model,
        P0,
        lam=lambda t: recursion.growing(t, lam[1], lam[0]),
        limits=(0.98, 0.999),
        first=max(model.history, given.get("nf", 0)),
    )
    for pair in zip(u, y, strict=True):
        eps, expected = ours.step(*pair), ref.step(*pair)[0]
        assert eps == approx(expected, rel=1e-8, abs=1e-9, nan_ok=True)
    assert ours.theta == approx(ref.theta[:-1], rel=1e-9, abs=1e-10)
    assert ours.P == approx(ref.P, rel=1e-7, abs=1e-9)
    assert ours.offset == approx(ref.physical_offset(), rel=1e-9)


def test_els_is_its_equations():
    model = pem.orders(na=1, nb=1, nc=1, nk=2)
    u, y = at_rest(model, [-0.8, 0.5, 0.5])
    ours = R.ARMAX(1, 1, 1, 2, method="els", P0=2.0, lam0=1.0, **BARE)
    ref = recursion.PredictionError(model, 2.0, method="els")
    for pair in zip(u, y, strict=True):
        ours.step(*pair)
        ref.step(*pair)
    assert ours.theta == approx(ref.theta[:-1], rel=1e-11)


@pytest.mark.parametrize("offset", [True, False])
def test_arx_without_forgetting_is_the_batch_estimator(offset):
    """With segments and outputs that do not count: the same rows, the same sums."""
    rec = plant("arx", 1, 600)
    y, valid = rec.y[:, 0].copy(), np.ones(600, bool)
    y[250], valid[[250, 251, 400]] = 1e6, False
    rec = pt.Record(u=rec.u, y=y, Ts=1.0, valid=valid, starts=[0, 200, 333])
    arx = R.ARX(2, 2, 2, offset=offset, P0=1e12, clip=None, alarm=False)
    trace = arx.run(rec)
    fit = pt.estimate.arx(rec, 2, 2, 2, offset=offset)
    assert trace.learnt.sum() == fit.N
    assert arx.theta == approx(fit.theta, rel=1e-9)
    assert arx.offset == approx(float(fit.offset[0]), rel=1e-9)
    assert arx.sd == approx(fit.sd, rel=0.2)  # the noise of the last 200 rows, and of all
    if offset:
        assert arx.offset_sd == approx(fit.offset_sd, rel=0.2)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_it_comes_to_the_batch_estimate(kind):
    """40 records: as near to the truth as the batch, or nearly, and near to the batch itself."""
    make, truth = ESTIMATORS[kind]
    batch = {
        "arx": lambda rec: pt.estimate.arx(rec, 1, 1, 2),
        "armax": lambda rec: pt.estimate.armax(rec, 1, 1, 1, 2),
        "oe": lambda rec: pt.estimate.oe(rec, 1, 1, 2),
    }
    errors, of_batch = [], []
    for seed in range(40):
        rec = plant(kind, seed)
        recursive = make(clip=None, alarm=False)
        recursive.run(rec, every=rec.N)
        errors.append(recursive.theta - truth)
        if kind in batch:
            of_batch.append(batch[kind](rec).theta - truth)
        else:  # no batch Box-Jenkins yet: the oracle's
            model = pem.orders(nb=1, nc=1, nd=1, nf=1, nk=2)
            u, y = rec.u, rec.y[:, 0]
            of_batch.append(pem.fit(model, u, y, truth).theta - truth)
    ours, theirs, between = (
        np.sqrt(np.mean(np.square(e), axis=0))
        for e in (errors, of_batch, np.array(errors) - of_batch)
    )
    # C and D of Box-Jenkins wait for the path, and come late.
    late = np.array([3.0 if name[0] in "cd" and kind == "bj" else 1.0 for name in recursive.names])
    assert (ours < 1.5 * late * theirs).all(), (ours, theirs)
    assert (between < 1.2 * late * theirs).all(), (between, theirs)


@pytest.mark.parametrize("lam", [1.0, 0.98])
@pytest.mark.parametrize("kind", ["arx", "armax", "oe"])
def test_standard_deviations_are_those_of_the_errors(kind, lam):
    """Offset included; 100 records, a standard error of 7 % of each."""
    make, truth = ESTIMATORS[kind]
    z = []
    for seed in range(100):
        recursive = make(lam=lam)
        recursive.run(plant(kind, seed), every=10_000)
        errors = np.r_[recursive.theta - truth, recursive.offset - 7.0]
        z.append(errors / np.r_[recursive.sd, recursive.offset_sd])
    z = np.sqrt(np.mean(np.square(z), axis=0))
    # Without forgetting, what an output error began with stays a little.
    most = 1.6 if (kind, lam) == ("oe", 1.0) else 1.3
    assert ((z > 0.75) & (z < most)).all(), z


def test_extended_least_squares_fails_where_theory_says_it_may():
    """`1/C - 1/2` has to be positive real, and of this C it is not; RML does not mind.

    Ljung, Söderström and Gustavsson 1975: A = 1 + 0.9 q^-1 + 0.95 q^-2,
    C = 1 + 1.5 q^-1 + 0.75 q^-2.
    """
    found = {"rml": [], "els": []}
    for seed in range(10):
        e = np.random.default_rng(seed).normal(size=6000)
        y = lfilter([1, 1.5, 0.75], [1, 0.9, 0.95], e)
        rec = pt.Record(u=np.random.default_rng(seed + 99).normal(size=6000), y=y, Ts=1.0)
        for method, errors in found.items():
            # From the truth: does it stay?
            armax = R.ARMAX(2, 1, 2, 1, method=method, P0=0.01, theta0=[0.9, 0.95, 0, 1.5, 0.75])
            armax.run(rec, every=6000)
            errors.append(np.abs(armax.theta[[3, 4]] - [1.5, 0.75]).max())
    assert np.median(found["rml"]) < 0.05 < 0.1 < np.median(found["els"])


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_run_is_step_in_a_loop_to_the_last_bit(kind):
    rec = plant(kind, 3, 500)
    valid = np.ones(500, bool)
    valid[[300, 301, 440]] = False
    rec = pt.Record(u=rec.u, y=rec.y, Ts=1.0, valid=valid, starts=[0, 150])
    make, _ = ESTIMATORS[kind]
    whole, steps = make(lam=0.99), make(lam=0.99)
    trace = whole.run(rec)
    for k, (u, y) in enumerate(zip(rec.u[:, 0], rec.y[:, 0], strict=True)):
        if k in rec.starts:
            steps.restart()
        eps = steps.step(u, y) if valid[k] else steps.skip(u)
        assert trace.eps[k] == eps or (np.isnan(trace.eps[k]) and (eps is None or np.isnan(eps)))
        assert trace.theta[k].tolist() == steps.theta.tolist()
        assert trace.sd[k].tolist() == steps.sd.tolist()
        assert trace.learnt[k] == steps.learnt
    assert trace.offset[-1] == steps.offset and trace.offset_sd[-1] == steps.offset_sd
    assert whole.P.tolist() == steps.P.tolist() and whole.samples == steps.samples == 500
    thin = make(lam=0.99).run(rec, every=100)
    assert thin.rows.tolist() == [0, 100, 200, 300, 400, 499]
    assert thin.theta.tolist() == trace.theta[thin.rows].tolist()
    assert thin.t.tolist() == rec.time[thin.rows].tolist()


def test_all_of_the_family_are_recursions():
    assert all(isinstance(make(), pt.recursive.Recursion) for make, *_ in ESTIMATORS.values())
    with pytest.raises(TypeError):
        pt.recursive.Recursion()


@pytest.mark.parametrize("stop", [5, 40, 300])
@pytest.mark.parametrize("kind", ESTIMATORS)
def test_a_pickle_goes_on_to_the_last_bit(kind, stop):
    rec = plant(kind, 4, 400)
    rows = list(zip(rec.u[:, 0].tolist(), rec.y[:, 0].tolist(), strict=True))
    one = ESTIMATORS[kind][0](lam=0.99, Ts=1.0, window=37, P_max=1e7)
    for row in rows[:stop]:
        one.step(*row)
    others = [pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)]
    assert all(type(x) is type(one) and x.names == one.names and x.Ts == 1.0 for x in others)
    for row in rows[stop:]:
        eps = [x.step(*row) for x in (one, *others)]
        assert len(set(eps)) == 1 or np.isnan(eps).all()
    for other in others:
        assert one.theta.tolist() == other.theta.tolist() and one.P.tolist() == other.P.tolist()
        assert repr(one) == repr(other)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_units_do_not_matter_to_a_start_without_knowledge(kind):
    rec = plant(kind, 5, 400)
    make, _ = ESTIMATORS[kind]
    plain = make(lam=0.99).run(rec)
    for by_u, by_y in ((2.0**-40, 2.0**40), (2.0**30, 2.0**-30)):
        other = make(lam=0.99).run(pt.Record(u=by_u * rec.u, y=by_y * rec.y, Ts=1.0))
        unit = np.where([name[0] == "b" for name in plain.names], by_y / by_u, 1.0)
        # The constant starts in units of y, which the rounding of the rest does not outlive.
        assert other.theta[-1] / unit == approx(plain.theta[-1], rel=0.05, abs=0.05)


def test_the_input_of_the_same_sample_may_act_at_once():
    u = np.random.default_rng(0).normal(size=50)
    arx = R.ARX(0, 1, 0, offset=False, P0=1e12, **BARE)
    for x in u:
        arx.step(x, 3.0 * x)
    assert arx.theta == approx([3.0], rel=1e-9)


def test_a_gap_is_filled_again_and_nothing_is_learnt_across_it():
    rec = plant("armax", 6, 300)
    armax = R.ARMAX(1, 1, 1, 4, Ts=1.0)
    rows = list(zip(rec.u[:, 0], rec.y[:, 0], strict=True))
    for row in rows:
        armax.step(*row)
    before = armax.theta.tolist()
    armax.restart()
    for row in rows[100:104]:
        assert np.isnan(armax.step(*row)) and not armax.learnt
    assert armax.theta.tolist() == before
    armax.step(*rows[104])
    assert armax.learnt and armax.theta.tolist() != before


def test_outputs_that_are_missing_cost_what_they_held():
    """Every seventh is missing: output errors pass over it, and the estimate stays."""
    rec = plant("oe", 7, 3000)
    valid = np.random.default_rng(1).random(3000) > 0.15
    y = np.where(valid, rec.y[:, 0], np.nan)
    trace = R.OE(1, 1, 2).run(pt.Record(u=rec.u, y=y, Ts=1.0, valid=valid))
    assert trace.theta[-1] == approx([0.5, -0.8], abs=0.03)
    assert np.isnan(trace.eps[~valid]).all() and not trace.learnt[~valid].any()


def test_a_record_keeps_the_limits_it_was_made_with():
    rec, valid = plant("oe", 7, 300), np.arange(300) % 3 > 0
    limits = pt.Limits(D07=0.5)
    rec = pt.Record(u=rec.u, y=rec.y, Ts=1.0, valid=valid, limits=limits)
    assert R.OE(1, 1, 2).run(rec).learnt.sum() > 100


def test_the_trace_carries_the_model_of_each_moment():
    rec = plant("bj", 8)
    trace = R.BJ(1, 1, 1, 1, 2).run(rec)
    middle = trace.model_at(700.4)
    assert [*middle.B, middle.C[1], middle.D[1], middle.F[1]] == trace.theta[700].tolist()
    assert trace.final.F[1] == trace.theta[-1, 3] and trace.final.nk == 2 == middle.nk
    assert trace.source == rec.source and trace.method == "BJ"
    again = pickle.loads(pickle.dumps(trace))
    assert again.theta.tolist() == trace.theta.tolist()
    with pytest.raises(ValueError, match="read-only"):
        trace.theta[0] = 0.0
    with pytest.raises(pt.UsageError):
        trace.model_at(-1.0)


def test_a_slow_plant_keeps_its_pole():
    """F may come near the unit circle, further than C."""
    u = levels(6000, 50, np.random.default_rng(0))
    y = lfilter([0, 0.01], [1, -0.99], u) + 0.01 * np.random.default_rng(1).normal(size=6000)
    trace = R.OE(1, 1, 1).run(pt.Record(u=u, y=y, Ts=1.0))
    assert trace.theta[-1] == approx([0.01, -0.99], rel=0.02)


@pytest.mark.parametrize("name", ["Recursion", "ARX", "ARMAX", "OE", "BJ"])
def test_the_examples_of_the_docstrings_run(name):
    runner = doctest.DocTestRunner()
    tests = doctest.DocTestFinder().find(getattr(R, name), name, globs={})
    tried = sum(runner.run(test).attempted for test in tests)
    assert tried >= 3 and not runner.failures


@pytest.mark.parametrize(
    "make",
    [
        lambda: R.ARX(1, 0, 1),
        lambda: R.ARX(-1, 1, 1),
        lambda: R.ARX(1.5, 1, 1),
        lambda: R.ARX(1, 1, 10**9),
        lambda: R.ARX(1, 1, method="rml"),
        lambda: R.ARX(1, 1, lambda_=0.9),
        lambda: R.ARX(1, 1, lam=0.0),
        lambda: R.ARX(1, 1, lam="a"),
        lambda: R.ARX(1, 1, P0=-1.0),
        lambda: R.ARX(1, 1, P0=np.eye(2)),
        lambda: R.ARX(1, 1, theta0=[0.0]),
        lambda: R.ARX(1, 1, theta0=[0.0, np.nan]),
        lambda: R.ARX(1, 1, Ts=0.0),
        lambda: R.ARX(1, 1, clip=-1.0),
        lambda: R.ARX(1, 1, gate=-1.0),
        lambda: R.ARX(1, 1, gate=True, window=1),
        lambda: R.ARX(1, 1, P_max=0.0),
        lambda: R.ARX(1, 1, forgetting="kalman", R1=[1.0]),
        lambda: R.ARMAX(1, 1, 1, method="ml"),
        lambda: R.ARX(1, 1).model,
        lambda: R.ARX(1, 1).run(pt.Record(u=np.zeros((9, 2)), y=np.zeros(9), Ts=1.0)),
        lambda: R.ARX(1, 1, Ts=0.5).run(pt.Record(u=range(9), y=range(9), Ts=1.0)),
        lambda: R.ARX(1, 1).run(pt.Record(u=range(9), y=range(9), Ts=1.0), every=0),
    ],
)
def test_what_no_estimator_can_be_is_refused(make):
    with pytest.raises(pt.UsageError) as caught:
        make()
    check_refusal(caught.value, "U01", ())


@pytest.mark.parametrize("kind", ESTIMATORS)
@pytest.mark.parametrize(
    ("u", "y", "code"),
    [
        (np.nan, 0.0, "U01"),
        (0.0, np.nan, "U01"),
        (np.inf, 0.0, "U01"),
        (0.0, -np.inf, "U01"),
        (1e200, 0.0, "N02"),
        (0.0, 1e200, "N02"),
    ],
)
@pytest.mark.parametrize("after", [0, 1, 10, 200])
def test_a_sample_that_is_none_is_refused_and_changes_nothing(kind, u, y, code, after):
    rec = plant(kind, 9, 210)
    estimator = ESTIMATORS[kind][0](lam=0.99)
    for row in zip(rec.u[:after, 0], rec.y[:after, 0], strict=True):
        estimator.step(*row)
    before = estimator.__getstate__()[1].tolist()
    with pytest.raises(pt.PlantuneError) as caught:
        estimator.step(u, y)
    check_refusal(caught.value, code, ())
    assert estimator.__getstate__()[1].tolist() == before


@pytest.mark.parametrize("method", ["rml", "els"])
def test_one_loop_is_a_bank_of_one(method):
    """The recursion that `Bank` runs in registers, to the rounding that it orders otherwise."""
    rec = plant("armax", 2, 2000)
    settings = {"lam": 0.995, "lam0": 0.95, "rho": 0.99, "P0": 100.0, "method": method}
    bank = R.Bank(1, (2, 2), swell=1e12, c_most=0.98, **settings)
    bank.run(rec.u, rec.y)
    armax = R.ARMAX(1, 1, 1, 2, **settings, **BARE)
    armax.run(rec, every=2000)
    a, b, _, c = bank.theta[0, 0]
    assert armax.theta == approx([-a, b, c], rel=1e-12)
    order = [0, 1, 3, 2]  # the constant last
    sign = np.array([-1.0, 1.0, 1.0, 1.0])
    P = bank.P[0, 0][np.ix_(order, order)] * np.outer(sign, sign)
    assert armax.P == approx(P, rel=1e-10, abs=1e-12)
