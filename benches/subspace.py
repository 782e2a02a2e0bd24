"""Subspace identification of the winding record and a made-up one, against nfoursid and SIPPY.

The same orders, block rows and data, a direct term for all.  nfoursid has MOESP alone and takes
its order from the user; SIPPY's N4SID, MOESP and CVA differ in a weight.  The difference is that
of the frequency responses, largest singular value, relative.
"""

import os
from functools import partial
from pathlib import Path

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant

ROOT = Path(__file__).resolve().parents[1]
W = np.linspace(0.05, 3.0, 30)


def made(N=4000, n=6, nu=2, ny=2):
    """Three resonances, white noise of 5 %."""
    rng = np.random.default_rng(0)
    A = np.zeros((n, n))
    for i, (r, angle) in enumerate([(0.95, 0.3), (0.9, 0.9), (0.8, 1.8)]):
        c, s = r * np.cos(angle), r * np.sin(angle)
        A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[c, s], [-s, c]]
    model = pt.models.StateSpace(
        A=A, B=rng.normal(size=(n, nu)), C=rng.normal(size=(ny, n)), Ts=1.0
    )
    u = rng.normal(size=(N, nu))
    y = model.simulate(u)
    return u, y + 0.05 * y.std(0) * rng.normal(size=y.shape)


def winding():
    """First half of the measured record, centred and scaled; the made-up one where it is absent."""
    path = ROOT / os.environ.get("PLANTUNE_DATA", "../shared/data") / "winding" / "winding.dat"
    if not path.is_file():
        return made()
    x = np.loadtxt(path)[:1250]
    x = (x - x.mean(0)) / x.std(0)
    return x[:, :5], x[:, 5:]


def response(A, B, C, D):
    model = pt.models.StateSpace(A=A, B=B, C=C, D=D, Ts=1.0)
    return abs(model.freqresp(W)).ravel()


def ours(record, n, s, method, variant):
    u, y = record()
    rec = pt.Record(u=u, y=y, Ts=1.0)

    def job():
        fit = pt.estimate.subspace(rec, n, rows=s, method=method, variant=variant, offset=False)
        model = fit.model
        return response(model.A, model.B, model.C, model.D)

    return job


def nfoursid(record, n, s):
    import pandas as pd
    from nfoursid.nfoursid import NFourSID

    u, y = record()
    names = [f"u{i}" for i in range(u.shape[1])], [f"y{i}" for i in range(y.shape[1])]
    frame = pd.DataFrame(np.hstack([u, y]), columns=[*names[0], *names[1]])

    def job():
        found = NFourSID(frame, names[1], names[0], num_block_rows=s)
        found.subspace_identification()
        model, _ = found.system_identification(rank=n)
        return response(model.a, model.b, model.c, model.d)

    return job


def sippy(record, n, s, method):
    from sippy_unipi import system_identification

    u, y = record()

    def job():
        found = system_identification(
            y.T, u.T, method, SS_f=s, SS_p=s, SS_fixed_order=n, SS_D_required=True
        )
        return response(found.A, found.B, found.C, found.D)

    return job


def bench(title, record, n, s):
    mine = [
        Contestant(f"plantune {method}, {variant}", partial(ours, record, n, s, method, variant))
        for method, variant in (
            ("moesp", "states"),
            ("moesp", "simulation"),
            ("n4sid", "simulation"),
            ("cva", "simulation"),
        )
    ]
    theirs = [
        Contestant("nfoursid", partial(nfoursid, record, n, s), ("nfoursid", "pandas")),
        *(
            Contestant(f"SIPPY {method}", partial(sippy, record, n, s, method), ("sippy_unipi",))
            for method in ("MOESP", "N4SID", "CVA")
        ),
    ]
    return Bench(title, [*mine, *theirs])


BENCHES = [
    bench("winding, 5 inputs, 2 outputs, 1250 rows: 6 states, 10 block rows", winding, 6, 10),
    bench("made up, 2 inputs, 2 outputs, 4000 rows: 6 states, 15 block rows", made, 6, 15),
]
