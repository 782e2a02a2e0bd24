"""Models of hysteresis as values."""

from plantune.models.hysteresis.creep import ChargeLeak, Creep, CreepInverse
from plantune.models.hysteresis.play_stack import PlayStack
from plantune.models.hysteresis.preisach import Preisach, PreisachInverse
from plantune.models.hysteresis.series_slip import SeriesSlip

__all__ = [
    "ChargeLeak",
    "Creep",
    "CreepInverse",
    "PlayStack",
    "Preisach",
    "PreisachInverse",
    "SeriesSlip",
]
