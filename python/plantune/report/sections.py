"""The sections of the page, in the order in which they are read."""

from __future__ import annotations

import platform
import re
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from plantune.plot.style import Names, over
from plantune.report.about import (
    SECTIONS,
    fresh,
    is_process,
    rule_names,
    section,
    units,
    verdict_on_chosen,
    where,
)
from plantune.report.text import escaped, table, unit_of, with_interval, with_sd
from plantune.text import number

if TYPE_CHECKING:
    from plantune.job import Run
    from plantune.notes import Note
    from plantune.tune import Comparison, Tuning


def head(run: Run) -> str:
    """Title, the outcome in a few sentences, and the numbers one came for."""
    verdict = verdict_on_chosen(run)
    chip = ""
    if verdict is not None:
        word = "passes" if verdict else "does not pass"
        kind = "passes" if verdict and fresh(run) else "fails"
        text = f"{verdict.name} {word} on {where(run)}" + ", not validated" * (not fresh(run))
        chip = f'<p><span class="verdict {kind}">{escaped(text)}</span></p>'
    links = "".join(
        f'<li><a href="#{name}">{text}</a></li>'
        for name, text in SECTIONS.items()
        if run.tunings or name not in ("rules", "indices")
    )
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
    names = Names(run.record)
    text = f"{names.y} answers {names.u} as {_kind(run)}. "
    verdict = verdict_on_chosen(run)
    if verdict is not None:
        word = "passes" if verdict else "does not pass; the notes say why"
        rows = "rows kept apart from the fit" if fresh(run) else "rows that it was fitted on"
        text += f"On {verdict.N} {rows} its simulation fit is {verdict.fit:.1f} %: it {word}. "
    if run.tunings:
        first = run.tunings[0]
        pid, m, bands = first.controller, first.margins, first.bands
        text += (
            f"PI settings Kp = {number(pid.Kp)}{unit_of(names.control_unit)} and "
            f"Ti = {number(pid.Ti)} {names.time_unit} leave a gain margin of "
            f"{with_interval(m.gain, bands.get('gain'))} and a phase margin of "
            f"{with_interval(m.phase_deg, bands.get('phase_deg'), unit='°')}"
        )
        text += "; 95 % intervals in brackets." if bands else "."
    else:
        text += "No settings are given; the notes say why."
    # A number stays with its name, its deviation and its unit.
    return re.sub(r" (?=[=±%°]|to )|(?<=[=±]) |(?<=\d) (?=s\b)", "\u00a0", text)


def _kind(run: Run) -> str:
    """Say what kind of plant it is; parameters are listed where they are few."""
    fit, unit = run.chosen, units(run)
    if not is_process(fit):
        poles = len(fit.model.poles()) if fit.model is not None else 0
        return f"a linear model with {poles} poles, {fit.method}"
    parameters = ", ".join(
        f"{name} = {with_sd(x, sd)}{unit_of(unit.get(name, ''))}"
        for name, x, sd in zip(fit.names, fit.theta, fit.sd, strict=True)
    )
    order = "first" if fit.model.is_first_order else "second"
    return f"a {order}-order process with dead time: {parameters} (± one standard deviation)"


def notes(run: Run) -> str:
    """Doubts first, remarks after them, each with evidence and remedy."""
    found = run.named_notes()
    order = ("error", "warning", "info")
    ranked = sorted(found, key=lambda note: order.index(note.severity))
    if not ranked:
        return section("notes", "<p>Nothing in the data leaves a doubt.</p>")
    items = "".join(note_item(note, found[note]) for note in ranked)
    return section("notes", f'<ul class="notes">{items}</ul>')


