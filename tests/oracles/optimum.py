"""The best PI on K e^(-Ls)/(Ts + 1), delay exact, by brute force: least IAE with Ms <= M.

Everything is computed for K = 1, L = 1: Kp in 1/K, Ti and T in L, IAE of a unit load step on
the plant's input in K L, of a unit set-point step in L.  METHODS 3.1, 3.2.

`iae` cuts time into fractions of a delay on which y and u are Taylor series (method of steps),
for many settings at once.  `search` walks a grid of Ti and, for each, all Kp up to the largest
with Ms <= M (a dense frequency grid); it then closes in on the best.
"""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq, minimize, minimize_scalar

ORDER = 16  # Taylor terms a piece
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)


def iae(T, Kp, Ti, kind="load", t_end=None, pieces=None):
    """Return the IAE of each pair of settings (arrays), over [0, t_end] in delays.

    kind: "load", a unit step on the plant's input, or "setpoint".  |e| is integrated between
    its zeros, found where it changes sign between five points of a piece.  The default t_end
    is 20 of the loop's slow time constants Ti, Ti/Kp.
    """
    Kp, Ti = np.broadcast_arrays(np.atleast_1d(np.asarray(Kp, float)), Ti)
    shortest = min(1.0, T, float(np.min(Ti)))
    m = pieces or max(2, int(np.ceil(4 / shortest)))
    h = 1 / m
    t_end = t_end or 40.0 + 20 * float(np.max(Ti * np.maximum(1, 1 / Kp)))
    n = int(np.ceil(t_end * m))
    r = 1.0 if kind == "setpoint" else 0.0
    d = 1.0 - r
    x = (NODES + 1) / 2 * h
    grid = np.linspace(0, h, 5)
    line, line5 = (v[:, None] ** np.arange(ORDER) for v in (x, grid))
    end = h ** np.arange(ORDER)
    U = []
    y0, i0, total = np.zeros(Kp.shape), np.zeros(Kp.shape), np.zeros(Kp.shape)
    zero = np.zeros((ORDER, *Kp.shape))
    for p in range(n):
        drive = U[p - m] if p >= m else zero
        y, i = np.empty_like(zero), np.empty_like(zero)
        y[0], i[0] = y0, i0
        for k in range(ORDER - 1):
            push = drive[k] + (d if k == 0 and p >= m else 0.0)
            y[k + 1] = (push - y[k]) / (T * (k + 1))
            i[k + 1] = ((r if k == 0 else 0.0) - y[k]) / (k + 1)
        u = Kp * (-y + i / Ti)
        u[0] += Kp * r
        U.append(u)
        y0, i0 = end @ y, end @ i
        e = -y
        e[0] += r
        total += WEIGHTS @ np.abs(line @ e) * h / 2
        # where e passes 0: replace the rule's value by the sum over both sides
        v = line5 @ e
        for j in np.flatnonzero(np.any(np.signbit(v[1:]) != np.signbit(v[:-1]), axis=0)):
            total[j] += _split(e[:, j], v[:, j], grid) - WEIGHTS @ np.abs(line @ e[:, j]) * h / 2
    return total


def _split(e, v, grid):
    """Return the integral of |e| over one piece, from zero to zero of the polynomial."""
    whole = np.append(0.0, e / np.arange(1, len(e) + 1))  # antiderivative, lowest power first

    def at(p, x):
        return np.polynomial.polynomial.polyval(x, p)

    cuts = [grid[0]]
    for a, b, fa, fb in zip(grid[:-1], grid[1:], v[:-1], v[1:], strict=True):
        if np.signbit(fa) != np.signbit(fb) and fa != 0 and fb != 0:
            cuts.append(brentq(lambda x: at(e, x), a, b, xtol=1e-15))
    cuts.append(grid[-1])
    return np.sum(np.abs(np.diff(at(whole, np.array(cuts)))))


def frequencies(T):
    """Return the dense grid: to far beyond the crossover, in rad per delay."""
    return np.concatenate([np.geomspace(1e-3 / (1 + T), 0.2, 1500), np.linspace(0.2, 12, 6000)[1:]])


