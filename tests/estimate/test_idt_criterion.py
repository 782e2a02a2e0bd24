"""Source 003, (11) and (15): poles and zeros of a clean step response, the order rising."""

import numpy as np
import pytest

import plantune as pt
from oracles import idt as oracle
from plantune.errors import NotIdentifiable, NumericsError, UsageError

T_16 = (1.25, 3.25, 5.5)
N = 401


def sampled(num, den, dt=0.1, n=N, before=0, x0=None):
    """Return a record of a unit step, so many rows at rest before it."""
    y = oracle.step_response(num, den, dt * np.arange(n), x0)
    u = np.repeat([0.0, 1.0], [before, n])
    return pt.Record(u=u, y=np.r_[np.zeros(before), y], Ts=dt)


def three_lags(**more):
    return sampled([1.0], oracle.polynomial(T_16), **more)


@pytest.mark.parametrize("dt", [0.1, 0.01])
@pytest.mark.parametrize("gain", [None, 1.0])
def test_example_i(dt, gain):
    found = pt.estimate.idt_criterion(three_lags(dt=dt, n=round(40 / dt)), gain=gain)
    assert found.order == 3
    assert found.T == pytest.approx(T_16, rel=1e-10)
    assert [rise.order for rise in found.tried] == [1, 2, 3]


def test_example_ii_with_its_zeros():
    den = oracle.polynomial((2, 5, 8))
    found = pt.estimate.idt_criterion(sampled(oracle.polynomial((1, 9)), den, n=601, before=10))
    assert found.T == pytest.approx([2, 5, 8], rel=1e-10)
    assert found.numerator == pytest.approx([0, 9, 10, 1], abs=1e-9)
    assert sorted(-1 / found.zeros.real) == pytest.approx([1, 9], rel=1e-9)


def test_example_iii_whose_gain_nobody_told():
    found = pt.estimate.idt_criterion(sampled([20.0], [0.01, 0.04, 1.0], dt=0.01, before=5))
    assert found.gain == pytest.approx(20.0, rel=1e-10)
    assert sorted(found.poles.imag) == pytest.approx([-np.sqrt(96), np.sqrt(96)], rel=1e-9)
    assert found.poles.real == pytest.approx([-2, -2], rel=1e-9)


def test_the_initial_state_does_not_matter():
    den = oracle.polynomial(T_16)
    for seed in range(30):
        x0 = np.random.default_rng(seed).normal(scale=5, size=3)
        found = pt.estimate.idt_criterion(sampled([1.0], den, x0=x0), order=3)
        assert found.T == pytest.approx(T_16, rel=1e-9)
        assert found.level == pytest.approx(1.0, abs=1e-9)


def test_zeros_need_a_rest_before_the_step_and_no_delay():
    assert pt.estimate.idt_criterion(three_lags()).gain is None
    rec = three_lags(before=10)
    assert len(pt.estimate.idt_criterion(rec).zeros) == 0
    late = pt.Record(u=rec.u, y=np.r_[np.zeros(7), rec.y[:-7, 0]], Ts=rec.Ts)
    found = pt.estimate.idt_criterion(late)
    assert found.zeros is None
    assert found.T == pytest.approx(T_16, rel=1e-9)


def test_the_oracle_finds_the_same_on_plants_at_random():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        T = np.sort(np.exp(rng.uniform(np.log(0.5), np.log(8), 3)))
        if min(T[1:] / T[:-1]) < 1.3:
            continue
        rec = sampled([1.0], oracle.polynomial(T), n=500)
        found = pt.estimate.idt_criterion(rec, order=3, lag=5)
        other = oracle.minimum(rec.y[:, 0], 0.1, 3, lag=5)
        assert found.T == pytest.approx(np.sort(-1 / other.poles.real), rel=1e-7)


def test_the_operator_that_was_found_gives_the_step_back():
    rec = three_lags(before=10)
    found = pt.estimate.idt_criterion(rec)
    x = found.operator(rec.Ts).run(rec.y[10:, 0])
    assert x[found.order * found.lag :] == pytest.approx(
        np.ones(N - found.order * found.lag), abs=1e-9
    )


