"""ARX of several outputs: the oracle's numbers, over segments and holes, and the fits."""

import numpy as np
import pytest
from pytest import approx
from scipy.stats import norm

import plantune as pt
from oracles import lsq, matrix_arx

A = np.array([np.eye(2), [[-0.8, 0.1], [0.2, -0.5]], [[0.1, 0.0], [0.05, 0.1]]])
B = np.random.default_rng(7).normal(size=(2, 2, 3))
O = np.array([3.0, -40.0])


def record(N=400, seed=0, noise=0.1, **fields):
    rng = np.random.default_rng(seed)
    U, E = rng.normal(size=(N, 3)), noise * rng.normal(size=(N, 2))
    return pt.Record(u=U, y=matrix_arx.simulate(A, B, 1, U, E, offset=O), Ts=0.1, **fields)


def by_output(x, na, nb, ny, nu):
    """Rows of the oracle, lag by lag, in the order of theta: a per output, b per input."""
    a = x[: na * ny].reshape(na, ny, ny).transpose(2, 1, 0).reshape(ny, na * ny)
    b = x[na * ny : na * ny + nb * nu].reshape(nb, nu, ny).transpose(2, 1, 0).reshape(ny, nb * nu)
    return np.hstack([a, b]).ravel()


@pytest.mark.parametrize("offset", [True, False])
@pytest.mark.parametrize("na, nb, nk", [(2, 2, 1), (1, 1, 0), (0, 3, 2)])
def test_arx_of_several_outputs_is_the_oracle(na, nb, nk, offset):
    rec = record()
    rec = rec if offset else pt.prep.detrend(rec)
    ours = pt.estimate.arx(rec, na, nb, nk, offset=offset)
    ref = matrix_arx.fit(rec.y, rec.u, na, nb, nk, offset=offset)
    assert (ours.N, ours.status) == (ref.N, "exact")
    assert np.allclose(ours.model.A, ref.A, rtol=1e-9, atol=1e-12)
    assert np.allclose(ours.model.B, ref.B, rtol=1e-9, atol=1e-12)
    assert ours.theta == approx(by_output(ref.Theta, na, nb, 2, 3), rel=1e-9, abs=1e-12)
    assert ours.sd == approx(by_output(ref.sd, na, nb, 2, 3), rel=1e-8)
    assert ours.loss == approx(np.mean(ref.eps**2), rel=1e-9)
    d = len(ours.theta)
    assert ours.aic == approx(ours.N * np.log(ref.loss) + 2 * d, rel=1e-9)
    assert ours.fpe == approx(ref.loss * (1 + d / ours.N) / (1 - d / ours.N), rel=1e-8)
    if offset:
        assert ours.offset == approx(ref.offset, rel=1e-10)
    one_step = ours.model.predict(rec, 1, ours.offset)
    assert (rec.y - one_step)[ref.rows] == approx(ref.eps, abs=1e-9)


def test_the_covariance_is_that_of_kronecker():
    rec = record()
    ours, ref = pt.estimate.arx(rec, 1, 1, 1), matrix_arx.fit(rec.y, rec.u, 1, 1, 1)
    P, n = ours.P, 5
    for i in range(2):
        for j in range(2):
            block = ref.Sigma[i, j] * ref.inverse[:n, :n]
            assert approx(block, rel=1e-8, abs=1e-14) == P[i * n : i * n + n, j * n : j * n + n]


def test_offsets_vary_as_the_delta_rule_says():
    """`O = A(1)^-1 (d - B(1) u0)` by finite differences of the oracle's parameters."""
    rec = record(seed=3)
    ours, ref = pt.estimate.arx(rec, 1, 1, 1), matrix_arx.fit(rec.y, rec.u, 1, 1, 1)

    def level(x):
        theta = x.reshape(6, 2)
        A1 = np.eye(2) + theta[:2].T
        return rec.y[0] + np.linalg.solve(A1, theta[5])

    x, J = ref.Theta.ravel(), []
    for k in range(len(x)):
        step = np.zeros(len(x))
        step[k] = 1e-6
        J.append((level(x + step) - level(x - step)) / 2e-6)
    cov = np.kron(ref.inverse, ref.Sigma)
    assert ours.P[-2:, -2:] == approx(np.array(J).T @ cov @ np.array(J), rel=1e-6)


