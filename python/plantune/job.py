"""The main job: a record becomes a validated model, settings with margins, and a loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

from plantune import _core
from plantune.analyze import DelayScan, Health, delay, health
from plantune.errors import NotIdentifiable, PlantuneError, from_note, refusal
from plantune.estimate import Fit, candidates, process
from plantune.estimate.candidates import again, is_sound
from plantune.estimate.fit import flat, widened
from plantune.models import PolyModel, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note, note_of, notes_from_core
from plantune.prep import exclude
from plantune.prep.exclude import Ends
from plantune.record import Record
from plantune.simulate import Response
from plantune.text import column
from plantune.tune import Comparison, Tuning, imc_pi, imc_pid, optimal
from plantune.tune import compare as compare_rules
from plantune.tune.compare import DEFAULT_RULES, HIGHER_ORDER
from plantune.validate import Verdict, check, closed_loop, compare, plausible, trust
from plantune.validate.expected import Range, expected_columns
from plantune.validate.second_lag import second_lag
from plantune.validate.time_varying import ORDER, look, sure
from plantune.validate.trust import noise_holds

# Largest sensitivity of the optimum, on 95 % of the models that the record leaves open.
_MS = 1.6

# Share of a response below which it is a ramp, and deviations from which on a slope is sure.
_RAMP = 0.1
_SURE = 5.0

# Process models, the larger one last.
_PROCESS = ("P1D", "P2D")

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
        What went in, without the rows that were left out.
    findings : mapping
        `health`: what is wrong with the record; `delay`: the delay scan.
    fits, verdicts : mapping
        `ARX`, `OE`, `ARMAX` and `P1D` as far as the record supports them, and `P2D` where a second
        lag is needed, fitted on one part of it and judged on the other; models that were given are
        among the verdicts.
    trusted : str
        Name of the fit to trust; the note V10 says why.
    chosen : Fit
        The process model on all rows, its standard deviations widened where the judge saw more;
        where no process model serves the plant, the trusted model.
    comparison : Comparison or None
        The tuning rules side by side, the recommended one first.
    tunings, responses : tuple
        Its settings, and the response of each loop to a unit step of the set point.
    notes : tuple of Note
        Doubts about the run as a whole.
    truth : mapping or None
        True values of simulated records.

    Examples
    --------
    >>> import plantune as pt
    >>> run = pt.job.run(pt.datasets.hair_dryer())
    >>> run.findings["delay"].nk, {name: round(v.fit) for name, v in run.verdicts.items()}
    (3, {'ARX': 85, 'OE': 86, 'ARMAX': 86, 'P1D': 82, 'P2D': 86})
    >>> run.trusted, run.tunings[0].rule
    ('ARX', 'IMC-PI, gain_margin = 3')
    """

    title: str
    record: Record
    findings: Mapping[str, Any]
    fits: Mapping[str, Fit]
    verdicts: Mapping[str, Verdict]
    trusted: str
    chosen: Fit
    comparison: Comparison | None
    tunings: tuple[Tuning, ...]
    responses: tuple[Response, ...]
    notes: tuple[Note, ...]
    truth: Mapping[str, float] | None = None

    @property
    def relied(self) -> tuple[str, ...]:
        """Names of the models relied on: the trusted one, and the process model for tunings.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.job.run(pt.datasets.hair_dryer()).relied
        ('ARX', 'P2D')
        """
        return tuple(dict.fromkeys((self.trusted, self.chosen.method)))

    @property
    def process(self) -> str | None:
        """Name of the process model that is tuned on, `P2D` or `P1D`; None where none is known.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.job.run(pt.datasets.hair_dryer()).process
        'P2D'
        """
        return next((name for name in reversed(_PROCESS) if name in self.fits), None)

    @property
    def rival(self) -> str | None:
        """Name of the polynomial model that judges it: the trusted one, or the best simulation.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.job.run(pt.datasets.hair_dryer()).rival
        'ARX'
        """
        names = [name for name in self.fits if name not in _PROCESS]
        if self.trusted in names:
            return self.trusted
        sound = [n for n in names if is_sound(self.fits[n]) and not _is_unstable(self.verdicts[n])]
        return max(sound or names, key=lambda name: self.verdicts[name].fit, default=None)

    def all_notes(self) -> tuple[Note, ...]:
        """Return the notes of the run and of every value that its outcome relies on, each once.

        Doubts about models that are not relied on stay with their fits and verdicts, those about
        rules beside the recommended one in `comparison`.

        Examples
        --------
        >>> import plantune as pt
        >>> run = pt.job.run(pt.datasets.engine_loop(noise_var=1.5))
        >>> [note.code for note in run.all_notes() if note.code.startswith("D")]
        []
        """
        return tuple(dict.fromkeys(note for *_, part in self._parts() for note in part.notes))

    def named_notes(self) -> dict[Note, tuple[str, ...]]:
        """Return the same notes, the models that they speak of before the text, and their origins.

        Examples
        --------
        >>> import plantune as pt
        >>> run = pt.job.run(pt.datasets.hair_dryer())
        >>> for note, origins in run.named_notes().items():
        ...     print(note.code, note.text[:34], origins)
        V10 ARX is trusted: it simulates 495 r ('run',)
        V15 a second lag is needed: P2D simula ('run',)
        M08 P2D: residuals are not white: 19 l ('P2D judged',)
        V13 P2D: the level moved by 0.0982: wi ('P2D judged',)
        V05 P2D: standard deviations are widen ('P2D for the settings',)
        T05 settings are those for G(s) = 0.93 ('IMC-PI, gain margin = 3',)
        """
        found: dict[Note, list[tuple[str, str]]] = {}
        for origin, model, part in self._parts():
            for note in part.notes:
                found.setdefault(note, []).append((origin, model))
        named = {}
        for note, places in found.items():
            models = dict.fromkeys(model for _, model in places)
            text = note.text if "" in models else f"{', '.join(models)}: {note.text}"
            named[replace(note, text=text)] = tuple(origin for origin, _ in places)
        return named

    def _parts(self) -> list[tuple[str, str, Any]]:
        """List what the outcome relies on: its name, the model it speaks of or "", the value."""
        chosen = self.chosen.method
        return [
            ("record", "", self.record),
            ("run", "", self),
            *(
                ("delay scan" if name == "delay" else name, "", finding)
                for name, finding in self.findings.items()
            ),
            *((f"{name} fit", name, self.fits[name]) for name in self.relied),
            *((f"{name} judged", name, self.verdicts[name]) for name in self.relied),
            *([(f"{chosen} for the settings", chosen, self.chosen)] if self.tunings else []),
            *((tuning.rule.replace("_", " "), "", tuning) for tuning in self.tunings[:1]),
        ]


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
    _check_plant(identified, est, val, limits)
    chosen = _chosen(identified, limits, refit=val is not est, closed_loop=in_loop)
    odd = [n for n in plausible(chosen, expected=known.expected, limits=limits) if n.code == "N03"]
    identified = replace(identified, chosen=chosen, notes=(*identified.notes, *odd))
    _check_action(identified, known.action)
    return _tuned(identified, gain_margin, limits)


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


