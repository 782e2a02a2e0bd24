"""Profile likelihood of the dead time of a process model; METHODS 2.4.

    (RSS(L) - RSS(L^)) / (RSS(L^) / (N - n)) < F(1, N - n)

RSS(L) is the least over all other parameters.  RSS has kinks where L/Ts is whole: a row of y
comes under the influence of a move or leaves it, so the delta rule's sd, which knows one
side only, is too small or too large there.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.stats import f as f_law

from oracles import process_models


def profile(texts, u, y, Ts, best, L, L_max, **options):
    """Return the least RSS at each dead time L of the first input that has one; METHODS 2.4."""
    where = best.nonlinear.index("L")
    rss, p = np.empty(np.size(L)), best.p.copy()
    for k in np.argsort(np.abs(np.atleast_1d(L) - best.p[where])):
        p[where] = np.atleast_1d(L)[k]
        rss[k] = process_models.fit(
            texts, u, y, Ts, [p], L_max, hold=(where,), tight=False, **options
        ).rss
    return rss


def profile_interval(texts, u, y, Ts, best, L_max, level=0.95, **options):
    """Return where RSS(L) < RSS (1 + F/(N - n)), F the quantile of F(1, N - n); METHODS 2.4.

    Stepped outward from the minimum by half standard errors, then bisected.
    """
    where = best.nonlinear.index("L")
    limit = best.rss * (1 + f_law.ppf(level, 1, best.free) / best.free)
    sd = np.clip(best.sd[best.names.index("L")], 1e-3 * Ts, 2 * Ts)

    def excess(L):
        return float(profile(texts, u, y, Ts, best, [L], L_max, **options)[0]) - limit

    ends = []
    for sign, edge in ((-1, 0.0), (1, L_max)):
        inside = best.p[where]
        while True:
            outside = np.clip(inside + sign * sd / 2, 0.0, L_max)
            if excess(outside) > 0:
                ends.append(brentq(excess, inside, outside, xtol=1e-4 * sd))
                break
            inside = outside
            if inside == edge:
                ends.append(edge)
                break
    return tuple(ends)