def Ms(T, Kp, Ti, w=None, polish=True):
    """Return max |1/(1 + CG)| on the grid, polished at the top; inf when unstable.

    Unstable: the grid's Nyquist curve passes the negative axis left of -1 (one crossing counts,
    as |CG| and phase fall together under a PI with Ti > 0 on this plant).
    """
    w = frequencies(T) if w is None else w
    G = _CG(w, T, Kp, Ti)
    phase = np.unwrap(np.angle(G))
    phase += -np.pi * 2 * np.round((phase[0] + np.pi / 2) / (2 * np.pi))
    if np.any((phase <= -np.pi) & (np.abs(G) >= 1)):
        return np.inf
    v = 1 / np.abs(1 + G)
    k = int(np.argmax(v))
    if not polish or k in (0, len(w) - 1):
        return float(v[k])
    best = minimize_scalar(
        lambda x: -1 / abs(1 + _CG(x, T, Kp, Ti)),
        bounds=(w[k - 1], w[k + 1]),
        method="bounded",
        options={"xatol": 1e-12},
    )
    return float(max(v[k], -best.fun))


def largest_gain(T, Ti, M, kp_max=None):
    """Return the largest Kp with Ms <= M at this Ti, the first one from 0 upwards."""
    w = frequencies(T)
    top = kp_max or 2.0 * (1 + T)
    steps = np.geomspace(1e-4, 1, 120) * top
    inside = 0.0
    for Kp in steps:
        if Ms(T, Kp, Ti, w, polish=False) > M:
            return brentq(
                lambda x: min(Ms(T, x, Ti, w), 1e3) - M, max(inside, 1e-9), Kp, xtol=1e-13
            )
        inside = Kp
    return top


def search(T, M, kind="load", n=40):
    """Return Kp, Ti, Ms and IAE of the best PI with Ms <= M, and whether Ms = M there.

    A grid of n Ti (0.1 to 1.5 T + 4 delays) by 12 fractions of the largest Kp, then along the
    border Ms = M by Brent's method, and inside by the simplex method.
    """
    rows = []
    for Ti in np.geomspace(0.1, 1.5 * T + 4, n):
        gains = largest_gain(T, Ti, M) * np.linspace(0.45, 1.0, 12)
        rows += zip(iae(T, gains, Ti, kind), gains, [Ti] * 12, strict=True)
    best = min(rows)

    def border(lnTi):
        Ti = np.exp(lnTi)
        return float(iae(T, largest_gain(T, Ti, M), Ti, kind)[0])

    lo, hi = np.log(best[2]) - 0.25, np.log(best[2]) + 0.25
    along = minimize_scalar(border, bounds=(lo, hi), method="bounded", options={"xatol": 1e-7})
    Ti = float(np.exp(along.x))
    Kp, value, active = largest_gain(T, Ti, M), float(along.fun), True

    def inside(x):
        Kp, Ti = np.exp(x)
        if Ms(T, Kp, Ti) > M:
            return np.inf
        return float(iae(T, Kp, Ti, kind)[0])

    start = np.log([best[1] * (1 - 1e-6), best[2]])
    free = minimize(inside, start, method="Nelder-Mead", options=dict(xatol=1e-7, fatol=1e-11))
    if free.fun < value * (1 - 1e-9):
        (Kp, Ti), value = np.exp(free.x), float(free.fun)
        active = bool(Ms(T, Kp, Ti) > M * (1 - 1e-5))
    return SimpleNamespace(Kp=float(Kp), Ti=float(Ti), Ms=Ms(T, Kp, Ti), iae=value, active=active)


# -- the table -----------------------------------------------------------------------------

