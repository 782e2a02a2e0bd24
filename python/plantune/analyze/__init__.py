"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.health import Health, health
from plantune.analyze.informative import Informative, InformativeStretch, informative
from plantune.analyze.offset_steps import OffsetSteps, offset_steps

__all__ = [
    "DelayScan",
    "Health",
    "Informative",
    "InformativeStretch",
    "OffsetSteps",
    "delay",
    "health",
    "informative",
    "offset_steps",
]
