"""What an auto-tuner does, on the terminal: parameters with bands, delays, settings, reasons."""

from __future__ import annotations

from collections import Counter, deque
from math import inf
from typing import Any

import numpy as np
from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from plantune.adapt import AdaptLog, Decision, Sample, Settings
from plantune.cli.summary import shown_note
from plantune.models import PID, ProcessModel
from plantune.notes import Note
from plantune.text import number

_BARS = " ▏▎▍▌▋▊▉█"
_WIDTH = 24  # letters of a bar
_LAST = 5  # events that stay in sight

EVENTS = {
    "new_point": "operating point begins",
    "alarm": "alarm",
    "changed": "another plant",
    "retuned": "retuned",
}


class View:
    """The state of a tuner, to be shown at any time."""

    def __init__(self, title: str, settings: Settings) -> None:
        self._title = title
        self._settings = settings
        self._last: tuple[Sample, Decision] | None = None
        self._accepted = 0
        self._events: deque[Text] = deque(maxlen=_LAST)
        self._reasons: tuple[Note, ...] = ()

    def take(self, sample: Sample, decision: Decision) -> None:
        """Take a step."""
        self._last = sample, decision
        self._accepted += decision.accepted
        if decision.fitted:
            self._reasons = decision.reasons
        if happened := self.line(decision):
            self._events.append(happened)

    def line(self, decision: Decision) -> Text | None:
        """Return what happened at a step, in one line; None where nothing did."""
        found = events_of(decision)
        if decision.accepted and self._accepted == 1:
            found = ["first estimate accepted", *found]
        if not found:
            return None
        text = Text(f"{decision.t:9.2f} s  ", "dim") + Text(", ".join(found), _style(decision))
        if decision.accepted or decision.retuned:
            text += Text(f"  {_model(decision)}")
        if decision.retuned:
            text += Text(f"  {decision.controller}", "bold")
        return text

    def render(self) -> Group:
        """Return all that is to be seen now."""
        if self._last is None:
            return Group(Text(self._title, "bold"), Text("waiting for the first sample", "dim"))
        sample, decision = self._last
        point = decision.operating_point
        where = "" if point is None else f"  operating point {' '.join(map(str, point))}"
        head = Text(self._title, "bold") + Text(f"  {sample.t:.2f} s{where}", "dim")
        return Group(
            head,
            self._parameters(sample, decision),
            self._delays(decision),
            self._controller(decision),
            self._target(decision),
            *(shown_note(note) for note in self._reasons),
            *self._events,
        )

    def _parameters(self, sample: Sample, decision: Decision) -> Table:
        grid = Table(box=box.SIMPLE_HEAD)
        for heading in ("", "estimate", "± 2 sd", "taken"):
            grid.add_column(heading, justify="left" if not heading else "right")
        merged = decision.merged
        taken = ("–",) * 3 if merged is None else tuple(map(number, _parameters(merged)))
        found = ("–",) * 3 if decision.model is None else map(number, _parameters(decision.model))
        names = ("K", "T, s", "L, s")
        for name, x, sd, mean in zip(names, found, decision.sd[:3], taken, strict=True):
            grid.add_row(name, x, number(2 * float(sd), 3), mean)
        grid.add_row("offset", number(decision.offset), number(2 * float(decision.sd[3]), 3), "")
        for name in ("r", "y", "u"):
            x = getattr(sample, name)
            grid.add_row(name, "–" if x is None else number(x), "", "", style="dim")
        return grid

    def _delays(self, decision: Decision) -> Table:
        grid = Table.grid(padding=(0, 1))
        for nk, p in decision.delay_posterior.items():
            if p >= 0.005:
                L = (nk - 1) * self._settings.Ts
                grid.add_row(f"L {number(L)} s", Text(bar(p), "blue"), f"{100 * p:.0f} %")
        return grid

    def _controller(self, decision: Decision) -> Text:
        target = decision.target
        asked = "" if target is None or target == decision.controller else f"  asked for: {target}"
        return Text(f"at work: {decision.controller}", "bold") + Text(asked, "dim")

    def _target(self, decision: Decision) -> Text:
        wait = decision.time_to_target
        goal = f"{100 * self._settings.target:g} %"
        if wait == 0:
            return Text(f"K and T known to {goal}", "green")
        seconds = f"{wait:.0f}" if 10 <= wait < inf else number(wait, 2)
        return Text(f"K and T known to {goal} in {seconds} s", "dim")


def bar(share: float) -> str:
    """Return a bar for a share of 1, in eighths of a letter.

    Examples
    --------
    >>> bar(1.0) == "█" * 24, bar(0.5 / 24)
    (True, '▌')
    """
    whole, eighths = divmod(round(8 * _WIDTH * share), 8)
    return "█" * whole + _BARS[eighths].strip()


def events_of(decision: Decision) -> list[str]:
    """Name what happened at a step.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> events_of(SimpleNamespace(new_point=False, alarm=True, changed=False, retuned=True))
    ['alarm', 'retuned']
    """
    return [text for name, text in EVENTS.items() if getattr(decision, name)]


def event(sample: Sample, decision: Decision) -> dict[str, Any]:
    """Return the fields of a decision for JSON."""
    K, T, L = (None,) * 3 if decision.model is None else _parameters(decision.model)
    return {
        "t": decision.t,
        "events": events_of(decision),
        "accepted": decision.accepted,
        "r": sample.r,
        "u": sample.u,
        "y": sample.y,
        "K": K,
        "T": T,
        "L": L,
        "sd": decision.sd,
        "offset": decision.offset,
        "delay_posterior": {str(nk): p for nk, p in decision.delay_posterior.items()},
        "controller": _gains(decision.controller),
        "target": None if decision.target is None else _gains(decision.target),
        "operating_point": decision.operating_point,
        "time_to_target": decision.time_to_target,
        "reasons": decision.reasons,
    }


def summary(log: AdaptLog) -> dict[str, Any]:
    """Return what a whole log says for JSON."""
    accepted, last = np.flatnonzero(log.accepted), len(log.t) - 1
    counted = Counter(note.code for _, notes in log.reasons for note in notes)
    return {
        "samples": len(log.t),
        "accepted": len(accepted),
        "first_accepted": float(log.t[accepted[0]]) if len(accepted) else None,
        "alarms": log.t[log.alarm],
        "changes": log.t[log.changed],
        "retunings": [
            {"t": float(log.t[k]), "Kp": float(log.Kp[k]), "Ki": float(log.Ki[k])}
            for k in np.flatnonzero(log.retuned)
        ],
        "model": dict(zip("KTL", log.merged[last].tolist(), strict=True)),
        "sd": log.sd[last],
        "controller": {"Kp": float(log.Kp[last]), "Ki": float(log.Ki[last])},
        "time_to_target": float(log.time_to_target[last]),
        "delay_posterior": {
            str(nk): float(p) for nk, p in zip(log.nk, log.delays[last], strict=True)
        },
        "reasons": dict(counted.most_common()),
    }


def _parameters(model: ProcessModel) -> tuple[float, float, float]:
    (T,) = np.atleast_1d(model.T)
    return model.K, float(T), model.L


def _model(decision: Decision) -> str:
    if decision.model is None:
        return ""
    K, T, L = _parameters(decision.model)
    return f"K {number(K)}, T {number(T)} s, L {number(L)} s"


def _gains(pid: PID) -> dict[str, float]:
    return {"Kp": pid.Kp, "Ki": pid.Ki, "Td": pid.Td}


def _style(decision: Decision) -> str:
    return "yellow" if decision.alarm or decision.changed else "green"