def settings(run: Run) -> str:
    """List the recommended settings and their margins."""
    if not run.tunings:
        return section("settings", "<p>None: the model does not carry a tuning.</p>")
    names, first = Names(run.record), run.tunings[0]
    time, unit = names.time_unit, names.control_unit
    per_time = over(unit, time, "")
    rows: list[tuple[str, Any]] = [
        (f"Kp [{unit}]", lambda t: number(t.controller.Kp, 5)),
        (f"Ti [{time}]", lambda t: number(t.controller.Ti, 5)),
        (f"Ki = Kp/Ti [{per_time}]", lambda t: number(t.controller.Ki, 5)),
        ("gain margin [factor]", lambda t: _margin(t, "gain")),
        ("gain margin [dB]", lambda t: number(t.margins.gain_db)),
        ("phase margin [°]", lambda t: _margin(t, "phase_deg")),
        (f"delay margin [{time}]", lambda t: _margin(t, "delay")),
        ("Ms [1]", lambda t: _margin(t, "Ms")),
        ("Mt [1]", lambda t: _margin(t, "Mt")),
        (f"closed-loop time constant aimed at [{time}]", lambda t: number(t.tau_c)),
    ]
    body = table(
        "PI settings in the standard form u = Kp (e + 1/Ti ∫ e dt), e = set point - output.",
        ["", rule_names(run)[0]],
        [[label, value(first)] for label, value in rows],
        "In brackets: 95 % interval over the uncertainty of the model, not over a change of "
        "the plant.",
    )
    return section("settings", body)


def rules(run: Run) -> str:
    """Set the rules side by side: settings, margins, and what each costs."""
    if run.comparison is None:
        return ""
    lead = (
        "The first is recommended: it has the margin that was asked for. Ms, the moves of the "
        "controller output and the error after a load are what each rule costs."
    )
    own = run.tunings[0].notes
    return section("rules", compared(run.comparison, Names(run.record), lead, own))


def compared(comparison: Comparison, names: Names, lead: str, told: tuple[Note, ...] = ()) -> str:
    """Return the table of a comparison and its doubts, but for those `told` elsewhere."""
    y, time = names.y_unit or "y", names.time_unit
    derivative = any(row.tuning.controller.Td for row in comparison.rows)
    rows: list[tuple[str, Any]] = [
        (f"Kp [{names.control_unit}]", lambda row: number(row.tuning.controller.Kp)),
        (f"Ti [{time}]", lambda row: number(row.tuning.controller.Ti)),
        *([(f"Td [{time}]", lambda row: number(row.tuning.controller.Td))] if derivative else []),
        ("gain margin [factor]", lambda row: number(row.tuning.margins.gain, 3)),
        ("phase margin [°]", lambda row: number(row.tuning.margins.phase_deg, 3)),
        ("Ms [1]", lambda row: number(row.tuning.margins.Ms, 3)),
        ("overshoot [% of the move]", lambda row: number(row.set_point.indices.overshoot, 3)),
        (
            "overshoot of the controller output [%]",
            lambda row: number(row.set_point.indices.control_overshoot, 3),
        ),
        (f"IAE after a load of 1 [{y} {time}]", lambda row: number(row.load.indices.iae, 3)),
    ]
    body = table(
        lead,
        ["", *(row.tuning.rule.replace("_", " ") for row in comparison.rows)],
        [[label, *(value(row) for row in comparison.rows)] for label, value in rows],
    )
    doubts = "".join(
        f'<p class="small"><code>{escaped(note.code)}</code> {escaped(note.text, 500)}</p>'
        for note in comparison.notes
        if note not in told
    )
    return body + doubts


def indices(run: Run) -> str:
    """List indices of the simulated set-point step."""
    if not run.responses:
        return ""
    names = Names(run.record)
    y, u, time = names.y_unit or "y", names.u_unit or "u", names.time_unit
    rows = {
        f"rise, 10 to 90 % [{time}]": "rise",
        f"settling into 2 % [{time}]": "settling",
        "overshoot [% of the move]": "overshoot",
        f"IAE [{y} {time}]": "iae",
        f"ISE [{y}² {time}]": "ise",
        f"ITAE [{y} {time}²]": "itae",
        "overshoot of the controller output [%]": "control_overshoot",
        f"control energy [{u}² {time}]": "control_energy",
        f"total variation of the controller output [{u}]": "total_variation",
    }
    body = table(
        "A set-point step of 1, simulated with the model and the exact dead time.",
        ["", *rule_names(run)],
        [
            [label, *(number(getattr(r.indices, name)) for r in run.responses)]
            for label, name in rows.items()
        ],
        "A dash means that the response does not define the index.",
    )
    return section("indices", body)


