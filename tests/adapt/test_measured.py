"""Measured records, 001, 3.7.8: what is accepted beside the batch P1D, and what is refused.

None of these plants is first order.  On a window that holds its slow motion the heat shield is
close to the batch; what is fitted to less of it is not, whatever its standard deviation says.
"""

from collections import Counter

import numpy as np
from pytest import approx

import plantune as pt
from plantune.adapt import Settings
from plantune.models import PID


def followed(rec, fit, nk, **changes):
    pid = PID(Kp=0.2 / fit.model.K, Ti=fit.model.T, Ts=rec.Ts)
    log = pt.adapt.replay(rec, Settings(Ts=rec.Ts, nk=nk, controller=pid, **changes))
    return log, Counter(note.code for _, notes in log.reasons for note in notes)


def test_a_step_of_tclab_is_refused(data):
    """One step of each heater, the second heater unread: K and T cannot be told apart."""
    table = np.loadtxt(data("tclab_mimo") / "data_no_headers.csv", delimiter=",")
    rec = pt.Record(u=table[:, 1], y=table[:, 3], Ts=1.0)
    log, codes = followed(rec, pt.estimate.process(rec), (1, 31))
    assert not log.accepted.any() and not log.retuned.any()
    assert codes["A07"] + codes["A02"] == np.count_nonzero(log.fitted)


def test_the_heat_shield_over_all_its_rows(data):
    rec = pt.read(data("heat_shield") / "resultID.mat", u="resultID[1]", y="resultID[0]", Ts=2.0)
    fit = pt.estimate.process(rec)
    log, codes = followed(rec, fit, (1, 16), rows=rec.N, every=100)
    assert log.K[-1] == approx(fit.model.K, abs=2 * log.sd[-1, 0])
    assert log.T[-1] == approx(fit.model.T, rel=0.10)  # 488 against 523 s
    assert log.L[-1] < 2 * rec.Ts + 1
    assert not log.alarm.any() and set(codes) <= {"A01", "A03", "A05", "A07", "C01", "C07"}
