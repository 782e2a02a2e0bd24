"""Historian compression: how a record is thinned, and how a thinned record gives itself away.

    exception    a value is kept when it differs from the last kept one by more than the limit
    swinging door (Bristol 1990)  a straight line from the last kept point must pass within
                 +-limit of every point skipped; the doors are the steepest and the flattest slope
                 that still do; when they cross, the point before is kept

Resampled on its old grid by hold or by straight lines, the record has long stretches on which
the second difference (line) or the first (hold) is zero to rounding; measured noise has none:
of three neighbours in line to 1e-6 of the typical second difference there are about 1e-6.

    share of points in exact line  s2 = #{|d2 y| < 1e-6 median|d2 y| (of those not zero)}/N
    share of exact repeats         s1 = #{d y = 0}/N, runs of repeats longer than the quantiser's

A quantised signal repeats and is in line as well, but all its values lie on one lattice
(`noise.resolution`), and where it repeats often it mostly moves by one step.
METHODS 8, pitfall 7; BAD_INPUTS D15.
"""

import numpy as np

from oracles import noise


def exception(y, limit):
    """Return the kept indices."""
    kept = [0]
    for k in range(1, len(y)):
        if abs(y[k] - y[kept[-1]]) > limit:
            kept.append(k)
    return np.array(kept)


def swinging_door(y, limit):
    """Return the kept indices, the last sample among them."""
    kept, last = [0], len(y) - 1
    low, high = -np.inf, np.inf
    for k in range(1, len(y)):
        a = kept[-1]
        low = max(low, (y[k] - limit - y[a]) / (k - a))
        high = min(high, (y[k] + limit - y[a]) / (k - a))
        if low > high and k - 1 > a:
            kept.append(k - 1)
            low, high = y[k] - y[k - 1] - limit, y[k] - y[k - 1] + limit
    return np.array([*kept, last] if kept[-1] != last else kept)


def refilled(y, kept, how):
    """Return the record on its old grid, by "hold" or "line"."""
    if how == "line":
        return np.interp(np.arange(len(y)), kept, y[kept])
    return y[kept][np.searchsorted(kept, np.arange(len(y)), side="right") - 1]


def longest_run(flags):
    """Return the length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max()) if len(edges) else 0


def shares(y):
    """Return s1, s2 and the resolution of y (None when it is not quantised)."""
    size = np.max(np.abs(y)) if len(y) else 0.0
    d1, d2 = np.diff(y), np.diff(y, 2)
    tiny = 64 * np.finfo(float).eps * size
    moving = np.abs(d2[np.abs(d2) > tiny])
    limit = max(tiny, 1e-6 * np.median(moving)) if len(moving) else tiny
    level = np.abs(d1[1:]) <= tiny  # a line on a slope; plateaus are counted in s1
    return (
        np.mean(np.abs(d1) <= tiny),
        np.mean((np.abs(d2) <= limit) & ~level),
        noise.resolution(y),
    )


def compressed(y, line_share=0.15, hold_share=0.1, step_share=0.3):
    """Return None, "line" or "hold".

    "line": more than `line_share` of the points lie in line on a slope and y is not quantised.
    "hold": y is not quantised and more than `hold_share` of it repeats; or y is quantised, more
    than `step_share` repeats, and yet most moves are by more than one step.
    """
    s1, s2, q = shares(y)
    moves = np.abs(np.diff(y))
    moves = moves[moves > 0]
    if len(moves) < 10:
        return None  # stuck, or a few steps: the business of D18
    if q is None:
        return "line" if s2 > line_share else "hold" if s1 > hold_share else None
    return "hold" if s1 > step_share and np.mean(moves < 1.5 * q) < 0.5 else None
