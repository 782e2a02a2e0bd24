"""Source 000, 2.3 and chapter 3: what smoothing does, on motors whose truth is known.

The `mse` of a treatment is against fresh rows as they were measured.
"""

import importlib.util
import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

import plantune as pt
from conftest import ROOT
from plantune.datasets import DRIVES, PRINTER_MOTOR, printer_motor

TRUTH = PRINTER_MOTOR.model()
TREATMENTS = ["none", "y alone", "both", "OE"]


def example():
    """Load the example, which is no package."""
    spec = importlib.util.spec_from_file_location("source_000", ROOT / "examples" / "source_000.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def gains(seeds, **plant):
    """Return how many times nearer the truth each treatment comes than none: medians."""
    return dict(zip(TREATMENTS[1:], example().factors(seeds, **plant)[0], strict=True))


@pytest.mark.parametrize("kind", DRIVES)
def test_y_alone_shifts_a1_without_any_noise_and_both_do_not(kind):
    """ERRATA 2: -0.06 to -0.13 on its motor; on ours -0.05 to -0.16."""
    rec = printer_motor(kind, resolution=0.0)
    a1 = [pt.estimate.arx(r, 2, 2).theta[0] for r in (rec, *smoothed(rec))]
    assert a1[0] == approx(TRUTH.A[1], abs=1e-9) and a1[2] == approx(TRUTH.A[1], abs=1e-9)
    assert -0.17 < a1[1] - a1[0] < -0.05


def smoothed(rec):
    return pt.prep.smooth(rec, "y"), pt.prep.smooth(rec)


def test_measurement_noise_on_a_prbs_y_alone_helps_a_little_and_both_much():
    """ERRATA 2: 2 times and 50 to 60 times; each is one level of noise on a curve."""
    faint = gains(range(30), noise_var=0.01, resolution=0.0)
    assert 1.2 < faint["y alone"] < 2.5 and faint["both"] > 100
    middling = gains(range(30), noise_var=0.15, resolution=0.0)
    assert 4 < middling["y alone"] < 9 and 40 < middling["both"] < 90
    assert middling["OE"] > middling["both"]


def test_an_encoder_is_measurement_noise():
    found = gains(range(30))
    assert found["y alone"] < 10 < 50 < found["both"] < found["OE"]


@pytest.mark.parametrize("var", [0.01, 0.1, 1.0])
def test_equation_noise_makes_smoothing_worse(var):
    """ERRATA 2: 2 to 4 times.  Ours: both 3 to 9 times, y alone 8 to 18 times."""
    found = gains(range(30), equation_var=var, resolution=0.0)
    assert 2 < 1 / found["both"] < 12 and 6 < 1 / found["y alone"] < 25


RECORDS = [
    (kind, plant)
    for kind in ("prbs", "step", "square")
    for plant in (
        {"noise_var": 1.0, "resolution": 0.0},
        {"noise_var": 0.01, "resolution": 0.0},
        {},
        {"equation_var": 0.1, "resolution": 0.0},
    )
]


@pytest.mark.parametrize(("kind", "plant"), RECORDS)
def test_y_alone_is_never_advised(kind, plant):
    """17 seeds each, 204 records; whatever y alone leaves, the advice is something else."""
    chosen = Counter()
    for seed in range(17):
        found = pt.validate.smoothing(printer_motor(kind, seed=seed, **plant), 2, 2)
        chosen[found.best.name] += 1
        start = found.advice.split(":")[0].split(";")[0]
        assert start in {
            "leave the record as it is",
            "fit an output-error model to the record as it is",
            "smooth u and y alike",
        }
        alone = found.rows[1]
        assert ("still not for use" in found.advice) == (alone.mse < found.rows[0].mse)
    assert chosen["y alone"] == 0
    if "equation_var" in plant:
        assert chosen["none"] >= 14, chosen
    if kind == "prbs" and "equation_var" not in plant:
        assert chosen["none"] == 0, chosen


def test_the_error_is_that_of_fresh_rows_as_measured():
    rec = printer_motor(noise_var=0.1)
    est, val = rec.split(0.5)
    found = pt.validate.smoothing(rec, 2, 2)
    assert [row.name for row in found.rows] == TREATMENTS
    y_alone, both = smoothed(est)
    fits = [pt.estimate.arx(part, 2, 2) for part in (est, y_alone, both)]
    fits.append(pt.estimate.oe(est, 2, 2))
    for row, fit in zip(found.rows, fits, strict=True):
        assert np.array_equal(row.fit.theta, fit.theta)
        e = val.y[:, 0] - fit.model.predict(val, horizon=None, offset=float(fit.offset[0]))
        assert row.mse == approx(np.nanmean(e**2), rel=1e-9)
        assert np.isfinite(e).sum() == row.N
    assert "M11" not in {note.code for note in found.notes}


def test_it_prints_as_a_table_with_its_advice():
    found = pt.validate.smoothing(printer_motor(), 2, 2)
    lines = str(found).splitlines()
    assert [line.split("  ")[0] for line in lines[2:6]] == TREATMENTS
    assert all(re.search(r"\d\.\d{4}", line) for line in lines[2:6])
    assert lines[-1] == found.advice


@pytest.mark.parametrize(("share", "best"), [(0.9, "none"), (0.4, "OE")])
def test_a_search_that_did_not_end_must_halve_the_error(share, best):
    found = pt.validate.smoothing(printer_motor(), 2, 2)
    none, alone, both, oe = found.rows
    stopped = replace(oe, mse=share * none.mse, codes=("N05",))
    worse = replace(both, mse=2.0 * none.mse)
    assert replace(found, rows=(none, alone, worse, stopped), limit=0.05).best.name == best
    ended = replace(stopped, codes=())
    assert replace(found, rows=(none, alone, worse, ended), limit=0.05).best.name == "OE"


def test_of_equals_the_less_doubtful_is_advised_and_the_advice_says_so():
    found = pt.validate.smoothing(printer_motor(), 2, 2)
    none, alone, both, oe = found.rows
    doubtful = replace(none, mse=oe.mse, codes=("V06", "V07"))
    even = replace(found, rows=(doubtful, alone, both, oe))
    assert even.best.name == "OE"
    assert even.advice.endswith("as good, and no V06 and V07")
    rows = (
        replace(none, mse=1.25),
        alone,
        replace(both, mse=1.0, codes=("V07",)),
        replace(oe, mse=1.1),
    )
    assert replace(found, rows=rows).advice.startswith(
        "fit an output-error model to the record as it is: error 1.1 instead of 1.25;"
    )
    lucky = replace(found, rows=(none, replace(alone, mse=0.5 * oe.mse), both, oe))
    assert lucky.best.name == "OE" and "leaves least here" in lucky.advice


def test_several_inputs_and_delays():
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], (150, 2)), 8, axis=0)
    plant = pt.models.PolyModel(A=[1, -0.9], B=[[0.2], [0.4]], nk=[1, 2], Ts=1.0)
    rec = pt.Record(u=u, y=plant.simulate(u) + 0.5 * rng.normal(size=1200), Ts=1.0)
    found = pt.validate.smoothing(rec, 1, [1, 1], [1, 2])
    assert found.best.name == "OE" and "," in str(found).splitlines()[2]


