"""Peaks and margins of rational loops from the roots of polynomials, no frequency grid.

Continuous: |p(jw)|^2 is a polynomial in x = w^2.  Sampled: |p(e^(j theta))|^2 is one in
x = 2 - 2 cos theta, theta = w Ts (in cos theta itself slow poles, all near 1, drown).  A peak of
|n/d| lies where N' D - N D' = 0, N = |n|^2, D = |d|^2, or at an end of the axis, and no peak is
too narrow for that:

    Ms = max |S|, S = 1/(1 + CG);   Mt = max |T|, T = CG/(1 + CG);   noise gain max |CS|.

Gain margin where Im CG = 0, phase and delay margin where |CG| = 1; source 001, (3.6-27) to
(3.6-30).  All roots in mpmath, coefficients taken as the binary numbers they are; `dt` None
is continuous, otherwise polynomials are in z, highest power first.
"""

from types import SimpleNamespace

import mpmath
import numpy as np
from scipy import signal

from oracles.rational import exact, horner, roots

DPS = 120  # products of floats are exact, and zeros are zero


def peak(num, den, dt=None, dps=DPS):
    """Return max over w of |num/den| and the w where it is; w may be 0, inf or pi/dt.

    Infinite where the denominator has a root on the axis that the numerator has not.
    """
    with mpmath.workdps(dps):
        N, D = _squared(num, dt), _squared(den, dt)
        slope = _add(_mul(_derived(N), D), _mul(N, _derived(D)), -1)
        best, at = mpmath.mpf(-1), None
        candidates = [*_on_axis(roots(slope), dt), *_on_axis(roots(D), dt), *_ends(dt)]
        for x in candidates:
            value = _ratio(N, D, x)
            if value is not None and value > best:
                best, at = value, x
        return float(mpmath.sqrt(best)), _frequency(at, dt)


def open_loop(nG, dG, nC, dC, dps=DPS):
    """Return numerator and denominator of CG, multiplied without rounding."""
    with mpmath.workdps(dps):
        return _mul(exact(nG), exact(nC)), _mul(exact(dG), exact(dC))


def closed(nG, dG, nC, dC, dps=DPS):
    """Return {"S", "T", "CS"} as (num, den), multiplied without rounding.

    In floats a product of sampled polynomials loses the integrator and slow poles near 1.
    """
    with mpmath.workdps(dps):
        n, d = open_loop(nG, dG, nC, dC, dps)
        den = _add(n, d)
        return {"S": (d, den), "T": (n, den), "CS": (_mul(exact(nC), exact(dG)), den)}


def sensitivities(nG, dG, nC, dC, dt=None):
    """Return Ms, Mt, the noise gain Mks = max |CS|, and the frequencies of the three."""
    sys = closed(nG, dG, nC, dC)
    (Ms, w_s), (Mt, w_t), (Mks, w_k) = (peak(*sys[name], dt) for name in ("S", "T", "CS"))
    return SimpleNamespace(Ms=Ms, w_Ms=w_s, Mt=Mt, w_Mt=w_t, Mks=Mks, w_Mks=w_k)


def stable(nG, dG, nC, dC, dt=None, dps=DPS):
    """Tell whether all roots of dG dC + nG nC lie left of the axis, or inside the circle."""
    with mpmath.workdps(dps):
        z = roots(_add(*open_loop(nG, dG, nC, dC, dps)))
        return all(mpmath.re(v) < 0 if dt is None else abs(v) < 1 for v in z)


def modulus(num, den, w, dt=None, dps=DPS):
    """Return |num/den| at one frequency w."""
    with mpmath.workdps(dps):
        s = mpmath.mpc(0, w) if dt is None else mpmath.expj(mpmath.mpf(w) * dt)
        return float(abs(horner(exact(num), s) / horner(exact(den), s)))


