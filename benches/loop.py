"""A closed loop of a million samples beside the bare recursion of its plant.

The engine loop: first order plus dead time under a sampled PI, set point steps, indices included.
The bare plant is `model.simulate(u)` on as many samples; scipy's `lfilter` runs the same recursion.
"""

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant

N, TS = 1_000_000, 0.02
PLANT = pt.models.ProcessModel(K=-5.939, T=0.1491, L=0.1)
PID = pt.models.PID(Kp=-0.1315, Ti=0.1491, Ts=TS)


def bare():
    u = np.ones(N)
    return lambda: PLANT.simulate(u, TS)[-1:]


def loop(**more):
    def setup():
        r = np.ones(N)
        return lambda: pt.simulate.closed_loop(PLANT, PID, r, **more).y[-1:]

    return setup


def limited():
    return loop(actuator=pt.simulate.Actuator(low=-0.2, high=0.0, rate=5.0))()


def scipy():
    from scipy.signal import lfilter

    sampled = pt.models.c2d(PLANT, TS)
    B, u = [0.0] * sampled.nk + [*sampled.B], np.ones(N)
    return lambda: lfilter(B, sampled.A, u)[-1:]


BENCHES = [
    Bench(
        "A loop of 1e6 samples with indices, in units of its bare plant recursion",
        [
            Contestant("model.simulate, the plant alone", bare),
            Contestant("simulate.closed_loop, PI", loop()),
            Contestant("the same, limits and rate", limited),
            Contestant("scipy lfilter, the plant alone", scipy, ("scipy",)),
        ],
        difference=None,
    )
]
