"""Steps of the offset: where a load came on, and the fit that carries them.

    y(t) = G u(t) + O + sum_j h_j 1(t >= c_j) + v(t)
    scan      of residuals e of a fit:  for each c the gain in the sum of squares by one step,
              S(c) = (n1 n2/N) (mean2 - mean1)^2 / s2;   the largest S and where      Hinkley 1970
    binary segmentation: split at the best c while S > limit, both parts again       Vostrikova 1981
    limit     2 ln N + 3 (white e; false alarm about 1 %); coloured e: S divided by the ratio of
              the long-run variance to the variance, 1 + 2 sum R(l)
    refit     G, O and all h_j together (each step is one more column), then scan again

A step of the *load* passes the noise filter or the plant before it is seen: then the edge is
soft; the model of a soft edge is the same column through 1/F.
"""

import numpy as np

from oracles import experiment_design, noise


def scan(e):
    """Return S(c) for c = 0 ... N-1 (0 at c = 0), s2 from both parts at each c, and the sums."""
    N = len(e)
    total = np.cumsum(e)
    n1 = np.arange(1, N)
    n2 = N - n1
    jump = total[-1] / n2 - total[:-1] / n2 - total[:-1] / n1
    gain = n1 * n2 / N * jump**2
    rss = np.sum((e - e.mean()) ** 2)
    s2 = np.maximum(rss - gain, 1e-12 * rss) / (N - 2)
    return np.concatenate([[0.0], gain / s2])


def long_run_ratio(e, steps=()):
    """Return 1 + 2 sum R(l) of e with steps taken out, R summed up to its first zero."""
    e = np.array(e, float)
    for a, b in zip([0, *steps], [*steps, len(e)], strict=True):
        e[a:b] -= e[a:b].mean()
    N = len(e)
    R = noise.autocorrelation(e, min(N // 4, 200))[1:]
    below = np.flatnonzero(R < 1 / np.sqrt(N))
    R = R[: below[0]] if len(below) else R
    return max(1.0, 1 + 2 * np.sum(R))


def steps(e, least=10, most=20, margin=3.0):
    """Return the change points of e by binary segmentation, least `least` samples apart."""
    found = []
    ratio = 1.0
    for _ in range(3):  # the colour needs the steps, the steps need the colour
        new = _split(np.asarray(e, float), 0, least, ratio, 2 * np.log(len(e)) + margin)
        new = sorted(new)[:most]
        ratio_new = long_run_ratio(e, new)
        if new == found and np.isclose(ratio, ratio_new):
            break
        found, ratio = new, ratio_new
    return found


def _split(e, first, least, ratio, limit):
    if len(e) < 2 * least:
        return []
    S = scan(e) / ratio
    S[:least] = S[len(e) - least + 1 :] = 0.0
    c = int(np.argmax(S))
    if S[c] < limit:
        return []
    left, right = e[:c], e[c:]
    return [
        *_split(left, first, least, ratio, limit),
        first + c,
        *_split(right, first + c, least, ratio, limit),
    ]


def line_gain(e):
    """Return what a straight line takes from the sum of squares, over s2: the rival of one step."""
    N = len(e)
    t = np.arange(N) - (N - 1) / 2
    slope = t @ e / (t @ t)
    rss = np.sum((e - e.mean()) ** 2)
    gain = slope**2 * (t @ t)
    return gain / ((rss - gain) / (N - 2))


def fit_with_steps(y, u, t, p0, rounds=8):
    """Fit K, T, L, O and the steps of the offset in turn; return p, the steps and the residuals.

    The first residuals are those at the rough T and L, only K and O fitted: free T and L would
    bend to the unseen steps (T grows until the free response looks like one).
    """
    found, p = None, np.array(p0, float)
    for k in range(rounds):
        columns = [(np.arange(len(y)) >= c).astype(float) for c in found or ()]
        starts, moves = ((p, p0), 40) if k else ((p0,), 0)
        tries = [experiment_design.estimate(y, u, t, t, q, moves, more=columns) for q in starts]
        p, _ = min(tries, key=lambda got: got[1])
        e = y - experiment_design.response((p[0], p[1], p[2], 0.0), u, t, t)
        new = steps(e)
        if k and new == found:
            break
        found = new
    return p, found, e