def test_each_output_is_an_arx_with_the_others_as_inputs():
    rec = record(seed=2)
    fit = pt.estimate.arx(rec, 2, 2, 1)
    one = pt.Record(u=np.column_stack([rec.y[:, 1], rec.u]), y=rec.y[:, 0], Ts=0.1)
    single = pt.estimate.arx(one, 2, 2, 1)
    n = len(single.theta)
    sign = np.array([1, 1, -1, -1] + [1] * (n - 4))
    assert fit.theta[:n] == approx(sign * single.theta, rel=1e-9)
    assert fit.sd[:n] == approx(single.sd, rel=1e-9)


def test_segments_are_honoured():
    a, b = record(250, 1), record(180, 2)
    rec = pt.Record.join([a, b])
    ours = pt.estimate.arx(rec, 2, 1, 1)
    ref = matrix_arx.fit(rec.y, rec.u, 2, 1, 1, starts=(0, 250))
    assert ours.N == ref.N == 426
    assert ours.theta == approx(by_output(ref.Theta, 2, 1, 2, 3), rel=1e-9)


def test_outputs_that_do_not_count_leave_rows_of_their_own():
    rec = record()
    valid = np.ones((400, 2), bool)
    valid[100:110, 0] = False
    valid[200, 1] = False
    holed = pt.Record(u=rec.u, y=np.where(valid, rec.y, np.nan), Ts=0.1, valid=valid)
    fit = pt.estimate.arx(holed, 1, 1, 1)
    for i, lost in enumerate((valid[:, 0], valid[:, 1])):
        t = np.arange(1, 400)
        t = t[lost[t] & valid[t - 1].all(axis=1)]
        phi = np.column_stack([-rec.y[t - 1], rec.u[t - 1], np.ones(len(t))])
        theta, eps, inverse = lsq.solve(phi, rec.y[t, i])
        assert fit.theta[5 * i : 5 * i + 5] == approx(theta[:5], rel=1e-8)
        sd = np.sqrt(np.diag(inverse) * (eps @ eps) / (len(t) - 6))
        assert fit.sd[5 * i : 5 * i + 5] == approx(sd[:5], rel=1e-7)
    assert fit.N == 388  # 399 with history, but 101 to 110 and 201 miss an output before them
    assert np.linalg.eigvalsh(fit.P).min() > 0


def test_bands_cover():
    inside = []
    truth = by_output(np.vstack([A[1].T, B[0].T]), 1, 1, 2, 3)
    for seed in range(60):
        rng = np.random.default_rng(seed)
        U = rng.normal(size=(200, 3))
        E = rng.normal(size=(200, 2)) @ [[0.3, 0.2], [0.0, 0.1]]
        y = matrix_arx.simulate(A[:2], B[:1], 1, U, E)
        fit = pt.estimate.arx(pt.Record(u=U, y=y, Ts=1.0), 1, 1, 1)
        inside.append(np.abs(fit.theta - truth) < norm.ppf(0.975) * fit.sd)
    assert np.mean(inside) == approx(0.95, abs=0.03)


def test_names_follow_the_signals():
    rec = record(u_names=("a", "b", "c"), y_names=("p", "q"))
    fit = pt.estimate.arx(rec, 1, 1, 1)
    assert fit.names[:5] == ("a1[p,p]", "a1[p,q]", "b1[p,a]", "b1[p,b]", "b1[p,c]")
    assert fit.names[5] == "a1[q,p]" and "offset2" in str(fit)


