"""First-order ARMAX and OE against scipy's Levenberg-Marquardt, SIPPY and statsmodels.

    y(t) + a y(t-1) = b u(t-1) + e(t) + c e(t-1)        y = B/F u + e,  F = 1 + f q^-1

All start from rest and estimate no offset.  scipy minimises the same sum of squares from the
same ARX estimate, with `lfilter` for the errors and for their analytic slopes, so its ratio is
one of like with like.  SIPPY keeps its own start and tolerances.  statsmodels has neither structure
ready: its Kalman filter and search get the models as state spaces, and the same ARX start.
"""

from functools import partial
from time import process_time

import numpy as np

import plantune as pt
from benches.frame import Bench, Contestant, Report

TOLERANCE = 1e-10
OPTIONS = dict(offset=False, x0="zero")
LATER = [0.0, 1.0]  # q^-1


def signals(N):
    rng = np.random.default_rng(1)
    return rng.standard_normal(N), 0.1 * rng.standard_normal(N)


def armax_data(N):
    u, e = signals(N)
    model = pt.models.PolyModel(A=[1.0, -0.8], B=[[0.5], [1.0, -0.5]], nk=[1, 0], Ts=1.0)
    return u, model.simulate(np.column_stack([u, e]))


def oe_data(N):
    u, e = signals(N)
    return u, pt.models.PolyModel(B=[0.5], F=[1.0, -0.8], nk=1, Ts=1.0).simulate(u) + e


def armax(N):
    u, y = armax_data(N)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    return lambda: pt.estimate.armax(rec, 1, 1, 1, **OPTIONS).theta


def oe(N):
    u, y = oe_data(N)
    rec = pt.Record(u=u, y=y, Ts=1.0)
    return lambda: pt.estimate.oe(rec, 1, 1, **OPTIONS).theta


# scipy ----------------------------------------------------------------------------------------


def armax_errors(u, y):
    """eps by [a, b, c], and its slopes given eps."""
    from scipy.signal import lfilter

    def eps(theta):
        a, b, c = theta
        return lfilter([1.0, a], [1.0, c], y) - lfilter([0.0, b], [1.0, c], u)

    def slopes(theta, eps):
        C = [1.0, theta[2]]
        return lfilter(LATER, C, y), -lfilter(LATER, C, u), -lfilter(LATER, C, eps)

    return eps, slopes


def oe_errors(u, y):
    """eps by [b, f], and its slopes given eps."""
    from scipy.signal import lfilter

    def eps(theta):
        b, f = theta
        return y - lfilter([0.0, b], [1.0, f], u)

    def slopes(theta, eps):
        F = [1.0, theta[1]]
        return -lfilter(LATER, F, u), lfilter(LATER, F, y - eps)

    return eps, slopes


def levenberg_marquardt(data, errors, start, N):
    from scipy.optimize import least_squares

    u, y = data(N)
    eps, slopes = errors(u, y)

    def job():
        past = np.column_stack([-y[:-1], u[:-1]])
        arx = np.linalg.lstsq(past, y[1:], rcond=None)[0]
        last = {}

        def residual(theta):
            last["eps"] = eps(theta)
            return last["eps"]

        def jacobian(theta):  # MINPACK asks for it only where it has just asked for the residual
            return np.array(slopes(theta, last["eps"])).T

        return least_squares(
            residual,
            start(*arx),
            jacobian,
            method="lm",
            x_scale="jac",
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            gtol=TOLERANCE,
        ).x

    return job


# SIPPY ----------------------------------------------------------------------------------------


def sippy_armax(method, N):
    from sippy_unipi import system_identification

    u, y = armax_data(N)

    def job():
        fit = system_identification(y, u, "ARMAX", ARMAX_orders=[1, 1, 1, 0], ARMAX_mod=method)
        return [fit.G.den[0][0][1], fit.G.num[0][0][-1], fit.H.num[0][0][1]]

    return job


def sippy_oe(N):
    from sippy_unipi import system_identification

    u, y = oe_data(N)

    def job():
        fit = system_identification(y, u, "OE", OE_orders=[1, 1, 0], OE_mod="OPT")
        return [fit.G.num[0][0][-1], fit.G.den[0][0][1]]

    return job


# statsmodels ----------------------------------------------------------------------------------


