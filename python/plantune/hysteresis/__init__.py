"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import SeriesSlipLearner, Stream
from plantune.hysteresis.cycles import Cycles, Repeatability, cycles, repeatability
from plantune.models.hysteresis import BoucWen, BoucWenForce, PlayStack, SeriesSlip

__all__ = [
    "BoucWen",
    "BoucWenForce",
    "Cycles",
    "PlayStack",
    "Repeatability",
    "SeriesSlip",
    "SeriesSlipLearner",
    "Stream",
    "cycles",
    "repeatability",
]