def test_refusals():
    rec = record()
    still = pt.Record(u=np.column_stack([rec.u[:, :2], np.ones(400)]), y=rec.y, Ts=0.1)
    twice = pt.Record(u=rec.u[:, [0, 1, 1]], y=rec.y, Ts=0.1)
    slow = np.sin(0.3 * np.arange(400))
    poor = pt.Record(u=np.column_stack([rec.u[:, :2], slow]), y=rec.y, Ts=0.1)
    exact = matrix_arx.simulate(A[:2], B[:1], 1, rec.u)
    cases = [
        ("X01", still, (1, 1, 1)),
        ("X02", poor, (2, 2, 1)),
        ("X03", rec.take(slice(0, 12)), (2, 2, 1)),
        ("X05", rec, (1, 1, 200)),
        ("X08", pt.Record(u=rec.u, y=exact, Ts=0.1), (2, 3, 1)),
        ("X11", twice, (1, 1, 1)),
        ("U01", rec, (1, 1, [1, 2])),
        ("U01", rec, (1, [1, 2, 1], 1)),
        ("U01", rec, (1, 0, 1)),
    ]
    for code, given, orders in cases:
        with pytest.raises(pt.PlantuneError) as refused:
            pt.estimate.arx(given, *orders)
        assert refused.value.code == code, orders


def test_each_output_has_a_verdict():
    est, val = record(800).split(0.5)
    fit = pt.estimate.arx(est, 2, 2, 1)
    verdict = pt.validate.check(val, fit, output="y2")
    free = fit.predict(val, None)[verdict.rows]
    around = np.linalg.norm(val.y[verdict.rows, 1] - val.y[verdict.rows, 1].mean())
    off = np.linalg.norm(val.y[verdict.rows, 1] - free[:, 1])
    assert verdict.fit == approx(100 * (1 - off / around), rel=1e-6)
    assert verdict.passed and verdict.fit_1step > verdict.fit > 80
    assert verdict.y == approx(val.y[verdict.rows, 1])
    moved = pt.Record(u=val.u, y=val.y + np.array([0.0, 5.0]), Ts=0.1)
    assert pt.validate.check(moved, fit, output="y2", offset="estimate").offset == approx(
        verdict.offset + 5, abs=0.1
    )
    with pytest.raises(pt.UsageError, match="'y1', 'y2'"):
        pt.validate.check(val, fit)


# What (3, 2, 1) reaches on rows not seen: one-step and simulation fit of each output, %, the offset
# estimated there.  The dryer's third output is the moisture of its raw material: a disturbance.
RECORDS = {
    "winding/winding.dat": ((0, 1, 2, 3, 4), (5, 6), 0.5, [(86.6, 64.2), (59.7, 42.5)]),
    "industrial_dryer/dryer2.dat": (
        (1, 2, 3),
        (4, 5, 6),
        0.6,
        [(96.9, 40.7), (98.9, 51.4), (68.8, -14.2)],
    ),
}


@pytest.mark.parametrize("name", RECORDS)
def test_measured_records(data, name):
    inputs, outputs, share, reached = RECORDS[name]
    folder, file = name.split("/")
    x = np.loadtxt(data(folder) / file)
    est, val = pt.Record(u=x[:, inputs], y=x[:, outputs], Ts=1.0).split(share)
    fit = pt.estimate.arx(est, 3, 2, 1)
    for output, fits in zip(est.y_names, reached, strict=True):
        if fits[1] > 0:
            verdict = pt.validate.check(val, fit, output=output, offset="estimate")
        else:
            with pytest.raises(pt.NotIdentifiable, match="no better than the mean") as refused:
                pt.validate.check(val, fit, output=output, offset="estimate")
            verdict = refused.value.result
        assert (verdict.fit_1step, verdict.fit) == approx(fits, abs=0.1)
        assert verdict.passed == (
            verdict.fit > 50 and not any(n.code == "V02" for n in verdict.notes)
        )
