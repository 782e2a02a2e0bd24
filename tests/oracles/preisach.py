"""The discrete Preisach model: relays one by one, and the Everett table; source 002, (2) to (4).

    f(t) = sum over S+ of mu - sum over S- of mu, S: alpha >= beta       (4, as in ERRATA 4)
    relay: +1 once x >= alpha, -1 once x <= beta, else as before
    Everett  E(alpha, beta) = integral of mu over beta <= b <= a <= alpha
                            = (f_alpha - f_alpha,beta)/2
    mu = 1/2 d2 f_alpha,beta/(d alpha d beta) from first-order reversal curves (FORC)
    f(t) = f(-) + 2 sum_k [E(M_k, m_(k-1)) - E(M_k, m_k)] over the remembered extremes; from the
    virgin state (relays of alpha + beta < 0 up) the first rise gives E(x, -x)
    play stack: E = sum w_i max((alpha - beta)/2 - r_i, 0)

A cell (i, j), i >= j, holds alpha in [L_i, L_i+1] and beta in [L_j, L_j+1] of the levels L; its
relay switches in the middle of both.  Inputs on the levels give relays and table alike.
Mayergoyz, Mathematical Models of Hysteresis and Their Applications, 2003, chapter 1.
"""

import itertools

import numpy as np
from scipy.optimize import nnls

# -- relays ------------------------------------------------------------------------------


def cells(n):
    """Return the rows (i, j) of all cells of n + 1 levels."""
    return np.array([(i, j) for i in range(n) for j in range(i + 1)])


def relays(x, levels, start=-1.0):
    """Return the (N, cells) states; `start`: -1, +1 or "virgin"."""
    middle = (np.asarray(levels[:-1]) + levels[1:]) / 2
    ij = cells(len(middle))
    alpha, beta = middle[ij[:, 0]], middle[ij[:, 1]]
    if start == "virgin":
        state = np.where(alpha + beta < -1e-12 * abs(alpha).max(), 1.0, -1.0)
        state[abs(alpha + beta) <= 1e-12 * abs(alpha).max()] = 0.0  # on the line itself: half each
    else:
        state = np.full(len(ij), start)
    out = []
    for xt in x:
        state = np.where(xt >= alpha, 1.0, np.where(xt <= beta, -1.0, state))
        out.append(state)
    return np.array(out)


def output(x, levels, mu, start=-1.0):
    """Return f by (4), mu per cell."""
    return relays(x, levels, start) @ mu


# -- the Everett function ----------------------------------------------------------------


def everett(mu):
    """Return E of every pair of levels, 0 where alpha <= beta."""
    n = round((np.sqrt(8 * len(mu) + 1) - 1) / 2)
    E = np.zeros((n + 1, n + 1))
    ij = cells(n)
    for a in range(n + 1):
        for b in range(a):
            E[a, b] = np.sum(mu[(ij[:, 0] < a) & (ij[:, 1] >= b)])
    return E


def weights(E):
    """Return mu per cell: the mixed difference of the table."""
    return np.array(
        [E[i + 1, j] - E[i, j] - E[i + 1, j + 1] + (E[i, j + 1]) for i, j in cells(len(E) - 1)]
    )


def play_everett(levels, r, w):
    """Return the table of a play stack."""
    half = np.subtract.outer(levels, levels) / 2
    return sum(wi * np.maximum(half - ri, 0) for ri, wi in zip(r, w, strict=True))


def interpolate(E, levels, alpha, beta):
    """Return E between levels: bilinear, on the diagonal proportional to alpha - beta."""
    last = len(levels) - 2
    i = min(max(int(np.searchsorted(levels, alpha, "right")) - 1, 0), last)
    j = min(max(int(np.searchsorted(levels, beta, "right")) - 1, 0), last)
    p = (alpha - levels[i]) / (levels[i + 1] - levels[i])
    q = (beta - levels[j]) / (levels[j + 1] - levels[j])
    if i <= j:
        return E[i + 1, i] * max(p - q, 0.0) if i == j else 0.0
    low = E[i, j] + q * (E[i, j + 1] - E[i, j])
    high = E[i + 1, j] + q * (E[i + 1, j + 1] - E[i + 1, j])
    return low + p * (high - low)


def by_table(x, E, levels, start=-1.0):
    """Return f by remembered extremes; `start`: -1 (all relays down) or "virgin"."""

    def of(a, b):
        return interpolate(E, levels, a, b)

    low, high = levels[0], levels[-1]
    out = []
    for t in range(len(x)):
        ends = extremes(x[: t + 1], start, low, high)
        f = half(ends[0], of) if start == "virgin" else -of(high, low)
        for a, b in itertools.pairwise(ends):
            f += 2 * of(b, a) if b > a else -2 * of(a, b)
        out.append(f)
    return np.array(out)


def half(x, of):
    """Return the virgin curve: E(x, -x), odd."""
    return of(x, -x) if x >= 0 else -of(-x, x)


def extremes(x, start, low, high):
    """Return the remembered extremes and the last input, by the wiping-out rule."""
    ends = [low] if start != "virgin" else [0.0]
    for xt in x:
        while len(ends) > 1 and (ends[-1] - ends[-2]) * (xt - ends[-1]) >= 0:
            ends.pop()  # the same way on
            if start == "virgin" and len(ends) == 1:
                break
        ends = wiped(ends, xt, start)
        ends.append(xt)
    return ends[1:] if start == "virgin" else ends


def wiped(ends, xt, start):
    """Return the extremes that xt leaves: an excursion beyond a remembered one erases a pair."""
    while len(ends) >= 3 and (xt - ends[-2]) * (ends[-2] - ends[-1]) >= 0:
        ends = ends[:-2]
    if start == "virgin" and len(ends) == 2 and abs(xt) >= abs(ends[1]):
        return ends[:1]
    return ends


# -- identification ----------------------------------------------------------------------


def forc(levels, measure):
    """Return E from curves: measure(x) takes an input from negative saturation and returns f."""
    E = np.zeros((len(levels), len(levels)))
    for a in range(1, len(levels)):
        up, down = levels[: a + 1], levels[a - 1 :: -1] if a > 0 else []
        f = measure(np.concatenate([up, down]))
        E[a, a - 1 :: -1] = (f[a] - f[a + 1 :]) / 2
    return E


def fit(x, y, levels, ridge, start=-1.0):
    """Return mu >= 0 and an offset that minimise |y - f - offset|^2 + ridge |mu|^2."""
    S = relays(x, levels, start)
    n = S.shape[1]
    A = np.vstack([S, np.sqrt(ridge) * np.eye(n)])
    ones = np.append(np.ones(len(x)), np.zeros(n))[:, None]
    found, _ = nnls(np.hstack([A, ones, -ones]), np.append(y, np.zeros(n)), maxiter=20_000)
    return found[:n], found[n] - found[n + 1]
