"""A run as the main job returns it, made from a simulated record."""

from functools import partial

import numpy as np
import pytest

import plantune as pt
from plantune import _core

TRUTH = {"K": -2.0, "T": 1.5, "L": 0.43, "offset": 7.0}


@pytest.fixture(scope="session")
def make():
    """Give `make(title=..., truth=..., **fields of the record)`."""

    def run(title="Tank", truth=None, notes=(), fresh=True, **fields):
        N, Ts = 600, 0.1
        u = _core.prbs(N, 8, 8, 1)
        plant = pt.models.ProcessModel(**{name: TRUTH[name] for name in "KTL"})
        y = plant.simulate(u, Ts=Ts) + 7 + np.random.default_rng(3).normal(0, 0.05, N)
        names = {"u_names": ["valve"], "y_names": ["level"], "log": ("600 rows read",)}
        rec = pt.Record(u=u, y=y, Ts=Ts, **{**names, **fields})
        est, val = rec.split(0.5) if fresh else (rec, rec)
        fits = {"ARX": pt.estimate.arx(est, 1, 2, 5), "P1D": pt.estimate.process(est, "P1D")}
        chosen = pt.estimate.process(rec, "P1D")
        rules = (partial(pt.tune.imc_pi, gain_margin=3), partial(pt.tune.imc_pi, tau_c=1.0))
        comparison = pt.tune.compare(chosen, rules)
        return pt.job.Run(
            record=rec,
            findings={"delay": pt.analyze.delay(rec)},
            fits=fits,
            verdicts={name: pt.validate.check(val, fit) for name, fit in fits.items()},
            trusted="ARX",
            chosen=chosen,
            comparison=comparison,
            tunings=tuple(row.tuning for row in comparison.rows),
            responses=tuple(row.set_point for row in comparison.rows),
            notes=tuple(notes),
            title=title,
            truth=truth,
        )

    return run
