"""Source 001, 3.6.8: tables 3.6-4 to 3.6-9, three rules at three operating points.

Conventions of the tables: exact delay, continuous PI, unit step at t = 0, K positive; settling 2 %,
interpolated; PO_u relative to 1/K; ISE, IAE, ITAE, IP as sums of 20 ms samples times 0.02 s over
100 s, t = 0 included.

The tables come from a simulation with a step of its own, whose traces they carry: the loop of IMC,
the same at all points in units of L, is printed with a settling time of 6.033 L, 6.028 L and
6.034 L (exact 6.0367), and with PO_y 5.6468, 5.6461 and 5.6414 % (exact 5.6434).
"""

from types import SimpleNamespace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from oracles import loop

TS = 0.02
POINTS = {  # K, T, L; the text prints T of point 5 as 0.414, its own Kp and Ti ask for 0.4145
    1: (5.9390, 0.1491, 0.1000),
    5: (8.1370, 0.4145, 0.1000),
    6: (4.4888, 0.1527, 0.1200),
}
RULES = {
    "ZN": pt.tune.ziegler_nichols,
    "RZN": pt.tune.refined_ziegler_nichols,
    "IMC": lambda model: pt.tune.imc_pi(model, gain_margin=3),
}
TIME = {  # tables 3.6-4, 3.6-6, 3.6-8
    (1, "ZN"): "0.2259 0.3000 1.1340 6.1025 0.1576 0.2426 0.0640 78.9031 2.8400",
    (1, "RZN"): "0.0787 0.1118 0.9604 5.5742 0.2117 0.2903 0.0554 67.1089 2.8384",
    (1, "IMC"): "0.1315 0.1491 0.6033 5.6468 0.1757 0.2240 0.0285 32.7621 2.8414",
    (5, "ZN"): "0.4585 0.3000 1.1655 52.2487 0.1882 0.3039 0.0816 396.5517 1.5661",
    (5, "RZN"): "0.0938 0.1684 2.2258 20.2982 0.2784 0.4774 0.2315 59.2282 1.5240",
    (5, "IMC"): "0.2667 0.4145 0.6028 5.6461 0.1757 0.2240 0.0285 169.2330 1.5292",
    (6, "ZN"): "0.2551 0.3600 1.6573 N/A 0.1935 0.3246 0.1263 52.6595 4.9648",
    (6, "RZN"): "0.0955 0.1286 0.9834 2.5762 0.2479 0.3313 0.0668 6.3275 4.9645",
    (6, "IMC"): "0.1484 0.1527 0.7241 5.6414 0.2088 0.2667 0.0411 24.1235 4.9716",
}
COLUMNS = ("Kp", "Ti", "Ts", "PO_y", "ISE", "IAE", "ITAE", "PO_u", "IP")
FREQUENCY = {  # tables 3.6-5, 3.6-7, 3.6-9
    (1, "ZN"): (6.20957, 17.485, 66.341, 7.27992),
    (1, "RZN"): (12.7544, 14.5105, 60.7834, 3.93767),
    (1, "IMC"): (9.54169, 15.7066, 60, 5.23599),
    (5, "ZN"): (5.85351, 17.0412, 58.1064, 7.88456),
    (5, "RZN"): (13.0328, 14.1403, 57.9235, 3.92853),
    (5, "IMC"): (9.54169, 15.7066, 60, 5.23599),
    (6, "ZN"): (6.62865, 14.9937, 76.5759, 5.34412),
    (6, "RZN"): (12.5781, 12.4704, 64.0237, 3.23893),
    (6, "IMC"): (9.54194, 13.0892, 60, 4.36332),
}

TOLERANCE = {
    "Kp": 5e-5,  # the last digit's half
    "Ti": 5e-5,
    "Ts": 1.4e-3,  # as the printed 6.028 L is from 6.0367 L, and half as much again
    "PO_y": 0.015,  # % points: 1e-4 of the peak
    "ISE": 1e-4,  # the last digit
    "IAE": 1e-4,
    "ITAE": 1e-4,
    "PO_u": 0.2,  # % of the peak: a printed peak is the last step before a corner of u
}

# The phase crossovers are those of a frequency grid: that of IMC is pi/(2 L), printed 9e-5 lower;
# the worst is 3.2e-4 lower.
GRID = 3.5e-4

# Corrections of misprints: what the table should say.
CORRECTED = {
    (1, "ZN", "PO_y"): 6.39,
    (1, "RZN", "PO_u"): 12.8,
    (5, "ZN", "frequency"): (4.409, 15.120, 31.77, 9.257),  # printed: those of operating point 2
    (5, "RZN", "frequency"): (16.525, 13.304, 47.49, 3.129),
}
# Neither reproduced nor a known misprint: all from the loops with the sharpest corners.
UNEXPLAINED = {
    (5, "ZN", "PO_y"): 52.670,
    (5, "ZN", "IAE"): 0.30376,
    (5, "ZN", "ITAE"): 0.08146,
    (6, "IMC", "PO_u"): 24.556,
}


