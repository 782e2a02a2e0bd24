"""The sections of the page, in the order in which they are read."""

from __future__ import annotations

import platform
import re
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from plantune import plot
from plantune.models import ProcessModel
from plantune.plot.embed import embedded
from plantune.plot.style import Names, over
from plantune.report.text import escaped, table, unit_of, with_interval, with_sd
from plantune.text import number

if TYPE_CHECKING:
    from plantune.estimate import Fit
    from plantune.job import Run
    from plantune.notes import Note
    from plantune.tune import Tuning
    from plantune.validate import Verdict

_SECTIONS = {
    "notes": "What to know first",
    "settings": "Controller settings",
    "model": "Model",
    "figures": "Figures",
    "indices": "Indices of the closed loop",
    "provenance": "Where this comes from",
}


def head(run: Run) -> str:
    """Title, the outcome in a few sentences, and the numbers one came for."""
    verdict = _verdict(run)
    chip = ""
    if verdict is not None:
        word = "passes" if verdict else "does not pass"
        kind = "passes" if verdict and _fresh(run) else "fails"
        text = f"{verdict.name} {word} on {_where(run)}" + ", not validated" * (not _fresh(run))
        chip = f'<p><span class="verdict {kind}">{escaped(text)}</span></p>'
    links = "".join(f'<li><a href="#{name}">{text}</a></li>' for name, text in _SECTIONS.items())
    return f"""<header>
<p class="kicker">plantune report</p>
<h1>{escaped(run.title)}</h1>
{chip}
<p class="outcome">{escaped(outcome(run), 1200)}</p>
{_facts(run)}
<nav aria-label="Sections"><ul>{links}</ul></nav>
</header>"""


def outcome(run: Run) -> str:
    """Say model, verdict, settings and margins in one breath."""
    names, units = Names(run.record), _units(run)
    model = ", ".join(
        f"{name} = {with_sd(x, sd)}{unit_of(units.get(name, ''))}"
        for name, x, sd in zip(run.chosen.names, run.chosen.theta, run.chosen.sd, strict=True)
    )
    kind = "a first-order process with dead time" if _is_process(run.chosen) else "a linear model"
    text = f"{names.y} answers {names.u} as {kind}: {model} (± one standard deviation). "
    verdict = _verdict(run)
    if verdict is not None:
        word = "passes" if verdict else "does not pass; the notes say why"
        rows = "rows kept apart from the fit" if _fresh(run) else "rows that it was fitted on"
        text += f"On {verdict.N} {rows} its simulation fit is {verdict.fit:.1f} %: it {word}. "
    if run.tunings:
        first = run.tunings[0]
        pid, m, bands = first.controller, first.margins, first.bands
        text += (
            f"PI settings Kp = {number(pid.Kp)}{unit_of(names.control_unit)} and "
            f"Ti = {number(pid.Ti)} s leave a gain margin of "
            f"{with_interval(m.gain, bands.get('gain'))} and a phase margin of "
            f"{with_interval(m.phase_deg, bands.get('phase_deg'), unit='°')}"
        )
        text += "; 95 % intervals in brackets." if bands else "."
    else:
        text += "No settings are given; the notes say why."
    # A number stays with its name, its deviation and its unit.
    return re.sub(r" (?=[=±%°]|to )|(?<=[=±]) |(?<=\d) (?=s\b)", "\u00a0", text)


def notes(run: Run) -> str:
    """Doubts first, remarks after them, each with evidence and remedy."""
    found: dict[Note, list[str]] = {}
    for origin, part in _parts(run):
        for note in part.notes:
            found.setdefault(note, []).append(origin)
    ranked = sorted(found, key=lambda note: note.severity != "warning")
    if not ranked:
        return _section("notes", "<p>Nothing in the data leaves a doubt.</p>")
    items = "".join(_note(note, found[note]) for note in ranked)
    return _section("notes", f'<ul class="notes">{items}</ul>')


