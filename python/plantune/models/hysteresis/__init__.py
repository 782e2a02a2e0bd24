"""Models of hysteresis as values."""

from plantune.models.hysteresis.asymmetric_stack import AsymmetricInverse, AsymmetricStack
from plantune.models.hysteresis.bouc_wen import BoucWen
from plantune.models.hysteresis.bouc_wen_force import BoucWenForce
from plantune.models.hysteresis.creep import ChargeLeak, Creep, CreepInverse
from plantune.models.hysteresis.even_stack import EvenStack
from plantune.models.hysteresis.maxwell_slip import MaxwellSlip
from plantune.models.hysteresis.play_stack import PlayStack
from plantune.models.hysteresis.preisach import Preisach, PreisachInverse
from plantune.models.hysteresis.series_slip import SeriesSlip

__all__ = [
    "AsymmetricInverse",
    "AsymmetricStack",
    "BoucWen",
    "BoucWenForce",
    "ChargeLeak",
    "Creep",
    "CreepInverse",
    "EvenStack",
    "MaxwellSlip",
    "PlayStack",
    "Preisach",
    "PreisachInverse",
    "SeriesSlip",
]
