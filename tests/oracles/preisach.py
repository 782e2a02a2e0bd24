"""The discrete Preisach model: relays one by one, and the Everett table; source 002, (2) to (4).

    f(t) = sum over S+ of mu - sum over S- of mu, S: alpha >= beta       (4, as in ERRATA 4)
    relay: +1 once x >= alpha, -1 once x <= beta, else as before
    Everett  E(alpha, beta) = integral of mu over beta <= b <= a <= alpha
                            = (f_alpha - f_alpha,beta)/2
    mu = 1/2 d2 f_alpha,beta/(d alpha d beta) from first-order reversal curves (FORC)
    f(t) = f(-) + 2 sum_k [E(M_k, m_(k-1)) - E(M_k, m_k)] over the remembered extremes
    virgin state: relays of alpha + beta < 0 up; first rise E(x, -x) if mu(a, b) = mu(-b, -a)
    play stack: E = sum w_i max((alpha - beta)/2 - r_i, 0)

A cell (i, j), i >= j, holds alpha in [L_i, L_i+1] and beta in [L_j, L_j+1] of the levels L; its
relay switches in the middle of both.  Inputs on the levels give relays and table alike.
Mayergoyz, Mathematical Models of Hysteresis and Their Applications, 2003, chapter 1.
"""

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
    """Return f by remembered extremes; `start`: -1 (all relays down) or "virgin".

    The virgin state is reached as in the laboratory, by extremes that shrink.
    """
    before = virgin(levels) if start == "virgin" else []
    ends, f = [levels[0]], [-interpolate(E, levels, levels[-1], levels[0])]
    out = []
    for xt in [*before, *x]:
        while len(ends) > 1 and (ends[-1] - ends[-2]) * (xt - ends[-1]) >= 0:
            del ends[-1], f[-1]  # the same way on: the last end was no extreme
        while len(ends) > 2 and (xt - ends[-2]) * (ends[-2] - ends[-1]) >= 0:
            del ends[-2:], f[-2:]  # beyond a remembered extreme: the pair is wiped out
        if xt != ends[-1]:
            a, b = max(xt, ends[-1]), min(xt, ends[-1])
            f.append(f[-1] + (2 if xt > ends[-1] else -2) * interpolate(E, levels, a, b))
            ends.append(xt)
        out.append(f[-1])
    return np.array(out[len(before) :])


def virgin(levels, pairs=2000):
    """Return the shrinking extremes, up first, that end at 0."""
    k = np.arange(pairs)
    return np.column_stack(
        [levels[-1] * (1 - k / pairs), levels[0] * (1 - (k + 0.5) / pairs)]
    ).ravel()


def rows(x, levels, start=-1.0):
    """Return the (N, cells) factors of mu in `by_table`, which is linear in mu."""
    n = len(cells(len(levels) - 1))
    return np.column_stack([by_table(x, everett(mu), levels, start) for mu in np.eye(n)])


# -- identification ----------------------------------------------------------------------


def forc(levels, measure):
    """Return E from curves: measure(x) takes an input from negative saturation and returns f."""
    E = np.zeros((len(levels), len(levels)))
    for a in range(1, len(levels)):
        up, down = levels[: a + 1], levels[a - 1 :: -1] if a > 0 else []
        f = measure(np.concatenate([up, down]))
        E[a, a - 1 :: -1] = (f[a] - f[a + 1 :]) / 2
    return E


def fit(S, y, ridge):
    """Return mu >= 0 and an offset that minimise |y - S mu - offset|^2 + ridge |mu|^2.

    S are `relays` (a staircase) or `rows` (the interpolated table).
    """
    n = S.shape[1]
    A = np.vstack([S, np.sqrt(ridge) * np.eye(n)])
    ones = np.append(np.ones(len(y)), np.zeros(n))[:, None]
    found, _ = nnls(np.hstack([A, ones, -ones]), np.append(y, np.zeros(n)), maxiter=20_000)
    return found[:n], found[n] - found[n + 1]