def _check_plant(run: Run, est: Record, val: Record, limits: Limits) -> None:
    """Refuse a plant that no process model serves, with the true cause."""
    process, rival = run.verdicts.get(run.process or ""), run.rival
    serves = process is not None and process.fit >= limits.V01
    _check_settles(run, serves=serves)
    if serves:
        return
    known = run.verdicts[rival].fit if rival is not None else 0.0
    if rival is not None:
        # From rest: an undamped model rings on from the start of a record it has no relation to.
        known = compare(val, run.fits[rival], x0="zero", limits=limits).rows[0].fit
    least = max(limits.V01, limits.V03 + (process.fit if process is not None else 0.0))
    if process is None:
        _raise_cause(est, run.record, limits, but="X04" if known >= least else "")
    if known < least:
        _check_stable(run)
    if rival is not None and known >= least:
        raise _other_plant(run, rival, limits)
    if process is not None and any(note.code == "X04" for note in process.notes):
        check(val, run.fits[run.process or "P1D"], limits=limits)


def _check_settles(run: Run, *, serves: bool) -> None:
    """Refuse a plant that integrates as far as the record shows (M01); `serves`: a process model simulates it.

    A lag of which the record shows less than a tenth is no lag to tune on; an output that drifts
    by itself, unrelated to the input, looks the same (X04).
    """
    if any(note.code == "X04" for note in run.findings["delay"].notes):
        return
    for name, fit in run.fits.items():
        shown = (n.measured for n in fit.notes if n.code == "X07" and n.measured is not None)
        ramp = any(share < _RAMP for share in shown)
        if (ramp and name == run.process) or (not serves and (ramp or _integrates(fit))):
            error = refusal(
                "M01",
                f"{name} finds the plant integrating, as far as the record shows: "
                "no steady-state gain, and rules for plants that settle do not apply",
                where=(run.record.u_names[0], None, None),
                remedy='estimate.process(rec, "P0DI") or "P1DI", and tune.simc; or record longer',
            )
            error.result = replace(run, notes=(note_of(error), *run.notes))
            raise error


def _integrates(fit: Fit) -> bool:
    """Whether a polynomial fit cannot be told from an integrator that clearly moves."""
    if all(note.code != "M01" for note in fit.notes):
        return False
    slope, sd = fit.derived()["slope"]
    return abs(slope) > _SURE * sd