def settings(run: Run) -> str:
    """List settings and margins, one column per rule."""
    if not run.tunings:
        return _section("settings", "<p>None: the model does not carry a tuning.</p>")
    names = Names(run.record)
    unit, per_second = names.control_unit, over(names.control_unit, "s", "")
    rows: list[tuple[str, Any]] = [
        (f"Kp [{unit}]", lambda t: number(t.controller.Kp, 5)),
        ("Ti [s]", lambda t: number(t.controller.Ti, 5)),
        (f"Ki = Kp/Ti [{per_second}]", lambda t: number(t.controller.Ki, 5)),
        ("gain margin [factor]", lambda t: _margin(t, "gain")),
        ("gain margin [dB]", lambda t: number(t.margins.gain_db)),
        ("phase margin [°]", lambda t: _margin(t, "phase_deg")),
        ("delay margin [s]", lambda t: _margin(t, "delay")),
        ("Ms [1]", lambda t: _margin(t, "Ms")),
        ("Mt [1]", lambda t: _margin(t, "Mt")),
        ("closed-loop time constant aimed at [s]", lambda t: number(t.tau_c)),
    ]
    body = table(
        "PI settings in the standard form u = Kp (e + 1/Ti ∫ e dt), e = set point - output.",
        ["", *_rules(run)],
        [[label, *(value(t) for t in run.tunings)] for label, value in rows],
        "In brackets: 95 % interval over the uncertainty of the model, not over a change of "
        "the plant.",
    )
    return _section("settings", body)


def model(run: Run) -> str:
    """Parameters with their standard deviations, and how the models did on fresh rows."""
    fit, units = run.chosen, _units(run)
    truth = run.truth or {}
    parameters = list(zip(fit.names, fit.theta, fit.sd, strict=True))
    if len(fit.offset):
        parameters.append(("offset", float(fit.offset[0]), fit.offset_sd))
    head = ["parameter", "value ± sd", "unit"]
    cells = [[name, with_sd(x, sd), units.get(name, "")] for name, x, sd in parameters]
    if truth:
        head.append("true value")
        for row in cells:
            row.append(number(truth[row[0]], 6) if row[0] in truth else "–")
    parts = [
        _equation(fit.model),
        table(
            f"{fit.method}, fitted on {fit.N} rows that have a history; ± one standard deviation.",
            head,
            cells,
        ),
        _judged(run),
    ]
    for other in run.fits.values():
        if not _is_process(other):
            text = f"The {other.method} model that judges it, fitted on the estimation part:"
            parts.append(f"<p>{escaped(text)}</p><pre>{escaped(other, 4000)}</pre>")
    return _section("model", "".join(parts))


def figures(run: Run) -> str:
    """Every figure with its claim above and what is drawn below."""
    rec, fit = run.record, run.chosen
    verdicts = [v for v in (_verdict(run), *run.verdicts.values()) if v is not None]
    verdicts = list({id(v): v for v in verdicts}.values())
    polynomial = [f for f in run.fits.values() if not _is_process(f)]
    fresh = verdicts[0] if verdicts and _fresh(run) else None
    drawn = [
        (
            "record",
            plot.record(rec, fresh=fresh),
            "Shaded: the rows kept apart from the fit, on which the models are judged."
            if fresh
            else "",
        )
    ]
    if verdicts:
        drawn.append(
            (
                "fit",
                plot.compare(*verdicts, of=rec),
                "Simulated from the input alone; the percentages are fits of the simulation, not "
                "of the one-step prediction.",
            )
        )
        drawn += [
            (
                f"residuals-{i}",
                plot.residuals(verdict, of=rec),
                "Lag 0, which is 1, is left out. Below, bars outside the band at "
                "lags of 0 and more are dynamics that the model misses; at negative lags, "
                "feedback.",
            )
            for i, verdict in enumerate(verdicts)
        ]
    drawn += [
        ("step", plot.step(fit, *polynomial, of=rec), ""),
        (
            "bode",
            plot.bode(fit, *polynomial, of=rec),
            "With the exact dead time; sampled models end at half the sampling rate.",
        ),
    ]
    drawn += [
        (
            f"margins-{i}",
            plot.margins(tuning),
            "In brackets the 95 % intervals over the uncertainty of the model.",
        )
        for i, tuning in enumerate(run.tunings)
    ]
    if run.responses:
        held = any(tuning.controller.Ts is not None for tuning in run.tunings)
        loop = plot.closed_loop(*run.responses, names=_rules(run), of=rec, held=held)
        drawn.append(("loop", loop, ""))
    if "delay" in run.findings:
        text = (
            "The lower, the more of the output is explained. The choice counts parameters as "
            "well (BIC), so it need not be the lowest point."
        )
        drawn.append(("delay", plot.delay(run.findings["delay"], of=rec), text))
    hint = (
        '<p class="small screen">Drag across a figure to zoom, double-click to return; a click '
        "on a legend entry hides its line.</p>"
    )
    return _section("figures", hint + "".join(_figure(*each) for each in drawn))


