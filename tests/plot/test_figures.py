"""Figures show what the results hold, with units, and stay small."""

import re
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest
from numpy.testing import assert_array_equal

import plantune as pt
from plantune import _core, plot
from plantune.plot.record import BUCKETS
from plantune.plot.style import MEASURED, MODEL, SECOND, SET_POINT

PLANT = pt.models.ProcessModel(K=-2.0, T=1.5, L=0.43)
UNITS = {"valve": "%", "level": "cm"}


def simulated(N=600, Ts=0.1, **more):
    u = _core.prbs(N, 8, 8, 1)
    y = PLANT.simulate(u, Ts=Ts) + 7 + np.random.default_rng(3).normal(0, 0.05, N)
    names = {"u_names": ["valve"], "y_names": ["level"], "units": UNITS}
    return pt.Record(u=u, y=y, Ts=Ts, **{**names, **more})


@pytest.fixture(scope="module")
def rec():
    return simulated()


@pytest.fixture(scope="module")
def fits(rec):
    est, _ = rec.split(0.5)
    return pt.estimate.process(est, "P1D"), pt.estimate.arx(est, 1, 2, 5)


@pytest.fixture(scope="module")
def verdicts(rec, fits):
    _, val = rec.split(0.5)
    return tuple(pt.validate.check(val, fit) for fit in fits)


@pytest.fixture(scope="module")
def tuning(fits):
    return pt.tune.imc_pi(fits[0], gain_margin=3)


@pytest.fixture(scope="module")
def response(tuning):
    return pt.simulate.step(tuning.model, tuning.controller)


def relay_test(**more):
    rec = pt.simulate.relay(PLANT, high=2.0, low=-1.0, hysteresis=0.2, Ts=0.05, t_end=60.0, **more)
    named = replace(rec, u_names=("valve",), y_names=("level",), units=UNITS)
    return pt.tune.relay(named), named


def stepped():
    u = np.repeat([0.0, 4.0], [50, 650])
    two = pt.models.ProcessModel(K=2.0, T=(3.0, 10.0), L=4.0)
    y = 20 + two.simulate(u, Ts=0.1) + 0.01 * np.random.default_rng(0).normal(size=700)
    rec = pt.Record(u=u, y=y, Ts=0.1, u_names=["valve"], y_names=["level"], units=UNITS)
    return pt.estimate.idt(rec), rec


def adapted(rec, **more):
    pid = pt.models.PID(Kp=-0.2, Ti=1.5)
    return pt.adapt.replay(rec, pt.adapt.Settings(Ts=0.1, nk=(1, 9), controller=pid, **more))


def planned():
    wishes = {"u_limits": (-2.0, 2.0), "y_limits": (0.0, 14.0), "at": (0.0, 7.0)}
    return pt.analyze.experiment(PLANT, Ts=0.1, noise_sd=0.05, time=60.0, **wishes)


def curves():
    relays = pt.hysteresis.Preisach(levels=[-1, 0, 1], mu=[[1, 0], [2, 1]])
    x = [-1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0]
    return pt.hysteresis.forc(x, relays.simulate(x))


def loop():
    x = 50 - 50 * np.cos(np.linspace(0, 6 * np.pi, 900)) * np.linspace(1, 0.5, 900)
    stack = pt.hysteresis.PlayStack(r=[0, 5, 20], w=[0.4, 0.1, 0.1])
    y = stack.simulate(x) + 0.1 * np.random.default_rng(0).normal(size=900)
    return pt.hysteresis.PlayStack.identify(x, y, n=5), x, y


def followed():
    plant, r = pt.hysteresis.PlayStack(r=[0, 0.5], w=[1, 1]), np.sin(np.arange(300) / 20)
    gain = pt.hysteresis.PlayStack(r=[0], w=[0.5])
    ways = {"gain": gain, "inverse": plant.inverse()}
    return {name: pt.hysteresis.track(plant, r, 0.1, inverse=way) for name, way in ways.items()}


