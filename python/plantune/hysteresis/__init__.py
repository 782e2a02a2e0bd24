"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import Cmac, PlayLearner, SeriesSlipLearner, Stream
from plantune.hysteresis.cycles import Cycles, Repeatability, cycles, repeatability
from plantune.hysteresis.direction import LoopDirection, loop_direction
from plantune.hysteresis.forc import Forc, forc
from plantune.hysteresis.identify import Loops, identify
from plantune.hysteresis.track import Tracking, track
from plantune.models.hysteresis import (
    AsymmetricInverse,
    AsymmetricStack,
    BoucWen,
    BoucWenForce,
    ChargeLeak,
    Creep,
    CreepInverse,
    EvenStack,
    MaxwellSlip,
    PlayStack,
    Preisach,
    PreisachInverse,
    SeriesSlip,
)

__all__ = [
    "AsymmetricInverse",
    "AsymmetricStack",
    "BoucWen",
    "BoucWenForce",
    "ChargeLeak",
    "Cmac",
    "Creep",
    "CreepInverse",
    "Cycles",
    "EvenStack",
    "Forc",
    "LoopDirection",
    "Loops",
    "MaxwellSlip",
    "PlayLearner",
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
    "identify",
    "loop_direction",
    "repeatability",
    "track",
]
