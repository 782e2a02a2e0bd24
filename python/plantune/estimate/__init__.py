"""Estimation: a record in, a fitted model with its uncertainty out."""

from plantune.estimate.areas import areas
from plantune.estimate.arx import arx
from plantune.estimate.candidates import candidates
from plantune.estimate.fit import Fit
from plantune.estimate.idt_criterion import IdtCriterion, idt_criterion
from plantune.estimate.least_squares import least_squares
from plantune.estimate.order_choice import OrderRow, OrderTable, order
from plantune.estimate.pem import armax, oe
from plantune.estimate.process import process
from plantune.estimate.step_modes import StepModes, idt

__all__ = [
    "Fit",
    "IdtCriterion",
    "OrderRow",
    "OrderTable",
    "StepModes",
    "areas",
    "armax",
    "arx",
    "candidates",
    "idt",
    "idt_criterion",
    "least_squares",
    "oe",
    "order",
    "process",
]
