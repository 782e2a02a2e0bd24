"""The choice of orders: the same rows for all, criteria by their formulas, near-ties named."""

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from contract.records import codes, refused


def record(seed, N=600, level=0.3):
    """Return a second-order ARX plant with a delay of two samples."""
    rng = np.random.default_rng(seed)
    u, e, y = np.sign(rng.normal(size=N)), rng.normal(size=N), np.zeros(N)
    for k in range(3, N):
        y[k] = 1.3 * y[k - 1] - 0.42 * y[k - 2] + 0.5 * u[k - 2] + 0.3 * u[k - 3] + level * e[k]
    return pt.Record(u=u, y=40 + y, Ts=1.0)


def test_one_triangle_is_least_squares_by_numpy():
    rec = record(0)
    found = pt.estimate.order(rec, na=(1, 3), nb=(1, 3), nk=(1, 3))
    u, y, N = rec.u[:, 0], rec.y[:, 0], rec.N
    assert found.N == N - 5  # nk + nb - 1
    for row in found.rows:
        o = row.orders
        t = np.arange(5, N)
        past = [-y[t - k] for k in range(1, o.na + 1)]
        inputs = [u[t - o.nk[0] - k] for k in range(o.nb[0])]
        X = np.column_stack([*past, *inputs, np.ones(len(t))])
        e = y[t] - X @ np.linalg.lstsq(X, y[t], rcond=None)[0]
        V, d = float(np.mean(e**2)), o.na + o.nb[0]
        assert row.loss == approx(V, rel=1e-9)
        assert row.fpe == approx(V * (1 + d / found.N) / (1 - d / found.N))
        assert row.aic == approx(found.N * np.log(V) + 2 * d)
        assert row.bic == approx(found.N * np.log(V) + d * np.log(found.N))


def test_bic_finds_the_orders_in_most_records():
    chosen = [pt.estimate.order(record(s), nk=(1, 4)).best.orders for s in range(20)]
    right = [(o.na, o.nb[0], o.nk[0]) == (2, 2, 2) for o in chosen]
    assert sum(right) >= 17


def test_fresh_rows_decide_and_the_smallest_of_the_near_wins():
    rec, fresh = record(1), record(2)
    found = pt.estimate.order(rec, nk=(1, 4), fresh=fresh)
    least = min(row.fresh for row in found.rows)
    near = [row for row in found.rows if row.fresh <= 1.01 * least]
    assert found.best in near
    assert found.best.d == min(row.d for row in near)
    assert {"V12", "X06"} & set(codes(found))
    assert str(found).splitlines()[0].startswith("64 ARX models on")


@pytest.mark.parametrize("method", ["OE", "ARMAX"])
def test_prediction_errors_share_their_rows(method):
    rec = record(3, N=400)
    found = pt.estimate.order(
        rec, method, na=(1, 2), nb=2, nf=(1, 2), nc=1, nk=2, fresh=record(4, N=400)
    )
    assert len(found.rows) == 2
    assert found.best.orders.nk == [2]
    assert max(found.best.orders.na, *found.best.orders.nf) == 2
    assert found.best.fresh == approx(found.best.loss, rel=0.5)


def test_the_end_of_the_grid_is_doubtful():
    found = pt.estimate.order(record(5), na=(1, 2), nb=2, nk=2)
    (note,) = (n for n in found.notes if "end of the orders" in n.text)
    assert "na" in note.text


@pytest.mark.parametrize(
    "wrong",
    [
        {"method": "FIR"},
        {"na": (3, 1)},
        {"nk": [1, 2]},
        {"na": (1, 40), "nb": (1, 40), "nk": (0, 40)},
    ],
)
def test_what_is_no_grid_is_u01(wrong):
    refused(lambda: pt.estimate.order(record(6, N=100), **wrong), "U01", ())


def test_no_supported_candidate_is_the_refusal_of_the_first():
    rec = pt.Record(u=np.ones(200), y=np.random.default_rng(0).normal(size=200), Ts=1.0)
    refused(lambda: pt.estimate.order(rec), "X01", ())


def test_the_structure_is_named_in_letters_of_either_case():
    rec = pt.datasets.hair_dryer()
    lower, upper = (pt.estimate.order(rec, name, na=2, nb=2, nk=3) for name in ("arx", "ARX"))
    assert lower.method == upper.method == "ARX"
    assert lower.best.loss == upper.best.loss
    with pytest.raises(pt.UsageError, match="bj"):
        pt.estimate.order(rec, "bj")


def test_ends_of_the_grid_are_said_in_the_number_they_have():
    rec = pt.datasets.hair_dryer()
    both = pt.estimate.order(rec, na=(1, 2), nb=(1, 2), nk=3)
    texts = [note.text for note in both.notes if "of the orders tried" in note.text]
    assert texts == ["the best na and nb lie at the ends of the orders tried"]
