"""The page of a look: what the files hold, what the record shows, what to do next."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from plantune import plot
from plantune.report.figures import HINT, Drawn, drawn_figure
from plantune.report.sections import fact_list, note_item
from plantune.report.text import escaped, table, with_sd
from plantune.text import number

if TYPE_CHECKING:
    from plantune.inspection import FileSeen, Inspection
    from plantune.record import Record

# Columns of a file up to which they are listed.
_MOST_COLUMNS = 50

_ORDER = ("error", "warning", "info")


def of_inspection(seen: Inspection, title: str) -> list[str]:
    """Return the sections of the page, in the order in which they are read."""
    files = "".join(_file(file) for file in (seen, *seen.others) if file.columns)
    parts = {
        "next": ("What to do next", _next(seen)),
        "found": ("What was found", _found(seen)),
        "figures": ("What the record shows", _figures(seen)),
        "files": ("What the files hold", files),
    }
    links = "".join(f'<li><a href="#{name}">{text}</a></li>' for name, (text, _) in parts.items())
    return [
        _head(seen, title, links),
        *(f'<section id="{n}"><h2>{t}</h2>{body}</section>' for n, (t, body) in parts.items()),
    ]


def _head(seen: Inspection, title: str, links: str) -> str:
    kind, word = ("passes", "can be read") if seen else ("fails", "not as it is")
    return f"""<header>
<p class="kicker">plantune inspection</p>
<h1>{escaped(title)}</h1>
<p><span class="verdict {kind}">{word}</span></p>
<p class="outcome">{escaped(seen.record or "No record: name its input and its output.", 1200)}</p>
{_facts(seen)}
<nav aria-label="Sections"><ul>{links}</ul></nav>
</header>"""


def _facts(seen: Inspection) -> str:
    """Return the few numbers that one came for."""
    facts: list[tuple[str, str, str]] = []
    rec = seen.record
    if rec is not None:
        span = f"{number(rec.Ts)} {rec.time_unit} apart"
        facts.append(("rows", str(rec.N), span))
    h = seen.impulse
    if h is not None and len(h.inputs) == 1:
        facts.append(("gain", with_sd(float(h.gain), float(h.gain_sd)), "without a model"))
    if len(seen.delay) == 1:
        (found,) = seen.delay.values()
        likely = " or ".join(map(str, found.likely))
        sure = "over 99 % likely" if found.weight > 0.99 else f"{100 * found.weight:.0f} % likely"
        facts.append(("delay", f"{likely} samples", sure))
    if seen.informative is not None:
        count = len(seen.informative.stretches)
        can = len(seen.informative.identifiable)
        facts.append(("stretches to identify", f"{can} of {count}", "in which u drives y"))
    return fact_list(facts)


def _next(seen: Inspection) -> str:
    steps = (re.sub(r"`([^`]*)`", r"<code>\1</code>", escaped(step, 500)) for step in seen.steps)
    items = "".join(f"<li>{step}</li>" for step in steps)
    return f"<ol>{items}</ol>"


def _found(seen: Inspection) -> str:
    """List refusals first, doubts and remarks after them, each with its place."""
    ranked = sorted(seen.findings, key=lambda note: _ORDER.index(note.severity))
    items = "".join(map(note_item, ranked))
    return f'<ul class="notes">{items}</ul>' if items else "<p>Nothing wrong was found.</p>"


def _figures(seen: Inspection) -> str:
    if seen.record is None:
        return "<p>Nothing, before input and output are named.</p>"
    drawn = [*_record(seen, seen.record), *_responses(seen), *_delays(seen), *_noise(seen)]
    return HINT + "".join(drawn_figure(*each) for each in drawn)


def _record(seen: Inspection, rec: Record) -> Drawn:
    found = seen.informative
    if found is not None and found.stretches:
        text = "Shaded: where the input drives the output, darker where it can be identified."
        yield "record", plot.stretches(rec, found), text
    else:
        yield "record", plot.record(rec), ""


def _responses(seen: Inspection) -> Drawn:
    if seen.impulse is not None:
        text = "No order and no delay were assumed."
        for i in range(len(seen.impulse.inputs)):
            yield f"impulse-{i}", plot.impulse(seen.impulse, of=seen.part, input=i), text
    if seen.response is not None:
        text = "Blank where the output does not follow the input, coherence below one half."
        for i in range(seen.response.G.shape[2]):
            yield f"response-{i}", plot.frequency(seen.response, of=seen.part, input=i), text


def _delays(seen: Inspection) -> Drawn:
    for i, found in enumerate(seen.delay.values()):
        yield f"delay-{i}", plot.delay_evidence(found, of=seen.part), ""


def _noise(seen: Inspection) -> Drawn:
    for i, found in enumerate(seen.noise.values()):
        advice = ". ".join(text[:1].upper() + text[1:] for text in found.advice)
        yield f"noise-{i}", plot.noise(found), advice
        yield f"spectrum-{i}", plot.spectrum(found, of=seen.part), ""


def _file(file: FileSeen) -> str:
    """List columns and stamps of a file."""
    head = ["", "column", "holds", "values", "missing", "min", "max", "distinct"]
    rows = []
    for c in file.columns[:_MOST_COLUMNS]:
        ends = ["" if x is None else number(x, 6) for x in (c.low, c.high)]
        counts = ["" if x is None else str(x) for x in (c.values, c.missing, c.distinct)]
        name = f"{c.name} [{c.unit}]" if c.unit else c.name
        rows.append([str(c.number), name, c.holds, *counts[:2], *ends, counts[2]])
    more = len(file.columns) - _MOST_COLUMNS
    s = file.stamps
    stamps = "" if s is None else (
        f"Stamps ({s.column}): step {s.step:.6g} s, 1 % to 99 % from {s.p1:.6g} to {s.p99:.6g} s; "
        f"{s.gaps} gaps, {s.back} repeated or back."
        + "".join(f" {text[:1].upper()}{text[1:]}." for text in s.said)
    )  # fmt: skip
    return table(file.name, head, rows, f"And {more} more columns. " * (more > 0) + stamps)