def indices(run: Run) -> str:
    """List indices of the simulated set-point step."""
    if not run.responses:
        return ""
    names = Names(run.record)
    y, u = names.y_unit or "y", names.u_unit or "u"
    rows = {
        "rise, 10 to 90 % [s]": "rise",
        "settling into 2 % [s]": "settling",
        "overshoot [% of the move]": "overshoot",
        f"IAE [{y} s]": "iae",
        f"ISE [{y}² s]": "ise",
        f"ITAE [{y} s²]": "itae",
        "overshoot of the controller output [%]": "control_overshoot",
        f"control energy [{u}² s]": "control_energy",
        f"total variation of the controller output [{u}]": "total_variation",
    }
    body = table(
        "A set-point step of 1, simulated with the model and the exact dead time.",
        ["", *_rules(run)],
        [
            [label, *(number(getattr(r.indices, name)) for r in run.responses)]
            for label, name in rows.items()
        ],
        "A dash means that the response does not define the index.",
    )
    return _section("indices", body)


def provenance(run: Run) -> str:
    """Say which rows went where, what was done to them, and by which versions."""
    rec = run.record
    time = rec.time
    signals = [*rec.u_names, *rec.y_names]
    rows = [
        ["fingerprint of the record", rec.source],
        ["rows", f"{rec.N}, from {number(time[0], 6)} s to {number(time[-1], 6)} s"],
        ["sample time", f"{rec.Ts:g} s"],
        ["segments", str(len(rec.starts))],
        ["outputs that do not count", str(int((~rec.valid).sum()))],
        ["inputs", ", ".join(rec.u_names)],
        ["outputs", ", ".join(rec.y_names)],
        ["units", ", ".join(f"{n}: {rec.units.get(n) or 'not given'}" for n in signals)],
        *([f"{fit.method} fitted on rows", _ranges(fit.rows)] for fit in run.fits.values()),
        ["settings rest on rows", _ranges(run.chosen.rows)],
        *(
            [f"{v.name} judged on", f"{v.N} rows, {number(v.t[0], 6)} s to {number(v.t[-1], 6)} s"]
            for v in run.verdicts.values()
            if len(v.t)
        ),
        ["versions", ", ".join(f"{name} {found}" for name, found in _versions().items())],
    ]
    log = "".join(f"<li>{escaped(step)}</li>" for step in rec.log)
    steps = f"<ol>{log}</ol>" if log else "<p>None: the rows are used as they came.</p>"
    body = table("The record and the rows used.", ["", ""], rows)
    return _section("provenance", f"{body}<h3>Preparation steps</h3>{steps}")


def _verdict(run: Run) -> Verdict | None:
    """Pick the verdict on the kind of model that is tuned on."""
    return run.verdicts.get(run.chosen.method)


def _rules(run: Run) -> list[str]:
    """Name each rule as it is read."""
    return [tuning.rule.replace("_", " ") for tuning in run.tunings]


def _is_process(fit: Fit) -> bool:
    return isinstance(fit.model, ProcessModel)


def _fresh(run: Run) -> bool:
    """Whether the models were judged on rows that they were not fitted on."""
    return not any(note.code == "M11" for v in run.verdicts.values() for note in v.notes)


def _where(run: Run) -> str:
    return "fresh rows" if _fresh(run) else "the rows it was fitted on"


def _parts(run: Run) -> list[tuple[str, Any]]:
    """Pair everything that carries notes with what it is called."""
    return [
        ("run", run),
        *(
            ("delay scan" if name == "delay" else name, finding)
            for name, finding in run.findings.items()
        ),
        *((f"{name} fit", fit) for name, fit in run.fits.items()),
        *((f"{name} judged", verdict) for name, verdict in run.verdicts.items()),
        (f"{run.chosen.method} for the settings", run.chosen),
        *zip(_rules(run), run.tunings, strict=True),
    ]


def _units(run: Run) -> dict[str, str]:
    names = Names(run.record)
    return {"K": names.gain_unit, "T": "s", "L": "s", "offset": names.y_unit or "y"}


