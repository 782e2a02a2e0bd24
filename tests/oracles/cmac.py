"""A stage in its loop: inverse feed-forward, PID, and a CMAC that learns; source 002, 3.3, 5.2.

    u(t) = u_ff(r(t)) + u_pid(e(t-1)), e(t) = r(t) - y(t), y(t) the answer to u(t); the PID adds
    Kp e + I + Kd (e(t-1) - e(t-2))/Ts.  With r(t) - y(t-1) for e it would fight a right u_ff.
    CMAC: inputs quantised, c layers of cells, each shifted by one step; output = sum of the c
    weights met; after a target: w += beta (target - output)/c on those met
    figure 3.3b: the target is the whole u, so the PID's share is what is still to be learnt
    figure 5.1: u_ff is the inverse model's

Albus, J. Dynamic Systems, Measurement and Control 97, 1975; Ku et al., IEEE/ASME Trans.
Mechatronics 5, 2000.
"""

from types import SimpleNamespace

import numpy as np


def met(s, low, high, cells, layers):
    """Return the index of the cell met in each layer; s in [low, high] in cells*layers steps."""
    step = int(np.clip((s - low) / (high - low) * cells * layers, 0, cells * layers - 1))
    return [(layer, (step + layer) // layers) for layer in range(layers)]


def cmac(low, high, cells, layers, beta, tables=1):
    """Return recall(s, table) and learn(s, target, table) with their weights at 0.

    `table` chooses one of several memories: rising and falling reference, for a plant with
    hysteresis that a function of r alone cannot invert.
    """
    w = np.zeros((tables, layers, cells + 1))

    def recall(s, table=0):
        return sum(w[table, layer, cell] for layer, cell in met(s, low, high, cells, layers))

    def learn(s, target, table=0):
        step = beta * (target - recall(s, table)) / layers
        for layer, cell in met(s, low, high, cells, layers):
            w[table, layer, cell] += step

    return SimpleNamespace(recall=recall, learn=learn, w=w)


def loop(r, plant, Ts, Kp, Ki, Kd=0.0, feed=None, learner=None):
    """Return u, y, e and the PID's share; plant(u) takes one sample and gives the y after it.

    `feed` is a sequence u_ff(t); `learner` a `cmac` with two tables, used and taught on line.
    """
    e, before, integral, way = 0.0, 0.0, 0.0, 0
    u, out, errors, shares = [], [], [], []
    for t, rt in enumerate(r):
        way = way if t == 0 or rt == r[t - 1] else (0 if rt > r[t - 1] else 1)
        integral += Ki * Ts * e
        share = Kp * e + integral + Kd * (e - before) / Ts
        ahead = 0.0 if feed is None else feed[t]
        if learner is not None:
            ahead += learner.recall(rt, way)
            learner.learn(rt, ahead + share, way)
        u.append(ahead + share)
        out.append(plant(u[-1]))
        e, before = rt - out[-1], e
        errors.append(e)
        shares.append(share)
    return SimpleNamespace(u=np.array(u), y=np.array(out), e=np.array(errors), pid=np.array(shares))


def stage(r, w, d=(0.0,), v=(1.0,)):
    """Return plant(u) of a play stack behind dead zones, one sample at a time."""
    z = np.zeros(len(r))

    def plant(u):
        nonlocal z
        z = np.maximum(u - r, np.minimum(u + r, z))
        h = float(z @ w)
        y = v[0] * h
        for dk, vk in zip(d[1:], v[1:], strict=True):
            y += vk * (max(h - dk, 0) if dk > 0 else min(h - dk, 0))
        return y

    return plant
