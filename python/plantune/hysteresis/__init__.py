"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import Cmac, Stream
from plantune.hysteresis.forc import Forc, forc
from plantune.hysteresis.track import Tracking, track
from plantune.models.hysteresis import (
    ChargeLeak,
    Creep,
    CreepInverse,
    PlayStack,
    Preisach,
    PreisachInverse,
)

__all__ = [
    "ChargeLeak",
    "Cmac",
    "Creep",
    "CreepInverse",
    "Forc",
    "PlayStack",
    "Preisach",
    "PreisachInverse",
    "Stream",
    "Tracking",
    "forc",
    "track",
]
