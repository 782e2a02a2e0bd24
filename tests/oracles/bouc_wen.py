"""Bouc-Wen hysteresis: of a displacement, and inside an oscillator; by an adaptive integrator.

    z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu)
    displacement:  dz/dx = alpha - beta (gamma sgn(z dx) + delta) |z|^nu; for nu = 1 exponentials
                   on every stretch where x runs one way and z keeps its sign
    oscillator:    m y'' + c y' + k y + z = u
    benchmark:     m = 2, c = 10, k = 5e4, alpha = 5e4, beta = 1e3, gamma = 0.8, delta = -1.1,
                   nu = 1; integrated at 15 kHz, kept at 750 Hz

Wen, J. Eng. Mech. Div. 102, 1976; Noel & Schoukens, Hysteretic benchmark with a dynamic
nonlinearity, 2016; METHODS 4.
"""

import itertools
from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import resample

BENCHMARK = SimpleNamespace(
    m=2.0, c=10.0, k=5e4, alpha=5e4, beta=1e3, gamma=0.8, delta=-1.1, nu=1.0
)


def rate(p, v, z):
    """Return z'."""
    size = abs(z) ** (p.nu - 1)
    return p.alpha * v - p.beta * (p.gamma * abs(v) * size * z + p.delta * v * size * abs(z))


def of_displacement(x, p, z0=0.0):
    """Return z at every x, the input straight between samples and x(-1) = x(0)."""
    z, out = z0, [z0]
    for a, b in itertools.pairwise(x):
        if a != b:
            way = np.sign(b - a)

            def slope(_, s, way=way):
                return [rate(p, way, s[0])]

            z = solve_ivp(slope, (0, abs(b - a)), [z], "DOP853", rtol=1e-12, atol=1e-14).y[0, -1]
        out.append(z)
    return np.array(out)


def exponentials(x, p, z0=0.0):
    """Return the same for nu = 1 in closed form."""
    z, out = z0, [z0]
    for a, b in itertools.pairwise(x):
        way, left = np.sign(b - a), abs(b - a)
        while left > 0:
            sign = np.sign(z) if z != 0 else way  # from 0 the force follows the motion
            q = p.beta * (p.gamma * sign + p.delta * way)  # dz/ds = way alpha - q sign z
            q = q * sign
            rest = way * p.alpha / q if q != 0 else np.inf
            after = rest + (z - rest) * np.exp(-q * left) if q != 0 else z + way * p.alpha * left
            if after * sign >= 0:
                z, left = after, 0.0
            else:
                crossing = -np.log(rest / (rest - z)) / q if q != 0 else abs(z) / p.alpha
                z, left = 0.0, left - crossing
        out.append(z)
    return np.array(out)


def limit(p):
    """Return the force at which z no longer grows: (alpha/(beta (gamma + delta)))^(1/nu)."""
    return (p.alpha / (p.beta * (p.gamma + p.delta))) ** (1 / p.nu)


def oscillator(t, u, p, start=(0.0, 0.0, 0.0), rtol=1e-10):
    """Return y, y', z at the times t; u is a function of time."""

    def slope(at, s):
        y, v, z = s
        return [v, (u(at) - p.c * v - p.k * y - z) / p.m, rate(p, v, z)]

    step = t[1] - t[0]
    found = solve_ivp(
        slope, (t[0], t[-1]), start, "DOP853", t, rtol=rtol, atol=1e-14, max_step=step / 2
    )
    return found.y


def periodic(u, Ts):
    """Return u(t) as the trigonometric polynomial through one period of samples."""
    c = np.fft.rfft(u) / len(u)
    keep = np.flatnonzero(abs(c) > 1e-14 * abs(c).max())
    w, c = 2 * np.pi * keep / (len(u) * Ts), c[keep] * np.where(keep == 0, 1, 2)
    return lambda t: float((c * np.exp(1j * w * t)).real.sum())


def newmark(u, Ts, p, oversample, start=(0.0, 0.0, 0.0), periodic_input=True):
    """Return y by the average-acceleration rule of Newmark and the midpoint rule for z.

    u is resampled as a trigonometric polynomial (or straight between samples), each step solved
    by fixed-point iteration to 1e-13.
    """
    h, N = Ts / oversample, len(u)
    fine = (
        resample(u, N * oversample)
        if periodic_input
        else np.interp(np.arange(N * oversample) / oversample, np.arange(N), u)
    )
    y, v, z = start
    a = (fine[0] - p.c * v - p.k * y - z) / p.m
    out = [y]
    for n in range(1, (N - 1) * oversample + 1):
        a1, z1 = a, z
        for _ in range(60):
            v1 = v + h / 2 * (a + a1)
            y1 = y + h * v + h * h / 4 * (a + a1)
            z1 = z + h * rate(p, (v + v1) / 2, (z + z1) / 2)
            a2 = (fine[n] - p.c * v1 - p.k * y1 - z1) / p.m
            done = abs(a2 - a1) <= 1e-13 * (1 + abs(a2))
            a1 = a2
            if done:
                break
        y, v, a, z = y1, v1, a1, z1
        if n % oversample == 0:
            out.append(y)
    return np.array(out)