def margins(num, den, dt=None, dps=DPS):
    """Return the margins of the loop gain num/den, and all crossings they are chosen from.

    `factors` are the gains (at the frequencies `w_factors`) that put the loop on -1; `gain` is
    the least above 1 (inf if none), `gain_low` the largest below 1 (0 if none).  `phase_deg`
    is the least in size of the distances to -180 degrees where |CG| = 1, `delay` the least
    delay that uses one of them up.  Of a stable closed loop.
    """
    with mpmath.workdps(dps):
        re, im = _product(num, den, dt)
        D, N = _squared(den, dt), _squared(num, dt)
        factors = []
        for x in [*_on_axis(roots(im), dt), *_ends(dt)]:
            value = _ratio(re, D, x)
            # |CG| above 1e12 at an end is an integrator whose floats do not sum to 0
            if value is not None and -1e12 < value < 0:
                factors.append((float(-1 / value), _frequency(x, dt)))
        factors = sorted(set(factors))
        phases = []
        for x in _on_axis(roots(_add(N, D, -1)), dt):
            w = _frequency(x, dt)
            if w == 0:
                continue
            s = _point(x, dt)
            at = horner(exact(num), s) / horner(exact(den), s)
            phases.append((float(mpmath.arg(-at)), w))
    above = [f for f in factors if f[0] > 1]
    below = [f for f in factors if f[0] < 1]
    gain, w_gain = min(above, default=(np.inf, np.nan))
    gain_low, w_gain_low = max(below, default=(0.0, np.nan))
    phase, w_phase = min(phases, key=lambda p: abs(p[0]), default=(np.inf, np.nan))
    delay = min((np.mod(p, 2 * np.pi) / w for p, w in phases), default=np.inf)
    return SimpleNamespace(
        gain=gain,
        w_gain=w_gain,
        gain_low=gain_low,
        w_gain_low=w_gain_low,
        phase_deg=float(np.degrees(phase)),
        w_phase=w_phase,
        delay=float(delay),
        factors=[f for f, _ in factors],
        w_factors=[w for _, w in factors],
        phases_deg=[float(np.degrees(p)) for p, _ in phases],
        w_phases=[w for _, w in phases],
    )


def with_control(num, den, dt=None):
    """Return python-control's gain, phase, their frequencies, and Ms = 1/(distance to -1)."""
    import control

    sys = control.TransferFunction(num, den) if dt is None else control.tf(num, den, dt)
    gm, pm, sm, wpc, wgc, _ = control.stability_margins(sys)
    return SimpleNamespace(gain=gm, phase_deg=pm, Ms=1 / sm, w_gain=wpc, w_phase=wgc)


# -- loops for tests -------------------------------------------------------------------


def random_loop(seed, zeta=(1e-6, 0.5), modes=2, tries=200):
    """Return nG, dG, nC, dC of a stable loop with narrow resonances, the same for one seed.

    K/((T1 s + 1)(T2 s + 1)) plus `modes` terms r w^2/(s^2 + 2 zeta w s + w^2), whose height at
    resonance r/(2 zeta) is 0.05 to 3 times K; PI, or PID with a lag on D.  Gains are halved
    until the closed loop is stable.
    """
    rng = np.random.default_rng(seed)
    for _ in range(tries):
        K = rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 1)
        T1, T2 = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(-2, 0)
        num, den = np.array([K]), np.polymul([T1, 1.0], [T2, 1.0])
        for _ in range(modes):
            w, z = 10 ** rng.uniform(-0.5, 2), np.exp(rng.uniform(*np.log(zeta)))
            r = K * 2 * z * 10 ** rng.uniform(-1.3, 0.5) * rng.choice([-1, 1])
            mode = [1.0, 2 * z * w, w**2]
            num = np.polyadd(np.polymul(num, mode), r * w**2 * den)
            den = np.polymul(den, mode)
        Kp = 10 ** rng.uniform(-1, 1) / K
        Ti, Td = T1 * 10 ** rng.uniform(-0.5, 0.5), rng.choice([0.0, T2])
        Tf = 0.1 * Td
        # Kp (1 + 1/(Ti s) + Td s/(Tf s + 1))
        dC = np.polymul([Ti, 0.0], [Tf, 1.0]) if Td else np.array([Ti, 0.0])
        nC = np.array([Ti * (Tf + Td), Ti + Tf, 1.0]) if Td else np.array([Ti, 1.0])
        for halves in range(8):
            if stable(num, den, Kp / 2**halves * nC, dC):
                return num, den, Kp / 2**halves * nC, dC
    raise RuntimeError("no stable loop found")


def sampled(nG, dG, nC, dC, Ts):
    """Return the loop with the plant held (ZOH) and the controller by backward differences.

    The plant's polynomials and the controller's, both in z, highest power first.
    """
    nP, dP, _ = signal.cont2discrete((nG, dG), Ts, method="zoh")
    # s = (z - 1)/(Ts z)
    n = max(len(nC), len(dC)) - 1

    def backward(p):
        out = np.zeros(1)
        for k, c in enumerate(np.asarray(p)[::-1]):
            term = np.array([c / Ts**k])
            for _ in range(k):
                term = np.polymul(term, [1.0, -1.0])
            out = np.polyadd(out, np.polymul(term, [1.0] + [0.0] * (n - k)))
        return out

    return np.trim_zeros(nP[0], "f"), dP, backward(nC), backward(dC)


