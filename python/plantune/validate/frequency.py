"""A model against a measured frequency response."""

from __future__ import annotations

from dataclasses import dataclass

from plantune import _core
from plantune.estimate.fit import Fit
from plantune.models import FrequencyResponse, PolyModel, ProcessModel, TransferFunction
from plantune.notes import Note, notes_from_core
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyVerdict:
    """How many frequencies of a model lie in the discs of a response; true where enough do.

    Attributes
    ----------
    name : str
        Of the model.
    w : array (n,)
        Frequencies judged, rad/s.
    distance : array (n, nu)
        `|G_model - G| / radius`: at most 1 inside the disc.
    inside, N : int
        Points inside, and points.
    share, limit : float
        Share of points inside, and the least with which a true model passes.
    worst : (w, input, distance)
        The point furthest off.
    passed : bool
        Whether `share >= limit`.
    notes : tuple of Note
        V02 where it does not.
    source : str
        Fingerprint of the record behind the response.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.datasets.hair_dryer()
    >>> fr = pt.analyze.spa(rec, n=128)
    >>> for code in ("P1D", "P2D"):
    ...     print(pt.validate.frequency(fr, pt.estimate.process(rec, code)))
    P1D: lies in the discs
    """

    name: str
    w: Floats
    distance: Floats
    inside: int
    N: int
    share: float
    limit: float
    worst: tuple[float, int, float]
    passed: bool
    notes: tuple[Note, ...]
    source: str

    def __bool__(self) -> bool:
        return self.passed

    def __str__(self) -> str:
        word = "passes" if self else "departs"
        head = (
            f"{self.name}: {word}, {self.inside} of {self.N} frequencies in the 95 % discs, "
            f"worst {self.worst[2]:.2f} radii at {self.worst[0]:.4g} rad/s"
        )
        return "\n".join([head, *(f"  {note}" for note in self.notes)])


def frequency(
    fr: FrequencyResponse, fit: Fit | PolyModel | ProcessModel | TransferFunction
) -> FrequencyVerdict:
    """Count how many frequencies of a model lie in the discs of a measured response.

    Parameters
    ----------
    fr : FrequencyResponse
        One output, as many inputs as the model, with discs; best from data that the model has not
        seen.  Points that are not coherent are left out.
    fit : Fit or model
        A continuous model is sampled behind a hold where `fr` is sampled.

    Returns
    -------
    FrequencyVerdict

    Raises
    ------
    UsageError
        No discs, or another number of inputs or outputs (U01).

    Notes
    -----
    A true model has 95 % of its points inside.  It passes with `0.95 - 3 sqrt(0.95 0.05/m)` or
    more, `m` the independent points.  It needs no assumption on the noise and none on the order of
    the plant: what a time-domain verdict blames on either shows here as a frequency.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> w = np.geomspace(0.01, 10, 40)
    >>> truth = pt.models.ProcessModel(K=2.0, T=3.0, L=0.7)
    >>> fr = pt.models.FrequencyResponse(w=w, G=truth.freqresp(w), sd=0.01)
    >>> bool(frequency(fr, truth)), bool(frequency(fr, pt.models.ProcessModel(K=2.0, T=3.2)))
    (True, False)
    """
    kept = fr.take(fr.coherent)
    model, name = (fit.model, fit.method) if isinstance(fit, Fit) else (fit, type(fit).__name__)
    d = dict(_core.frequency_verdict(kept, model))
    return FrequencyVerdict(
        name=name,
        w=kept.w,
        N=d["distance"].size,
        share=d.pop("part"),
        notes=notes_from_core(d.pop("notes")),
        source=fr.source,
        **d,
    )
