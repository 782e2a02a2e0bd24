"""C99 without allocation, without the library: a structure, how it starts, and its step."""

from __future__ import annotations

from plantune.errors import refusal
from plantune.estimate import Fit
from plantune.export.c_hysteresis import hysteresis
from plantune.export.c_text import array, declared, double, function, text
from plantune.export.subject import (
    Controller,
    Plant,
    estimator_about,
    named,
    subject_of,
)
from plantune.models import PID, PolyModel, ProcessModel, TransferFunction
from plantune.models.hysteresis.base import HysteresisModel
from plantune.recursive import RLS
from plantune.tune import Tuning


def c_source(
    what: Tuning | PID | Fit | ProcessModel | TransferFunction | PolyModel | RLS | HysteresisModel,
    Ts: float | None = None,
    *,
    u_min: float | None = None,
    u_max: float | None = None,
    prefix: str | None = None,
    u_unit: str = "",
    y_unit: str = "",
) -> str:
    r"""Return C99 source: a controller, a plant, an estimator, or a hysteresis.

    The file stands alone: it includes nothing, allocates nothing and keeps its state in a structure
    of the caller's.  Compile it; where its functions are called, include it with
    `PREFIX_DECLARATIONS` defined, which leaves the declarations only.

    A controller is `init(s, y, u)`, in equilibrium at `y` with the output `u`; `step(s, r, y)`; and
    `manual(s, r, y, u)`, after which `step` goes on without a bump.  It does exactly what
    `simulate.closed_loop` simulates with a sampled one.  While `r` or `y` is not finite the output
    holds.  A plant is `init(s)`, at rest, and `step(s, u)`, which returns what is measured at the
    next sample (at the same one where `nk = 0`).  An estimator is `init(s)`, which starts where the
    estimator given stands, and `update(s, phi, y)`, which returns the prior prediction error; a
    sample that is not finite is not learnt.  A model of hysteresis, or its inverse, is `init(s)`,
    in the virgin state, and `step(s, x)`, which returns `y`; it holds while `x` is not finite.

    Parameters
    ----------
    what : Tuning, PID, Fit, ProcessModel, TransferFunction, PolyModel, RLS or model of hysteresis
        A controller, a plant of one input, an estimator; or a `SeriesSlip`, `PlayStack`,
        `AsymmetricStack`, `AsymmetricInverse` or `MaxwellSlip`.
    Ts : float, optional
        Sample time, seconds; needed where `what` has none of its own.
    u_min, u_max : float, optional
        Both or neither: range of the controller's output, in its units.
    prefix : str, optional
        Of every name; `pid`, `plant`, `rls` or such as `series_slip` by default.
    u_unit, y_unit : str
        Units, for the comments.

    Returns
    -------
    str
        ASCII, without a warning under `-std=c99 -Wall -Wextra -pedantic`.  Its head states
        settings, units, plant, margins at this sample time, doubts and the fingerprint of the
        record.

    Raises
    ------
    UsageError
        Without a sample time or with another one than the model's, a range that is none, a
        prefix that is none, more than one input (U01).
    RunError
        A tuning whose loop is unstable at this sample time (C07).

    Examples
    --------
    >>> import plantune as pt
    >>> text = c_source(pt.models.PID(Kp=1.25, Ti=5.0), Ts=0.1)
    >>> print(text[text.index("double pid_step(pid_state *s, double r, double y)\n{"):])
    double pid_step(pid_state *s, double r, double y)
    {
        if (!(r - r == 0.0 && y - y == 0.0))
            return s->u; /* not a reading: the output holds */
        const double rest = pid_rest(s, r, y);
        s->I += pid_Ki * pid_Ts * (r - y);
        s->u = rest + s->I;
        return s->u;
    }
    ...
    """
    if isinstance(what, RLS | HysteresisModel):
        if Ts is not None or u_min is not None or u_max is not None:
            kind = "an estimator" if isinstance(what, RLS) else "a hysteresis"
            raise refusal("U01", f"{kind} has neither Ts nor limits of u", remedy="leave them out")
        if isinstance(what, RLS):
            return text(_estimator(_plain(what), named(prefix, "rls")))
        return text(hysteresis(what, named(prefix, what.kind), (u_unit, y_unit)))
    subject = subject_of(what, Ts, u_min, u_max, (u_unit, y_unit))
    if isinstance(subject, Controller):
        return text(_controller(subject, named(prefix, "pid")))
    return text(_plant(subject, named(prefix, "plant")))


