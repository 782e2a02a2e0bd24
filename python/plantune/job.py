"""The main job: a record becomes a validated model, settings with margins, and a loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from plantune import _core
from plantune.analyze import DelayScan, Health, delay, health
from plantune.errors import NotIdentifiable, from_note, refusal
from plantune.estimate import Fit, arx, process
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Record
from plantune.simulate import Response, step
from plantune.tune import Tuning, imc_pi
from plantune.validate import Verdict, check

# Rows below which a half cannot carry the smallest models.
_LEAST_ROWS = 24


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What the main job returns: every value on the way from the record to the loop.

    Attributes
    ----------
    title : str
        What the record is called.
    record : Record
        What went in.
    findings : mapping
        `health`: what is wrong with the record; `delay`: the delay scan.
    fits, verdicts : mapping
        `ARX` and `P1D`, fitted on one part of the record and judged on the other.
    chosen : Fit
        The process model on all rows, its standard deviations widened where the judge saw more.
    tunings, responses : tuple
        Settings, and the response of each loop to a unit step of the set point.
    notes : tuple of Note
        Doubts about the run as a whole.
    truth : mapping or None
        True values of simulated records.

    Examples
    --------
    >>> import plantune as pt
    >>> run = pt.job.run(pt.datasets.hair_dryer())
    >>> run.findings["delay"].nk, {name: round(v.fit) for name, v in run.verdicts.items()}
    (3, {'ARX': 92, 'P1D': 87})
    >>> run.tunings[0].rule
    'IMC-PI, gain_margin = 3'
    """

    title: str
    record: Record
    findings: Mapping[str, Any]
    fits: Mapping[str, Fit]
    verdicts: Mapping[str, Verdict]
    chosen: Fit
    tunings: tuple[Tuning, ...]
    responses: tuple[Response, ...]
    notes: tuple[Note, ...]
    truth: Mapping[str, float] | None = None

    def all_notes(self) -> tuple[Note, ...]:
        """Return the notes of the run and of every value in it, each once.

        Examples
        --------
        >>> import plantune as pt
        >>> run = pt.job.run(pt.datasets.engine_loop(noise_var=1.5))
        >>> [note.code for note in run.all_notes() if note.code.startswith("D")]
        []
        """
        parts: list[Any] = [
            self.record,
            self,
            *self.findings.values(),
            *self.fits.values(),
            *self.verdicts.values(),
            self.chosen,
            *self.tunings,
        ]
        return tuple(dict.fromkeys(note for part in parts for note in part.notes))