@pytest.fixture(scope="module")
def figures(rec, fits, verdicts, tuning, response):
    return {
        "adapt": plot.adapt(adapted(rec), of=rec),
        "record": plot.record(rec, fresh=verdicts[0]),
        "compare": plot.compare(*verdicts, of=rec),
        "residuals": plot.residuals(verdicts[0], of=rec),
        "step": plot.step(*fits, of=rec),
        "bode": plot.bode(*fits, of=rec),
        "margins": plot.margins(tuning),
        "closed_loop": plot.closed_loop(response, of=rec),
        "delay": plot.delay(pt.analyze.delay(rec), of=rec),
        "delay_evidence": plot.delay_evidence(pt.analyze.delay_evidence(rec), of=rec),
        "experiment": plot.experiment(planned(), of=rec),
        "impulse": plot.impulse(pt.analyze.impulse(rec, 40), fits[0], of=rec),
        "frequency": plot.frequency(pt.analyze.spa(rec), fits[0], of=rec),
        "noise": plot.noise(pt.analyze.noise(rec)),
        "spectrum": plot.spectrum(pt.analyze.noise(rec), of=rec),
        "hysteresis": plot.hysteresis(*loop(), of=rec),
        "tracking": plot.tracking(followed(), x="valve", y="level", x_unit="%", y_unit="cm"),
        "forc": plot.forc(curves(), x="valve", y="level", x_unit="%", y_unit="cm"),
        "relay": plot.relay(*relay_test(noise_sd=0.02)),
        "robustness": plot.robustness(pt.tune.robustness(tuning, fits[0])),
        "rules": plot.rules(pt.tune.compare(fits[0]), of=rec),
        "step_modes": plot.step_modes(*stepped()),
        "stretches": plot.stretches(rec, pt.analyze.informative(rec)),
    }


def axis_titles(fig):
    panels = [fig.layout[name] for name in fig.layout if re.fullmatch(r"[xy]axis\d*", name)]
    return [panel.title.text for panel in panels if panel.title.text]


def trace(fig, name):
    (found,) = [t for t in fig.data if t.name == name]
    return found


def test_there_is_a_figure_for_every_public_name(figures):
    assert sorted(figures) == sorted(plot.__all__)


def test_every_axis_has_name_and_unit(figures):
    for name, fig in figures.items():
        assert isinstance(fig, go.Figure)
        titles = axis_titles(fig)
        assert len(titles) >= 2, name
        assert all(re.search(r"\S \[[^?\]]+\]$", title) for title in titles), (name, titles)


def test_titles_fit_a_laptop_and_say_record_and_model(figures, rec):
    for name, fig in figures.items():
        title = fig.layout.title
        assert 0 < len(title.text) <= 80, name
        assert "<" not in title.text
        # These know no record.
        if name not in ("closed_loop", "experiment", "forc", "relay", "step_modes", "tracking"):
            assert rec.source[:8] in title.subtitle.text, name


def test_figures_do_not_depend_on_the_global_template(figures, rec):
    import plotly.io as pio

    before, pio.templates.default = pio.templates.default, "plotly_dark"
    try:
        assert plot.record(rec).layout.template.layout.paper_bgcolor == "#ffffff"
    finally:
        pio.templates.default = before


def test_no_button_sends_the_figure_away(figures):
    for fig in figures.values():
        assert "sendChartToCloud" in fig.layout.template.layout.modebar.remove


def test_record_draws_every_value_of_a_short_record(rec):
    fig = plot.record(rec)
    y, u = trace(fig, "level"), trace(fig, "valve")
    assert_array_equal(y.x, rec.time)
    assert_array_equal(y.y, rec.y[:, 0])
    assert_array_equal(u.y, rec.u[:, 0])
    assert u.line.shape == "hv"
    assert (y.line.color, y.yaxis, u.yaxis) == (MEASURED, "y", "y2")


def test_record_draws_the_set_point_dashed_and_black():
    fig = plot.record(simulated(r=np.full(600, 7.0)))
    r = trace(fig, "set point of level")
    assert (r.line.color, r.line.dash) == (SET_POINT, "dash")


def test_record_breaks_at_gaps_and_at_outputs_that_do_not_count():
    valid = np.ones(600, bool)
    valid[100:110] = False
    rec = simulated(valid=valid, starts=[0, 300])
    y = trace(plot.record(rec), "level").y
    assert len(y) == 601 and np.isnan(y[300])
    assert np.isnan(y[100:110]).all() and np.isnan(y).sum() == 11


