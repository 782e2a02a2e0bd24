"""Estimation: a record in, a fitted model with its uncertainty out."""

from plantune.estimate.ararx import ararmax, ararx
from plantune.estimate.areas import areas
from plantune.estimate.armax import armax
from plantune.estimate.arx import arx
from plantune.estimate.bj import bj
from plantune.estimate.candidates import candidates
from plantune.estimate.fit import Fit
from plantune.estimate.idt_criterion import IdtCriterion, idt_criterion
from plantune.estimate.iv4 import iv4
from plantune.estimate.least_squares import least_squares
from plantune.estimate.oe import oe
from plantune.estimate.poly import poly
from plantune.estimate.process import process
from plantune.estimate.step_modes import StepModes, idt

__all__ = [
    "Fit",
    "IdtCriterion",
    "StepModes",
    "ararmax",
    "ararx",
    "areas",
    "armax",
    "arx",
    "bj",
    "candidates",
    "idt",
    "idt_criterion",
    "iv4",
    "least_squares",
    "oe",
    "poly",
    "process",
]