def run(
    rec: Record,
    *,
    gain_margin: float = 3.0,
    title: str = "",
    truth: Mapping[str, float] | None = None,
    limits: Limits | None = None,
) -> Run:
    """Take a record to a validated model and a tuned loop.

    A record that `analyze.health` finds wrong is refused.  The delay is scanned, ARX and a process
    model are fitted on the first half and judged on the second; the process model is fitted again
    on all rows, tuned by IMC-PI, and the loop is simulated.  The ARX model is the judge: where it
    simulates clearly better, or needs another delay, the process model's intervals are widened
    and a note says so.

    Parameters
    ----------
    rec : Record
        One input, one output.
    gain_margin : float
        Asked of the loop, as a factor.
    title : str
        What the record is called.
    truth : mapping, optional
        True `K T L offset` of a simulated record.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Run
        With the notes of every stage.

    Raises
    ------
    DataError
        An output stands still (D18), or a column holds codes for missing values (D19).
    NotIdentifiable
        The record cannot support a model; says why and what to record instead.

    Examples
    --------
    >>> import plantune as pt
    >>> run = pt.job.run(pt.datasets.engine_loop())
    >>> print(run.tunings[0].controller)
    PI: Kp = -0.131451, Ti = 0.1491 s
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    if rec.nu != 1 or rec.ny != 1:
        raise refusal(
            "U01",
            f"the main job takes one input and one output, the record has {rec.nu} and {rec.ny}",
            remedy="choose one of each: read(path, u=..., y=...)",
        )
    if rec.N < _LEAST_ROWS:
        raise refusal(
            "X03",
            f"{rec.N} rows are too few to fit one half and judge on the other",
            count=rec.N,
            measured=rec.N,
            limit=_LEAST_ROWS,
            remedy="record longer",
        )
    found = _healthy(rec, limits)
    est, val, notes = _parts(rec, limits)
    scan = _scan(est, limits)
    fits = {"ARX": _arx(est, scan, limits), "P1D": _process(est, rec, limits)}
    verdicts = {name: check(val, fit, limits=limits) for name, fit in fits.items()}
    chosen = _chosen(rec, fits, verdicts, limits, refit=val is not est)
    tuning = imc_pi(chosen, gain_margin=gain_margin, delay_at_least=rec.Ts, limits=limits)
    return Run(
        title=title or f"{rec.u_names[0]} to {rec.y_names[0]}",
        record=rec,
        findings={"health": found, "delay": scan},
        fits=fits,
        verdicts=verdicts,
        chosen=chosen,
        tunings=(tuning,),
        responses=(step(tuning.model, tuning.controller),),
        notes=notes,
        truth=truth,
    )


def _healthy(rec: Record, limits: Limits) -> Health:
    """Look at the record; refuse what forbids a model."""
    found = health(rec, limits)
    for note in found.notes:
        if note.severity == "error":
            raise from_note(note, found)
    return found


def _parts(rec: Record, limits: Limits) -> tuple[Record, Record, tuple[Note, ...]]:
    """Two halves; or the whole record twice, with a note, where one half moves no input."""
    est, val = rec.split(0.5)
    if all(_core.input_moves(part, limits) for part in (est, val)):
        return est, val, ()
    note = Note(
        code="M11",
        severity="warning",
        text="not validated: the input moves in one half of the record only, "
        "so no fresh part is left",
        remedy="record a second step, up and down, to judge the model on",
    )
    return rec, rec, (note,)


def _scan(rec: Record, limits: Limits) -> DelayScan:
    """Scan delays, over a wider range as long as the best lies at its end."""
    most = max(1, min(200, rec.N // 4))
    high = min(20, most)
    while high < most:
        try:
            scan = delay(rec, (0, high), limits=limits)
            if scan.nk < high:
                return scan
        except NotIdentifiable as error:
            if error.code != "X04":
                raise
        high = min(2 * high, most)
    return delay(rec, (0, most), limits=limits)


def _arx(rec: Record, scan: DelayScan, limits: Limits) -> Fit:
    """ARX of the scanned order, or of the highest lower one that the record supports."""
    for order in range(scan.order, 0, -1):
        try:
            return arx(rec, order, order, scan.nk, limits=limits)
        except NotIdentifiable:
            if order == 1:
                raise
    raise AssertionError("orders start at 1")


def _process(est: Record, rec: Record, limits: Limits) -> Fit:
    """Process model of one part; where it finds no relation the whole record may know the cause."""
    try:
        return process(est, "P1D", limits=limits)
    except NotIdentifiable as error:
        if error.code == "X04" and est is not rec:
            process(rec, "P1D", limits=limits)
        raise


def _chosen(
    rec: Record,
    fits: Mapping[str, Fit],
    verdicts: Mapping[str, Verdict],
    limits: Limits,
    *,
    refit: bool,
) -> Fit:
    """Fit the process model to all rows, and widen it by what the judge says."""
    fit = process(rec, "P1D", limits=limits) if refit else fits["P1D"]
    factor, found = _core.judge(
        verdicts["P1D"],
        verdicts["ARX"],
        (float(fit.theta[2]), float(fit.sd[2]), rec.Ts),
        fits["ARX"].model.nk,  # type: ignore[union-attr]
        limits,
    )
    notes = notes_from_core(found)
    P, sd = _core.widened(np.ascontiguousarray(fit.P).reshape(-1), len(fit.theta), factor)
    return replace(fit, P=P.reshape(fit.P.shape), sd=sd, notes=(*fit.notes, *notes))
