"""Inverse digital transform of step responses: estimates of the input, and what follows from them.

A step response y(t) = K + sum_i d_i e^(p_i t) is taken back to K by (source 003, (5) to (8))

    X*[n] = prod_i (1 - z_i q^-1)/(1 - z_i) y[n],    z_i = e^(p_i h),

a product, one factor a root, m factors for a root of multiplicity m; a complex pair makes

    (1 - 2 c q^-1 + r^2 q^-2)/(1 - 2 c + r^2),   r = e^(-beta h),  c = r cos(Omega h).

h is the sample time dt, or `lag` samples.  The d_i stand for any initial state: a row counts only
when its whole history is measured, so none of them is ever needed.  The same estimates follow
from solving (4) at each n, with t^l e^(p t) for the repeats of a root.

With d(q) the product, normalised to d(1) = 1, the criterion (15), S = sum (K - X*)^2, is a
quadratic form in d, and with K unknown one in d and K: least squares with one linear constraint
gives its minimum, the roots of d(q) the p_i.  This is Prony's method (1795).

ERRATA 5 corrects (4), (9), (11), (13) and (14), which stand here as corrected.
"""

from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm, null_space

# -- step responses to try it on ------------------------------------------------------------


def polynomial(T):
    """Return prod (T_i s + 1), highest power first."""
    p = np.ones(1)
    for Ti in T:
        p = np.polymul(p, [Ti, 1.0])
    return p


def step_response(num, den, t, x0=None):
    """Return the response of num/den to a unit step at t = 0 from the state x0, 0 if not given.

    x = A^-1 (e^(At) - 1) B + e^(At) x0, y = C x + D, controllable form; repeated roots are no case.
    """
    den = np.asarray(den, float)
    k = len(den) - 1
    num = np.concatenate([np.zeros(k + 1 - len(num)), num]) / den[0]
    den = den / den[0]
    A = np.zeros((k, k))
    A[0], A[1:, :-1] = -den[1:], np.eye(k - 1)
    B = np.eye(k)[0]
    C, D = num[1:] - den[1:] * num[0], num[0]
    x0 = np.zeros(k) if x0 is None else np.asarray(x0, float)
    rest = -np.linalg.solve(A, B)
    return C @ rest + D + expm(np.asarray(t, float)[:, None, None] * A) @ (x0 - rest) @ C


# -- operators -------------------------------------------------------------------------------


def first(y, T, dt):
    """Return X*[n], n >= 1, by (5)."""
    z = np.exp(-dt / T)
    return (y[1:] - z * y[:-1]) / (1 - z)


def second(y, beta, Omega, dt):
    """Return X*[n], n >= 2, by (6) for the roots -beta +- j Omega."""
    r, c = np.exp(-beta * dt), np.cos(Omega * dt)
    return (y[2:] - 2 * r * c * y[1:-1] + r**2 * y[:-2]) / (1 - 2 * r * c + r**2)


def coefficients(poles, h):
    """Return d_0 ... d_J of the product of all operators, sum d = 1."""
    d = np.ones(1, complex)
    for p in poles:
        z = np.exp(p * h)
        d = np.convolve(d, [1 / (1 - z), -z / (1 - z)])
    return d.real


def cascade(y, poles, dt, lag=1):
    """Return X*[n] for n >= J lag: one first-order operator after the other, complex ones too."""
    x = np.asarray(y, complex)
    for p in poles:
        z = np.exp(p * dt * lag)
        x = (x[lag:] - z * x[:-lag]) / (1 - z)
    return x.real


def stream(y, poles, dt):
    """Yield X*[n] sample by sample, NaN until the history is whole; conjugate roots side by side.

    The memory is one sample for each first-order operator and two for a pair.
    """
    stages, i = [], 0
    while i < len(poles):
        pair = np.imag(poles[i]) != 0
        stages.append((coefficients(poles[i : i + 1 + pair], dt), []))
        i += 1 + pair
    for value in y:
        x = value
        for d, past in stages:
            past.insert(0, x)
            x = float(np.dot(d, past)) if len(past) == len(d) else np.nan
            del past[len(d) - 1 :]
            if np.isnan(x):
                break
        yield x