def _facts(run: Run) -> str:
    facts: list[tuple[str, str, str]] = []
    if run.tunings:
        first = run.tunings[0]
        pid, m, bands = first.controller, first.margins, first.bands
        unit = Names(run.record).control_unit
        facts += [
            ("Kp", number(pid.Kp), unit),
            ("Ti", f"{number(pid.Ti)} s", "integral time"),
            ("gain margin", number(m.gain, 3, padded=True), _band(bands.get("gain"), "")),
            (
                "phase margin",
                f"{number(m.phase_deg, 3, padded=True)}°",
                _band(bands.get("phase_deg"), "°"),
            ),
        ]
    verdict = _verdict(run)
    if verdict is not None:
        one = f"one step {verdict.fit_1step:.1f} %"
        facts.append(("simulation fit", f"{verdict.fit:.1f} %", one))
    cells = (
        f"<div><dt>{escaped(name)}</dt><dd>{escaped(value)}<small>{escaped(small)}</small></dd>"
        "</div>"
        for name, value, small in facts
    )
    return f'<dl class="facts">{"".join(cells)}</dl>'


def _band(interval: tuple[float, float] | None, unit: str) -> str:
    if interval is None:
        return "no interval"
    low, high = (number(end, 3, padded=True) for end in interval)
    return f"95 %: {low} to {high}{unit}"


def _margin(tuning: Tuning, name: str) -> str:
    return with_interval(getattr(tuning.margins, name), tuning.bands.get(name))


def _note(note: Note, origins: list[str]) -> str:
    kind = "warning" if note.severity == "warning" else "info"
    lines = [f"<p><code>{escaped(note.code)}</code>{escaped(note.text, 500)}</p>"]
    small = "; ".join(part for part in (", ".join(origins), note.evidence) if part)
    lines.append(f'<p class="small">{escaped(small)}</p>')
    if note.remedy:
        lines.append(f"<p><strong>Do:</strong> {escaped(note.remedy, 500)}</p>")
    return f'<li class="{kind}">{"".join(lines)}</li>'


def _equation(plant: object) -> str:
    if isinstance(plant, ProcessModel):
        return (
            '<p class="equation"><i>y</i> = <i>K</i> e<sup>−<i>L</i> s</sup> / (<i>T</i> s + 1) '
            "<i>u</i> + offset</p>"
        )
    return f"<pre>{escaped(plant, 2000)}</pre>"


def _judged(run: Run) -> str:
    verdicts = list(run.verdicts.values())
    if not verdicts:
        return ""
    unit = Names(run.record).y_unit or "y"
    rows: list[tuple[str, Any]] = [
        ("fit of the simulation [%]", lambda v: f"{v.fit:.1f}"),
        ("fit one step ahead [%]", lambda v: f"{v.fit_1step:.1f}"),
        (f"RMSE of the simulation [{unit}]", lambda v: number(v.rmse)),
        ("rows judged", lambda v: str(v.N)),
        ("verdict", lambda v: "passes" if v else "does not pass"),
    ]
    return table(
        f"How the models fitted on one part of the record do on {_where(run)}.",
        ["", *(v.name for v in verdicts)],
        [[label, *(value(v) for v in verdicts)] for label, value in rows],
        "Fit = 100 (1 - |y - ŷ| / |y - mean of y|). The simulation sees the input alone; one "
        "step ahead also sees the last measured output.",
    )


def _figure(name: str, fig: Any, text: str) -> str:
    parts = embedded(fig)
    words = " ".join(
        f"{part[:1].upper()}{part[1:]}{'' if part.endswith('.') else '.'}"
        for part in (parts.subtitle, text)
        if part
    )
    return (
        f'<figure id="figure-{name}"><h3>{escaped(parts.title)}</h3>'
        f'<div class="plot" id="plot-{name}" role="img" style="height:{parts.height}px" '
        f'aria-label="{escaped(parts.title)}"></div>'
        f"<figcaption>{escaped(words, 600)}</figcaption>"
        f'<script type="application/json" data-figure="plot-{name}">{parts.json}</script></figure>'
    )


def _ranges(rows: Any) -> str:
    shown = [f"{a} to {b}" for a, b in rows[:8].tolist()]
    return ", ".join(shown) + (f" and {len(rows) - 8} more stretches" if len(rows) > 8 else "")


def _versions() -> dict[str, str]:
    found = {name: version(name) for name in ("plantune", "numpy", "plotly")}
    return {**found, "Python": platform.python_version()}


def _section(name: str, body: str) -> str:
    return f'<section id="{name}"><h2>{_SECTIONS[name]}</h2>{body}</section>'
