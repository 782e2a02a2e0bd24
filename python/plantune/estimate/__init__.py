"""Estimation: a record in, a fitted model with its uncertainty out."""

from plantune.estimate.ararx import ararmax, ararx
from plantune.estimate.areas import areas
from plantune.estimate.armax import armax
from plantune.estimate.arx import arx
from plantune.estimate.bj import bj
from plantune.estimate.bootstrap import Bootstrap, bootstrap
from plantune.estimate.candidates import candidates
from plantune.estimate.derived import Curve, Derived, Root
from plantune.estimate.fit import Fit, OffsetStep
from plantune.estimate.forecast import Forecast
from plantune.estimate.frequency import frequency
from plantune.estimate.idt_criterion import IdtCriterion, idt_criterion
from plantune.estimate.iv4 import iv4
from plantune.estimate.least_squares import least_squares
from plantune.estimate.oe import oe
from plantune.estimate.order_choice import OrderRow, OrderTable, order
from plantune.estimate.poly import poly
from plantune.estimate.process import process
from plantune.estimate.sandwich import sandwich
from plantune.estimate.saved import load_fit, save_fit
from plantune.estimate.sps import ArxRegion, Region, sps, sps_arx
from plantune.estimate.srivc import srivc
from plantune.estimate.step_modes import StepModes, idt
from plantune.estimate.subspace import pbsid, subspace
from plantune.estimate.subspace_bands import SubspaceBands, subspace_bands
from plantune.estimate.subspace_frequency import FrequencyFit, subspace_frequency

__all__ = [
    "ArxRegion",
    "Bootstrap",
    "Curve",
    "Derived",
    "Fit",
    "Forecast",
    "FrequencyFit",
    "IdtCriterion",
    "OffsetStep",
    "OrderRow",
    "OrderTable",
    "Region",
    "Root",
    "StepModes",
    "SubspaceBands",
    "ararmax",
    "ararx",
    "areas",
    "armax",
    "arx",
    "bj",
    "bootstrap",
    "candidates",
    "frequency",
    "idt",
    "idt_criterion",
    "iv4",
    "least_squares",
    "load_fit",
    "oe",
    "order",
    "pbsid",
    "poly",
    "process",
    "sandwich",
    "save_fit",
    "sps",
    "sps_arx",
    "srivc",
    "subspace",
    "subspace_bands",
    "subspace_frequency",
]
