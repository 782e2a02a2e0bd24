"""What every tuning rule returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.notes import Note
from plantune.tune.margins import Margins


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """Controller settings with their margins, and bands of these over the model's uncertainty.

    Attributes
    ----------
    controller : PID
        The settings.
    rule : str
        The rule and what it was asked for.
    model : ProcessModel, TransferFunction or PolyModel
        The model given; where the rule was computed on a reduced one, a note says on which (T05).
    margins : Margins
        On that model.
    bands : mapping
        95 % interval of `gain phase_deg delay Ms Mt`; empty for a model without uncertainty.
    tau_c : float
        Closed-loop time constant aimed at, seconds; NaN where the rule aims at none.
    cost : float
        Of an optimum what it minimises; NaN otherwise.
    notes : tuple of Note
        Doubts, such as margins that the model's uncertainty leaves weak.
    source : str
        Fingerprint of the record behind the model; empty without one.

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    >>> tuning = pt.tune.imc_pi(fit, gain_margin=3)
    >>> print(tuning.controller)
    PI: Kp = -0.13047, Ti = 0.148606 s
    >>> low, high = tuning.bands["gain"]
    >>> low < tuning.margins.gain < high
    True
    """

    kind: ClassVar[str] = "tuning"

    controller: PID
    rule: str
    model: LinearModel
    margins: Margins
    bands: Mapping[str, tuple[float, float]]
    tau_c: float
    cost: float
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        lines = [f"{self.rule} -> {self.controller}", f"  {self.margins}"]
        if self.bands:
            bands = ", ".join(f"{k} {a:.3g} … {b:.3g}" for k, (a, b) in self.bands.items())
            lines.append(f"  95 %: {bands}")
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])
