"""Faceplates: the printed vector on each, margins as entered, and what is refused."""

import json
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

import plantune as pt
from plantune.models import PID, ProcessModel

W = np.logspace(-3, 3, 31)
SPANS = {"pv_span": 100.0, "op_span": 100.0}
PROFILES = {profile.name: profile for profile in pt.export.vendors()}
# Series 2, 10 s, 2 s as each controller has it, by hand from its equation and units.
VECTOR = {
    "abb-bailey": {"K": 1.0, "KP": 2.4, "KI": 12.0, "KD": 4 / 60},
    "deltav-series": {"GAIN": 2.0, "RESET": 10.0, "RATE": 2.0, "ALPHA": 0.125},
    "deltav-standard": {"GAIN": 2.4, "RESET": 12.0, "RATE": 5 / 3, "ALPHA": 0.125},
    "embedded": {"kp": 2.4, "ki": 0.2 * 0.5, "kd": 4 / 0.5},
    "foxboro-pida": {"PBAND": 50.0, "INT": 10 / 60, "DERIV": 2 / 60, "KD": 10.0},
    "honeywell-a": {"K": 2.4, "T1": 0.2, "T2": 5 / 180},
    "honeywell-b": {"K": 2.4, "T1": 0.2, "T2": 5 / 180},
    "honeywell-interactive": {"K": 2.0, "T1": 10 / 60, "T2": 2 / 60},
    "rockwell-pide": {"PGain": 2.4, "IGain": 12.0, "DGain": 4 / 60},
    "rockwell-pide-dependent": {"PGain": 2.4, "IGain": 0.2, "DGain": 5 / 180},
    "schneider-pidff": {"kp": 2.4, "ti": 12.0, "td": 5 / 3, "kd": 10.0},
    "siemens-pid-compact": {
        "Gain": 2.4,
        "Ti": 12.0,
        "Td": 5 / 3,
        "TdFiltRatio": 0.2,
        "PWeighting": 1.0,
        "DWeighting": 0.0,
    },
    "yokogawa-centum": {"P": 41.7, "I": 12.0, "D": 1.7},
}


def vector():
    return PID.from_form("series", Kp=2.0, Ti=10.0, Td=2.0)


def response(pid):
    s = 1j * W if pid.Ts is None else (1 - np.exp(-1j * W * pid.Ts)) / pid.Ts
    return pid.Kp + pid.Ki / s + pid.Kd * s / (pid.Tf * s + 1)


def codes(entry):
    return [note.code for note in entry.notes]


def test_every_profile_is_in_the_vector_and_says_where_it_is_from():
    assert set(VECTOR) == set(PROFILES)
    for profile in PROFILES.values():
        assert profile.level in ("verified", "unverified")
        assert profile.source and profile.checked and profile.setup
        assert any(setting.name for setting in profile.settings)


@pytest.mark.parametrize("name", VECTOR)
def test_the_printed_vector_on_each_faceplate(name):
    pid = replace(vector(), Ts=0.5) if name == "embedded" else vector()
    entry = pt.export.vendor(pid, name, **SPANS)
    assert entry.values == approx(VECTOR[name], rel=1e-6)
    assert ("P01" in codes(entry)) == (entry.level == "unverified") and entry.source
    assert name == entry.vendor and entry.level in str(entry)
    down = pt.export.vendor(replace(pid, Kp=-pid.Kp), name, **SPANS)
    if PROFILES[name].signed:
        assert down.action == "signed" and down.values["kp"] == approx(-2.4)
    else:
        assert (entry.action, down.action) == ("reverse", "direct")
        assert down.values == entry.values
    assert down.controller.Kp == -entry.controller.Kp


times = st.floats(-1, 2).map(lambda x: 10.0**x)


@pytest.mark.parametrize("name", VECTOR)
@given(Kp=times, Ti=times, share=st.floats(0.01, 0.24), sign=st.sampled_from([-1.0, 1.0]))
def test_what_is_entered_is_the_controller_behind_its_own_filter(name, Kp, Ti, share, sign):
    pid = PID(Kp=sign * Kp, Ti=Ti, Td=share * Ti, Ts=0.5 if name == "embedded" else None)
    entry = pt.export.vendor(pid, name, pv_span=40.0, op_span=5.0, digits=15)
    got = entry.controller
    # Without its filter it is the design, in series form too.
    if PROFILES[name].form == "series":
        lag = 1j * W * got.Tf + 1
        assert response(got) * lag == approx(response(pid), rel=1e-9)
    else:
        assert (got.Kp, got.Ti, got.Td) == approx((pid.Kp, pid.Ti, pid.Td), rel=1e-12)
    assert ("P02" in codes(entry)) == (got.Tf > 0)


def test_a_filter_the_controller_can_have_is_kept():
    design = PID.from_form("series", Kp=2.0, Ti=10.0, Td=2.0, Tf=0.25)
    for name in ("deltav-series", "foxboro-pida"):
        entry = pt.export.vendor(design, name, **SPANS, digits=15)
        assert response(entry.controller) == approx(response(design), rel=1e-12)
        assert "P02" not in codes(entry)
    entry = pt.export.vendor(design, "siemens-pid-compact", digits=15)
    assert response(entry.controller) == approx(response(design), rel=1e-12)


