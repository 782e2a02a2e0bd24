"""Banks of delays: many loops side by side, each as if it were alone."""

import doctest
import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt


def records(N=300, loops=3, seed=0):
    """First-order loops with delays 2, 3, 4, 2, …, each with its own gain, pole and offset."""
    rng = np.random.default_rng(seed)
    k = np.arange(loops)
    a, b, nk = 0.7 + 0.25 * (k % 7) / 7, 1.5 - k % 5, 2 + k % 3
    u, e = np.sign(rng.normal(size=(N, loops))), 0.1 * rng.normal(size=(N, loops))
    y = np.zeros((N, loops))
    for t in range(4, N):
        y[t] = a * y[t - 1] + b * u[t - nk, k] + e[t] - 0.4 * e[t - 1]
    return u, y + 10.0 * k


def plain(u, y, nk, high, P0, lam=0.995, lam0=0.95, rho=0.99, rml=True):
    """The recursion on the whole matrix: theta, P, and eps and q of every sample learnt."""
    theta, P, psi, ebar, gap = np.zeros(4), P0 * np.eye(4), np.zeros(4), 0.0, lam - lam0
    u, y, told = u - u[0], y - y[0], []
    for t in range(len(y)):
        phi = np.array([y[t - 1] if t else 0.0, u[t - nk] if t >= nk else 0.0, 1.0, ebar])
        psi = phi - rml * theta[3] * psi
        if t < high:  # what u was before the record is not known
            ebar = 0.0
            continue
        lambda_t, gap = lam - gap, gap * rho
        eps, q = y[t] - phi @ theta, psi @ P @ psi
        gain = P @ psi / (lambda_t + q)
        theta = theta + gain * eps
        P = (P - np.outer(gain, psi @ P)) / lambda_t
        theta[3] = np.clip(theta[3], -0.97, 0.97)
        ebar = y[t] - phi @ theta
        told.append((eps, q))
    return theta, P, *np.transpose(told)


