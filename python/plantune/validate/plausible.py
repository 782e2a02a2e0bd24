"""Poles and zeros that a sampled plant of lags does not have."""

from __future__ import annotations

from collections.abc import Sequence

from plantune import _core
from plantune.estimate.fit import Fit, flat
from plantune.models import PolyModel, ProcessModel
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core


def plausible(
    fit: Fit | PolyModel | ProcessModel,
    *,
    inputs: Sequence[str] = (),
    limits: Limits | None = None,
) -> tuple[Note, ...]:
    """Return doubts about the poles and zeros of a model; none where they could be a plant's.

    V06, a real zero beyond 1: the step response starts the wrong way.  V07, a pole with a negative
    real part that dies out at least three times as fast as the slowest, which lies on the right:
    no lag sampled behind a zero-order hold has one.  V08, both: the pattern of errors in
    variables, least squares whose regressor is noisy.

    Parameters
    ----------
    fit : Fit, PolyModel or ProcessModel
        Of a fit only what lies two standard deviations beyond counts; a bare model is taken at
        its word.
    inputs : sequence of str
        Names of several inputs, to say which is concerned; a fit knows them.
    limits : Limits, optional
        Thresholds V06 and V07.

    Returns
    -------
    tuple of Note

    Raises
    ------
    UsageError
        The fit has no model (U01).

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
    return notes_from_core(_core.plausible(model, P, list(named), limits))


def _inputs(fit: Fit) -> list[str]:
    """Return the inputs' names, in brackets behind parameters where there are several."""
    named = (name.partition("[")[2][:-1] for name in fit.names if name.endswith("]"))
    return list(dict.fromkeys(named))