def test_a_million_rows_stay_few_points_and_keep_their_peaks():
    N = 1_000_000
    y = np.sin(np.arange(N) / 5e4)
    y[654_321] = 9.0
    rec = pt.Record(u=np.arange(N) % 7, y=y, Ts=0.01)
    fig = plot.record(rec)
    assert all(len(t.x) <= 4 * BUCKETS for t in fig.data)
    assert max(trace(fig, "y").y) == 9.0
    assert len(fig.to_json()) < 300_000


def test_many_segments_stay_few_points():
    N = 60_000
    rec = pt.Record(u=np.arange(N) % 7, y=np.arange(N), Ts=1.0, starts=range(0, N, 2))
    assert all(len(t.x) <= 4 * BUCKETS for t in plot.record(rec).data)


def test_record_has_a_panel_for_each_signal():
    N = 50
    u, y = np.arange(2 * N).reshape(N, 2) % 5, np.arange(2 * N).reshape(N, 2) % 9
    fig = plot.record(pt.Record(u=u, y=y, Ts=1.0))
    assert sorted(axis_titles(fig)) == ["time [s]", "u1", "u2", "y1", "y2"]


def test_several_inputs_have_a_correlation_panel_each():
    u = np.random.default_rng(1).normal(size=(400, 2))
    rec = pt.Record(u=u, y=np.r_[0, u[:-1, 0] + 0.5 * u[:-1, 1]], Ts=1.0, u_names=["a", "b"])
    fit = pt.estimate.arx(rec, 1, [1, 1], [1, 1])
    fig = plot.residuals(pt.validate.check(rec, fit), of=rec)
    assert axis_titles(fig).count("lag [samples]") == 3
    assert "errors with<br>b [1]" in axis_titles(fig)
    assert plot.step(fit, of=rec, input=1).layout.yaxis.title.text == "y per b [y/u]"


def test_names_are_inert():
    rec = simulated(u_names=["<b>u</b>"], y_names=["<script>alert(1)</script>"], units={})
    fig = plot.record(rec)
    assert "<script>" not in fig.to_json() and "<b>" not in fig.layout.yaxis2.title.text
    assert "<" not in fig.layout.title.text


def test_compare_draws_measured_grey_first_blue_second_orange(verdicts, rec):
    fig = plot.compare(*verdicts, of=rec)
    assert [t.line.color for t in fig.data] == [MEASURED, MODEL, SECOND]
    assert [t.name for t in fig.data[1:]] == [
        f"P1D, simulation {verdicts[0].fit:.1f} %",
        f"ARX, simulation {verdicts[1].fit:.1f} %",
    ]
    assert_array_equal(fig.data[1].y, verdicts[0].yhat)
    assert "fresh rows" in fig.layout.title.text


def test_compare_says_when_the_rows_are_not_fresh(rec, fits):
    est, _ = rec.split(0.5)
    fig = plot.compare(pt.validate.check(est, fits[0]))
    assert "also used to fit" in fig.layout.title.text


def test_relay_draws_measured_model_and_thresholds():
    test, rec = relay_test(noise_sd=0.02)
    fig = plot.relay(test, of=rec)
    measured, model = trace(fig, "measured"), trace(fig, "model of the cycle")
    assert (measured.line.color, model.line.color) == (MEASURED, MODEL)
    assert_array_equal(model.y, test.yhat)
    levels = [t.y[0] for t in fig.data if t.name == "relay switches"]
    assert levels == list(test.thresholds)
    assert test.source[:8] in fig.layout.title.subtitle.text


def test_experiment_stays_between_its_limits(rec):
    plan = planned()
    fig = plot.experiment(plan, of=rec)
    assert_array_equal(trace(fig, "level, expected, without noise").y, plan.y)
    assert_array_equal(trace(fig, "valve").y, plan.u)
    assert [t.y[0] for t in fig.data if t.name == "limits"] == [0.0, 14.0, -2.0, 2.0]
    assert sum(t.name == "limits" and t.showlegend for t in fig.data) == 1
    assert plan.shape in fig.layout.title.text


def test_residuals_show_their_99_percent_limits(verdicts):
    fig, r = plot.residuals(verdicts[0]), verdicts[0].residuals
    edges = [t.y for t in fig.data if t.type == "scatter"]
    assert edges == [(s * b, s * b) for b in (r.band, r.cross_band[0]) for s in (-1, 1)]
    bars = [t for t in fig.data if t.type == "bar"]
    assert_array_equal(bars[0].y, r.autocorr[1:])
    assert_array_equal(bars[1].y, r.crosscorr[0])


