"""What an exported block computes, and what is said of it in its head."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import isclose, isfinite
from textwrap import wrap
from typing import Any

from plantune import _core
from plantune.errors import PlantuneError, refusal
from plantune.estimate import Fit
from plantune.models import PID, PolyModel, ProcessModel, TransferFunction, c2d
from plantune.models.hysteresis.base import HysteresisModel
from plantune.recursive import RLS
from plantune.tune import Tuning
from plantune.tune.judge import as_given

# Samples that a block keeps: an INT counts them, and small controllers hold them.
_MOST_SAMPLES = 16_000

_PLAIN = str.maketrans(
    {"…": "to", "±": "+-", "°": "deg ", "µ": "u", "μ": "u", "²": "^2", "−": "-", "·": "*"}
    | {"∞": "inf", "\\": "/", "?": "."}
)


@dataclass(frozen=True, slots=True)
class Controller:
    """A sampled controller, the range of its output, and lines about it."""

    pid: PID
    u_min: float | None
    u_max: float | None
    about: tuple[str, ...]

    @property
    def Ts(self) -> float:
        """Sample time, seconds."""
        assert self.pid.Ts is not None  # `controller_of` gives it one
        return self.pid.Ts

    @property
    def constants(self) -> dict[str, float]:
        """The settings that its law needs, by their letters."""
        pid = self.pid
        settings = {"Kp": pid.Kp, "Ki": pid.Ki, "b": pid.b, "Ts": self.Ts}
        if pid.Td > 0:
            settings |= {"Td": pid.Td, "Tf": pid.Tf, "c": pid.c}
        if self.u_min is not None and self.u_max is not None:
            settings |= {"u_min": self.u_min, "u_max": self.u_max}
        return settings


@dataclass(frozen=True, slots=True)
class Plant:
    """A plant as the recursion `w = B u - (F - 1) w`, `x = w - (A - 1) x`, `y = x + offset`."""

    model: PolyModel
    offset: float
    about: tuple[str, ...]

    @property
    def ahead(self) -> int:
        """Samples by which `y` lies after the input that a call brings: 1, or 0 without delay."""
        return min(1, int(self.model.nk))

    @property
    def terms(self) -> list[tuple[float, int]]:
        """Coefficients of the input, and how many calls ago each came."""
        first = int(self.model.nk) - self.ahead
        return [(b, first + j) for j, b in enumerate(self.model.B.tolist())]

    @property
    def kept(self) -> int:
        """Inputs to keep, the one just given counted."""
        return self.terms[-1][1] + 1


def subject_of(
    what: Any,
    Ts: float | None,
    u_min: float | None,
    u_max: float | None,
    units: tuple[str, str],
) -> Controller | Plant:
    """Return what a tuning, controller, model or fit is to compute."""
    if Ts is not None and not (isfinite(Ts) and Ts > 0):
        raise refusal("U01", f"`Ts` is {Ts}, must be positive seconds", remedy="Ts=0.1")
    if isinstance(what, Tuning | PID):
        return _controller(what, Ts, u_min, u_max, units)
    if not isinstance(what, ProcessModel | TransferFunction | PolyModel | Fit):
        raise refusal(
            "U01",
            f"a {type(what).__name__} cannot be exported",
            remedy="pass a Tuning, a PID, a Fit, a ProcessModel, a TransferFunction or a PolyModel",
        )
    if u_min is not None or u_max is not None:
        raise refusal("U01", "a plant has no limits of u", remedy="leave u_min and u_max out")
    return _plant(what, Ts, units)


def estimator_about(rls: RLS) -> tuple[str, ...]:
    """Return the lines about an estimator."""
    return (
        f"Recursive least squares, {rls.n} parameters, forgetting factor {rls.lam:g}.",
        "It starts from the parameters and the covariance that it had when it was written.",
        _author(),
    )


def hysteresis_about(model: HysteresisModel, units: tuple[str, str]) -> tuple[str, ...]:
    """Return the lines about a model of hysteresis, or its inverse."""
    said = str(model).splitlines()
    found = model.identified
    return (
        f"Hysteresis, {model.kind.replace('_', ' ')}: y for an input x, at any sample time.",
        _author(),
        f"model       {said[0]}",
        *(f"            {line}" for line in said[1:]),
        f"units       {_units(units, 'y').replace('u in', 'x in', 1)}",
        *([f"fitted      {found.N} rows, largest error {found.worst:.3g}"] if found else []),
        *(f"doubt       {note}" for note in model.notes),
    )


def comment(lines: Iterable[str], width: int = 92) -> list[str]:
    """Return lines that may stand in a comment: ASCII, wrapped, no end of comment among them."""
    return [
        part
        for line in lines
        for part in wrap(harmless(line), width, subsequent_indent="            ") or [""]
    ]


def harmless(text: str) -> str:
    r"""Return one line of ASCII that opens and closes no comment.

    Examples
    --------
    >>> harmless("a */ b *) c"), harmless("line 1\nline 2"), harmless("3 … 4 °C")
    ('a x/ b x) c', 'line 1 line 2', '3 to 4 deg C')
    """
    line = "".join(c if c.isprintable() else " " for c in text.translate(_PLAIN))
    line = line.encode("ascii", "replace").decode().replace("?", ".")
    return re.sub(r"\*(?=[/)])|(?<=[/(])\*", "x", line)


def named(name: str | None, default: str, keywords: frozenset[str] = frozenset()) -> str:
    """Return the name of a block, which must be one in every language."""
    if name is None:
        return default
    if re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name) is None or name.upper() in keywords:
        raise refusal(
            "U01",
            f"{harmless(name)!r} is no name of a block",
            remedy="take letters, digits and single underscores, beginning with a letter",
        )
    return name


def _controller(
    what: Tuning | PID,
    Ts: float | None,
    u_min: float | None,
    u_max: float | None,
    units: tuple[str, str],
) -> Controller:
    given = what.controller if isinstance(what, Tuning) else what
    pid = replace(given, Ts=_sample_time(given.Ts, Ts))
    if pid.filter != "d1":
        raise refusal(
            "U01",
            f"the filter {pid.filter!r} cannot be exported yet",
            remedy="filter='d1', on the derivative",
        )
    _check_range(u_min, u_max)
    about = [
        f"PID controller, sampled every {pid.Ts:g} s by backward Euler.",
        _author(),
        f"settings    {replace(pid, Ts=None)}",
        f"weights     b = {pid.b:g}" + (f", c = {pid.c:g}" if pid.Td > 0 else ""),
        f"units       {_units(units, 'r and y')}; Kp in those of u per those of y; times in s",
    ]
    if isinstance(what, Tuning):
        about += _about_tuning(what, pid)
    return Controller(pid, u_min, u_max, tuple(about))


def _about_tuning(tuning: Tuning, pid: PID) -> list[str]:
    """Where the settings come from, and what they promise at this sample time."""
    sampled = pid.Ts == tuning.controller.Ts
    judged = tuning if sampled else as_given(pid, tuning.model, 0.0, None)
    if not judged.margins.stable:
        raise refusal(
            "C07",
            f"sampled every {pid.Ts:g} s, the loop is unstable on its own model",
            remedy="sample faster, or take less gain",
        )
    bands = ", ".join(f"{k} {low:.3g} to {high:.3g}" for k, (low, high) in tuning.bands.items())
    notes = [*tuning.notes, *(note for note in judged.notes if note not in tuning.notes)]
    return [
        f"rule        {tuning.rule}",
        f"plant       {tuning.model}",
        f"margins     {judged.margins}",
        *([f"95 %        {bands}" + ("" if sampled else " (continuous)")] if bands else []),
        *(f"doubt       {note}" for note in notes),
        f"record      {tuning.source or 'none'}",
    ]


def _plant(
    what: ProcessModel | TransferFunction | PolyModel | Fit,
    Ts: float | None,
    units: tuple[str, str],
) -> Plant:
    model = what.model if isinstance(what, Fit) else what
    if model is None:
        raise refusal("U01", "a plain least-squares fit has no model", remedy="export a model")
    if isinstance(model, PolyModel):
        Ts = _sample_time(model.Ts, Ts)
        sampled = model
    else:
        Ts = _sample_time(what.Ts if isinstance(what, Fit) and Ts is None else None, Ts)
        sampled = c2d(model, Ts)
    if isinstance(sampled.B, list):
        raise refusal(
            "U01",
            f"the model has {len(sampled.B)} inputs, must have one",
            remedy="export a PolyModel of one of its B, F and nk",
        )
    plant = Plant(sampled, float(what.offset[0]) if isinstance(what, Fit) else 0.0, ())
    if plant.kept > _MOST_SAMPLES:
        raise refusal(
            "U01",
            f"the delay takes {plant.kept} samples, must be at most {_MOST_SAMPLES}",
            remedy="sample more slowly",
        )
    said = str(model).splitlines()
    about = [
        f"Plant, sampled every {Ts:g} s behind a zero-order hold; the delay is exact.",
        _author(),
        f"model       {said[0]}",
        *(f"            {line}" for line in said[1:]),
        f"units       {_units(units, 'y')}",
    ]
    if isinstance(what, Fit):
        found = zip(what.names, what.theta.tolist(), what.sd.tolist(), strict=True)
        about.append("fitted      " + ", ".join(f"{k} {v:.6g} +- {sd:.2g}" for k, v, sd in found))
        about += [f"doubt       {note}" for note in what.notes]
        about.append(f"record      {what.source}")
    return replace(plant, about=tuple(about))


def _sample_time(own: float | None, given: float | None) -> float:
    Ts = own if given is None else given
    if Ts is None:
        raise refusal("U01", "`Ts` is missing", remedy="pass Ts=, the seconds between two calls")
    if own is not None and not isclose(Ts, own, rel_tol=1e-9):
        raise refusal(
            "U01",
            f"`Ts` is {Ts} s, the sample time of this one is {own} s",
            remedy="leave Ts out, or convert with d2c and c2d",
        )
    return Ts


def _check_range(u_min: float | None, u_max: float | None) -> None:
    if u_min is None and u_max is None:
        return
    if u_min is None or u_max is None or not (isfinite(u_max - u_min) and u_min < u_max):
        raise _no_range(u_min, u_max)


def _no_range(u_min: float | None, u_max: float | None) -> PlantuneError:
    return refusal(
        "U01",
        f"u_min and u_max are {u_min} and {u_max}, must be two numbers, the lower one first",
        remedy="u_min=0.0, u_max=100.0",
    )


def _units(units: tuple[str, str], y: str) -> str:
    u_unit, y_unit = (unit or "the plant's own unit" for unit in units)
    return f"u in {u_unit}, {y} in {y_unit}"


def _author() -> str:
    return f"Written by plantune {_core.__version__}."
