"""What the main job returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from plantune.estimate import Fit
from plantune.estimate.candidates import is_sound
from plantune.notes import Note
from plantune.record import Record
from plantune.simulate import Response
from plantune.tune import Comparison, Tuning
from plantune.validate import Verdict

# Process models, the larger one last.
PROCESS = ("P1D", "P2D")


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
        return next((name for name in reversed(PROCESS) if name in self.fits), None)

    @property
    def rival(self) -> str | None:
        """Name of the polynomial model that judges it: the trusted one, or the best simulation.

        Examples
        --------
        >>> import plantune as pt
        >>> pt.job.run(pt.datasets.hair_dryer()).rival
        'ARX'
        """
        names = [name for name in self.fits if name not in PROCESS]
        if self.trusted in names:
            return self.trusted
        sound = [n for n in names if is_sound(self.fits[n]) and not is_unstable(self.verdicts[n])]
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


def is_unstable(verdict: Verdict) -> bool:
    """Whether the verdict is one step ahead, since the model cannot be simulated."""
    return any(note.code == "M02" for note in verdict.notes)
