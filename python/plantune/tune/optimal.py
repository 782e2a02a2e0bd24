"""The controller of least error that keeps given limits, also over the model's uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit
from plantune.models import PID, ProcessModel
from plantune.models.base import LinearModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.tune.judge import check_fit, judged, with_delay
from plantune.tune.tuning import Tuning


@dataclass(frozen=True, slots=True)
class Wish:
    """What `optimal` is asked for, as the core reads it."""

    Ms: float
    Mt: float
    noise_gain: float
    answer: str
    controller: str
    filter: str
    Ts: float | None
    share: float


def optimal(
    model: LinearModel | Fit | Sequence[Fit],
    *,
    Ms: float = 1.6,
    Mt: float = inf,
    noise_gain: float = inf,
    answer: str = "load",
    controller: str = "PI",
    filter: str = "d1",
    Ts: float | None = None,
    share: float = 0.95,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return the PI or PID of least integrated absolute error with `max |S| <= Ms`.

    Parameters
    ----------
    model : ProcessModel, TransferFunction, PolyModel, Fit or sequence of Fit
        A model is taken as it is.  With a fit the limits hold on the `share` of the models that
        the data leave open, drawn from its covariance, delay included.  Fits of one record with
        different delays are weighed by their likelihood.
    Ms, Mt : float
        Largest sensitivity and complementary sensitivity, above 1.
    noise_gain : float
        Largest gain from measurement noise to u, u/y.
    answer : "load", "set_point" or "both"
        The unit step that is answered best: at the plant input, of the set point, or the mean of
        both, each measured by the least that it could be alone.
    controller : "PI" or "PID"
        A PID has `Tf = Td / 10`, or with a `noise_gain` the filter that is best.
    filter : "d1" or "y2"
        First order on D, or second order on y.
    Ts : float, optional
        Sample time of a sampled controller, seconds; that of a polynomial model by default.
    share : float
        Share of the models, from 0.5 to 1, on which the limits hold.
    delay_at_least : float
        Seconds of dead time that a process model has at least; see `imc_pi`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Tuning
        `cost` is the IAE (or, for "both", the mean of the ratios) on the model itself; bands are
        those over the uncertainty.  A note says what the uncertainty costs, and how many more
        seconds of record would bring it down (T04).

    Raises
    ------
    UsageError
        A limit out of its range (U01).
    NotIdentifiable
        The sign of the gain is open (X12); no controller keeps the limits over the uncertainty
        (X13), with the seconds of record that would do; a plant that needs no limit, or keeps
        none (M12).

    Notes
    -----
    Found by a simplex over the shape of the controller, whose largest gain that keeps the limits
    follows from a quadratic at each frequency.  The optimum is flat: integral gain alone, as in
    `Ki` maximised, would cost error.  Garpinger and Hagglund 2008; Grimholt and Skogestad 2012.

    Examples
    --------
    >>> from plantune.models import ProcessModel
    >>> engine = ProcessModel(K=-5.939, T=0.1491, L=0.1)
    >>> tuning = optimal(engine, Ms=1.59)
    >>> print(tuning.controller)
    PI: Kp = -0.121, Ti = 0.142 s
    >>> round(tuning.margins.Ms, 2), round(tuning.cost, 2)
    (1.59, 1.17)
    """
    limits = limits or DEFAULT_LIMITS
    fits = _fits(model)
    plant: Any = fits[0].model if fits else model
    notes: tuple[Note, ...] = ()
    if isinstance(plant, ProcessModel):
        plant, notes = with_delay(plant, delay_at_least)
    if Ts is None:
        Ts = getattr(plant, "Ts", None)
    if not 0.5 <= share <= 1.0:
        raise refusal("U01", f"`share` is {share}, must lie in [0.5, 1]", remedy="share=0.95")
    wish = Wish(float(Ms), float(Mt), float(noise_gain), answer, controller, filter, Ts, share)
    rule = f"optimal {controller}, Ms = {Ms:g}"
    if not fits:
        settings, cost = _core.optimal(plant, wish)
        return judged(rule, model, plant, PID(**settings), cost=cost, notes=notes, limits=limits)
    for fit in fits:
        check_fit(fit, limits)
    settings, cost, kept, more = _core.optimal_over(
        [(plant, *fits[0].drawn_from[1:]), *(fit.drawn_from for fit in fits[1:])], wish, limits.T04
    )
    return judged(
        rule + f" on {100 * share:g} % of the models",
        fits if len(fits) > 1 else fits[0],
        plant,
        PID(**settings),
        cost=cost,
        notes=(*notes, *_dear(kept, more, limits)),
        limits=limits,
    )


def _fits(model: LinearModel | Fit | Sequence[Fit]) -> tuple[Fit, ...]:
    """Return the fits, the likeliest first; none of a bare model."""
    if isinstance(model, Fit):
        return (model,)
    if isinstance(model, LinearModel):
        return ()
    fits = tuple(model) if isinstance(model, Sequence) else ()
    if not fits or not all(isinstance(fit, Fit) for fit in fits):
        raise refusal(
            "U01",
            f"`model` is a {type(model).__name__}, must be a model, a Fit or several Fits",
            remedy="optimal(fit), or optimal([armax(rec, 1, 1, 1, nk) for nk in range(3, 9)])",
        )
    if len({fit.source for fit in fits}) > 1:
        raise refusal("U01", "the fits are of different records", remedy="fit them to one record")
    return tuple(sorted(fits, key=lambda fit: fit.loss))


def _dear(kept: float, more: float | None, limits: Limits) -> tuple[Note, ...]:
    """T04 where the uncertainty costs much of the integral gain."""
    if kept >= limits.T04:
        return ()
    text = f"the uncertainty leaves {100 * kept:.0f} % of the integral gain that the model allows"
    record = "record longer or with larger steps of the input"
    if more is not None:
        record = f"{more:.3g} s more of the same kind of record would leave {100 * limits.T04:g} %"
    return (
        Note(
            code="T04",
            severity="warning",
            text=text,
            measured=kept,
            limit=limits.T04,
            remedy=record,
        ),
    )