def test_noise_is_refused_before_it_moves_a_time_constant_by_a_hundredth():
    """Where poles are given under noise, they are right to the digits that are said, and 1 %."""
    given = 0
    for exponent in (-8, -6, -5, -4, -2):
        for seed in range(8):
            noise = 10.0**exponent * np.random.default_rng(seed).normal(size=N)
            rec = three_lags()
            try:
                found = pt.estimate.idt_criterion(pt.Record(u=rec.u, y=rec.y[:, 0] + noise, Ts=0.1))
            except (NumericsError, NotIdentifiable) as error:
                assert error.code in ("N04", "X02")
                assert "idt" in error.remedy
                assert exponent > -6
                continue
            given += 1
            assert found.order == 3
            assert np.abs(found.T / T_16 - 1).max() < 2 * 10**-found.digits
    assert given >= 16


def random_response(rng, N=401):
    """Return poles of one to three lags, or of a lag and a pair, and a response from any state."""
    k = int(rng.integers(1, 4))
    T = np.exp(rng.uniform(np.log(0.5), np.log(8)) + np.arange(k) * rng.uniform(0.4, 0.8))
    poles = list(-1 / T + 0j)
    if k > 1 and rng.random() < 0.4:
        w = rng.uniform(0.5, 5)
        poles[:2] = [w * (-0.3 + 1j), w * (-0.3 - 1j)]
    t, b = 0.1 * np.arange(N), rng.normal(size=k) + 1j * rng.normal(size=k)
    upper = [(bi, p) for bi, p in zip(b, poles, strict=True) if p.imag >= 0]
    y = 1 + sum((bi * np.exp(p * t)).real * (1 + (p.imag > 0)) for bi, p in upper)
    return sorted(poles, key=lambda p: (p.real, p.imag)), y


def test_digits_are_true_on_plants_at_random():
    """White noise of 1e-9 to 1e-3 of the travel: hardly an error beyond what the digits say."""
    errors = []
    for seed in range(120):
        rng = np.random.default_rng(seed)
        poles, y = random_response(rng)
        noise = 10.0 ** rng.uniform(-9, -3) * np.ptp(y) * rng.normal(size=len(y))
        rec = pt.Record(u=np.ones(len(y)), y=y + noise, Ts=0.1)
        try:
            found = pt.estimate.idt_criterion(rec)
        except (NumericsError, NotIdentifiable):
            continue
        assert [note.code for note in found.notes] in (["X01"], ["N04", "X01"])
        if found.order == len(poles):
            got = sorted(found.poles, key=lambda p: (p.real, p.imag))
            error = max(abs(p - q) / abs(q) for p, q in zip(got, poles, strict=True))
            errors.append(error * 10**found.digits)
    assert len(errors) > 60
    assert np.mean(np.array(errors) > 1) < 0.03 and max(errors) < 2


def test_a_long_record_is_no_noisier_for_its_length():
    n = 30_001
    found = pt.estimate.idt_criterion(three_lags(dt=40 / n, n=n))
    assert found.T == pytest.approx(T_16, rel=1e-9) and found.rms < 1e-13


def test_rows_that_do_not_count_are_not_closed_up():
    y, valid = three_lags(before=10).y[:, 0], np.ones(N + 10, bool)
    valid[[40, 150, 151, 152, 300]] = False
    u = np.repeat([0.0, 1.0], [10, N])
    rec = pt.Record(u=u, y=np.where(valid, y, np.nan), Ts=0.1, valid=valid)
    found = pt.estimate.idt_criterion(rec)
    assert found.T == pytest.approx(T_16, rel=1e-9)
    assert found.gain == pytest.approx(1.0, abs=1e-9)