def provenance(run: Run) -> str:
    """Say which rows went where, what was done to them, and by which versions."""
    rec = run.record
    time, unit = rec.time, rec.time_unit
    signals = [*rec.u_names, *rec.y_names]
    rows = [
        ["fingerprint of the record", rec.source],
        ["rows", f"{rec.N}, from {number(time[0], 6)} to {number(time[-1], 6)} {unit}"],
        ["sample time", f"{rec.Ts:g} {unit}"],
        ["segments", str(len(rec.starts))],
        ["outputs that do not count", str(int((~rec.valid).sum()))],
        ["inputs", ", ".join(rec.u_names)],
        ["outputs", ", ".join(rec.y_names)],
        ["units", ", ".join(f"{n}: {rec.units.get(n) or 'not given'}" for n in signals)],
        *([f"{fit.method} fitted on rows", _ranges(fit.rows)] for fit in run.fits.values()),
        *([["settings rest on rows", _ranges(run.chosen.rows)]] if run.tunings else []),
        *(
            [
                f"{v.name} judged on",
                f"{v.N} rows, {number(v.t[0], 6)} to {number(v.t[-1], 6)} {unit}",
            ]
            for v in run.verdicts.values()
            if len(v.t)
        ),
        ["versions", ", ".join(f"{name} {found}" for name, found in _versions().items())],
    ]
    log = "".join(f"<li>{escaped(step)}</li>" for step in rec.log)
    steps = f"<ol>{log}</ol>" if log else "<p>None: the rows are used as they came.</p>"
    body = table("The record and the rows used.", ["", ""], rows)
    return section("provenance", f"{body}<h3>Preparation steps</h3>{steps}")


def _facts(run: Run) -> str:
    facts: list[tuple[str, str, str]] = []
    if run.tunings:
        first = run.tunings[0]
        pid, m, bands = first.controller, first.margins, first.bands
        unit = Names(run.record).control_unit
        facts += [
            ("Kp", number(pid.Kp), unit),
            ("Ti", f"{number(pid.Ti)} {Names(run.record).time_unit}", "integral time"),
            ("gain margin", number(m.gain, 3, padded=True), _band(bands.get("gain"), "")),
            (
                "phase margin",
                f"{number(m.phase_deg, 3, padded=True)}°",
                _band(bands.get("phase_deg"), "°"),
            ),
        ]
    verdict = verdict_on_chosen(run)
    if verdict is not None:
        one = f"one step {verdict.fit_1step:.1f} %"
        facts.append(("simulation fit", f"{verdict.fit:.1f} %", one))
    return fact_list(facts)


def fact_list(facts: list[tuple[str, str, str]]) -> str:
    """Return numbers in boxes: name, number, and a few words below it."""
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


def note_item(note: Note, origins: tuple[str, ...] = ()) -> str:
    """Return a doubt or remark with its evidence and what to do."""
    kind = "info" if note.severity == "info" else "warning"
    lines = [f"<p><code>{escaped(note.code)}</code>{escaped(note.text, 500)}</p>"]
    small = "; ".join(part for part in (", ".join(origins), note.evidence) if part)
    lines.append(f'<p class="small">{escaped(small)}</p>')
    if note.remedy:
        lines.append(f"<p><strong>Do:</strong> {escaped(note.remedy, 500)}</p>")
    return f'<li class="{kind}">{"".join(lines)}</li>'


def _ranges(rows: Any) -> str:
    shown = [f"{a} to {b}" for a, b in rows[:8].tolist()]
    return ", ".join(shown) + (f" and {len(rows) - 8} more stretches" if len(rows) > 8 else "")


def _versions() -> dict[str, str]:
    found = {name: version(name) for name in ("plantune", "numpy", "plotly")}
    return {**found, "Python": platform.python_version()}
