"""The improved Maxwell slip model of source 002, chapter 4, as corrected in ERRATA 4.

Two groups of elements (x_b, y_b, k), one for rising and one for falling input.  In use is the
last one whose x_b has been passed in the present direction; before the first the output holds.

    anchored     F = y_b + k (x - x_b)
    series       F(t) = F(t-1) + the rise of the anchored or of the chained group between x(t-1)
                 and x(t): f_i = k_i times the length of the segment, carried over at reversals
    closure      the falling group is scaled so that both groups travel the same from end to end
    identified   RLS on increments, k of Y - y_b = k (x - x_b); |Y - F| > threshold opens the next
                 element at (x, Y); a reversal of x opens the other group

Source 002, (8a), (8b), 4.2 to 4.4, tables 4.1.
"""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np

TABLE_4_1 = SimpleNamespace(
    up=((0.0, 1.205, 0.3547), (9.1877, 3.9765, 0.3547), (19.538, 8.3145, 0.44513)),
    down=((97.908, 43.862, 0.2777), (65.378, 33.981, 0.42597), (21.593, 14.46, 0.59484)),
)


def passed(group, x, direction):
    """Return the last element whose breakpoint lies behind x, or None."""
    found = None
    for element in group:
        if (x - element[0]) * direction >= 0:
            found = element
    return found


def value(group, x, direction):
    """Return y_b + k (x - x_b), or None before the first breakpoint."""
    element = passed(group, x, direction)
    return None if element is None else element[1] + element[2] * (x - element[0])


def anchored(x, up, down, F0=0.0):
    """Return F: absolute positions, so a loop from end to end cannot drift."""
    F, direction, out = F0, 1, []
    for t, xt in enumerate(x):
        if t > 0 and xt != x[t - 1]:
            direction = 1 if xt > x[t - 1] else -1
        there = value(up if direction > 0 else down, xt, direction)
        F = F if there is None else there
        out.append(F)
    return np.array(out)


def climb(group, a, b):
    """Return the sum of the element forces between a and b: the integral of k."""
    direction = 1 if b > a else -1
    inside = (e[0] for e in group if min(a, b) < e[0] < max(a, b))
    cuts = sorted({a, b, *inside}, reverse=bool(b < a))
    total = 0.0
    for p, q in pairwise(cuts):
        element = passed(group, (p + q) / 2, direction)
        total += 0.0 if element is None else element[2] * (q - p)
    return total


def series(x, up, down, F0=0.0):
    """Return F: increments carried over at reversals, F_n = F_(n-1)."""
    F, out = F0, [F0]
    for a, b in pairwise(x):
        if a != b:
            F += climb(up if b > a else down, a, b)
        out.append(F)
    return np.array(out)


def drift(up, down, low, high):
    """Return what one cycle low -> high -> low of the series form leaves."""
    return climb(up, low, high) + climb(down, high, low)


def closed(up, down, low, high):
    """Return the falling group, scaled about the top of the rising one so that nothing is left."""
    scale = -climb(up, low, high) / climb(down, high, low)
    return tuple((x_b, y_b, scale * k) for x_b, y_b, k in down)


def chained(group, y0=None):
    """Return the group with each y_b moved to where the element before it ends."""
    out = [(group[0][0], group[0][1] if y0 is None else y0, group[0][2])]
    for x_b, _, k in group[1:]:
        x_a, y_a, k_a = out[-1]
        out.append((x_b, y_a + k_a * (x_b - x_a), k))
    return tuple(out)


def literal(x, group, direction):
    """Return (8a), (8b) as printed, F_i in the table for f_i: right only in ERRATA's sense."""
    total = 0.0
    for x_b, f, k in group:
        if (x - x_b) * direction >= 0:
            pull = k * (x - x_b)
            total += pull if abs(pull) < f else f
    return total


def identify(x, y, threshold, P0=100.0, consecutive=1, keep=True, back=False):
    """Return both groups, on line, and the F of each sample after its update.

    `keep`: a new element starts from the slope of the one before; else from 0 as printed.
    `back`: it starts at the last sample that was within the threshold, not at the one beyond;
    then no F is further off than the threshold (with consecutive = 1).
    """
    groups = {1: [], -1: []}
    direction, beyond, F = 1, [], [y[0]]
    x_b, y_b, k, P = x[0], y[0], 0.0, P0

    def learn(t, k, P):
        d = x[t] - x_b
        k += P * d / (1 + d * P * d) * (y[t] - y_b - k * d)
        return k, P - P * d * d * P / (1 + d * P * d), y_b + k * d

    for t in range(1, len(x)):
        if (x[t] - x[t - 1]) * direction < 0:
            groups[direction].append((x_b, y_b, k))
            direction, beyond = -direction, []
            x_b, y_b, k, P = x[t - 1], y[t - 1], 0.0, P0
        before = k
        k, P, Ft = learn(t, k, P)
        beyond = [*beyond, (t, before)] if abs(y[t] - Ft) > threshold else []
        if len(beyond) >= consecutive:
            first, within = beyond[0]
            k = within if back else k
            groups[direction].append((x_b, y_b, k))
            start = first - 1 if back else t
            x_b, y_b, k, P, beyond = x[start], y[start], k if keep else 0.0, P0, []
            for s in range(start + 1, t + 1):
                k, P, Ft = learn(s, k, P)
        F.append(Ft)
    groups[direction].append((x_b, y_b, k))
    return SimpleNamespace(up=tuple(groups[1]), down=tuple(groups[-1]), F=np.array(F))


def inverse(y, up, down, direction):
    """Return x with anchored(x) = y in the given direction; a jump up is crossed at its x_b."""
    group = up if direction > 0 else down
    for n, (x_b, y_b, k) in enumerate(group):
        x = x_b + (y - y_b) / k
        if n + 1 == len(group) or (x - group[n + 1][0]) * direction < 0:
            return x if n == 0 or (x - x_b) * direction >= 0 else x_b
    raise AssertionError("the last element always answers")
