"""The model structures that a record supports, each of the order that suits it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from plantune.errors import NotIdentifiable, NumericsError
from plantune.estimate.armax import armax
from plantune.estimate.arx import arx
from plantune.estimate.fit import Fit
from plantune.estimate.oe import oe
from plantune.estimate.process import process
from plantune.notes import Limits, Note, note_of
from plantune.record import Record

_REFUSALS = (NotIdentifiable, NumericsError)

_STRUCTURES: dict[str, Callable[[Record, int, int, Limits | None], Fit]] = {
    "ARX": lambda rec, n, nk, limits: arx(rec, n, n, nk, limits=limits),
    "OE": lambda rec, n, nk, limits: oe(rec, n, n, nk, limits=limits),
    "ARMAX": lambda rec, n, nk, limits: armax(rec, n, n, n, nk, limits=limits),
}


def candidates(
    rec: Record, order: int, nk: int, *, limits: Limits | None = None
) -> tuple[dict[str, Fit], tuple[Note, ...]]:
    """Fit ARX, OE, ARMAX and P1D, and leave out what the record does not support.

    Parameters
    ----------
    rec : Record
        One input, one output.
    order : int
        Highest order `na = nb` or `nf = nb`, >= 1, such as that of a delay scan.  Each polynomial
        structure takes the order up to it with the least BIC per row, one whose search did not
        converge (N05) or whose parameters cannot be told apart (X10) only where it halves the
        loss of the sound ones.
    nk : int
        Delay in samples, such as that of a delay scan.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    fits : dict
        By name, in the order above.
    notes : tuple of Note
        One per structure left out, with the code of its refusal.

    Raises
    ------
    NotIdentifiable, NumericsError
        No structure is supported: the refusal of P1D, the smallest.

    Examples
    --------
    >>> import plantune as pt
    >>> fits, notes = candidates(pt.datasets.engine_loop(noise_var=1.5), 4, 6)
    >>> {name: len(fit.theta) for name, fit in fits.items()}, notes
    ({'ARX': 8, 'OE': 2, 'ARMAX': 3, 'P1D': 3}, ())
    """
    fits: dict[str, Fit] = {}
    refused: dict[str, NotIdentifiable | NumericsError] = {}
    for name in (*_STRUCTURES, "P1D"):
        try:
            fits[name] = _fitted(rec, name, order, nk, limits)
        except _REFUSALS as error:
            refused[name] = error
    if not fits:
        raise refused["P1D"]
    return fits, tuple(
        note_of(error, "warning", f"{name} is left out: {error.text}")
        for name, error in refused.items()
    )


def again(fit: Fit, rec: Record, limits: Limits | None = None) -> Fit:
    """Fit one of the polynomial candidates to other rows; itself where these do not support it.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.engine_loop(noise_var=1.5)
    >>> first = pt.estimate.armax(rec.split(0.5)[0], 1, 1, 1, 6)
    >>> first.N, again(first, rec).N
    (1494, 2994)
    """
    model: Any = fit.model
    try:
        found = _STRUCTURES[fit.method](rec, len(model.B), model.nk, limits)
    except _REFUSALS:
        return fit
    return found if is_sound(found) else fit


def is_sound(fit: Fit) -> bool:
    """Whether the search converged and the parameters can be told apart.

    Two lags that cannot are quoted as their pair, which can.

    Examples
    --------
    >>> import plantune as pt
    >>> is_sound(pt.estimate.oe(pt.datasets.hair_dryer(), 2, 2, 3))
    True
    """
    apart = bool(fit.plants) or all(note.code != "X10" for note in fit.notes)
    return fit.status != "not converged" and apart


def size(fit: Fit) -> int:
    """Return the number of parameters, the delay counted, which `theta` may not hold.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> size(pt.estimate.process(rec)), size(pt.estimate.arx(rec, 2, 2, 3))
    (3, 5)
    """
    return len(fit.theta) + ("L" not in fit.names)


def _fitted(rec: Record, name: str, order: int, nk: int, limits: Limits | None) -> Fit:
    """Fit one structure; the refusal of the lowest order stands for all of them."""
    if name == "P1D":
        return process(rec, name, limits=limits)
    fits: list[Fit] = []
    for n in range(order, 0, -1):
        try:
            fits.append(_STRUCTURES[name](rec, n, nk, limits))
        except _REFUSALS:
            if n == 1 and not fits:
                raise
    best = min(fits, key=_bic)
    sound = min(filter(is_sound, fits), key=_bic, default=best)
    return best if 2.0 * best.loss < sound.loss else sound


def _bic(fit: Fit) -> float:
    """BIC per row, since a higher order leaves fewer rows."""
    return fit.bic / fit.N
