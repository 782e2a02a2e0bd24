"""Bouc and Wen: the oscillator, its force, and what a record tells of them."""

import pickle

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import bouc_wen as oracle
from plantune.errors import DataError, NotIdentifiable, NumericsError, UsageError

BoucWen, Force = pt.hysteresis.BoucWen, pt.hysteresis.BoucWenForce
TS = 1 / 750
TRUTH = BoucWen(m=2, c=10, k=5e4, alpha=5e4, bg=800, bd=-1100, nu=1, Ts=TS)
NAMES = ("m", "c", "k", "alpha", "bg", "bd", "nu")


def multisine(seed, N=1000, level=50.0, band=(5.0, 150.0)):
    """Give N samples at 750 Hz of a force of random phases in the band of the benchmark."""
    rng = np.random.default_rng(seed)
    t, f = np.arange(N) * TS, np.arange(*band, 0.75)
    u = np.sin(2 * np.pi * (f * t[:, None] + rng.random(len(f)))).sum(axis=1)
    return level * u / u.std() * np.minimum(1, np.arange(N) / 20)


def record(seed, truth=TRUTH, N=1000, noise=7e-6, **how):
    u = multisine(seed, N, **how)
    return u, truth.simulate(u) + np.random.default_rng(seed + 999).normal(0, noise, N)


# --- the oscillator ------------------------------------------------------------------------------


@pytest.mark.parametrize(("bg", "bd", "nu"), [(800, -1100, 1.0), (60, 20, 1.6)])
def test_the_oscillator_is_that_of_an_adaptive_integrator(bg, bd, nu):
    t = np.arange(150) * TS

    def force(t):
        return 120 * np.sin(200 * t) * np.sin(20 * t) ** 2

    p = oracle.SimpleNamespace(m=2, c=10, k=5e4, alpha=5e4, beta=1.0, gamma=bg, delta=bd, nu=nu)
    start = (1e-4, 0.02, 5.0)
    exact = oracle.oscillator(t, force, p, start)[0]
    plant = BoucWen(2, 10, 5e4, 5e4, bg, bd, nu)
    # Where y' or z changes sign, slopes have kinks, and the rule is of lower order there.
    for steps, limit in ((None, 5e-4), (32, 2e-5)):
        error = plant.simulate(force(t), TS, x0=start, substeps=steps) - exact
        assert abs(error).max() < limit * abs(exact).max()


def test_a_straight_force_streams_to_the_same_bits():
    u = multisine(3, 300)
    stream = TRUTH.stream()
    y = stream.run(u[:100])
    again = pickle.loads(pickle.dumps(stream))
    y = np.r_[y, [again.step(x) for x in u[100:]]]
    assert np.array_equal(y, TRUTH.simulate(u, hold="line"))
    assert again.model.same_as(TRUTH)


def test_the_force_between_samples_counts():
    u = multisine(4, 500)
    fine = TRUTH.simulate(u, substeps=16)
    off = {h: np.std(TRUTH.simulate(u, hold=h) - fine) for h in ("spline", "line", "zoh")}
    assert off["spline"] < 1e-6 < off["line"] < 2e-5 < off["zoh"]


def test_an_initial_state_is_found():
    u = multisine(5, 600)
    y = TRUTH.simulate(u)
    x0 = TRUTH.initial_state(u[300:], y[300:])
    # What is left is the spline of the first sample.
    assert abs(TRUTH.simulate(u[300:], x0=x0) - y[300:]).max() < 3e-3 * abs(y).max()
    assert x0[0] == approx(y[300], abs=2e-6)


# --- from a record -------------------------------------------------------------------------------


def test_an_exact_record_gives_the_truth_back():
    u, y = record(1, noise=0.0)
    model = BoucWen.identify(u, y, TS)
    assert [getattr(model, n) for n in NAMES] == approx([2, 10, 5e4, 5e4, 800, -1100, 1], rel=1e-5)
    assert model.x0 == approx((0, 0, 0), abs=1e-4)
    assert not model.notes


@pytest.mark.parametrize("x0", ["estimate", "rest"])
def test_standard_deviations_are_those_of_the_errors(x0):
    z = []
    for seed in range(16):
        model = BoucWen.identify(*record(seed), TS, x0=x0)
        theta = np.array([getattr(model, n) for n in NAMES])
        truth = [getattr(TRUTH, n) for n in NAMES]
        z.append((theta - truth) / model.identified.sd[:7])
    # 16 errors of each of seven: their rms, were it 1, is within 0.5 to 1.5 nearly always.
    assert 0.5 < np.sqrt(np.mean(np.square(z), axis=0)).min()
    assert np.sqrt(np.mean(np.square(z), axis=0)).max() < 1.6


def test_ten_times_the_noise_ends_at_the_truth():
    model = BoucWen.identify(*record(2, N=4000, noise=7e-5), TS)
    theta = np.array([getattr(model, n) for n in NAMES])
    truth = [getattr(TRUTH, n) for n in NAMES]
    assert (abs(theta - truth) < 4 * model.identified.sd[:7]).all()


