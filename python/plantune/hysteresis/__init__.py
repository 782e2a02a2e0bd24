"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import Cmac, SeriesSlipLearner, Stream
from plantune.hysteresis.cycles import Cycles, Repeatability, cycles, repeatability
from plantune.hysteresis.direction import LoopDirection, loop_direction
from plantune.hysteresis.forc import Forc, forc
from plantune.hysteresis.track import Tracking, track
from plantune.models.hysteresis import (
    BoucWen,
    BoucWenForce,
    ChargeLeak,
    Creep,
    CreepInverse,
    MaxwellSlip,
    PlayStack,
    Preisach,
    PreisachInverse,
    SeriesSlip,
)

__all__ = [
    "BoucWen",
    "BoucWenForce",
    "ChargeLeak",
    "Cmac",
    "Creep",
    "CreepInverse",
    "Cycles",
    "Forc",
    "LoopDirection",
    "MaxwellSlip",
    "PlayStack",
    "Preisach",
    "PreisachInverse",
    "Repeatability",
    "SeriesSlip",
    "SeriesSlipLearner",
    "Stream",
    "Tracking",
    "cycles",
    "forc",
    "loop_direction",
    "repeatability",
    "track",
]
