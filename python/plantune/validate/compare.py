"""Models side by side on one record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from plantune.errors import NotIdentifiable, refusal
from plantune.estimate.fit import Fit
from plantune.models import PolyModel, ProcessModel
from plantune.notes import Limits, Note, merged, note_of
from plantune.record import Record
from plantune.text import number, table
from plantune.validate.check import Verdict, check

_SCORES = ("model", "simulation [%]", "one step [%]", "rmse", "loss", "rows")
_TERMS = ("offset", "from", "rows also fitted", "passes")


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Models on one record; prints as a table.

    Attributes
    ----------
    rows : tuple of Verdict
        One per model, in the order given, under the names of the comparison.
    notes : tuple of Note
        Doubts, with the model they speak of.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.hair_dryer().split(0.5)
    >>> fits = [pt.estimate.arx(est, n, n, 3) for n in (1, 2)]
    >>> both = pt.validate.compare(val, *fits)
    >>> [row.name for row in both.rows], both.best.name
    (['ARX 1', 'ARX 2'], 'ARX 2')
    """

    rows: tuple[Verdict, ...]
    notes: tuple[Note, ...]
    source: str

    @property
    def best(self) -> Verdict:
        """The model of the largest simulation fit; where some rows are fresh, among those."""
        fresh = [row for row in self.rows if not _seen(row)]
        return max(fresh or self.rows, key=lambda row: row.fit)

    def __str__(self) -> str:
        head = f"{len(self.rows)} models on one record; best simulation: {self.best.name}"
        lines = [head, *table([_SCORES + _TERMS, *map(_row, self.rows)])]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def compare(
    rec: Record,
    *fits: Fit | PolyModel | ProcessModel,
    names: Sequence[str] | None = None,
    x0: str = "estimate",
    offset: str | None = None,
    limits: Limits | None = None,
) -> Comparison:
    """Judge several fits or bare models on one record, best on rows none has seen.

    Parameters
    ----------
    rec : Record
        With the columns of the models.
    *fits : Fit, PolyModel or ProcessModel
        A bare model, such as one from an earlier study, has its offset estimated on the record.
    names : sequence of str, optional
        One per model; by default the methods, numbered where they repeat.
    x0 : "estimate" or "zero"
        Initial state of each segment.
    offset : "fit" or "estimate", optional
        Of each fit its own, or a new one for this record; by default as in `check`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Comparison
        A model no better than the mean is in it with note X04, one that has seen the rows with
        M11.

    Raises
    ------
    UsageError
        No model, names that are not one per model, a model that does not match the record (U01).

    Notes
    -----
    Source 001, 3.5.11 and table 3.5-9: parameters of an earlier study and new ones, by the rmse on
    the same fresh records.  Of one model `check` tells more.

    Examples
    --------
    >>> import plantune as pt
    >>> est, val = pt.datasets.engine_loop(noise_var=1.5).split(0.5)
    >>> earlier = pt.models.ProcessModel(K=-8.0, T=0.08, L=0.1)
    >>> both = compare(val, pt.estimate.process(est, "P1D"), earlier, names=["new", "earlier"])
    >>> both.best.name, both.rows[1].rmse > 3 * both.rows[0].rmse, both.rows[1].offset_from
    ('new', True, 'estimate')
    """
    if not fits:
        raise refusal("U01", "there is no model to compare", remedy="compare(rec, fit1, fit2)")
    names = _names(fits) if names is None else names
    if len(names) != len(fits):
        raise refusal(
            "U01",
            f"`names` has {len(names)} entries, must have one per model: {len(fits)}",
            remedy="leave it out, or name every model",
        )
    rows = tuple(
        _judged(rec, fit, name, x0, offset if isinstance(fit, Fit) else "estimate", limits)
        for fit, name in zip(fits, names, strict=True)
    )
    notes = merged([(row.name, row.notes) for row in rows])
    return Comparison(rows=rows, notes=notes, source=rec.source)


def _judged(
    rec: Record,
    fit: Fit | PolyModel | ProcessModel,
    name: str,
    x0: str,
    offset: str | None,
    limits: Limits | None,
) -> Verdict:
    try:
        verdict = check(rec, fit, x0=x0, offset=offset, limits=limits)
    except NotIdentifiable as error:
        if error.result is None:
            raise
        verdict = replace(
            error.result, passed=False, notes=(*error.result.notes, note_of(error, "warning"))
        )
    return replace(verdict, name=name)


def _names(fits: Sequence[Fit | PolyModel | ProcessModel]) -> list[str]:
    """Return method or class of each, numbered where it repeats."""
    plain = [fit.method if isinstance(fit, Fit) else type(fit).__name__ for fit in fits]
    return [
        f"{name} {plain[: k + 1].count(name)}" if plain.count(name) > 1 else name
        for k, name in enumerate(plain)
    ]


def _seen(verdict: Verdict) -> int:
    """Rows of the record that were used to fit."""
    return sum(note.count or 0 for note in verdict.notes if note.code == "M11")


def _row(v: Verdict) -> list[str]:
    scores = [f"{v.fit:.1f}", f"{v.fit_1step:.1f}", number(v.rmse), number(v.loss), str(v.N)]
    offset = [number(v.offset, 6), v.offset_from]
    return [v.name, *scores, *offset, str(_seen(v)), "yes" if v else "no"]