# search(1/ratio, M, kind) with n = 40, about 25 s a row: kind, L/T, M, Kp, Ti, IAE, and whether
# Ms = M there.  IAE to 1e-8; Kp and Ti to 1e-4, as the minimum is flat.  Where e does not
# change sign the IAE of the load step is Ti/Kp, as is that of the set-point step.
TABLE = [
    ("load", 0.1, 1.4, 3.110077, 4.526073, 1.52088269, True),
    ("load", 0.1, 1.59, 4.12409, 3.971446, 0.989613939, True),
    ("load", 0.1, 2.0, 5.697511, 3.354408, 0.591280691, True),
    ("load", 0.2, 1.4, 1.599482, 3.250585, 2.10027218, True),
    ("load", 0.2, 1.59, 2.135084, 3.023004, 1.44393052, True),
    ("load", 0.2, 2.0, 2.974286, 2.738709, 0.926113663, True),
    ("load", 0.5, 1.4, 0.6799852, 1.739849, 2.58440367, True),
    ("load", 0.5, 1.59, 0.9304208, 1.760293, 1.90028914, True),
    ("load", 0.5, 2.0, 1.346566, 1.828498, 1.37325429, True),
    ("load", 0.6706908, 1.4, 0.520048, 1.370979, 2.64692508, True),
    ("load", 0.6706908, 1.59, 0.7212344, 1.420638, 1.97389626, True),
    ("load", 0.6706908, 2.0, 1.072945, 1.566257, 1.48115194, True),
    ("load", 1, 1.4, 0.3641406, 0.976245, 2.68131092, True),
    ("load", 1, 1.59, 0.5190569, 1.046707, 2.01823467, True),
    ("load", 1, 2.0, 0.8119287, 1.259172, 1.58306417, True),
    ("load", 2, 1.4, 0.2368891, 0.6222201, 2.62663042, True),
    ("load", 2, 1.59, 0.3182899, 0.6304671, 1.98090654, True),
    ("load", 2, 2.0, 0.5556701, 0.8784411, 1.63568188, True),
    ("load", 5, 1.4, 0.1765059, 0.4286337, 2.42843875, True),
    ("load", 5, 1.59, 0.2222256, 0.4091236, 1.84102781, True),
    ("load", 5, 2.0, 0.4179486, 0.6206649, 1.55278055, False),
    ("setpoint", 0.1, 1.4, 3.726583, 9.996253, 2.68324448, True),
    ("setpoint", 0.1, 1.59, 4.997055, 10.00001, 2.16915452, True),
    ("setpoint", 0.1, 2.0, 5.937134, 10.00008, 2.10374702, False),
    ("setpoint", 0.2, 1.4, 1.860794, 4.967046, 2.68079847, True),
    ("setpoint", 0.2, 1.59, 2.500954, 5.02749, 2.16864853, True),
    ("setpoint", 0.2, 2.0, 2.992023, 5.087929, 2.10092983, False),
    ("setpoint", 0.5, 1.4, 0.7354349, 1.953127, 2.67284852, True),
    ("setpoint", 0.5, 1.59, 1.032386, 2.15176, 2.13057798, True),
    ("setpoint", 0.5, 2.0, 1.318804, 2.348579, 2.03048421, False),
    ("setpoint", 0.6706908, 1.4, 0.5457091, 1.454821, 2.67490347, True),
    ("setpoint", 0.6706908, 1.59, 0.7866976, 1.638818, 2.10829878, True),
    ("setpoint", 0.6706908, 2.0, 1.05203, 1.863573, 1.9827993, False),
    ("setpoint", 1, 1.4, 0.3677738, 0.9862418, 2.68214459, True),
    ("setpoint", 1, 1.59, 0.5531468, 1.141043, 2.07140232, True),
    ("setpoint", 1, 2.0, 0.7917247, 1.392403, 1.9061948, False),
    ("setpoint", 2, 1.4, 0.2368891, 0.62222, 2.62663042, True),
    ("setpoint", 2, 1.59, 0.3263875, 0.6478908, 1.98538761, True),
    ("setpoint", 2, 2.0, 0.5356259, 0.8932714, 1.75921929, False),
    ("setpoint", 5, 1.4, 0.1765059, 0.4286337, 2.42843875, True),
    ("setpoint", 5, 1.59, 0.2222256, 0.4091236, 1.84102781, True),
    ("setpoint", 5, 2.0, 0.3987114, 0.6042303, 1.57664022, False),
]
ROWS = [
    SimpleNamespace(
        **dict(zip(("kind", "ratio", "M", "Kp", "Ti", "iae", "active"), v, strict=True))
    )
    for v in TABLE
]


def row(kind, ratio, M):
    """Return the row of the table nearest to L/T = ratio."""
    rows = [r for r in ROWS if r.kind == kind and r.M == M]
    return min(rows, key=lambda r: abs(r.ratio - ratio))


def scaled(row, K, T, L):
    """Return Kp, Ti, IAE of the load step in a plant's own units."""
    return row.Kp / K, row.Ti * L, row.iae * K * L


def _CG(w, T, Kp, Ti):
    s = 1j * np.asarray(w)
    return Kp * (1 + 1 / (Ti * s)) * np.exp(-s) / (T * s + 1)
