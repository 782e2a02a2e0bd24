"""The 27 nonlinear problems of NIST StRD: formula, data, both starts, certified values.

Minimise sum (y - f(x, b))^2.  Starts, certified values, standard deviations, residual sum and
data are read from the files (shared data, nist_strd/nonlinear); the formulas stand here.
The Jacobian is the complex step Im f(x, b + ih)/h, exact to rounding (all f are analytic).
"""

import re
from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares

PI = np.pi


def gauss(b, x):
    """One falling exponential and two bells."""
    bells = b[2] * np.exp(-((x - b[3]) ** 2) / b[4] ** 2)
    return b[0] * np.exp(-b[1] * x) + bells + b[5] * np.exp(-((x - b[6]) ** 2) / b[7] ** 2)


def lanczos(b, x):
    return sum(b[i] * np.exp(-b[i + 1] * x) for i in (0, 2, 4))


def cubic_ratio(b, x):
    return (b[0] + x * (b[1] + x * (b[2] + x * b[3]))) / (1 + x * (b[4] + x * (b[5] + x * b[6])))


def enso(b, x):
    y = b[0] + b[1] * np.cos(PI * x / 6) + b[2] * np.sin(PI * x / 6)
    y = y + b[4] * np.cos(2 * PI * x / b[3]) + b[5] * np.sin(2 * PI * x / b[3])
    return y + b[7] * np.cos(2 * PI * x / b[6]) + b[8] * np.sin(2 * PI * x / b[6])


def power(base, exponent):
    """Return base^exponent; a negative base is no number, as in real arithmetic."""
    base = np.where(np.real(base) > 0, base, np.nan)
    return np.exp(exponent * np.log(base))


FORMULAS = {
    "Bennett5": lambda b, x: b[0] * power(b[1] + x, -1 / b[2]),
    "BoxBOD": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Chwirut1": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "Chwirut2": lambda b, x: np.exp(-b[0] * x) / (b[1] + b[2] * x),
    "DanWood": lambda b, x: b[0] * power(x, b[1]),
    "ENSO": enso,
    "Eckerle4": lambda b, x: b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Gauss1": gauss,
    "Gauss2": gauss,
    "Gauss3": gauss,
    "Hahn1": cubic_ratio,
    "Kirby2": lambda b, x: (b[0] + x * (b[1] + x * b[2])) / (1 + x * (b[3] + x * b[4])),
    "Lanczos1": lanczos,
    "Lanczos2": lanczos,
    "Lanczos3": lanczos,
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * np.exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Misra1a": lambda b, x: b[0] * (1 - np.exp(-b[1] * x)),
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - power(1 + 2 * b[1] * x, -0.5)),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Nelson": lambda b, x: b[0] - b[1] * x[:, 0] * np.exp(-b[2] * x[:, 1]),  # of log y
    "Rat42": lambda b, x: b[0] / (1 + np.exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] * power(1 + np.exp(b[1] - b[2] * x), -1 / b[3]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - np.arctan(b[2] / (x - b[3])) / PI,
    "Thurber": cubic_ratio,
}

NUMBER = r"([-+]?\d*\.?\d+(?:[EeDd][-+]?\d+)?)"


def read(folder, name):
    """Read one problem from `folder`/nonlinear/`name`.dat."""
    lines = (folder / "nonlinear" / f"{name}.dat").read_text().splitlines()
    table = [re.match(rf"\s*b\d+ =\s+{NUMBER}\s+{NUMBER}\s+{NUMBER}\s+{NUMBER}", s) for s in lines]
    table = np.array([[float(v) for v in m.groups()] for m in table if m])
    rss = next(float(s.split(":")[1]) for s in lines if s.startswith("Residual Sum of Squares"))
    first = max(i for i, s in enumerate(lines) if s.startswith("Data:")) + 1
    data = np.array([[float(v) for v in s.split()] for s in lines[first:] if s.strip()])
    y, x = data[:, 0], data[:, 1:]
    y, x = (np.log(y), x) if name == "Nelson" else (y, x[:, 0])
    return SimpleNamespace(
        name=name,
        f=FORMULAS[name],
        x=x,
        y=y,
        starts=(table[:, 0], table[:, 1]),
        certified=table[:, 2],
        sd=table[:, 3],
        rss=rss,
    )


def errors(problem, b):
    """Return y - f(x, b)."""
    with np.errstate(all="ignore"):
        return problem.y - problem.f(np.asarray(b, float), problem.x)


def jacobian(problem, b):
    """Return d(y - f)/db by the complex step."""
    J = np.empty((len(problem.y), len(b)))
    with np.errstate(all="ignore"):
        for i in range(len(b)):
            c = np.asarray(b, complex)
            c[i] += 1e-30j * max(abs(b[i]), 1e-30)
            J[:, i] = -np.imag(problem.f(c, problem.x)) / (1e-30 * max(abs(b[i]), 1e-30))
    return J


def cosine(problem, b):
    """Return the largest cosine between the errors and a column of the Jacobian."""
    eps, J = errors(problem, b), jacobian(problem, b)
    with np.errstate(all="ignore"):
        return float(np.max(np.abs(J.T @ eps) / np.linalg.norm(J, axis=0) / np.linalg.norm(eps)))


def digits(found, certified):
    """Return the log relative error of the worst parameter, at most 11 (what is certified)."""
    with np.errstate(all="ignore"):
        error = np.max(np.abs(np.asarray(found) - certified) / np.abs(certified))
    return float(min(11.0, -np.log10(max(error, 1e-16)))) if np.isfinite(error) else -np.inf


def scipy_fit(problem, start, method="lm", x_scale="jac"):
    """Minimise from one start by scipy; returns b, or None where the arithmetic ends."""
    tight = dict(xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=20000)
    scale = np.abs(start) if x_scale == "start" else x_scale

    def walled(b):  # where f is no number stands a high wall: the step is shortened
        eps = errors(problem, b)
        return np.where(np.isfinite(eps), eps, 1e100)

    try:
        with np.errstate(all="ignore"):
            return least_squares(
                walled, start, lambda b: jacobian(problem, b), method=method, x_scale=scale, **tight
            ).x
    except (ValueError, np.linalg.LinAlgError):
        return None
