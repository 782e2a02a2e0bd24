"""Printed numbers of source 001, 3.5.3 and 3.7.4, as corrected."""

from functools import reduce

import numpy as np
import pytest
from pytest import approx

import plantune as pt

TS = 0.02
NYQUIST = np.pi / TS
LOW = pt.prep.Butterworth("low", order=5, w=20.0, Ts=TS)
BAND = pt.prep.Butterworth("band", order=5, w=(1.0, 20.0), Ts=TS)


def transfer_function(design):
    """Return numerator and denominator in falling powers of z."""
    numerator, denominator = (
        reduce(np.convolve, part) for part in (design.sos[:, :3], design.sos[:, 3:])
    )
    n = len(design.poles) + 1
    # What a section of first order lacks is zero at the end.
    assert np.all(numerator[n:] == 0) and np.all(denominator[n:] == 0)
    return numerator[:n], denominator[:n]


def test_poles_of_the_prototype():
    printed = [-0.3090 + 0.9511j, -0.8090 + 0.5878j, -1, -0.8090 - 0.5878j, -0.3090 - 0.9511j]
    assert LOW.prototype == approx(np.array(printed), abs=5e-5)  # (3.5-22)


def test_polynomial_of_the_prototype():
    printed = [1, 3.236, 5.236, 5.236, 3.236, 1]
    assert np.poly(LOW.prototype).real == approx(printed, abs=5e-4)  # (3.5-23)


def test_low_pass_in_continuous_time():
    printed = [1, 64.72, 2094, 41889, 517771, 3200000]
    assert np.poly(20 * LOW.prototype).real == approx(printed, rel=2.1e-4)  # (3.5-27)


def test_prewarped_cut_off():
    # (3.5-28) is computed from the rounded share 0.1273 of the Nyquist frequency.
    rounded = pt.prep.Butterworth("low", order=5, w=0.1273 * NYQUIST, Ts=TS)
    assert rounded.prewarped == approx(0.4053, abs=5e-5)
    assert LOW.prewarped == approx(2 * np.tan(0.2), rel=1e-15)


def test_low_pass_in_the_prewarped_plane():
    printed = [1, 1.312, 0.8606, 0.3489, 0.08743, 0.01095]
    assert np.poly(LOW.prewarped * LOW.prototype).real == approx(printed, rel=5e-4)  # (3.5-30)


def test_sampled_low_pass():
    numerator, denominator = transfer_function(LOW)  # (3.5-32)
    printed = [0.0001782, 0.0008911, 0.001782, 0.001782, 0.0008911, 0.0001782]
    assert numerator == approx(printed, rel=5e-4)
    assert denominator == approx([1, -3.708, 5.628, -4.349, 1.706, -0.2711], rel=3e-4)


def test_the_printed_low_pass_loses_three_percent_and_ours_nothing():
    printed = 0.0001782 * 2 + 0.0008911 * 2 + 0.001782 * 2
    assert printed / (1 - 3.708 + 5.628 - 4.349 + 1.706 - 0.2711) < 0.98
    assert LOW.freqresp([0.0])[0] == approx(1.0, abs=1e-15)
    assert LOW.run([583.451] * 9).tolist() == [583.451] * 9


def test_numerator_of_the_band_pass():
    numerator, _ = transfer_function(BAND)  # (3.7-6)
    g = 0.0001416
    printed = [g, 0, -5 * g, 0, 10 * g, 0, -10 * g, 0, 5 * g, 0, -g]
    assert numerator == approx(printed, rel=5e-4, abs=1e-18)


def test_denominator_of_the_band_pass():
    _, denominator = transfer_function(BAND)
    printed = [1, -8.737, 34.42, -80.55, 124, -131.3, 96.73, -49.02, 16.35, -3.239, 0.2897]
    assert denominator == approx(printed, rel=5e-4)


def test_four_digits_of_the_band_pass_are_unstable():
    printed = [1, -8.737, 34.42, -80.55, 124, -131.3, 96.73, -49.02, 16.35, -3.239, 0.2897]
    assert np.abs(np.roots(printed)).max() == approx(1.95, abs=0.01)
    assert np.abs(BAND.poles).max() == approx(0.994332, abs=5e-7)
    assert len(BAND.poles) == 10


def test_settling_of_the_band_pass():
    # 2 % of the step response's own peak, 0.7633, interpolated; printed 13.5565 s.
    assert BAND.step_response(3000).max() == approx(0.7633, abs=5e-5)
    assert BAND.settling == approx(13.558, abs=5e-4)


@pytest.mark.parametrize("order", [1, 2, 5, 8])
def test_settling_of_low_passes_is_that_of_a_search(order):
    design = pt.prep.Butterworth("low", order=order, w=20.0, Ts=TS)
    y = design.step_response(500)
    off = np.abs(y - 1) - 0.02 * y.max()
    last = np.flatnonzero(off > 0)[-1]
    exact = np.interp(0.0, [-off[last], -off[last + 1]], [last, last + 1]) * TS
    assert design.settling == approx(exact, rel=1e-12)


def test_rows_of_the_shortest_stretch():
    # (3.5-2): 132.5 rows, rounded up to 133.
    u = np.repeat([0.0, 1.0], 300)
    rec = pt.Record(u=u, y=u, Ts=TS)
    rest = pt.prep.steady(rec, T_max=0.5, L_max=0.15)
    assert rest.rows[0] == 133 and rest.rows[300 - 133] == 433
