"""Estimation: a record in, a fitted model with its uncertainty out."""

from plantune.estimate.areas import areas
from plantune.estimate.arx import arx
from plantune.estimate.bootstrap import Bootstrap, bootstrap
from plantune.estimate.candidates import candidates
from plantune.estimate.derived import Curve, Derived, Root
from plantune.estimate.fit import Fit
from plantune.estimate.idt_criterion import IdtCriterion, idt_criterion
from plantune.estimate.least_squares import least_squares
from plantune.estimate.pem import armax, oe
from plantune.estimate.process import process
from plantune.estimate.sandwich import sandwich
from plantune.estimate.sps import Region, sps, sps_arx
from plantune.estimate.step_modes import StepModes, idt

__all__ = [
    "Bootstrap",
    "Curve",
    "Derived",
    "Fit",
    "IdtCriterion",
    "Region",
    "Root",
    "StepModes",
    "areas",
    "armax",
    "arx",
    "bootstrap",
    "candidates",
    "idt",
    "idt_criterion",
    "least_squares",
    "oe",
    "process",
    "sandwich",
    "sps",
    "sps_arx",
]