def test_step_draws_the_core_and_its_band(fits):
    fit, t = fits[0], np.linspace(0, 5, 11)
    fig = plot.step(fit, t=t)
    low, high = pt.tune.step_band(fit, t)
    assert_array_equal(fig.data[0].y, low)
    assert_array_equal(fig.data[1].y, high)
    assert_array_equal(trace(fig, "P1D").y, fit.model.step(t))


def test_step_and_bode_of_a_sampled_model_alone(fits):
    step, bode = plot.step(fits[1]), plot.bode(fits[1])
    assert trace(step, "ARX").line.shape == "hv"
    assert max(bode.data[0].x) <= np.pi / fits[1].model.Ts * (1 + 1e-12)


def test_bode_draws_the_core_and_its_bands(fits):
    fit, w = fits[0], np.geomspace(0.01, 10, 9)
    fig = plot.bode(fit, w=w)
    magnitude, phase = pt.tune.bode_band(fit, w)
    assert_array_equal([t.y for t in fig.data[:4]], [*magnitude, *phase])
    gain, degrees = (t for t in fig.data if t.name == "P1D")
    assert_array_equal(gain.y, abs(fit.model.freqresp(w)))
    assert_array_equal(degrees.y, _core.phase_deg(fit.model, 0, w))
    assert fig.layout.xaxis.type == fig.layout.yaxis.type == "log"


def test_margins_are_marked_where_the_loop_crosses(tuning):
    fig, m = plot.margins(tuning), tuning.margins
    gain, phase = fig.data[-2:]
    assert gain.x[0] == pytest.approx(-1 / m.gain)  # there the phase is -180 degrees
    assert gain.y[0] == pytest.approx(0, abs=1e-9)
    assert phase.x[0] ** 2 + phase.y[0] ** 2 == pytest.approx(1)
    low, high = tuning.bands["gain"]
    assert f"({low:.2f} to {high:.2f})" in gain.name


def test_the_loop_touches_the_ms_circle_but_does_not_enter(tuning):
    fig, Ms = plot.margins(tuning), tuning.margins.Ms
    loop = fig.data[0]
    distance = np.hypot(np.add(loop.x, 1), loop.y)
    assert distance.min() == pytest.approx(1 / Ms, rel=1e-3)


def test_margins_without_uncertainty_have_no_interval():
    tuning = pt.tune.imc_pi(PLANT, phase_margin=60)
    assert " to " not in "".join(t.name for t in plot.margins(tuning).data)


def test_closed_loop_draws_the_response(response, rec):
    fig = plot.closed_loop(response, of=rec)
    r, y, u = fig.data
    assert_array_equal(y.y, response.y)
    assert_array_equal(u.y, response.u)
    assert (r.line.dash, r.line.color) == ("dash", SET_POINT)
    assert f"overshoot {response.indices.overshoot:.1f} %" in fig.layout.title.text


def test_closed_loop_that_defines_no_settling_is_drawn(tuning):
    short = pt.simulate.step(tuning.model, tuning.controller, t_end=0.3)
    assert "settling – s" in plot.closed_loop(short).layout.title.text


def test_several_loops_share_the_figure(response):
    fig = plot.closed_loop(response, response, names=["a", "b"])
    assert [t.line.color for t in fig.data if t.name == "b"] == [SECOND, SECOND]


def test_delay_marks_the_choice(rec):
    scan = pt.analyze.delay(rec)
    fig = plot.delay(scan)
    curve, best = fig.data
    assert_array_equal(curve.y, scan.loss)
    assert best.x == (scan.nk,)


def test_rules_draw_set_point_and_load_in_the_colour_of_their_rule(fits):
    comparison = pt.tune.compare(fits[0])
    curves = plot.rules(comparison).data[1:]
    for k, row in enumerate(comparison.rows):
        above, below = curves[2 * k : 2 * k + 2]
        assert_array_equal(above.y, row.set_point.y)
        assert_array_equal(below.y, row.load.y)
        assert (above.yaxis, below.yaxis) == ("y", "y2")
        assert above.line.color == below.line.color and above.legendgroup == below.legendgroup
    assert len({t.line.color for t in curves}) == len(comparison.rows)