def state_space(data, order, N):
    """Maximum likelihood of x(t+1) = -f x + b u + (c - f) e, y = x + e; without c: OE."""
    from statsmodels.tsa.statespace.mlemodel import MLEModel

    u, y = data(N)
    is_pole = np.array([name in "fc" for name in order])

    class Model(MLEModel):
        def __init__(self, start):
            super().__init__(y, k_states=2, k_posdef=1)
            self._start = np.array(start)
            self.ssm.filter_concentrated = True  # the variance of e follows from the rest
            self["design"] = np.ones((1, 2))  # the states are x and e
            self["selection", 1, 0] = 1.0
            self["state_intercept"] = np.zeros((2, N))
            self["state_cov", 0, 0] = 1.0
            self.ssm.initialize_known(np.zeros(2), np.diag([0.0, 1.0]))

        start_params = property(lambda self: self._start)
        param_names = property(lambda self: list(order))

        def transform_params(self, free):  # f and c inside the unit circle
            return np.where(is_pole, np.tanh(free), free)

        def untransform_params(self, params):
            return np.where(is_pole, np.arctanh(params), params)

        def update(self, params, **options):
            p = dict(zip(self.param_names, super().update(params, **options), strict=True))
            self["transition"] = np.array([[-p["f"], p["c"] - p["f"] if "c" in p else 0.0], [0, 0]])
            self["state_intercept"] = np.vstack([p["b"] * u, np.zeros(N)])

    def job():
        past = np.column_stack([-y[:-1], u[:-1]])
        f, b = np.linalg.lstsq(past, y[1:], rcond=None)[0]
        first = {"f": f, "b": b, "c": 0.0}
        fit = Model([first[name] for name in order]).fit(disp=False, cov_type="none")
        return fit.params

    return job


ARMAX = ("plantune.estimate.armax", armax)
OE = ("plantune.estimate.oe", oe)
SIPPY_ARMAX = ("SIPPY, iterated least squares", partial(sippy_armax, "ILLS"))
SIPPY_OE = ("SIPPY, OPT", sippy_oe)
STATSMODELS_ARMAX = ("statsmodels, MLEModel", partial(state_space, armax_data, "fbc"))
STATSMODELS_OE = ("statsmodels, MLEModel", partial(state_space, oe_data, "bf"))


def scipy_lm(data, errors, start):
    return ("scipy least_squares, lm", partial(levenberg_marquardt, data, errors, start))


SCIPY_ARMAX = scipy_lm(armax_data, armax_errors, lambda a, b: [a, b, 0.0])
SCIPY_OE = scipy_lm(oe_data, oe_errors, lambda a, b: [b, a])


def bench(title, N, *contestants):
    def needs(name):
        peers = {"scipy": ("scipy",), "SIPPY,": ("sippy_unipi",), "statsmodels,": ("statsmodels",)}
        return peers.get(name.split()[0], ())

    return Bench(
        f"{title}, N = {N:.0e}",
        [Contestant(name, partial(setup, N), needs(name)) for name, setup in contestants],
    )


def once(ours, theirs):
    """One run of theirs: it takes so long that repeats say nothing more; of ours the second."""
    try:
        slow, job = theirs[1](10**5), ours[1](10**5)
        b = cpu_seconds(slow)
    except ImportError as missing:
        return [f"skipped: {missing}"]
    job()
    a = cpu_seconds(job)
    return [f"ours {a:.4f} s, {theirs[0]} {b:.1f} s: {b / a:.0f} times"]


def cpu_seconds(job):
    start = process_time()
    job()
    return process_time() - start


BENCHES = [
    bench("ARMAX 1, 1, 1", 10**3, ARMAX, SCIPY_ARMAX, SIPPY_ARMAX, STATSMODELS_ARMAX),
    bench("OE 1, 1", 10**3, OE, SCIPY_OE, SIPPY_OE, STATSMODELS_OE),
    bench("ARMAX 1, 1, 1", 10**5, ARMAX, SCIPY_ARMAX),
    bench("OE 1, 1", 10**5, OE, SCIPY_OE),
    # Without SIPPY's OE, which takes a minute and a half.
    Report("ARMAX 1, 1, 1, N = 1e+05, SIPPY once", partial(once, ARMAX, SIPPY_ARMAX)),
    Report("ARMAX 1, 1, 1, N = 1e+05, statsmodels once", partial(once, ARMAX, STATSMODELS_ARMAX)),
    Report("OE 1, 1, N = 1e+05, statsmodels once", partial(once, OE, STATSMODELS_OE)),
]