def test_a_force_that_yields_is_found_with_its_nu():
    truth = BoucWen(m=1, c=20, k=2e4, alpha=6e4, bg=2.0, bd=1.0, nu=2.2, Ts=TS)
    model = BoucWen.identify(*record(3, truth, 3000, noise=2e-6, level=150.0), TS)
    theta = np.array([model.m, model.c, model.k, model.alpha, model.nu])
    sd = model.identified.sd[[0, 1, 2, 3, 6]]
    assert (abs(theta - [1, 20, 2e4, 6e4, 2.2]) < 4 * sd).all()
    assert model.nu == approx(2.2, rel=0.05)


def test_units_scale():
    u, y = record(6)
    model = BoucWen.identify(u, y, TS, nu=1.0)
    other = BoucWen.identify(1e3 * u, 1e6 * y, TS, nu=1.0)  # mN and um
    assert other.m == approx(1e-3 * model.m, rel=1e-6)
    assert other.alpha == approx(1e-3 * model.alpha, rel=1e-6)
    assert other.bg == approx(1e-6 * model.bg, rel=1e-5)
    assert other.identified.sd[4] == approx(1e-6 * model.identified.sd[4], rel=1e-4)


def test_a_known_nu_narrows_the_rest():
    u, y = record(7)
    known, free = BoucWen.identify(u, y, TS, nu=1.0), BoucWen.identify(u, y, TS)
    assert known.nu == 1.0 and known.identified.sd[6] == 0.0
    assert known.identified.sd[4] < 0.5 * free.identified.sd[4]


def test_what_a_record_does_not_tell_is_refused_or_said():
    linear = BoucWen(m=2, c=10, k=9e4, alpha=1e4, bg=0, bd=0)
    u = multisine(8)
    with pytest.raises(NotIdentifiable, match=r"tell|asks") as refused:
        BoucWen.identify(u, linear.simulate(u, TS), TS)
    assert refused.value.code == "X02"
    # A hundredth of the swing: z hardly leaves its line, noise leaves half of a parameter open.
    try:
        model = BoucWen.identify(*record(9, level=0.5, noise=7e-7), TS)
    except (NotIdentifiable, NumericsError) as error:
        assert error.code in ("X02", "N05")
    else:
        size = np.abs([model.m, model.c, model.k, model.alpha, model.bg, model.bd, model.nu])
        assert np.max(np.asarray(model.identified.sd)[:7] / size) > 0.5


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda u, y: (0 * u, y, TS), "X01"),
        (lambda u, y: (u, 0 * y + 1, TS), "X01"),
        (lambda u, y: (u[:-7], y, TS), "D09"),
        (lambda u, y: (u[:30], y[:30], TS), "X02"),
        (lambda u, y: (u[:120], y[:120], TS), "X03"),
        (lambda u, y: (u[::6], y[::6], 6 * TS), "M09"),
        (lambda u, y: (u, np.where(y == y[40], np.nan, y), TS), "U01"),
        (lambda u, y: (u, y, 0.0), "U01"),
        (lambda u, y: (u, -y, TS), "X02"),
    ],
)
def test_bad_records_are_refused(change, code):
    u, y = record(10)
    with pytest.raises((UsageError, DataError, NotIdentifiable)) as refused:
        BoucWen.identify(*change(u, y))
    assert refused.value.code == code
    assert refused.value.remedy


def test_bad_arguments_are_refused():
    for change in ({"m": 0}, {"nu": -1}, {"alpha": np.inf}, {"Ts": 0.0}):
        with pytest.raises(UsageError, match=next(iter(change))):
            BoucWen(**{"m": 1, "c": 1, "k": 1, "alpha": 1, "bg": 1, "bd": 1, **change})
    plant = BoucWen(m=1, c=1, k=1, alpha=1, bg=1, bd=1)
    for call in (
        lambda: plant.simulate([0.0, 1.0]),
        plant.stream,
        plant.inverse,
        lambda: plant.simulate([0.0, 1.0], 0.1, hold="cubic"),
        lambda: plant.simulate([0.0, 1.0], 0.1, substeps=0),
        lambda: plant.simulate([0.0, 1.0], 0.1, x0="steady"),
        lambda: BoucWen.identify([0.0], [0.0], 0.1, x0="steady"),
        lambda: BoucWen.identify(*record(1), TS, nu=9.0),
    ):
        with pytest.raises(UsageError):
            call()
    with pytest.raises(NumericsError):
        BoucWen(m=1, c=-1e3, k=1, alpha=1, bg=1, bd=1).simulate(np.ones(1000), 1.0, substeps=1)


# --- the force over a displacement ---------------------------------------------------------------


@pytest.mark.parametrize(("g", "d", "nu"), [(0.8, -1.1, 1.0), (1.5, 0.5, 1.0), (1.2, 0.3, 1.7)])
def test_the_force_is_that_of_an_adaptive_integrator(g, d, nu):
    x = np.cumsum(np.random.default_rng(0).normal(0, 0.2, 120))
    x[0] = 0.0
    p = oracle.SimpleNamespace(alpha=1.0, beta=1.0, gamma=g, delta=d, nu=nu)
    exact = oracle.exponentials(x, p) if nu == 1 else oracle.of_displacement(x, p)
    force = Force(k=0, alpha=1, g=g, d=d, nu=nu).simulate(x)
    assert abs(force - exact).max() < 1e-5 * abs(exact).max()