@pytest.mark.parametrize("method", ["rml", "els"])
@pytest.mark.parametrize("loops", [1, 3, 34])
def test_every_estimator_follows_the_plain_recursion(method, loops):
    u, y = records(loops=loops)
    bank = pt.recursive.Bank(loops, (1, 5), P0=100.0, swell=1e12, method=method)
    eps, q = bank.run(u, y, errors=True)
    for k in {0, loops // 2, loops - 1}:
        for c, nk in enumerate(bank.nk):
            expected = plain(u[:, k], y[:, k], nk, 5, 100.0, rml=method == "rml")
            found = bank.theta[k, c], bank.P[k, c], eps[5:, k, c], q[5:, k, c]
            for ours, theirs in zip(found, expected, strict=True):
                # The whole matrix of the reference is what loses digits.
                assert ours == approx(theirs, rel=1e-9, abs=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("loops", [2, 41])
def test_a_loop_alone_is_the_same_among_many_and_run_is_step(loops):
    u, y = records(200, loops)
    at_once, stepped = (pt.recursive.Bank(loops, (1, 7), clip=6.0) for _ in range(2))
    at_once.run(u, y)
    for row in zip(u, y, strict=True):
        stepped.step(*row)
    names = ["theta", "P", "sd", "eps", "q", "s2", "learnt", "origin"]
    for name in names:
        assert getattr(at_once, name).tolist() == getattr(stepped, name).tolist()
    for k in (0, loops - 1):
        alone = pt.recursive.Bank(1, (1, 7), clip=6.0)
        alone.run(u[:, [k]], y[:, [k]])
        for name in names:
            assert getattr(at_once, name)[k].tolist() == getattr(alone, name)[0].tolist()


@pytest.mark.parametrize(("noise_var", "hold"), [(0.0, 0.3), (1.5, 0.2)])
def test_the_right_delay_has_the_smallest_error(noise_var, hold):
    """Source 001, 3.7.6: dead time 0.1 s at Ts 0.02 s is nk = 6."""
    rec = pt.datasets.engine_loop(noise_var=noise_var, seed=1, t_end=20.0, hold=hold)
    bank = pt.recursive.Bank(1, (3, 9))
    eps, q = bank.run(rec.u, rec.y, errors=True)
    assert bank.nk[np.square(eps[-500:, 0]).sum(axis=0).argmin()] == 6
    a, b, _, c = bank.theta[0, 3]
    truth = pt.datasets.ENGINE_LOOP
    tolerance = 1e-3 if noise_var == 0.0 else 0.05
    assert b / (1 - a) == approx(truth.K, rel=tolerance)
    assert -0.02 / np.log(a) == approx(truth.T, rel=2 * tolerance)
    if noise_var:
        assert c == approx(-a, abs=0.15)  # white noise on the output
        s2 = bank.s2[0, 3]
        assert s2 == approx(1.5, rel=0.3)
        z = np.square(eps[-500:, 0, 3]) / (s2 * (1 + q[-500:, 0, 3]))
        assert z.mean() == approx(1.0, rel=0.3)


def test_the_offset_in_physical_units_follows_from_the_origin():
    """Noise-free, and with little excitation: 40 samples."""
    u, x = np.sign(np.random.default_rng(2).normal(size=40)) + 5.0, 0.0
    y = []
    for t in range(40):
        x = 0.8 * x + 0.5 * (u[t - 1] if t else 5.0)
        y.append(x + 583.451)
    bank = pt.recursive.Bank(1, (1, 1), P0=1e8)
    bank.run(u[:, None], np.array(y)[:, None])
    a, b, d, _ = bank.theta[0, 0]
    u0, y0 = bank.origin[0]
    assert (a, b) == approx((0.8, 0.5), rel=1e-5)
    K = b / (1 - a)
    assert y0 - K * u0 + d / (1 - a) == approx(583.451, rel=1e-7)


def test_sd_is_that_of_the_estimates():
    """Over 200 loops of the same plant; the noise is white, so that ARMAX is right."""
    rng, loops = np.random.default_rng(5), 200
    u, e = np.sign(rng.normal(size=(1500, loops))), rng.normal(size=(1500, loops))
    y = np.zeros((1500, loops))
    for t in range(2, 1500):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 2] + e[t] - 0.5 * e[t - 1]
    bank = pt.recursive.Bank(loops, (2, 2), lam=0.99)
    bank.run(u, y)
    z = (bank.theta[:, 0, :2] - [0.8, 0.5]) / bank.sd[:, 0, :2]
    assert np.abs(z.mean(axis=0)).max() < 0.4
    assert z.std(axis=0) == approx(1.0, rel=0.25)  # 200 loops: 5 %; RML in 200 samples: the rest


def test_a_closed_gate_leaves_its_loop_as_it_is():
    u, y = records(300, 33)
    bank, other = (pt.recursive.Bank(33, (1, 5)) for _ in range(2))
    bank.run(u[:150], y[:150])
    other.run(u, y)
    bank.gate(7, False)
    before = bank.theta[7], bank.P[7]
    bank.run(u[150:290], y[150:290])
    assert (bank.theta[7] == before[0]).all() and (bank.P[7] == before[1]).all()
    assert bank.learnt.tolist() == [k != 7 for k in range(33)]
    bank.gate(7, True)
    bank.run(u[290:], y[290:])
    assert bank.learnt.all() and (bank.theta[7] != before[0]).all()
    elsewhere = np.arange(33) != 7
    assert (bank.theta[elsewhere] == other.theta[elsewhere]).all()


@pytest.mark.parametrize("loops", [3, 40])
def test_a_broken_loop_touches_no_other(loops):
    u, y = records(300, loops)
    u_bad, y_bad = u.copy(), y.copy()
    y_bad[100], u_bad[110], y_bad[120] = y[100], u[110], y[120]
    y_bad[100, 1], u_bad[110, 1], y_bad[120, 1] = np.nan, -np.inf, 1e300
    sound, bank = (pt.recursive.Bank(loops, (1, 5), clip=6.0) for _ in range(2))
    sound.run(u, y)
    bank.run(u_bad, y_bad)
    others = np.arange(loops) != 1
    for name in ("theta", "P", "sd", "eps", "q", "s2"):
        assert (getattr(bank, name)[others] == getattr(sound, name)[others]).all()
    assert np.isfinite(bank.P).all() and bank.restarts.tolist() == [k == 1 for k in range(loops)]
    fresh = pt.recursive.Bank(1, (1, 5), clip=6.0)
    fresh.run(u[121:, [1]], y[121:, [1]])
    assert (bank.theta[1] == fresh.theta[0]).all()


def test_an_offset_step_is_followed_once_the_offset_is_opened():
    """White noise on the output, and a step of 20 standard deviations: K and T hardly move."""
    rng = np.random.default_rng(7)
    u, x = np.sign(rng.normal(size=(700, 20))), np.zeros((700, 20))
    for t in range(2, 700):
        x[t] = 0.8 * x[t - 1] + 0.5 * u[t - 2]
    y = x + 0.1 * rng.normal(size=x.shape) - 2.0 * (np.arange(700) >= 500)[:, None]
    K_errors, a_errors = [], []
    for opens in (False, True):
        bank = pt.recursive.Bank(20, (2, 2), P0=1e4)
        bank.run(u[:500], y[:500])
        for k in range(20 * opens):
            bank.open_offset(k)
        bank.run(u[500:550], y[500:550])
        a, b = bank.theta[:, 0, :2].T
        K_errors.append(np.median(np.abs(b / (1 - a) / 2.5 - 1)))
        a_errors.append(np.median(np.abs(a - 0.8)))
    assert K_errors[1] < 0.03 and 5 * K_errors[1] < K_errors[0]
    assert a_errors[1] < 0.01 and 4 * a_errors[1] < a_errors[0]


def test_outliers_are_clipped():
    u, y = records(600, 1)
    y[300::40] += 50.0
    bare, clipped = pt.recursive.Bank(1, (2, 2)), pt.recursive.Bank(1, (2, 2), clip=6.0)
    for bank in (bare, clipped):
        bank.run(u, y)
    errors = [np.abs(bank.theta[0, 0, :2] - [0.7, 1.5]).max() for bank in (bare, clipped)]
    assert errors[1] < 0.1 < errors[0]
    assert clipped.s2[0, 0] < 0.1 < bare.s2.max() + 0.1


@pytest.mark.parametrize("lam", [0.95, 0.98])
def test_constant_stretches_leave_the_covariance_bounded(lam):
    u, y = records(500, 40)
    bank, k = pt.recursive.Bank(40, (1, 5), lam=lam), np.arange(40)
    bank.run(u, y)
    still, largest = np.ones((25_000, 1)), []
    for _ in range(2):
        bank.run(still * u[-1], still * y[-1])
        largest.append(np.einsum("kcii->kci", bank.P).max())
    # D is at most 1e9; entries of U are ratios of the constant signals.
    assert largest[0] < 1e18 and largest[1] == approx(largest[0], rel=1e-6)
    assert np.isfinite(bank.theta).all() and not bank.restarts.any()
    u, y = records(500, 40, seed=1)
    bank.run(u, y)
    assert bank.theta[k, 1 + k % 3, 0] == approx(0.7 + 0.25 * (k % 7) / 7, abs=0.2)


@pytest.mark.parametrize("loops", [2, 40])
def test_a_pickle_goes_on_to_the_last_bit(loops):
    u, y = records(200, loops)
    one = pt.recursive.Bank(loops, (2, 6), lam=0.99, P0=[1, 2, 3, 4], clip=5.0, method="els")
    one.scale(1, 2.0, 0.5)
    one.gate(0, False)
    one.run(u[:77], y[:77])
    other = pickle.loads(pickle.dumps(one))
    for bank in (one, other):
        bank.run(u[77:], y[77:])
    for name in ("theta", "P", "sd", "eps", "q", "s2", "learnt", "nk", "restarts", "origin"):
        assert getattr(one, name).tolist() == getattr(other, name).tolist()


def test_any_array_will_do():
    u, y = records(50, 40)
    one, other = (pt.recursive.Bank(40, (1, 5)) for _ in range(2))
    one.run(u, y)
    other.run(np.asfortranarray(u), y[::-1][::-1])
    assert (one.theta == other.theta).all()
    one.step(u[0].tolist(), y[0].tolist())
    other.step(np.repeat(u[0], 2)[::2], y[0])
    assert (one.theta == other.theta).all()


@pytest.mark.parametrize(
    ("args", "options", "name"),
    [
        ((0, (1, 5)), {}, "loops"),
        ((1.5, (1, 5)), {}, "loops"),
        ((1, (0, 5)), {}, "nk"),
        ((1, (6, 5)), {}, "nk"),
        ((1, 5), {}, "nk"),
        ((1, (1, 5)), {"lam": 0.0}, "lam"),
        ((1, (1, 5)), {"lam0": 1.5}, "lam0"),
        ((1, (1, 5)), {"rho": -0.1}, "rho"),
        ((1, (1, 5)), {"P0": -1.0}, "P0"),
        ((1, (1, 5)), {"method": "iv"}, "method"),
        ((1, (1, 5)), {"clip": 6.0, "errors": False}, "clip"),
        ((1, (1, 5)), {"swell": 0.1}, "swell"),
        ((1, (1, 5)), {"c_most": 1.0}, "c_most"),
        ((1, (1, 5)), {"memory": 3.0}, "memory"),
    ],
)
def test_what_is_out_of_range_is_refused_by_name(args, options, name):
    with pytest.raises(pt.errors.UsageError, match=f"`{name}`") as caught:
        pt.recursive.Bank(*args, **options)
    assert caught.value.code == "U01"


def test_samples_of_another_size_are_refused():
    bank = pt.recursive.Bank(3, (1, 5), errors=False)
    with pytest.raises(pt.errors.UsageError, match="`u` is 2 numbers"):
        bank.step([0.0, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(pt.errors.UsageError, match=r"\(N, 3\)"):
        bank.run(np.zeros((5, 2)), np.zeros((5, 2)))
    with pytest.raises(pt.errors.UsageError, match="`errors`"):
        bank.run(np.zeros((5, 3)), np.zeros((5, 3)), errors=True)
    for wrong in (bank.reset, bank.open_offset):
        with pytest.raises(pt.errors.UsageError, match="`index` is 3"):
            wrong(3)


def test_the_example_of_the_docstring_runs():
    examples = doctest.DocTestFinder().find(pt.recursive.Bank, "Bank", globs={})
    results = [doctest.DocTestRunner().run(example) for example in examples]
    assert sum(tried for _, tried in results) == 6 and not any(failed for failed, _ in results)
