"""Which structure is trusted on simulated plants of known truth, and what the reason says."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from pytest import approx
from scipy.signal import cont2discrete, lfilter

import plantune as pt

SEEDS = range(10)


def binary(seed, N=1200, hold=6):
    """Return +-1, switching at random every `hold` rows."""
    return np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], N // hold + 1), hold)[:N]


def noise(seed, sd, N=1200):
    return sd * np.random.default_rng(1000 + seed).normal(size=N)


def first_order(seed):
    """First order plus a delay between samples, white noise on the output."""
    u = binary(seed)
    y = pt.models.ProcessModel(K=2.0, T=1.0, L=0.43).simulate(u, Ts=0.1)
    return pt.Record(u=u, y=3.0 + y + noise(seed, 0.2), Ts=0.1)


def armax_plant(seed):
    """Two poles shared by input and noise, which is a moving average before them."""
    A, u = [1.0, -1.5, 0.7], binary(seed)
    y = lfilter([0.0, 0.0, 1.0, 0.5], A, u) + lfilter([1.0, -0.8, 0.5], A, noise(seed, 0.2))
    return pt.Record(u=u, y=y, Ts=0.1)


def second_order(seed, zeta=1.0):
    """Sample w^2/(s^2 + 2 zeta w s + w^2) with w = 2, a little white noise on the output."""
    u = binary(seed)
    b, a, _ = cont2discrete(([8.0], [1.0, 4.0 * zeta, 4.0]), 0.1)
    return pt.Record(u=u, y=lfilter(b.ravel(), a, u) + noise(seed, 0.02), Ts=0.1)


def closed_loop(seed, sd=0.05, N=2000):
    """A first-order ARMAX plant under a PI controller whose set point moves."""
    rng = np.random.default_rng(seed)
    r, e = np.repeat(rng.choice([-1.0, 1.0], N // 20), 20), sd * rng.normal(size=N)
    u, y, integral = np.zeros(N), np.zeros(N), 0.0
    for k in range(N):
        if k >= 3:
            y[k] = 0.9 * y[k - 1] + 0.2 * u[k - 3] + e[k] + 0.6 * e[k - 1]
        integral += 0.02 * (r[k] - y[k])
        u[k] = 0.8 * (r[k] - y[k]) + integral
    return pt.Record(u=u, y=y, r=r, Ts=0.1)


def judged(rec, order=4, nk=None):
    est, val = rec.split(0.5)
    scan = pt.analyze.delay(est, (1, 10))
    fits, _ = pt.estimate.candidates(est, order, scan.nk if nk is None else nk)
    rows = pt.validate.compare(val, *fits.values(), names=[*fits]).rows
    return fits, {row.name: row for row in rows}


def count(make, closed=False):
    found = (pt.validate.trust(*judged(make(seed)), closed_loop=closed) for seed in SEEDS)
    return Counter(trusted.name for trusted in found)


def test_first_order_in_white_output_noise_is_the_process_model():
    assert count(first_order)["P1D"] >= 9  # ARX needs 8 parameters for the same noise


def test_a_disturbance_before_the_poles_is_armax():
    assert count(armax_plant)["ARMAX"] >= 9


@pytest.mark.parametrize("zeta", [1.0, 0.1])
def test_second_order_in_white_output_noise_is_an_output_error_model(zeta):
    assert count(lambda seed: second_order(seed, zeta))["OE"] >= 9


def test_closed_loop_is_left_to_models_of_the_noise():
    found = count(closed_loop, closed=True)
    assert found["ARMAX"] >= 9
    assert found["ARMAX"] + found["ARX"] == len(SEEDS)


def test_only_a_loop_shows_feedback():
    """ARMAX errors hold nothing of the input: what is left tells an open from a closed loop."""

    def seen(make):
        return sum(judged(make(seed))[1]["ARMAX"].feedback for seed in SEEDS)

    assert seen(armax_plant) <= 1  # of 1 % each
    assert seen(lambda seed: closed_loop(seed, sd=0.2)) >= 8  # where noise moves u as set points do


def test_the_reason_names_the_numbers():
    fits, verdicts = judged(armax_plant(0))
    note = pt.validate.trust(fits, verdicts).note
    assert (note.code, note.severity, note.limit) == ("V10", "info", 1.0)
    best = max(verdict.fit for verdict in verdicts.values())
    assert note.measured == approx(best - verdicts["ARMAX"].fit)
    assert f"{verdicts['ARMAX'].fit:.1f} %" in note.text
    assert f"it has {len(fits['ARMAX'].theta) + 1} parameters" in note.text
    assert f"OE {len(fits['OE'].theta) + 1}" in note.text


def test_equals_are_those_within_the_limit():
    fits, verdicts = judged(first_order(0))
    gap = verdicts["P1D"].fit - verdicts["OE"].fit
    better = {**verdicts, "OE": replace(verdicts["OE"], fit=verdicts["OE"].fit + gap + 2.0)}
    assert pt.validate.trust(fits, better).name == "OE"
    assert pt.validate.trust(fits, better, limits=pt.Limits(V10=3.0)).name == "P1D"


def test_a_search_that_did_not_converge_is_never_trusted_beside_others():
    fits, verdicts = judged(armax_plant(2))
    fits["ARMAX"] = replace(fits["ARMAX"], status="not converged")
    found = pt.validate.trust(fits, verdicts)
    assert found.name != "ARMAX"
    assert "did not converge" in found.objections["ARMAX"]
    assert "not ARMAX" in found.note.text


def test_errors_that_follow_the_input_bar_a_model_unless_no_other_comes_near():
    fits, verdicts = judged(second_order(3), order=1)
    assert any(note.code == "V02" for note in verdicts["P1D"].notes)
    two, judged_two = judged(second_order(3))
    both = {"OE": two["OE"], "P1D": fits["P1D"]}
    rows = {"OE": judged_two["OE"], "P1D": verdicts["P1D"]}
    assert pt.validate.trust(both, rows).name == "OE"
    poor = {**rows, "OE": replace(rows["OE"], fit=rows["P1D"].fit - 6.0)}
    found = pt.validate.trust(both, poor)
    assert (found.name, found.note.severity) == ("P1D", "warning")
    assert "no other model comes near" in found.note.text


def test_a_structure_that_the_record_does_not_support_is_left_out_with_a_note():
    u = binary(0, N=8, hold=1)
    y = lfilter([0.0, 0.5], [1.0, -0.8], u) + noise(1, 0.01, N=8)
    fits, notes = pt.estimate.candidates(pt.Record(u=u, y=y, Ts=0.1), 1, 1)
    assert list(fits) == ["ARX", "OE", "ARMAX"]
    (note,) = notes
    assert (note.code, note.severity) == ("X03", "warning")
    assert note.text.startswith("P1D is left out: 5 usable rows for 5 parameters")
    assert note.remedy


def test_a_record_that_supports_nothing_is_refused():
    with pytest.raises(pt.NotIdentifiable) as caught:
        pt.estimate.candidates(pt.Record(u=np.ones(50), y=np.arange(50.0), Ts=0.1), 2, 1)
    assert caught.value.code == "X01"


def test_no_model_is_a_usage_error():
    with pytest.raises(pt.UsageError):
        pt.validate.trust({}, {})
