"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import PlayLearner, SeriesSlipLearner, Stream
from plantune.hysteresis.cycles import Cycles, Repeatability, cycles, repeatability
from plantune.models.hysteresis import (
    AsymmetricInverse,
    AsymmetricStack,
    EvenStack,
    PlayStack,
    SeriesSlip,
)

__all__ = [
    "AsymmetricInverse",
    "AsymmetricStack",
    "Cycles",
    "EvenStack",
    "PlayLearner",
    "PlayStack",
    "Repeatability",
    "SeriesSlip",
    "SeriesSlipLearner",
    "Stream",
    "cycles",
    "repeatability",
]
