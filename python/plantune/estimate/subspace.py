"""Subspace identification of models by states."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, NamedTuple

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import whole
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.record import Record

Method = Literal["moesp", "n4sid", "cva"]
Variant = Literal["simulation", "states", "combined"]


class _Options(NamedTuple):
    """What the core reads."""

    rows: int
    method: str
    variant: str
    stable: bool
    direct: bool
    offset: bool


def subspace(
    rec: Record,
    n: int | Literal["auto"] = "auto",
    *,
    rows: int = 15,
    method: Method = "moesp",
    variant: Variant = "simulation",
    stable: bool = True,
    direct: bool = True,
    offset: bool = True,
    limits: Limits | None = None,
) -> Fit:
    """Fit x(t+1) = A x + B u + K e, y = C x + D u + e + O without iterations.

    Parameters
    ----------
    rec : Record
        Of any number of inputs and outputs; segments and `valid` are honoured.
    n : int or "auto"
        Number of states, >= 1; "auto" takes from 1 to 10 the one with the least BIC of the
        simulation, correlated errors counted by how many are independent.
    rows : int
        Block rows of past and future: more than `n/ny`, and enough to see the slowest dynamics.
        A short record gets fewer, which a note says.
    method : "moesp", "n4sid" or "cva"
        Weight of the block whose singular values show the order.
    variant : "simulation", "states" or "combined"
        Where `B` and `D` come from: the least squares fit of the simulated output; states made of
        the past, from which `A` and `C` are taken too, for records whose disturbance drifts; or
        projected states, SLICOT's combination.
    stable : bool
        Whether poles outside the unit circle are reflected into it, which a note counts.
    direct : bool
        Whether `y(t)` may follow `u(t)` at once; without, `D = 0`.
    offset : bool
        Whether the constants of all signals are taken out, and come back as `O` in `y = G u + O`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `model` a `StateSpace` with the Kalman gain `K`; `offset` (ny,); `x0` (segments, n);
        `singular_values`, in units of y with one output, else of outputs scaled to unit
        variance.  `theta`, `P` and `sd` are empty, since the entries of `A B C D` have no meaning
        of their own: `subspace_bands` gives the bands of step, frequency response and gain.

    Raises
    ------
    NotIdentifiable
        An input stands still (X01) or supports fewer states (X02); too short a record (X03);
        inputs that copy each other (X11).
    UsageError
        A number or word out of its range (U01).

    Notes
    -----
    In a closed loop all three methods are biased: `pbsid`.  Verhaegen 1994; Van Overschee and
    De Moor 1996, chapter 4; Larimore 1990.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.subspace(pt.datasets.hair_dryer(), 4)
    >>> print(fit.model.poles().round(2))
    [0.47+0.21j 0.47-0.21j 0.76+0.j   0.95+0.j  ]

    SLICOT's printed example, IB01AD and IB01BD:

    >>> rec = pt.datasets.hair_dryer()
    >>> slicot = pt.estimate.subspace(rec, 4, rows=15, variant="combined", offset=False)
    >>> slicot.singular_values[:6].round(4)
    array([69.8841, 14.9963,  3.6675,  1.9677,  0.3   ,  0.2078])
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    order = None if n == "auto" else whole("n", n)
    options = _Options(whole("rows", rows), method, variant, stable, direct, offset)
    d, tried = _core.subspace(rec, order, options, limits)
    chosen = (_choice(tried),) if order is None else ()
    fit = fit_from_core(d, method.upper(), rec, limits, chosen)
    return replace(fit, settings=options._asdict())


def options_of(fit: Fit) -> Any:
    """Return how a subspace fit was asked for, as the core reads it."""
    if set(fit.settings) != set(_Options._fields):
        raise refusal(
            "U01", f"`fit` is of {fit.method}", remedy="give a fit of pt.estimate.subspace"
        )
    return _Options(**fit.settings)


def pbsid(
    rec: Record,
    n: int,
    *,
    past: int = 20,
    future: int = 12,
    direct: bool = False,
    offset: bool = True,
    limits: Limits | None = None,
) -> Fit:
    """Fit x(t+1) = A x + B u + K e, y = C x + D u + e + O on a record of a closed loop.

    Parameters
    ----------
    rec : Record
        Of any number of inputs and outputs; segments and `valid` are honoured.
    n : int
        Number of states, 1 to `future` times the outputs.
    past : int
        Lags of the predictor: it has to forget its start within them.
    future : int
        Block rows of the observability matrix, 1 to `past`.
    direct : bool
        Whether `y(t)` may follow `u(t)` at once; not in a loop without a delay.
    offset : bool
        Whether the constants of all signals are taken out, and come back as `O` in `y = G u + O`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        As of `subspace`; the poles stay where they are, for a plant in a loop may be unstable.

    Raises
    ------
    NotIdentifiable
        An input stands still (X01); too short a record (X03); inputs that copy each other (X11).
    UsageError
        A number out of its range (U01).

    Notes
    -----
    The loop needs an excitation of its own, set-point moves or a dither.  Chiuso, Automatica 43,
    2007; METHODS 2.3.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.pbsid(pt.datasets.engine_loop(noise_var=1.5), 2, past=10, future=6)
    >>> fit.model.n, fit.method
    (2, 'PBSID')
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    blocks = (whole("past", past), whole("future", future))
    d = _core.pbsid(rec, whole("n", n), blocks, (direct, offset), limits)
    return fit_from_core(d, "PBSID", rec, limits)


def _choice(tried: list[tuple[int, float, float]]) -> Note:
    """Return which order was chosen, and what came next."""
    ranked = sorted(tried, key=lambda row: row[2])
    if not ranked:
        raise refusal("X02", "no order is left to try", remedy="record with more excitation")
    best, others = ranked[0], ranked[1:]
    next_best = f"; next {others[0][0]}, {others[0][2] - best[2]:.3g} worse" if others else ""
    return Note(
        code="V14",
        severity="info",
        text=f"{best[0]} states of 1 to {len(tried)} have the least BIC{next_best}",
        count=len(tried),
    )