@pytest.fixture(scope="module", params=TIME, ids=lambda at: f"{at[0]}-{at[1]}")
def case(request):
    """Tune, simulate 100 s, and sum as the tables do."""
    point, rule = request.param
    model = pt.models.ProcessModel(*POINTS[point])
    tuning = RULES[rule](model)
    response = pt.simulate.closed_loop(model, tuning.controller, r=np.ones(5000), Ts=TS)
    e, i = 1 - response.y, response.indices
    ours = {
        "Kp": tuning.controller.Kp,
        "Ti": tuning.controller.Ti,
        "Ts": i.settling,
        "PO_y": i.overshoot,
        "ISE": TS * np.sum(e**2),
        "IAE": TS * np.sum(abs(e)),
        "ITAE": TS * np.sum(response.t * abs(e)),
        "PO_u": i.control_overshoot,
        "IP": TS * np.sum(response.u**2),
    }
    printed = dict(zip(COLUMNS, TIME[request.param].split(), strict=True))
    return SimpleNamespace(at=request.param, ours=ours, printed=printed, tuning=tuning, true=i)


def agrees(name, ours, printed):
    """Whether a printed number is reproduced."""
    if printed == "N/A":
        return ours == 0.0
    size = 1 + float(printed) / 100 if name == "PO_u" else 1
    return abs(ours - float(printed)) <= TOLERANCE[name] * size


def test_time_domain_numbers_are_reproduced_or_corrected(case):
    for name in TOLERANCE:
        ours, key = case.ours[name], (*case.at, name)
        fine = agrees(name, ours, case.printed[name])
        known = CORRECTED.get(key) or UNEXPLAINED.get(key)
        assert fine == (known is None), (name, ours, case.printed[name])
        if known is not None:
            assert ours == approx(known, abs=0.5 * 10 ** -decimals(known)), name


def decimals(x):
    """Count the digits behind the point."""
    return len(str(x).partition(".")[2])


def test_energy_is_within_its_unexplained_third_of_a_percent(case):
    """Printed above ours in every row, by up to 0.35 %; the cause was not found."""
    assert 0 < float(case.printed["IP"]) / case.ours["IP"] - 1 < 3.5e-3


def test_margins_are_reproduced_or_corrected(case):
    """Each rule's row against the closed loop's own crossovers."""
    m = case.tuning.margins
    ours = (m.gain_db, m.w_gain, m.phase_deg, m.w_phase)
    corrected = CORRECTED.get((*case.at, "frequency"))
    assert (ours == approx(FREQUENCY[case.at], rel=GRID)) == (corrected is None)
    if corrected is not None:
        assert ours == approx(corrected, rel=1.5e-4)  # four digits


@pytest.mark.parametrize("rule", ["ZN", "RZN"])
def test_table_3_6_7_repeats_operating_point_2(rule):
    m = RULES[rule](pt.models.ProcessModel(K=1.0, T=0.1733, L=0.1)).margins
    assert (m.gain_db, m.w_gain, m.phase_deg, m.w_phase) == approx(FREQUENCY[5, rule], rel=GRID)


def test_integrals_of_the_product_are_true_ones(case):
    """A sum from t = 0 on is Ts/2 = 0.010 above; the kink of e at t = L adds up to 6e-4."""
    assert case.ours["ISE"] - case.true.ise == approx(0.010, abs=7e-4)
    assert case.ours["IAE"] - case.true.iae == approx(0.010, abs=7e-4)
    assert case.ours["ITAE"] == approx(case.true.itae, abs=1e-4)


@pytest.mark.parametrize("at", sorted({key[:2] for key in (*CORRECTED, *UNEXPLAINED)}), ids=str)
def test_what_differs_from_the_tables_is_what_an_independent_simulation_gives(at):
    """Method of steps with Taylor series; 6 s hold the whole transient."""
    model = pt.models.ProcessModel(*POINTS[at[0]])
    pid = RULES[at[1]](model).controller
    ours = pt.simulate.step(model, pid, t_end=6.0).indices
    ref = loop.Continuous(*POINTS[at[0]], pid.Kp, pid.Ti, t_end=6.0).indices(1 / model.K)
    for name in ("overshoot", "settling", "ise", "iae", "itae", "control_overshoot"):
        assert getattr(ours, name) == approx(getattr(ref, name), rel=1e-5), name
