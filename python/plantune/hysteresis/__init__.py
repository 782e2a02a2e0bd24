"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import SeriesSlipLearner, Stream
from plantune.hysteresis.cycles import Cycles, Repeatability, cycles, repeatability
from plantune.hysteresis.direction import LoopDirection, loop_direction
from plantune.models.hysteresis import BoucWen, BoucWenForce, MaxwellSlip, PlayStack, SeriesSlip

__all__ = [
    "BoucWen",
    "BoucWenForce",
    "Cycles",
    "LoopDirection",
    "MaxwellSlip",
    "PlayStack",
    "Repeatability",
    "SeriesSlip",
    "SeriesSlipLearner",
    "Stream",
    "cycles",
    "loop_direction",
    "repeatability",
]
