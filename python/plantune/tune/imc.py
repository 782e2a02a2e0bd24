"""IMC-PI tuning."""

from __future__ import annotations

from dataclasses import replace

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit
from plantune.models import PID, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note
from plantune.tune.bands import flat
from plantune.tune.margins import margins
from plantune.tune.tuning import Tuning

# Margins that every model inside the uncertainty must leave: 6 dB and 45 degrees.
_LEAST = (("gain", "gain margin", "", 2.0), ("phase_deg", "phase margin", " deg", 45.0))


def imc_pi(
    model: ProcessModel | Fit,
    *,
    gain_margin: float | None = None,
    phase_margin: float | None = None,
    tau_c: float | None = None,
    delay_at_least: float = 0.0,
    limits: Limits | None = None,
) -> Tuning:
    """Return Kp = T / (K (tau_c + L)), Ti = T for a first-order plant with dead time.

    Parameters
    ----------
    model : ProcessModel or Fit
        Of a fit the margins come with bands over its uncertainty.
    gain_margin : float
        As a factor, above pi/2; 3 is 9.54 dB and goes with a phase margin of 60 degrees.
    phase_margin : float
        Degrees, between 32.704 and 90.
    tau_c : float
        Closed-loop time constant, seconds, >= 0.
    delay_at_least : float
        Seconds of dead time that the loop has at least, such as the sample time of the controller;
        a shorter one of the model counts as this, and a note says so.
    limits : Limits, optional
        Threshold M09.

    Returns
    -------
    Tuning
        `Kp` has the sign of `K`.

    Raises
    ------
    UsageError
        Not exactly one wish, or one out of its range (U01).
    NotIdentifiable
        The model is none (M12), its uncertainty leaves the sign of the gain open (X12), or its
        record was sampled too slowly for its time constant (M09).

    Notes
    -----
    Source 001, (3.6-18) to (3.6-45).

    Examples
    --------
    >>> tuning = imc_pi(ProcessModel(K=-5.939, T=0.1491, L=0.1), gain_margin=3)
    >>> print(tuning.controller)
    PI: Kp = -0.131451, Ti = 0.1491 s
    >>> round(tuning.margins.phase_deg, 3)
    60.0
    """
    wishes = {"gain_margin": gain_margin, "phase_margin": phase_margin, "tau_c": tau_c}
    given = {name: float(value) for name, value in wishes.items() if value is not None}
    if len(given) != 1:
        raise refusal(
            "U01",
            f"{len(given)} of gain_margin, phase_margin and tau_c are given, must be one",
            remedy="imc_pi(model, gain_margin=3)",
        )
    ((name, value),) = given.items()
    fit = model if isinstance(model, Fit) else None
    plant = fit.model if fit else model
    if not isinstance(plant, ProcessModel):
        raise refusal("U01", "IMC-PI needs a process model", remedy='estimate.process(rec, "P1D")')
    plant, notes = _with_delay(plant, delay_at_least)
    Kp, Ti, tau = _core.imc_pi(plant, name, value)
    pid = PID(Kp=Kp, Ti=Ti)
    bands: dict[str, tuple[float, float]] = {}
    if fit:
        _check_sign(fit)
        _check_sampling(fit, limits or DEFAULT_LIMITS)
        names = ("gain", "phase_deg", "delay", "Ms", "Mt")
        bands = dict(zip(names, _core.margin_bands(plant, flat(fit), pid), strict=True))
        notes = (*notes, *_weak(bands))
    return Tuning(
        controller=pid,
        rule=f"IMC-PI, {name} = {value:g}",
        model=plant,
        margins=margins(plant, pid),
        bands=bands,
        tau_c=tau,
        notes=notes,
        source=fit.source if fit else "",
    )


def _with_delay(plant: ProcessModel, least: float) -> tuple[ProcessModel, tuple[Note, ...]]:
    if plant.L >= least:
        return plant, ()
    note = Note(
        code="T01",
        severity="warning",
        text=f"the model's dead time, {plant.L:.4g} s, counts as {least:.4g} s",
        measured=plant.L,
        limit=least,
        remedy="sample faster to resolve the dead time, or give tau_c",
    )
    return replace(plant, L=least), (note,)


def _weak(bands: dict[str, tuple[float, float]]) -> tuple[Note, ...]:
    """C07 where part of the model's uncertainty leaves too little margin."""
    return tuple(
        Note(
            code="C07",
            severity="warning",
            text=f"weak margins: the {word} may be as low as {bands[name][0]:.3g}{unit}",
            measured=bands[name][0],
            limit=least,
            remedy="do not apply unattended; ask for more margin, or record longer or larger steps",
        )
        for name, word, unit, least in _LEAST
        if bands[name][0] < least
    )


def _check_sampling(fit: Fit, limits: Limits) -> None:
    """M09: a time constant clearly below two sample times must not be tuned on."""
    if fit.Ts is not None:
        _core.check_sampling(float(fit.theta[1]), float(fit.sd[1]), fit.Ts, limits)


def _check_sign(fit: Fit) -> None:
    """X12: a gain whose interval contains zero must not be tuned on."""
    gain, sd = abs(float(fit.theta[0])), float(fit.sd[0])
    if gain < 2 * sd:
        raise refusal(
            "X12",
            f"the sign of the gain is open: K = {fit.theta[0]:.4g} ± {sd:.2g}",
            measured=gain,
            limit=2 * sd,
            remedy="record longer or with larger steps of the input",
        )