def _controller(c: Controller, p: str) -> list[str]:
    """`u = P + D + I`, in manual and in automatic."""
    derivative = c.pid.Td > 0
    state = {"double I;": "integral, in units of u"}
    state |= {"double x;": "c r - y, filtered"} if derivative else {}
    state |= {"double u;": "last output"}
    init = f"void {p}_init({p}_state *s, double y, double u)"
    step = f"double {p}_step({p}_state *s, double r, double y)"
    manual = f"double {p}_manual({p}_state *s, double r, double y, double u)"
    functions = {
        init: "in equilibrium at r = y",
        step: "automatic; returns u",
        manual: "manual; step goes on from u",
    }
    finite = "r - r == 0.0 && y - y == 0.0"
    return [
        *declared(p, c.about, state, functions),
        *(f"static const double {p}_{k} = {double(v)};" for k, v in c.constants.items()),
        "",
        *_rest(p, derivative),
        "",
        *function(
            init,
            *([f"s->x = ({p}_c - 1.0) * y;"] if derivative else []),
            f"s->I = u - {p}_Kp * ({p}_b - 1.0) * y;",
            "s->u = u;",
        ),
        "",
        *function(
            step,
            f"if (!({finite}))",
            "    return s->u; /* not a reading: the output holds */",
            f"const double rest = {p}_rest(s, r, y);",
            *_integrated(p, limited=c.u_min is not None),
            "return s->u;",
        ),
        "",
        *function(
            manual,
            "s->u = u;",
            f"if ({finite})",
            f"    s->I = u - {p}_rest(s, r, y);",
            "return u;",
        ),
    ]


def _rest(p: str, derivative: bool) -> list[str]:
    """`P + D`, and the filter of D goes on."""
    P = f"{p}_Kp * ({p}_b * r - y)"
    if not derivative:
        said = "/* P: what is not the integral. */"
        head = f"static double {p}_rest(const {p}_state *s, double r, double y)"
        return [said, *function(head, "(void)s;", f"return {P};")]
    return [
        "/* P + D: what is not the integral. */",
        *function(
            f"static double {p}_rest({p}_state *s, double r, double y)",
            f"const double off = {p}_c * r - y - s->x;",
            f"s->x += {p}_Ts / ({p}_Tf + {p}_Ts) * off;",
            f"return {P} + {p}_Kp * {p}_Td / ({p}_Tf + {p}_Ts) * off;",
        ),
    ]


def _integrated(p: str, limited: bool) -> list[str]:
    """`I <- I + Ki Ts (r - y)` and `u = rest + I`, within its limits."""
    if not limited:
        return [f"s->I += {p}_Ki * {p}_Ts * (r - y);", "s->u = rest + s->I;"]
    return [
        f"const double more = {p}_Ki * {p}_Ts * (r - y);",
        "double u = rest + (s->I + more);",
        f"if ((u > {p}_u_max && more > 0.0) || (u < {p}_u_min && more < 0.0))",
        "    u = rest + s->I; /* driven further out: the integral waits */",
        "else",
        "    s->I += more;",
        f"s->u = u > {p}_u_max ? {p}_u_max : u < {p}_u_min ? {p}_u_min : u;",
    ]


def _plant(plant: Plant, p: str) -> list[str]:
    """`x` behind `B`, `F` and `A`, then `y = x + offset`."""
    B, A, F = plant.model.B.tolist(), plant.model.A.tolist()[1:], plant.model.F.tolist()[1:]
    past = {name: n for name, n in (("w", len(F)), ("x", len(A))) if n}
    kept, first = plant.kept, plant.terms[0][1]
    state = {f"double u[{kept}];": "a ring of inputs, the newest at k", "int k;": ""}
    state |= {f"double {name}[{n}];": "past, the newest first" for name, n in past.items()}
    arrays = {"B": B, "F": F, "A": A}
    init, step = f"void {p}_init({p}_state *s)", f"double {p}_step({p}_state *s, double u)"
    functions = {
        init: "at rest",
        step: f"returns y of {'the next' if plant.ahead else 'this'} sample",
    }
    return [
        *declared(p, plant.about, state, functions),
        *(array(f"{p}_{name}", values) for name, values in arrays.items() if values),
        "",
        *function(
            init,
            *(line for name, n in {"u": kept, **past}.items() for line in _zero(name, n)),
            "s->k = 0;",
        ),
        "",
        *function(
            step,
            "double w = 0.0;",
            f"s->k = (s->k + 1) % {kept};",
            "s->u[s->k] = u;",
            f"for (int j = 0; j < {len(B)}; j++)",
            f"    w += {p}_B[j] * s->u[(s->k + {kept - first} - j) % {kept}];",
            *(_divided("w", "w", f"{p}_F", len(F)) if F else []),
            *(_divided("w", "x", f"{p}_A", len(A)) if A else []),
            f"return w + {double(plant.offset)};" if plant.offset else "return w;",
        ),
    ]


