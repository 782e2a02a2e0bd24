"""From a record to the models that are trusted, and on to the loop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from plantune import _core
from plantune.analyze import DelayScan, Health, delay, health
from plantune.errors import NotIdentifiable, PlantuneError, from_note, refusal
from plantune.estimate import Fit, candidates
from plantune.estimate.candidates import is_sound
from plantune.job.outcome import Run
from plantune.job.refusals import check_action, check_plant
from plantune.job.settings import process_for_settings, tuned
from plantune.models import PolyModel, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note, note_of
from plantune.prep import exclude
from plantune.prep.exclude import Ends
from plantune.record import Record
from plantune.text import column
from plantune.validate import Verdict, closed_loop, compare, plausible, trust
from plantune.validate.expected import Range, expected_columns
from plantune.validate.second_lag import second_lag
from plantune.validate.time_varying import ORDER, look, sure

# Rows below which a half cannot carry the smallest models.
_LEAST_ROWS = 24


def run(
    rec: Record,
    *,
    gain_margin: float = 3.0,
    given: Mapping[str, ProcessModel | PolyModel] | None = None,
    u_limits: Ends | None = None,
    action: Literal["direct", "reverse"] | None = None,
    expected: Mapping[str, Range] | None = None,
    title: str = "",
    truth: Mapping[str, float] | None = None,
    limits: Limits | None = None,
) -> Run:
    """Take a record to a validated model and a tuned loop.

    A record that `analyze.health` finds wrong is refused; rows on which an output is stuck, or the
    input lies at a known limit, are left out, with a note (`prep.exclude`).  The delay is scanned;
    ARX, OE, ARMAX and P1D are fitted on the first half and judged on the second, and P2D as well
    where the data ask for a second lag (V15); a note says which is trusted and why, by the rule of
    `validate.trust`.  The process model is fitted again on all rows and tuned by IMC-PI (on two
    lags by the half rule), beside which other rules are compared.  The trusted polynomial model, or
    else the one of the best simulation, is the judge: where it simulates clearly better, or needs
    another delay, the process model's intervals are widened and a note says so; in closed loop also
    where feedback moved its gain or time constant (V11).  A plant that changed within the record is
    named with the time of the change (M07).

    Parameters
    ----------
    rec : Record
        One input, one output.
    gain_margin : float
        Asked of the loop, as a factor.
    given : mapping of str to model, optional
        Models of an earlier study, judged on the same rows as the others.
    u_limits : (low, high), optional
        Ends of the actuator's travel, where the record holds the command and not what the plant
        got.
    action : "direct" or "reverse", optional
        How the controller of the loop acts: in reverse, its output falls as the measurement rises,
        for plants of positive gain.  A gain of the other sign is refused before any tuning (X12).
    expected : mapping of str to (low, high), optional
        What the engineer knows of columns, by name, and of `K`, `T`, `L`; a note says what departs
        by more than a factor of 50 (N03), as units mixed up do.
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
        The record cannot support a model; says why and what to record instead.  Or first order
        plus dead time does not serve the plant while a polynomial model does (M12), or the gain has
        not the sign that `action` serves (X12): the run without tunings is then in `.result`.

    Notes
    -----
    A refusal carries in `.notes` what was found before it and may be its cause, such as a stretch
    on which the output stands still (D18).

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
    found: list[Note] = [*rec.notes]
    try:
        known = Known(u_limits, action, expected or {})
        return _job(rec, known, gain_margin, given or {}, title, truth, limits, found)
    except PlantuneError as error:
        error.notes = dict.fromkeys(note for note in found if note != note_of(error))
        raise


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a loop beside its record: see `run`."""

    u_limits: Ends | None = None
    action: Literal["direct", "reverse"] | None = None
    expected: Mapping[str, Range] = field(default_factory=dict)


def _job(
    rec: Record,
    known: Known,
    gain_margin: float,
    given: Mapping[str, ProcessModel | PolyModel],
    title: str,
    truth: Mapping[str, float] | None,
    limits: Limits,
    found: list[Note],
) -> Run:
    """Do the main job, and add to `found` what a refusal further on may come from."""
    healthy = _healthy(rec, limits, found)
    rec = exclude(rec, u_limits=known.u_limits, limits=limits)
    found += (note for note in rec.notes if note not in found)
    est, val, notes = _parts(rec, limits)
    notes = (*expected_columns(rec, known.expected, limits), *notes)
    found += notes
    scan = _scan(est, limits)
    found += scan.notes
    fits, left_out = candidates(est, scan.order, scan.nk, limits=limits)
    earlier = _earlier(given, fits)
    judged = compare(val, *fits.values(), *earlier.values(), names=[*fits, *earlier], limits=limits)
    verdicts = {row.name: row for row in judged.rows}
    own = {name: verdicts[name] for name in fits}
    in_loop = _in_closed_loop(rec, scan.nk, limits)
    lags: tuple[Note, ...] = ()
    if not in_loop:  # there a richer model simulates better for its bias
        fits, own, lags = _with_second_lag(est, val, fits, own, limits)
    best = trust(fits, own, closed_loop=in_loop, limits=limits)
    widening = min(verdict.widening for verdict in own.values())
    changes = sure(look(rec, [scan.nk], ORDER, limits), widening)
    verdicts = {**own, **{name: verdicts[name] for name in earlier}}
    identified = Run(
        title=title or f"{column(rec.u_names[0])} to {column(rec.y_names[0])}",
        record=rec,
        findings={"health": healthy, "delay": scan},
        fits=fits,
        verdicts={name: _without(verdict, changes) for name, verdict in verdicts.items()},
        trusted=best.name,
        chosen=fits[best.name],
        comparison=None,
        tunings=(),
        responses=(),
        notes=(*notes, best.note, *lags, *changes, *left_out),
        truth=truth,
    )
    check_plant(identified, est, val, limits)
    chosen = process_for_settings(identified, limits, refit=val is not est, closed_loop=in_loop)
    odd = [n for n in plausible(chosen, expected=known.expected, limits=limits) if n.code == "N03"]
    identified = replace(identified, chosen=chosen, notes=(*identified.notes, *odd))
    check_action(identified, known.action)
    return tuned(identified, gain_margin, limits)


def _healthy(rec: Record, limits: Limits, found: list[Note]) -> Health:
    """Look at the record; refuse what forbids a model."""
    seen = health(rec, limits)
    found += seen.notes
    for note in seen.notes:
        if note.severity == "error":
            raise from_note(note, seen)
    return seen


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
    """Scan delays, over a wider range as long as the best lies at its end.

    In closed loop u(t) holds e(t) by way of the controller, and nk = 0 would explain it by itself.
    """
    low = int(rec.r is not None)
    most = max(1, min(200, rec.N // 4))
    high = min(20, most)
    while high < most:
        try:
            scan = delay(rec, (low, high), limits=limits)
            if scan.nk < high:
                return scan
        except NotIdentifiable as error:
            if error.code != "X04":
                raise
        high = min(2 * high, most)
    return delay(rec, (low, most), limits=limits)


def _earlier(
    given: Mapping[str, ProcessModel | PolyModel], fits: Mapping[str, Fit]
) -> Mapping[str, ProcessModel | PolyModel]:
    """Return the given models; refuse what is none, and a name that is taken."""
    for name, model in given.items():
        if not isinstance(model, ProcessModel | PolyModel):
            raise refusal(
                "U01",
                f"`given` holds a {type(model).__name__} as {name!r}, must hold models",
                remedy='given={"earlier": ProcessModel(K=2.0, T=5.0, L=1.0)}',
            )
        if name in fits:
            raise refusal("U01", f"`given` holds the name {name!r} of a fit", remedy="rename it")
    return given


def _with_second_lag(
    est: Record, val: Record, fits: Mapping[str, Fit], own: Mapping[str, Verdict], limits: Limits
) -> tuple[dict[str, Fit], dict[str, Verdict], tuple[Note, ...]]:
    """Add P2D to the fits and verdicts where the data ask for it."""
    poly = [own[name].fit for name in fits if name != "P1D" and is_sound(fits[name])]
    if "P1D" not in fits or not poly:
        return dict(fits), dict(own), ()
    found = second_lag(est, val, fits["P1D"], own["P1D"], max(poly), limits)
    if found is None:
        return dict(fits), dict(own), ()
    fit, verdict, note = found
    return {**fits, "P2D": fit}, {**own, "P2D": verdict}, (note,)


def _without(verdict: Verdict, changes: tuple[Note, ...]) -> Verdict:
    """Return the verdict without M07 of its rows where the whole record says it."""
    kept = tuple(note for note in verdict.notes if not changes or note.code != "M07")
    return replace(verdict, notes=kept)


def _in_closed_loop(rec: Record, nk: int, limits: Limits) -> bool:
    """Whether there is a set point, or the input follows errors of the output."""
    return rec.r is not None or bool(closed_loop(rec, direct=nk == 0, limits=limits))