def test_notes_say_what_is_not_known():
    rng = np.random.default_rng(0)
    rec = three_lags(before=10)
    assert pt.estimate.idt_criterion(rec).notes == ()
    (start,) = pt.estimate.idt_criterion(three_lags()).notes
    assert start.code == "X01"
    noisy = pt.Record(u=rec.u, y=rec.y[:, 0] + 1e-7 * rng.normal(size=rec.N), Ts=0.1)
    (left,) = pt.estimate.idt_criterion(noisy).notes
    assert left.code == "N04" and "idt" in left.remedy
    assert left.measured == pytest.approx(1e-7, rel=0.2) and left.limit < 1.1e-9
    assert str(left) in str(pt.estimate.idt_criterion(noisy))
    changed = pt.estimate.idt_criterion(rec, limits=pt.Limits(X01=1e-7))
    assert [note.code for note in changed.notes] == ["X01"]


@pytest.mark.parametrize(("order", "code"), [(2, "N04"), (4, "X02"), (5, "X02")])
def test_an_order_that_is_not_the_plants_is_refused(order, code):
    with pytest.raises((NumericsError, NotIdentifiable)) as refused:
        pt.estimate.idt_criterion(three_lags(), order=order)
    assert refused.value.code == code


def test_equal_time_constants_lose_digits_and_say_so():
    t = 0.1 * np.arange(N)
    for y in (1 - (1 + t / 2) * np.exp(-t / 2), 1 - (1 + t / 2 + t**2 / 8) * np.exp(-t / 2)):
        found = pt.estimate.idt_criterion(pt.Record(u=np.ones(N), y=y, Ts=0.1))
        error = np.abs(found.poles / -0.5 - 1).max()
        assert found.digits < 8 and error < 3 * 10**-found.digits
        assert np.mean(found.poles) == pytest.approx(-0.5, rel=1e-8)


def test_first_order_under_noise_as_the_closed_form_says():
    """One root, K known: (15) gives (rho(1 - rho) - a)/(1 - rho + a), a = N s^2/S0."""
    t, T, s = 0.1 * np.arange(201), 2.0, 0.003
    clean = np.exp(-t / T)
    rho, seen = np.exp(-0.1 / T), []
    for seed in range(50):
        y = 1 - clean + s * np.random.default_rng(seed).normal(size=201)
        other = oracle.minimum(y, 0.1, 1, lag=1, K=1.0)
        seen.append(np.exp(other.poles.real[0] * 0.1))
        try:
            found = pt.estimate.idt_criterion(
                pt.Record(u=np.ones(201), y=y, Ts=0.1), order=1, lag=1, gain=1.0
            )
        except NumericsError as error:
            assert error.measured < 2
        else:
            assert np.exp(found.poles.real[0] * 0.1) == pytest.approx(seen[-1], rel=1e-9)
    assert np.mean(seen) == pytest.approx(
        oracle.biased_root(rho, 200 * s**2 / np.sum(clean**2)), abs=2e-3
    )


@pytest.mark.parametrize(
    ("more", "name"),
    [
        ({"order": 7}, "order"),
        ({"order": 3.0}, "order"),
        ({"order": "free"}, "order"),
        ({"lag": 0}, "lag"),
        ({"lag": -1}, "lag"),
        ({"lag": 10**15}, "lag"),
        ({"max_order": 0}, "max_order"),
        ({"eps": 0.0}, "eps"),
        ({"gain": 0.0}, "gain"),
    ],
)
def test_arguments_that_are_none_are_refused(more, name):
    with pytest.raises(UsageError, match=f"`{name}`"):
        pt.estimate.idt_criterion(three_lags(), **more)


def test_records_without_a_step_are_refused():
    u = np.random.default_rng(0).normal(size=300).cumsum()
    with pytest.raises(NotIdentifiable) as refused:
        pt.estimate.idt_criterion(pt.Record(u=u, y=u, Ts=0.1))
    assert refused.value.code == "X01"
    with pytest.raises(NotIdentifiable) as refused:
        pt.estimate.idt_criterion(pt.Record(u=np.ones(50), y=np.ones(50), Ts=0.1))
    assert refused.value.code == "X04"