def _check_stable(run: Run) -> None:
    """Refuse an unstable plant by its name (M02), where no stable model simulates it."""
    for name, verdict in run.verdicts.items():
        if name in run.fits and _is_unstable(verdict):
            (note,) = (note for note in verdict.notes if note.code == "M02")
            text = f"{name} finds the plant unstable; no rule for plants that settle serves it"
            error = from_note(replace(note, text=text))
            error.result = replace(run, notes=(note_of(error), *run.notes))
            raise error


def _is_unstable(verdict: Verdict) -> bool:
    """Whether the verdict is one step ahead, since the model cannot be simulated."""
    return any(note.code == "M02" for note in verdict.notes)


def _other_plant(run: Run, rival: str, limits: Limits) -> PlantuneError:
    """M12: a polynomial model knows the plant, first order plus dead time does not."""
    process, polynomial = run.verdicts.get("P1D"), run.verdicts[rival]
    own = f"with {process.fit:.0f} %" if process is not None else "not at all"
    resonance = run.fits[rival].model.resonance()
    if resonance is None:
        cause = "the plant is not of first order"
    else:
        at = f"{resonance[0]:.4g} rad/{run.record.time_unit}, damping {resonance[1]:.2g}"
        cause = f"the plant has a resonance at {at}"
    error = refusal(
        "M12",
        f"a polynomial model, {rival}, simulates {polynomial.N} rows with {polynomial.fit:.0f} %, "
        f"first order plus dead time {own}: {cause}; PI rules for first order do not apply",
        where=(run.record.y_names[0], None, None),
        count=polynomial.N,
        measured=process.fit if process is not None else 0.0,
        limit=limits.V01,
        remedy="take the polynomial model from the result, and design a controller of higher order",
    )
    error.result = replace(run, notes=(note_of(error), *run.notes))
    return error


def _raise_cause(est: Record, rec: Record, limits: Limits, *, but: str) -> None:
    """Raise why P1D was refused, `but` for one code; the whole record may know the cause."""
    try:
        process(est, "P1D", limits=limits)
    except NotIdentifiable as error:
        if error.code == but:
            return
        if error.code == "X04" and est is not rec:
            process(rec, "P1D", limits=limits)
        raise


def _chosen(run: Run, limits: Limits, *, refit: bool, closed_loop: bool) -> Fit:
    """Fit the process model to all rows, and widen it by what the judge says."""
    name = run.process or "P1D"
    fit = process(run.record, name, limits=limits) if refit else run.fits[name]
    rival, judge, feedback = run.rival, None, None
    if rival is not None:
        judge = (rival, run.verdicts[rival], run.fits[rival].model.nk)
    at = fit.names.index("L")
    delay = (float(fit.theta[at]), float(fit.sd[at]), run.record.Ts)
    if closed_loop and rival == run.trusted and noise_holds(run.fits[rival], run.verdicts[rival]):
        known = again(run.fits[rival], run.record, limits) if refit else run.fits[rival]
        feedback = ((fit.model, flat(fit)), (known.model, flat(known)))
    factor, found = _core.judge(run.verdicts[name], delay, judge, feedback, limits)
    fit = widened(fit, factor)
    return replace(fit, notes=(*fit.notes, *notes_from_core(found)))


def _check_action(run: Run, action: str | None) -> None:
    """Refuse a gain of the other sign than the loop was declared for."""
    if action is None:
        return
    try:
        _core.check_action(action, run.chosen.model.K)
    except NotIdentifiable as error:
        error.result = replace(run, notes=(note_of(error), *run.notes))
        raise


def _tuned(run: Run, gain_margin: float, limits: Limits) -> Run:
    """Tune by IMC-PI, which is recommended, and set the other rules beside it."""
    rules: tuple[Callable[..., Tuning], ...]
    if run.process == "P1D":
        rules = (partial(imc_pi, gain_margin=gain_margin), *DEFAULT_RULES[1:])
    else:
        first = partial(_on_two_lags, gain_margin=gain_margin)
        rules = (first, partial(imc_pid, gain_margin=gain_margin, N=10), *HIGHER_ORDER[2:])
    comparison = compare_rules(
        run.chosen,
        (*rules, partial(optimal, Ms=_MS)),
        delay_at_least=run.record.Ts,
        limits=limits,
    )
    return replace(
        run,
        comparison=comparison,
        tunings=tuple(row.tuning for row in comparison.rows),
        responses=tuple(row.set_point for row in comparison.rows),
    )


def _on_two_lags(model: Fit, *, gain_margin: float, **more: Any) -> Tuning:
    """IMC-PI with at least the gain margin asked for on the model itself.

    `Ti` is that of one lag, so the margin goes with `1/Kp`.  A larger one is kept: to spend it
    would cost phase margin, of which two lags leave less.
    """
    found = imc_pi(model, gain_margin=gain_margin, **more)
    if found.margins.gain >= gain_margin:
        return found
    wanted = gain_margin * gain_margin / found.margins.gain
    return replace(imc_pi(model, gain_margin=wanted, **more), rule=found.rule)