def test_an_unstable_loop_is_named_and_not_drawn():
    hasty = pt.models.PID(Kp=-9.0, Ti=1.0)
    fig = plot.rules(pt.tune.compare(PLANT, [pt.tune.simc, hasty]))
    (named,) = [t for t in fig.data if t.name.endswith(": unstable")]
    assert named.x == (None,) and str(hasty) in named.name
    assert len(fig.data) == 4  # set point, two of SIMC, and the name


def test_rules_that_share_a_colour_differ_in_their_dash():
    slower = [pt.models.PID(Kp=-0.1 * k, Ti=1.5) for k in range(1, 6)]
    curves = plot.rules(pt.tune.compare(PLANT, slower)).data[1::2]
    assert len({(t.line.color, t.line.dash) for t in curves}) == 5


def test_the_border_and_the_cloud_share_one_plane(figures):
    """More dead time leaves less gain; the cloud surrounds no change."""
    fig = figures["robustness"]
    border, cloud = trace(fig, "unstable beyond"), trace(fig, "models that the data leave open")
    assert abs(np.median(cloud.x)) < 0.5 and abs(np.median(cloud.y) - 1) < 0.1
    assert np.all(np.diff(border.y) <= 1e-9)


def test_adapt_draws_the_log_with_its_events(rec):
    loaded = simulated(aux={"load": np.where(np.arange(600) < 300, 0.0, 10.0)})
    points = {"break_points": {"load": [0.0, 10.0]}, "margins": {"load": 2.0}}
    log = adapted(loaded, **points)
    fig = plot.adapt(log, of=loaded)
    begins = trace(fig, "operating point begins")
    assert_array_equal(begins.x, [0.0, 30.0])
    assert (begins.marker.symbol, begins.yaxis) == ("cross-thin", "y")
    dots = [t for t in fig.data if t.name == "accepted"]
    assert [t.yaxis for t in dots] == ["y2", "y3", "y4"]
    for t, x in zip(dots, (log.K, log.T, log.L), strict=True):
        assert_array_equal(t.x, log.t[log.accepted])
        assert_array_equal(t.y, x[log.accepted])
    low, high = (
        t for t in fig.data if t.name in (None, "two standard deviations") and t.yaxis == "y2"
    )
    first = np.flatnonzero(log.accepted)[0]
    assert high.y[0] - low.y[0] == pytest.approx(4 * log.sd[first, 0])
    rings = [t for t in fig.data if t.name == "retuned"]
    assert_array_equal(rings[0].x, log.t[log.retuned])
    assert {"K [cm/%]", "T [s]", "L [s]", "Kp [%/cm]", "Ki [%/cm/s]"} <= set(axis_titles(fig))


def test_adapt_draws_a_log_in_which_nothing_was_accepted():
    still = pt.Record(u=np.full(300, 1.0), y=np.full(300, 2.0), Ts=0.1)
    fig = plot.adapt(adapted(still))
    assert "0 estimates accepted" in fig.layout.title.text


def test_adapt_does_not_zoom_into_rounding():
    exact = pt.datasets.engine_loop(t_end=4.0)
    pid = pt.models.PID(Kp=-0.018, Ti=0.0532)
    log = pt.adapt.replay(exact, pt.adapt.Settings(Ts=0.02, nk=(3, 11), controller=pid))
    low, high = plot.adapt(log, of=exact).layout.yaxis2.range
    assert (low, high) == pytest.approx((-5.939 * 1.001, -5.939 * 0.999))


def test_adapt_of_a_long_log_stays_few_points(rec):
    log = adapted(simulated(N=20_000), every=200)
    fig = plot.adapt(log)
    assert all(len(t.x) <= 4 * BUCKETS for t in fig.data)


def test_the_figure_of_a_step_response_shows_curve_parts_and_residual(figures):
    found, _ = stepped()
    fig = figures["step_modes"]
    traces = {trace.name: trace for trace in fig.data if trace.mode == "lines" and trace.name}
    assert_array_equal(traces["sum of the modes"].y, found.curve)
    assert traces["sum of the modes"].line.color == MODEL
    names = [name for name in traces if name.startswith("T = ")]
    assert [traces[name].yaxis for name in names] == ["y2", "y2"]
    assert_array_equal([traces[name].y for name in names], found.parts)
    assert fig.layout.yaxis.title.text == "level [cm]"
    assert traces["residual"].yaxis == "y3"
