"""Poles and zeros that a sampled plant of lags does not have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from plantune import _core
from plantune.estimate.fit import Fit, flat
from plantune.models import PolyModel, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.validate.expected import Range, expected_of


def plausible(
    fit: Fit | PolyModel | ProcessModel,
    *,
    expected: Mapping[str, Range] | None = None,
    inputs: Sequence[str] = (),
    limits: Limits | None = None,
) -> tuple[Note, ...]:
    """Return doubts about a model; none where it could be a plant's, and the one expected.

    V06, a real zero beyond 1: the step response starts the wrong way.  V07, a pole with a negative
    real part that dies out at least three times as fast as the slowest, which lies on the right:
    no lag sampled behind a zero-order hold has one.  V08, both: the pattern of errors in
    variables, least squares whose regressor is noisy.  N03, a gain, time constant or dead time
    more than 50 times beyond what was expected: the sign of units mixed up.

    Parameters
    ----------
    fit : Fit, PolyModel or ProcessModel
        Of a fit only what lies two standard deviations beyond counts; a bare model is taken at
        its word.
    expected : mapping of str to (low, high), optional
        Ranges of what `fit.derived()` names: `K`, `T` (the slowest of several), `L`, `w_n`.
        Names that the model has not are left alone.
    inputs : sequence of str
        Names of several inputs, to say which is concerned; a fit knows them.
    limits : Limits, optional
        Thresholds V06, V07 and N03.

    Returns
    -------
    tuple of Note

    Raises
    ------
    UsageError
        The fit has no model, or a range does not ascend (U01).

    Notes
    -----
    Source 000, 3.1 and 3.2: each of its eight printed models shows all three.  Zeros on the
    negative real axis say nothing, sampling puts them there: Åström, Hagander and Sternby 1984.

    Examples
    --------
    >>> import plantune as pt
    >>> printed = pt.models.PolyModel(A=[1, -0.5342, -0.3999], B=[-3.4524, 3.5661], Ts=1.0)
    >>> [note.code for note in plausible(printed)]
    ['V06', 'V07', 'V08']
    >>> plausible(pt.datasets.PRINTER_MOTOR.model())
    ()
    """
    limits = limits or DEFAULT_LIMITS
    model, P = (fit.model, flat(fit)) if isinstance(fit, Fit) else (fit, None)
    named = inputs or (_inputs(fit) if isinstance(fit, Fit) else ())
    notes = notes_from_core(_core.plausible(model, P, list(named), limits))
    return notes + expected_of(model, P, expected or {}, limits)


def _inputs(fit: Fit) -> list[str]:
    """Return the inputs' names, in brackets behind parameters where there are several."""
    named = (name.partition("[")[2][:-1] for name in fit.names if name.endswith("]"))
    return list(dict.fromkeys(named))
