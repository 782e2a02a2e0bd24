"""Subspace identification from frequency responses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from plantune import _core
from plantune.estimate.orders import whole
from plantune.models import FrequencyResponse, StateSpace
from plantune.notes import Note, notes_from_core
from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyFit:
    """A model of a frequency response.

    Attributes
    ----------
    model : StateSpace
        Sampled, or in continuous time, as the response is.
    singular_values : array
        Those that show the order.
    block_rows : int
        Block rows used.
    loss : float
        Mean squared error over all frequencies and entries.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record behind the response.

    Examples
    --------
    >>> import plantune as pt
    >>> w = [0.1, 0.3, 1.0, 3.0]
    >>> fr = pt.models.FrequencyResponse(w=w, G=[2 / (1 + 5j * w) for w in w])
    >>> pt.estimate.subspace_frequency(fr, 1).model.poles().round(6)
    array([-0.2+0.j])
    """

    model: StateSpace
    singular_values: Floats
    block_rows: int
    loss: float
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        head = f"subspace of a frequency response, {self.block_rows} block rows, "
        return "\n".join(
            [head + f"loss {self.loss:.4g}", str(self.model), *(f"  {n}" for n in self.notes)]
        )


def subspace_frequency(
    fr: FrequencyResponse, n: int | Literal["auto"] = "auto", *, stable: bool = True
) -> FrequencyFit:
    """Fit C (z I - A)^-1 B + D to a frequency response at any frequencies.

    Parameters
    ----------
    fr : FrequencyResponse
        Of any number of inputs and outputs; with `Ts` the model is sampled, else in continuous
        time.  A dead time is no rational function: take it out, or give the model more states.
    n : int or "auto"
        Number of states; "auto" takes the largest gap between the logarithms of the singular
        values, which is plain on clean data and a guess on noisy ones.
    stable : bool
        Whether unstable poles are reflected, which a note counts.

    Returns
    -------
    FrequencyFit
        It carries no uncertainty: the errors of a measured response are in `fr`, and how they
        pass on is not worked out here.

    Raises
    ------
    NotIdentifiable
        Too few frequencies for the order (X03).
    UsageError
        An order below 1 (U01).
    NumericsError
        A pole at infinity (N05).

    Notes
    -----
    McKelvey, Akçay and Ljung, IEEE Trans. Automatic Control 41, 1996, the frequencies first spread
    over the circle by a bilinear map, so that slow ones lose no digits.

    Examples
    --------
    >>> import numpy as np
    >>> import plantune as pt
    >>> true = pt.models.StateSpace(A=[[0.9, 0.2], [-0.2, 0.9]], B=[1, 0], C=[1, 1], Ts=0.1)
    >>> w = np.geomspace(0.01, 30, 50)
    >>> fr = pt.models.FrequencyResponse(w=w, G=true.freqresp(w), Ts=0.1)
    >>> fit = pt.estimate.subspace_frequency(fr)
    >>> fit.model.n, bool(abs(fit.model.freqresp(w) - fr.G).max() < 1e-12)
    (2, True)
    """
    order = None if n == "auto" else whole("n", n)
    G = np.ascontiguousarray(fr.G).reshape(-1)
    d = _core.subspace_frequency(fr.w, G, (fr.ny, fr.nu), fr.Ts, order, stable)
    return FrequencyFit(
        **{
            **d,
            "model": StateSpace.of_core(d["model"]),
            "notes": (*notes_from_core(d["notes"]), *fr.notes),
        },
        source=fr.source,
    )