def by_equations(y, poles, dt):
    """Return X*[n], n >= k, by solving (4) at each n: k + 1 samples, k + 1 unknowns.

    Time runs from t_(n-k), which only scales the d_i.  Repeats of a root bring t e^(pt), ...
    """
    k = len(poles)
    t = np.arange(k + 1)  # in samples
    columns = [np.ones(k + 1, complex)]
    for i, p in enumerate(poles):
        columns.append(t ** list(poles[:i]).count(p) * np.exp(p * dt * t))
    M = np.column_stack(columns)
    return np.array([np.linalg.solve(M, y[n - k : n + 1])[0].real for n in range(k, len(y))])


def differentiated(y, T, dt):
    """Return X*[n] by backward differences: e^(-dt/T) cut to 1 - dt/T in each factor; section 3."""
    x = np.asarray(y, float)
    for Ti in T:
        x = Ti / dt * np.diff(x) + x[:-1]
    return x


def noise_gain(d):
    """Return sd(X*)/sd(y) for white noise on y."""
    return float(np.sqrt(np.sum(np.square(d))))


# -- what is left when the roots are wrong ------------------------------------------------------


def mismatch(b, T, T0, h, n):
    """Return X*[n] for 1 + sum b_i e^(-t/T_i) under operators of T0: (9) as corrected."""
    T, T0 = np.asarray(T, float), np.asarray(T0, float)
    z, z0 = np.exp(-h / T), np.exp(-h / T0)
    B = b * z ** -len(T0) * np.prod(z[:, None] - z0, axis=1) / np.prod(1 - z0)
    return 1 + np.exp(-np.outer(n, h / T)) @ B


def sum_of_second_order(delta, omega, beta, Omega, dt):
    """Return the sum over n of 1 - X*[n + 2] of an oscillating response: (14) as corrected."""
    A = np.hypot(omega, delta) / omega
    phi = np.arctan2(omega, delta)
    z = np.exp((-delta + 1j * omega) * dt)
    c, q = np.exp(-beta * dt) * np.cos(Omega * dt), np.exp(-2 * beta * dt)
    s0 = np.imag(np.exp(1j * phi) / (1 - z))
    s1 = s0 - np.sin(phi)
    first_term = 2 * s1 * (np.exp(-delta * dt) * np.cos(omega * dt) - c)
    return A / (1 - 2 * c + q) * (first_term + s0 * (q - np.exp(-2 * delta * dt)))


def criterion(y, poles, dt, K=1.0, lag=1):
    """Return S of (15) over the rows whose history is whole; the initial state is free."""
    return float(np.sum((K - cascade(y, poles, dt, lag)) ** 2))


def biased_root(rho, a):
    """Return the z that (15) tends to for one root rho of lag h under white noise; K known.

    min over z of [S0 (rho - z)^2 + N s^2 (1 + z^2)]/(1 - z)^2, a = N s^2/S0, S0 the sum of
    squares of the transient: z = (rho (1 - rho) - a)/(1 - rho + a).  From a = rho (1 - rho) on
    no time constant is left, z <= 0: with lag 1 that is a = dt/T.
    """
    return (rho * (1 - rho) - a) / (1 - rho + a)


# -- identification -------------------------------------------------------------------------


def rows(y, J, lag):
    """Return the rows [y[n], y[n - lag], ..., y[n - J lag]], n >= J lag."""
    N = len(y)
    return np.column_stack([y[(J - j) * lag : N - j * lag] for j in range(J + 1)])


