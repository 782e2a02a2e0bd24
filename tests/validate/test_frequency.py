"""Models against a measured frequency response."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import plantune as pt

FR = pt.models.FrequencyResponse
TRUTH = pt.models.ProcessModel(K=2.0, T=5.0, L=2.6)


def record(seed, N=2000, plant=TRUTH):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], N // 4), 4)
    y = plant.simulate(u, Ts=1.0) + 5 + 0.2 * rng.normal(size=N)
    return pt.Record(u=u, y=y, Ts=1.0)


def test_distance_is_in_radii_of_the_sampled_model():
    w = np.linspace(0.1, 3, 30)
    model = pt.models.c2d(pt.models.ProcessModel(K=2.0, T=5.0, L=2.0), 1.0)
    fr = FR(w=w, G=model.freqresp(w) + 0.03, radius=0.06, Ts=1.0)
    for seen in (model, pt.models.ProcessModel(K=2.0, T=5.0, L=2.0)):
        found = pt.validate.frequency(fr, seen)
        assert_allclose(found.distance, 0.5, rtol=1e-9)
        assert found and found.inside == found.N == 30


def test_the_truth_passes_and_another_delay_does_not():
    passed, refused = [], []
    for seed in range(20):
        fr = pt.analyze.spa(record(seed))
        passed.append(bool(pt.validate.frequency(fr, TRUTH)))
        wrong = pt.models.ProcessModel(K=2.0, T=5.0, L=4.6)
        refused.append(not pt.validate.frequency(fr, wrong))
    assert sum(passed) >= 19 and all(refused)


def test_the_worst_frequency_is_named():
    fr = pt.analyze.spa(record(1))
    found = pt.validate.frequency(fr, pt.models.ProcessModel(K=3.0, T=5.0, L=2.6))
    assert [note.code for note in found.notes] == ["V02"]
    w, input, distance = found.worst
    assert distance == found.distance.max() and input == 0 and w in found.w


def test_what_cannot_be_judged_is_refused():
    fr = FR(w=[0.1, 1.0], G=[1, 1])
    with pytest.raises(pt.UsageError, match="discs"):
        pt.validate.frequency(fr, TRUTH)
    two = FR(w=[0.1, 1.0], G=np.ones((2, 1, 2)), radius=0.1)
    with pytest.raises(pt.UsageError, match="one output and 1 inputs"):
        pt.validate.frequency(two, TRUTH)