def test_moto_shield(data):
    """A real encoder: y alone is worse than none, none has the pole of errors in variables."""
    rec = example().moto(data("moto_shield") / "aprbsResult.mat")
    for order, errors, oe, odd in (
        (2, [872.875, 876.575, 874.721], 873.94, -0.61),
        (3, [878.191, 892.031, 893.618], 873.12, -0.41 + 0.42j),
    ):
        found = pt.validate.smoothing(rec, order, order)
        assert [row.mse for row in found.rows[:3]] == approx(errors, abs=0.01)
        assert found.rows[3].mse == approx(oe, rel=1e-3)  # where its search stops
        assert np.abs(found.rows[0].fit.model.poles() - odd).min() < 0.01
        assert found.rows[0].codes == ("V07",) and found.rows[2].codes == ()
        assert found.best.name != "y alone" and "y alone" not in found.advice


@pytest.mark.parametrize("order", [2, 3])
def test_the_page_shows_the_tables_of_the_example(order):
    page = (ROOT / "docs" / "sources" / "000.md").read_text(encoding="utf-8")
    for line in example().table(order)[1:]:
        kind, *numbers = line.split()
        rows = re.findall(rf"^\| {kind} \|(.*)\|$", page, re.M)
        shown = [float(cell) for cell in rows[order - 2].split("|")]
        ours = [float(number) for number in numbers]
        least_squares = [0, 1, 2, 4, 5, 6]
        # One unit of the last decimal, and what machines differ by.
        assert [shown[k] for k in least_squares] == approx(
            [ours[k] for k in least_squares], abs=2e-4, rel=1e-3
        ), kind
        # Where a search stops near a flat minimum is not a number to pin.
        assert shown[3] == approx(ours[3], rel=0.3), kind


@pytest.mark.slow
def test_the_page_shows_the_factors_of_the_example():
    page = (ROOT / "docs" / "sources" / "000.md").read_text(encoding="utf-8")
    source, advised = example(), {}
    for name, plant in source.NOISES.items():
        times, advised[name] = source.factors(source.SEEDS, **plant)
        (row,) = re.findall(rf"^\| {re.escape(name)} \|(.*)\|$", page, re.M)
        # Two digits are shown, and a search stops where the machine lets it.
        assert [float(cell) for cell in row.split("|")] == approx(times, rel=0.06), name
    assert not any(chosen["y alone"] for chosen in advised.values())
    assert not any(advised[name]["none"] for name in list(source.NOISES)[:4])
    kept = sum(advised[name]["none"] for name in source.NOISES if "equation" in name)
    assert kept == approx(766, abs=4) and "766 of 800" in page.replace("\n", " ")


def test_the_figures_of_the_example():
    overlay, bode = example().figures().values()
    assert [trace.name.split(",")[0] for trace in overlay.data] == ["measured", *TREATMENTS[:3]]
    lines = [trace.name for trace in bode.data if trace.showlegend is not False]
    assert lines == [*TREATMENTS[:3], "truth"]