def _zero(array: str, n: int) -> list[str]:
    return [f"for (int i = 0; i < {n}; i++)", f"    s->{array}[i] = 0.0;"]


def _divided(now: str, past: str, coefficients: str, n: int) -> list[str]:
    """`now <- now - sum c_i past(i)`, then the past moves on."""
    moved = [f"for (int i = {n - 1}; i > 0; i--)", f"    s->{past}[i] = s->{past}[i - 1];"]
    return [
        f"for (int i = 0; i < {n}; i++)",
        f"    {now} -= {coefficients}[i] * s->{past}[i];",
        *(moved if n > 1 else []),
        f"s->{past}[0] = {now};",
    ]


def _estimator(rls: RLS, p: str) -> list[str]:
    """Bierman's update of `P = U D U'`, as in the core."""
    n, (U, D) = rls.n, rls.factors
    above = [float(U[i, j]) for j in range(n) for i in range(j)]
    starts = {"theta": rls.theta.tolist(), "U": above, "D": D.tolist()}
    state = {
        f"double theta[{n}];": "parameters",
        f"double U[{max(1, len(above))}];": "above the diagonal, column by column",
        f"double D[{n}];": "P = U D U'",
        f"double f[{n}], b[{n}];": "U' phi, P phi",
    }
    init = f"void {p}_init({p}_state *s)"
    update = f"double {p}_update({p}_state *s, const double *phi, double y)"
    functions = {init: "", update: f"phi[{n}]; returns y - phi' theta before the update"}
    return [
        *declared(p, estimator_about(rls), state, functions),
        f"static const double {p}_lambda = {double(rls.lam)};",
        f"static const double {p}_D_most = {double(rls.D_most)};",
        *(array(f"{p}_{name}0", values) for name, values in starts.items() if values),
        "",
        *function(init, *_started(p, n, len(above))),
        "",
        *function(update, *_predicted(p, n), *_learnt(p, n)),
    ]


def _plain(rls: RLS) -> RLS:
    """Return an estimator that forgets in the plain way; refuse any other."""
    if rls.forgetting != "exponential" or rls.lam0 != rls.lam or rls.clip is not None:
        raise refusal(
            "U01",
            "only an estimator with one forgetting factor, and without a clip, is written in C",
            remedy="leave lam0, clip and forgetting out",
        )
    return rls


def _started(p: str, n: int, above: int) -> list[str]:
    """`theta`, `U` and `D` as they are now."""
    U = [f"for (int i = 0; i < {above}; i++)", f"    s->U[i] = {p}_U0[i];"]
    return [
        f"for (int i = 0; i < {n}; i++) {{",
        f"    s->theta[i] = {p}_theta0[i];",
        f"    s->D[i] = {p}_D0[i];",
        "    s->f[i] = s->b[i] = 0.0;",
        "}",
        *(U if above else ["s->U[0] = 0.0;"]),
    ]


def _predicted(p: str, n: int) -> list[str]:
    """`f = U' phi` and `eps = y - phi' theta`; what is not finite changes nothing."""
    return [
        f"double eps = y, alpha = {p}_lambda, inverse = 1.0 / {p}_lambda;",
        f"for (int j = 0, column = 0; j < {n}; column += j, j++) {{ /* f = U' phi */",
        "    double f = 0.0;",
        "    for (int i = 0; i < j; i++)",
        "        f += s->U[column + i] * phi[i];",
        "    s->f[j] = phi[j] + f;",
        "    alpha += s->f[j] * s->f[j] * s->D[j];",
        "    eps -= phi[j] * s->theta[j];",
        "}",
        "if (!(eps - eps == 0.0 && alpha - alpha == 0.0))",
        "    return eps; /* not a sample: nothing is learnt */",
    ]


def _learnt(p: str, n: int) -> list[str]:
    """`U`, `D` and `b = P phi` column by column, then `theta`."""
    return [
        f"alpha = {p}_lambda;",
        f"for (int j = 0, column = 0; j < {n}; column += j, j++) {{",
        "    const double before = alpha, slope = -s->f[j] * inverse, g = s->D[j] * s->f[j];",
        "    alpha += s->f[j] * g;",
        "    inverse = 1.0 / alpha;",
        f"    s->D[j] = s->D[j] * (before * inverse) / {p}_lambda;",
        f"    if (s->D[j] > {p}_D_most)",
        f"        s->D[j] = {p}_D_most;",
        "    for (int i = 0; i < j; i++) {",
        "        const double old = s->U[column + i];",
        "        s->U[column + i] += s->b[i] * slope;",
        "        s->b[i] += old * g;",
        "    }",
        "    s->b[j] = g;",
        "}",
        f"for (int i = 0; i < {n}; i++)",
        "    s->theta[i] += s->b[i] * inverse * eps;",
        "return eps;",
    ]