def test_set_point_weights_of_a_lead_on_y():
    """u = Kp' (1 + 1/(Ti' s)) (r - (Td' s + 1)/(Tf s + 1) y), the lead being on y alone."""
    entry = pt.export.vendor(vector(), "honeywell-interactive", **SPANS)
    pid, s = entry.controller, 1j * W
    assert pid.b * pid.Kp + pid.Ki / s == approx(2.0 * (1 + 1 / (10 * s)), rel=1e-6)
    assert pid.c == 0.0 and "P03" in codes(entry)


def test_spans_are_percent_of_percent_and_percent_of_the_output():
    pid = PID(Kp=2.0, Ti=30.0)
    entry = pt.export.vendor(pid, "yokogawa", pv_span=400.0, op_span=100.0)
    assert entry.values["P"] == 12.5  # Kp 400/100 = 8
    assert pt.export.vendor(pid, "siemens-pid-compact", op_span=10.0).values["Gain"] == 20.0
    assert entry.controller == replace(pid, b=0.0)


def test_rounding_costs_margin_and_says_so():
    plant = ProcessModel(K=2.7, T=2.0, L=1.0)
    tuning = pt.tune.simc(plant)
    fine = pt.export.vendor(tuning, "rockwell-pide", **SPANS)
    assert fine.margins.Ms == approx(tuning.margins.Ms, rel=1e-5) and not fine.notes
    coarse = pt.export.vendor(tuning, "rockwell-pide-dependent", **SPANS, digits=1)
    assert coarse.values == {"PGain": 0.4, "IGain": 0.03, "DGain": 0.0}
    own = pt.tune.margins(plant, coarse.controller)
    assert coarse.margins == own and own.Ms > tuning.margins.Ms
    note = next(note for note in coarse.notes if note.code == "P05")
    assert note.measured == own.Ms and note.limit == tuning.margins.Ms
    assert pt.export.vendor(tuning.controller, "rockwell-pide", **SPANS).margins is None


def test_switched_off_integral():
    p = PID(Kp=2.0)
    assert pt.export.vendor(p, "rockwell-pide-dependent", **SPANS).values["IGain"] == 0.0
    assert pt.export.vendor(p, "siemens-pid-compact").controller == p
    assert pt.export.vendor(p, "rockwell-pide", **SPANS).values["IGain"] == 0.0
    with pytest.raises(pt.UsageError, match="no integral action"):
        pt.export.vendor(p, "yokogawa-centum", **SPANS)
    i = PID.integral(-0.5)
    entry = pt.export.vendor(i, "rockwell-pide", **SPANS)
    assert (entry.values["PGain"], entry.values["IGain"], entry.action) == (0.0, 30.0, "direct")
    assert entry.controller == i


def test_a_filter_on_y_is_left_to_the_measurement():
    pid = PID(Kp=2.4, Ti=12.0, Td=5 / 3, Tf=0.5, filter="y2")
    entry = pt.export.vendor(pid, "rockwell-pide", **SPANS)
    assert (entry.controller.filter, entry.controller.Tf) == ("d1", 0.0)
    assert "filters y" in next(note for note in entry.notes if note.code == "P02").text


def test_out_of_range_is_said():
    entry = pt.export.vendor(PID(Kp=0.05, Ti=30.0), "yokogawa", **SPANS)
    note = next(note for note in entry.notes if note.code == "P04")
    assert (entry.values["P"], note.measured, note.limit) == (2000.0, 2000.0, 1000.0)


@pytest.mark.parametrize(
    ("pid", "name", "options", "word"),
    [
        (vector(), "acme", SPANS, "no controller 'acme'"),
        (vector(), "rockwell-pide", {}, "`pv_span`"),
        (vector(), "rockwell-pide", {"pv_span": 100.0}, "`op_span`"),
        (vector(), "rockwell-pide", {"pv_span": 0.0, "op_span": 1.0}, "`pv_span`"),
        (vector(), "embedded", {}, "`Ts`"),
        (vector(), "rockwell-pide", {**SPANS, "digits": 0}, "`digits`"),
        (PID(Kp=1.0, Ti=0.01), "yokogawa", SPANS, "round to 0"),
        (PID.integral(1.0), "yokogawa", SPANS, "integral controller"),
        (ProcessModel(K=1.0, T=1.0), "yokogawa", SPANS, "ProcessModel"),
    ],
)
def test_refusals(pid, name, options, word):
    with pytest.raises(pt.UsageError, match=word) as refused:
        pt.export.vendor(pid, name, **options)
    assert refused.value.code == "U01" and refused.value.remedy


def test_unknown_names_are_answered_with_the_known():
    with pytest.raises(pt.UsageError) as refused:
        pt.export.vendor(vector(), "acme")
    assert all(name in refused.value.remedy for name in PROFILES)
    aliases = ("rockwell-pide-independent", "emerson-deltav-series", "foxboro", "yokogawa")
    assert all(pt.export.vendor(vector(), alias, **SPANS) for alias in aliases)


def test_a_series_controller_for_complex_zeros_is_refused_with_the_nearest():
    pid = PID(Kp=-2.0, Ti=10.0, Td=5.0)
    with pytest.raises(pt.UsageError) as refused:
        pt.export.vendor(pid, "deltav-series", pv_span=200.0, op_span=100.0)
    nearest = refused.value.result
    assert nearest.deviation == approx((np.sqrt(2) - 1) / (np.sqrt(2) + 1))
    off = np.abs(response(nearest.form.pid()) / response(pid) - 1)
    assert off == approx(nearest.deviation)


def test_profiles_are_json_that_the_package_holds():
    folder = files("plantune.export") / "vendors"
    for name in PROFILES:
        assert json.loads((folder / f"{name}.json").read_text("utf-8"))["title"]
