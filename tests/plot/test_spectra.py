"""Figures of noise, spectra and frequency responses show what the results hold."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import plantune as pt
from plantune import plot
from plantune.plot.style import MEASURED, MODEL, SECOND

TRUTH = pt.models.ProcessModel(K=2.0, T=5.0, L=2.6)


@pytest.fixture(scope="module")
def rec():
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 500), 4)
    y = TRUTH.simulate(u, Ts=1.0) + 5 + 0.2 * rng.normal(size=2000)
    units = {"valve": "%", "level": "cm"}
    return pt.Record(u=u, y=y, Ts=1.0, u_names=["valve"], y_names=["level"], units=units)


@pytest.fixture(scope="module")
def report():
    y = 20 + np.random.default_rng(2).normal(size=800)
    return pt.analyze.noise(pt.Record(u=np.zeros(800), y=y, Ts=0.1, y_names=["level"]))


def named(fig, name, axis="y"):
    return [trace for trace in fig.data if trace.name == name and (trace.yaxis or "y") == axis]


def test_response_is_drawn_where_it_is_coherent_with_models_over_it(rec):
    fr = pt.analyze.spa(rec)
    fig = plot.frequency(fr, TRUTH, pt.estimate.process(rec, "P1"), of=rec)
    (points,) = named(fig, "measured")
    assert points.marker.color == MEASURED
    assert_allclose(points.y, np.abs(fr.G[fr.coherent, 0, 0]))
    lines = [t for t in fig.data if t.mode == "lines" and t.showlegend and t.fill is None]
    assert [line.line.color for line in lines[:2]] == [MODEL, SECOND]
    (coherence,) = named(fig, "coherence", "y3")
    assert_array_equal(coherence.y, fr.coherence[:, 0])
    assert fig.layout.yaxis.title.text == "magnitude [cm/%]"
    assert fig.layout.xaxis3.title.text == "frequency [rad/s]"


def test_the_band_holds_the_points_and_has_no_holes_filled(rec):
    fr = pt.analyze.spa(rec, n=256)
    fig = plot.frequency(fr, of=rec)
    kept = fr.coherent
    runs = np.count_nonzero(np.diff(np.concatenate([[0], kept.astype(int)])) == 1)
    filled = [t for t in fig.data if t.fill == "tonexty" and (t.yaxis or "y") == "y"]
    assert len(filled) == runs
    assert sum(t.showlegend is not False for t in filled) == 1


def test_a_response_of_ones_own_needs_no_record():
    w = np.geomspace(0.01, 3, 20)
    fr = pt.models.FrequencyResponse(w=w, G=TRUTH.freqresp(w))
    fig = plot.frequency(fr, TRUTH)
    assert len(fig.data) == 4  # points and a model, twice
    assert fig.layout.title.text == "Frequency response from u to y"


def test_spectrum_has_its_band_and_of_a_report_the_periodogram(report):
    fig = plot.spectrum(report)
    (raw,), (smooth,) = named(fig, "periodogram"), named(fig, "density")
    assert_array_equal(raw.y, report.periodogram.P[1:])
    assert_array_equal(smooth.x, report.spectrum.w[1:])
    assert len(plot.spectrum(report.spectrum).data) == 3


def test_noise_shows_histogram_and_correlation(report):
    fig = plot.noise(report)
    bars = [trace for trace in fig.data if trace.type == "bar"]
    assert_array_equal(bars[0].y, report.histogram.density)
    assert_array_equal(bars[1].y, report.R[1:])
    (law,) = named(fig, "normal law")
    assert_array_equal(law.y, report.histogram.normal)
    (edge,) = [t for t in named(fig, "95 % of white noise", "y2") if t.fill]
    assert_allclose(edge.y, report.R_band)


def test_names_are_inert(rec):
    hostile = pt.Record(
        u=rec.u, y=rec.y, Ts=1.0, u_names=["<b>u</b>"], y_names=["<script>y</script>"]
    )
    figs = [
        plot.frequency(pt.analyze.spa(hostile), of=hostile),
        plot.frequency(pt.analyze.spa(hostile)),
        plot.spectrum(pt.analyze.spectrum(hostile)),
        plot.noise(pt.analyze.noise(hostile)),
    ]
    for fig in figs:
        assert "<script>" not in fig.to_json() and "<b>u" not in fig.to_json()
