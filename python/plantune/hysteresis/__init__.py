"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import Cmac, SeriesSlipLearner, Stream
from plantune.hysteresis.cycles import Cycles, Repeatability, cycles, repeatability
from plantune.hysteresis.forc import Forc, forc
from plantune.hysteresis.track import Tracking, track
from plantune.models.hysteresis import (
    ChargeLeak,
    Creep,
    CreepInverse,
    PlayStack,
    Preisach,
    PreisachInverse,
    SeriesSlip,
)

__all__ = [
    "ChargeLeak",
    "Cmac",
    "Creep",
    "CreepInverse",
    "Cycles",
    "Forc",
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
    "repeatability",
    "track",
]