def test_the_force_is_that_of_the_oscillator():
    # z = alpha zeta; the force that holds a slow path is k x + z.
    force = Force(k=5e4, alpha=5e4, g=800 * 5e4 ** (1.3 - 1), d=-100 * 5e4 ** (1.3 - 1), nu=1.3)
    p = oracle.SimpleNamespace(alpha=5e4, beta=1.0, gamma=800, delta=-100, nu=1.3)
    x = 1e-4 * np.sin(np.arange(60) / 5)
    exact = 5e4 * x + oracle.of_displacement(x, p)
    assert abs(force.simulate(x) - exact).max() < 1e-5 * abs(exact).max()


def test_a_force_does_not_know_time():
    x = np.r_[np.linspace(0, 2, 40), np.linspace(2, -1, 60), np.linspace(-1, 1.5, 50)]
    force = Force(k=0.2, alpha=1, g=1, d=0.4, nu=1.5)
    slow = np.interp(np.arange(0, 149.5, 0.5), np.arange(150), x)
    assert force.simulate(slow)[::2] == approx(force.simulate(x), abs=1e-6)


def test_a_force_comes_back_from_its_loops():
    truth = Force(k=0.3, alpha=2, g=1.5, d=0.5, nu=1.4, offset=0.7)
    x = 3 * np.sin(np.arange(800) / 25) * np.linspace(0.2, 1, 800)
    model = Force.identify(x, truth.simulate(x))
    fields = ("k", "alpha", "g", "d", "nu", "offset")
    assert [getattr(model, n) for n in fields] == approx([0.3, 2, 1.5, 0.5, 1.4, 0.7], rel=1e-3)
    z = []
    for seed in range(12):
        y = truth.simulate(x) + np.random.default_rng(seed).normal(0, 0.01, len(x))
        model = Force.identify(x, y)
        theta = np.array([getattr(model, n) for n in fields])
        z.append((theta - [0.3, 2, 1.5, 0.5, 1.4, 0.7]) / model.identified.sd)
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.5


def test_records_without_a_loop_are_refused():
    x = np.sin(np.arange(200) / 10)
    for call, code in (
        (lambda: Force.identify(0 * x, x), "X01"),
        (lambda: Force.identify(x[:10], x[:10]), "X03"),
        (lambda: Force.identify(x[:-1], x), "D09"),
        (lambda: Force.identify(x, 2 * x), "X02"),
    ):
        with pytest.raises((DataError, NotIdentifiable, NumericsError)) as refused:
            call()
        assert refused.value.code == code


# --- the benchmark -------------------------------------------------------------------------------


def benchmark(folder):
    h5py = pytest.importorskip("h5py")
    records = {}
    for file, name in (("train", "multisine"), ("test", "multisine"), ("test", "sinesweep")):
        with h5py.File(folder / f"{file}.h5") as h5:
            records[file, name] = [h5[f"{name}/{s}"][()].ravel() for s in ("u", "y")]
    return records


def rms(model, u, y, x0):
    return np.sqrt(np.mean((model.simulate(u, x0=x0) - y) ** 2))


def judged(model, records):
    """Give the rms errors on the multisine, which begins in steady state, and on the sweep."""
    u, y = records["test", "multisine"]
    steady = rms(model, u, y, model.initial_state(u, y))
    return steady, rms(model, *records["test", "sinesweep"], "rest")


def test_the_benchmark_from_1000_samples(data):
    records = benchmark(data("bouc_wen_sim"))
    u, y = (signal[:1000] for signal in records["train", "multisine"])
    # Asked for: below 3e-5 m; the best linear model, OE(3, 2, 0): 1.66e-4 and 1.55e-4.
    model = BoucWen.identify(u, y, TS)
    steady, sweep = judged(model, records)
    assert steady < 1e-6 and sweep < 3e-6
    theta = np.array([getattr(model, n) for n in NAMES])
    truth = [getattr(TRUTH, n) for n in NAMES]
    assert (abs(theta - truth) < 3 * model.identified.sd[:7]).all()
    assert max(judged(BoucWen.fit_start(u, y, TS), records)) < 5e-6


@pytest.mark.slow
def test_the_benchmark_from_all_samples(data):
    records = benchmark(data("bouc_wen_sim"))
    model = BoucWen.identify(*records["train", "multisine"], TS)
    steady, sweep = judged(model, records)
    assert steady < 5e-7 and sweep < 2.6e-6
    assert model.identified.rms == approx(7.37e-6, rel=0.01)  # the noise of the record
    theta = np.array([getattr(model, n) for n in NAMES])
    truth = [getattr(TRUTH, n) for n in NAMES]
    assert (abs(theta - truth) < 3 * model.identified.sd[:7]).all()