def minimum(y, dt, J, lag=1, K=None):
    """Return the minimum of (15) over all operators of order J; K None: unknown too.

    min |Y d - K 1| with sum d = 1.  d = e_0 + Z a, the columns of Z spanning sum d = 0 by
    differences, so that nothing large cancels.  `poles` are ln(roots of d)/h; NaN where a root
    is 0 or negative, which no sampled exponential has.
    """
    Y = rows(np.asarray(y, float), J, lag)
    steps = np.diff(Y, axis=1)  # column j: y[n - (j+1) lag] - y[n - j lag]
    X = steps if K is not None else np.column_stack([steps, -np.ones(len(Y))])
    target = Y[:, 0] - (K if K is not None else 0.0)
    size = np.linalg.norm(X, axis=0)
    a = -np.linalg.lstsq(X / size, target, rcond=None)[0] / size
    d = np.zeros(J + 1)
    d[0] = 1
    d[1:] += a[:J]
    d[:-1] -= a[:J]
    z = np.roots(d).astype(complex)
    with np.errstate(divide="ignore"):
        poles = np.log(z) / (dt * lag)
    poles[(z.imag == 0) & (z.real <= 0)] = np.nan
    S = float(np.sum((target + X @ a) ** 2))
    return SimpleNamespace(d=d, z=z, poles=ordered(poles), K=K if K is not None else a[J], S=S)


def ordered(poles):
    """Return poles by rising time constant, conjugates side by side."""
    return poles[np.lexsort((poles.imag, np.abs(poles.imag), poles.real))]


def by_rising_order(y, dt, J_max, eps, lag=1, K=None):
    """Return the minimum of the least J whose mean square of K - X* is below eps^2, or None.

    eps in units of y.  Beyond the true order the extra roots are arbitrary: stop at the first.
    """
    for J in range(1, J_max + 1):
        found = minimum(y, dt, J, lag, K)
        n = len(y) - J * lag
        if found.S < n * eps**2 and np.all(np.isfinite(found.poles)):
            return found
    return None


def common_roots(y, dt, J, k, lag=1):
    """Return the k roots that every operator of order J > k that maps y to its K must have.

    The rows E = K - Y have rank k; the null space of E holds all these operators.  Its
    orthogonal complement, the row space, is spanned by [1, 1/z, 1/z^2, ...], whose shift
    has the roots as eigenvalues.  K is unknown: it is the root 1, left out at the end.
    """
    Y = rows(np.asarray(y, float), J, lag)
    V = np.linalg.svd(Y, full_matrices=False)[2][: k + 1].T
    z = 1 / np.linalg.eigvals(np.linalg.lstsq(V[:-1], V[1:], rcond=None)[0])
    z = np.delete(z, np.argmin(np.abs(z - 1))).astype(complex)
    return ordered(np.log(z) / (dt * lag))


# -- zeros ---------------------------------------------------------------------------------


def amplitudes(y, t, T, K=1.0):
    """Return b of y - K = sum b_i e^(-t/T_i) by least squares; T real and distinct."""
    return np.linalg.lstsq(np.exp(-np.outer(t, 1 / np.asarray(T))), y - K, rcond=None)[0]


def zeros(b, T, v):
    """Return the numerator prod (tau_i s + 1) of degree v, highest power first: (11) as corrected.

    N(-1/T_i) = -b_i prod_(l != i) (1 - T_l/T_i), N(0) = 1.  The plant was at rest at t = 0 and
    K is divided out.  v = k allows a jump at t = 0; v < k is least squares.
    """
    T = np.asarray(T, float)
    value = [
        -bi * np.prod(1 - np.delete(T, i) / Ti) for i, (bi, Ti) in enumerate(zip(b, T, strict=True))
    ]
    powers = (-1 / T)[:, None] ** np.arange(v, 0, -1)
    return np.append(np.linalg.lstsq(powers, np.array(value) - 1, rcond=None)[0], 1.0)


def null_operators(y, J, lag=1, K=1.0, tol=1e-9):
    """Return a basis of all d that take K - y to 0, sum d = 1 not yet asked for."""
    return null_space(K - rows(np.asarray(y, float), J, lag), rcond=tol)
