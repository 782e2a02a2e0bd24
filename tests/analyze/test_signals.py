"""Test signals: each against its oracle or its closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import plantune as pt
from oracles import excitation as oracle

signals = pt.signals


# --- PRBS ---


@pytest.mark.parametrize("bits", [3, 5, 8, 11])
def test_prbs_has_two_levels_of_autocorrelation(bits):
    M = 2**bits - 1
    r = oracle.periodic_correlation(signals.prbs(M, bits=bits, seed=3))
    assert_allclose(r, [1, *[-1 / M] * (M - 1)], atol=1e-12)


def test_prbs_that_is_held_has_the_spectrum_of_the_oracle():
    base = signals.prbs(63, bits=6)
    held = signals.prbs(63 * 4, hold=4, bits=6)
    assert_array_equal(held, np.repeat(base, 4))
    power = np.abs(np.fft.fft(held)) ** 2 / len(held)
    assert_allclose(power, oracle.held_spectrum(base, 4), atol=1e-9)


def test_prbs_is_the_oracles_up_to_direction_and_start():
    # Both are sequences of maximum length; with 3 bits there are two, one the other backward.
    ours, theirs = signals.prbs(7, bits=3), oracle.prbs(3)
    turned = [np.roll(x, k) for x in (theirs, theirs[::-1]) for k in range(7)]
    assert any(np.array_equal(ours, x) or np.array_equal(ours, -x) for x in turned)


def test_prbs_takes_as_many_bits_as_give_no_repetition():
    u = signals.prbs(600, hold=2)
    assert not any(np.array_equal(u[: 600 - k], u[k:]) for k in range(2, 500))


# --- GBN ---


def test_gbn_changes_as_often_as_it_says():
    N, hold, least = 4000, 20, 5
    changes = [
        np.count_nonzero(np.diff(signals.gbn(N, hold, least=least, seed=s))) for s in range(40)
    ]
    # 40 records of 800 ticks, p = 1/4: a relative standard error of 1 %
    assert np.sum(changes) == pytest.approx(40 * N / hold, rel=0.03)


def test_gbn_keeps_each_value_for_the_least_time():
    u = signals.gbn(3000, hold=12, least=4, seed=2)
    moves = np.flatnonzero(np.diff(u)) + 1
    assert set(u) == {-1.0, 1.0} and not np.any(moves % 4)


def test_gbn_has_the_correlation_of_its_law():
    u = signals.gbn(200_000, hold=10, seed=0)
    r = [u[: len(u) - l] @ u[l:] / (len(u) - l) for l in range(6)]
    assert_allclose(r, (1 - 2 * 0.1) ** np.arange(6), atol=0.02)


# --- multisine ---


def test_multisine_has_equal_lines_in_its_band_and_none_outside():
    N, Ts, band = 512, 0.5, (0.1, 1.3)
    power = np.abs(np.fft.rfft(signals.multisine(N, Ts, band)))
    w = 2 * np.pi * np.arange(N // 2 + 1) / (N * Ts)
    inside = (w >= band[0]) & (w <= band[1])
    assert_allclose(power[inside], power[inside].max(), rtol=1e-9)
    assert_allclose(power[~inside], 0, atol=1e-9)


def test_schroeders_multisine_is_the_oracles():
    lines = np.arange(1, 41)
    theirs = oracle.multisine(512, lines)
    ours = signals.multisine(512, 1.0, (0.0, 40.2 * 2 * np.pi / 512))
    # The oracle gives the first line no phase either; both scaled to one peak.
    assert_allclose(ours, theirs / np.abs(theirs).max(), atol=1e-9)


def test_schroeders_phases_have_a_lower_crest_than_random_ones():
    arguments = (1024, 1.0, (0.0, 1.0))
    low = signals.crest_factor(signals.multisine(*arguments))
    drawn = [
        signals.crest_factor(signals.multisine(*arguments, phases="random", seed=s))
        for s in range(20)
    ]
    assert low < 1.8 and min(drawn) > 2.2 and 2.6 < np.median(drawn) < 4


def test_multisine_repeats_after_its_period():
    u = signals.multisine(300, 1.0, (0.0, 2.0), period=100)
    assert_array_equal(u[:100], u[100:200])
    assert np.abs(u).max() == 1.0


# --- chirp and stairs ---


def test_linear_chirp_is_the_oracles():
    f0, f1 = 0.1, 5.0
    ours = signals.chirp(2000, 0.01, (2 * np.pi * f0, 2 * np.pi * f1), sweep="linear")
    assert_allclose(ours, oracle.chirp(2000, 0.01, f0, f1), atol=1e-9)


@pytest.mark.parametrize("sweep", ["linear", "logarithmic"])
@pytest.mark.parametrize("band", [(2.0, 40.0), (40.0, 2.0)])
def test_chirp_begins_and_ends_at_its_frequencies(sweep, band):
    N, Ts = 400_000, 0.001
    u = signals.chirp(N, Ts, band, sweep=sweep)
    half = np.diff(Ts * np.flatnonzero(u[1:] * u[:-1] < 0))  # half a turn each
    # The slowest half turn takes 1.6 s, in which a linear sweep has gained a tenth.
    assert np.pi / half[[0, -1]] == pytest.approx(band, rel=0.12)


def test_staircase_holds_each_level():
    levels = [1.0, -2.5, 0.0, 4.0]
    assert_array_equal(signals.staircase(levels, 3), oracle.staircase(levels, 3))


def test_crest_factor_is_the_oracles():
    u = np.random.default_rng(0).normal(size=50)
    assert signals.crest_factor(u) == pytest.approx(oracle.crest(u), rel=1e-12)


# --- all ---

MAKERS = {
    "prbs": lambda **seed: signals.prbs(200, 3, **seed),
    "gbn": lambda **seed: signals.gbn(200, 6, **seed),
    "multisine": lambda **seed: signals.multisine(200, 1.0, (0, 1), phases="random", **seed),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_a_seed_gives_one_signal(make):
    assert_array_equal(make(seed=4), make(seed=4))
    assert not np.array_equal(make(seed=4), make(seed=5))
    assert np.abs(make()).max() == 1.0 and len(make()) == 200


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: signals.prbs(100, hold=0),
        lambda: signals.prbs(100, bits=2),
        lambda: signals.prbs(100, bits=21),
        lambda: signals.prbs(-1),
        lambda: signals.prbs(10.5),
        lambda: signals.gbn(100, hold=5, least=5),
        lambda: signals.gbn(100, hold=5, least=0),
        lambda: signals.gbn(100, hold=np.nan),
        lambda: signals.multisine(100, 1.0, (0.0, 4.0)),
        lambda: signals.multisine(100, 1.0, (0.001, 0.01)),
        lambda: signals.multisine(100, 0.0, (0.0, 1.0)),
        lambda: signals.multisine(100, 1.0, (0.0, 1.0), phases="none"),
        lambda: signals.chirp(100, 1.0, (0.0, 1.0)),
        lambda: signals.chirp(100, 1.0, (0.1, 3.2)),
        lambda: signals.chirp(100, -1.0, (0.1, 1.0)),
        lambda: signals.chirp(100, 1.0, (0.1, 1.0), sweep="square"),
        lambda: signals.staircase([1.0], hold=0),
        lambda: signals.staircase([np.inf], hold=1),
    ],
)
def test_what_makes_no_signal_is_refused(wrong):
    with pytest.raises(pt.UsageError) as refused:
        wrong()
    assert refused.value.code == "U01"