# -- polynomials in x = w^2, or x = 2 - 2 cos(w dt) --------------------------------------


def _squared(p, dt):
    return _product(p, p, dt)[0]


def _product(n, d, dt):
    """Return Re and Im of n conj(d) on the axis as polynomials in x.

    Im without its factor w, or sin(w dt): the ends of the axis, where it is 0, are added
    by hand.
    """
    n, d = exact(n), exact(d)
    if dt is None:
        even_n, odd_n = _halves(n)
        even_d, odd_d = _halves(d)
        x = [mpmath.mpf(1), mpmath.mpf(0)]
        re = _add(_mul(even_n, even_d), _mul(x, _mul(odd_n, odd_d)))
        im = _add(_mul(odd_n, even_d), _mul(even_n, odd_d), -1)
        return re, im
    m = max(len(n), len(d))
    n, d = n[::-1] + [mpmath.mpf(0)] * (m - len(n)), d[::-1] + [mpmath.mpf(0)] * (m - len(d))
    # n(z) d(1/z) = sum_k r_k z^k
    r = {
        k: mpmath.fsum(n[i] * d[i - k] for i in range(m) if 0 <= i - k < m) for k in range(1 - m, m)
    }
    re, im = [r[0]], [mpmath.mpf(0)]
    first, second = _cosines(m)
    for k in range(1, m):
        re = _add(re, [v * (r[k] + r[-k]) for v in first[k]])
        im = _add(im, [v * (r[k] - r[-k]) for v in second[k - 1]])
    return re, im


def _halves(p):
    """Return e, o of p(jw) = e(w^2) + j w o(w^2), highest power first."""
    p = p[::-1]
    even = [c * (-1) ** i for i, c in enumerate(p[::2])][::-1]
    odd = [c * (-1) ** i for i, c in enumerate(p[1::2])][::-1]
    return even or [mpmath.mpf(0)], odd or [mpmath.mpf(0)]


def _cosines(m):
    """Return cos(k theta) and sin((k + 1) theta)/sin(theta) as polynomials in x."""
    first, second = [[1], [mpmath.mpf(-0.5), 1]], [[1], [-1, 2]]
    for rows in (first, second):
        while len(rows) < m:
            rows.append(_add(_mul([-1, 2], rows[-1]), rows[-2], -1))  # 2 cos = 2 - x
    return first, second


def _add(a, b, factor=1):
    n = max(len(a), len(b))
    a, b = [0] * (n - len(a)) + list(a), [0] * (n - len(b)) + list(b)
    return [x + factor * y for x, y in zip(a, b, strict=True)]


def _mul(a, b):
    out = [mpmath.mpf(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            out[i + j] += x * y
    return out


def _derived(p):
    n = len(p) - 1
    return [c * (n - k) for k, c in enumerate(p[:-1])] or [mpmath.mpf(0)]


def _on_axis(z, dt):
    """Return the real roots that are a frequency: x > 0, sampled also x < 4."""
    eps = mpmath.mpf(10) ** (-mpmath.mp.dps // 2)
    x = [mpmath.re(v) for v in z if abs(mpmath.im(v)) <= eps * abs(v)]
    return [v for v in x if v > 0 and (dt is None or v < 4)]


def _ends(dt):
    return [mpmath.mpf(0), mpmath.inf if dt is None else mpmath.mpf(4)]


def _ratio(N, D, x):
    """Return N(x)/D(x), also at infinity; inf at a pole, None where both vanish."""
    if x == mpmath.inf:
        N, D = _led(N), _led(D)
        if len(N) != len(D):
            return mpmath.mpf(0) if len(N) < len(D) else mpmath.inf * mpmath.sign(N[0] / D[0])
        return N[0] / D[0]
    n, d = horner(N, x), horner(D, x)
    small = mpmath.mpf(10) ** (-mpmath.mp.dps // 2)
    zero_n, zero_d = (
        abs(v) <= small * horner([abs(c) for c in p], abs(x)) for v, p in ((n, N), (d, D))
    )
    if zero_d:
        return None if zero_n else mpmath.inf
    return n / d


def _led(p):
    k = next((i for i, c in enumerate(p) if c != 0), len(p) - 1)
    return p[k:]


def _frequency(x, dt):
    root = mpmath.sqrt(x)
    return float(root if dt is None else 2 * mpmath.asin(root / 2) / dt)


def _point(x, dt):
    root = mpmath.sqrt(x)
    return mpmath.mpc(0, root) if dt is None else mpmath.expj(2 * mpmath.asin(root / 2))
