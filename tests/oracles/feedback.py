"""Does u answer y?  And: does y answer u at all?  Two F tests on regressions.

    feedback   u(t) on u(t-1) .. u(t-nu), 1 and e(t) .. e(t-ne+1), e the errors of a long ARX of y
               by past y and past u: in open loop no e takes part (Caines & Chan 1975).  Moves of
               the set point are rare and large against what e does: Huber's weights keep them
               from hiding it.  Where r is known its lags are regressors too.
    relation   y(t) on y(t-1) .. y(t-n), 1, with and without u(t-nk) .. u(t-nk-n+1).

An input that never moves but in rare jumps (MAD of its innovations zero) answers nothing: p = 1.
"""

import numpy as np
from scipy.stats import f as f_law

from oracles import robust


def lags(x, n, first, h):
    """Return x(t-first) .. x(t-first-n+1) as columns for t >= h."""
    return np.column_stack([x[h - k : len(x) - k] for k in range(first, first + n)])


def innovations(u, y, n=10):
    """Return the errors of y by ARX(n, n, 1) with a constant, on the rows from n on."""
    u, y = u - u[0], y - y[0]
    X = np.column_stack([lags(y, n, 1, n), lags(u, n, 1, n), np.ones(len(y) - n)])
    return y[n:] - X @ np.linalg.lstsq(X, y[n:], rcond=None)[0]


def p_of_feedback(u, y, r=None, n=10, nu=5, ne=3):
    """Return the p value of "e does not move u"."""
    u, y = np.asarray(u, float).ravel(), np.asarray(y, float).ravel()
    e, v = innovations(u, y, n), (u - u[0])[n:]
    h = n
    own = [lags(v, nu, 1, h), np.ones((len(v) - h, 1))]
    if r is not None:
        own.append(lags((np.ravel(r) - np.ravel(r)[0])[n:], 3, 0, h))
    W, t = np.column_stack([*own, lags(e, ne, 0, h)]), v[h:]
    fit = robust.regression(W, t, rounds=60)
    if not fit.s > 1e-9 * np.std(t):
        return 1.0 if r is None else p_by_least_squares(W, t, ne)
    b, P = fit.theta[-ne:], fit.P[-ne:, -ne:]
    return float(f_law.sf(b @ np.linalg.solve(P, b) / ne, ne, len(t) - W.shape[1]))


def p_by_least_squares(W, t, last):
    """Return the p value of "the last columns of W have no part in t"."""
    less = W[:, : W.shape[1] - last]
    r0, r1 = (np.sum((t - X @ np.linalg.lstsq(X, t, rcond=None)[0]) ** 2) for X in (less, W))
    free = len(t) - W.shape[1]
    return float(f_law.sf((r0 - r1) / last / (max(r1, 1e-300) / free), last, free))


def p_of_no_relation(u, y, n=10, nk=1):
    """Return the p value of "no lag of u has a part in y"."""
    u, y = (np.asarray(x, float).ravel() - np.ravel(x)[0] for x in (u, y))
    h = n + nk - 1
    W = np.column_stack([lags(y, n, 1, h), np.ones(len(y) - h), lags(u, n, nk, h)])
    return p_by_least_squares(W, y[h:], n)
